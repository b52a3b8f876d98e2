"""The cascade of an SVG's style sheets, by answers that CSS gives, worked out by hand."""

import xml.etree.ElementTree as ET

import pytest

from laptop.drawing.svg_css import INHERITED, StyleSheets, is_shown_media, style_of

ROOT = {**INHERITED}


def styles(body, css=""):
    """The style of each `path` of an SVG with these elements and this style sheet, in order."""
    text = f'<svg xmlns="http://www.w3.org/2000/svg"><style>{css}</style>{body}</svg>'
    root = ET.fromstring(text)
    sheets = StyleSheets(root, lambda element: element.tag.endswith("}style"))
    found = []

    def walk(element, parent):
        style = style_of(element, parent, sheets)
        if element.tag.endswith("}path"):
            found.append(style)
        for child in element:
            walk(child, style)

    walk(root, ROOT)
    return found


@pytest.mark.parametrize(
    ("css", "attributes", "fill"),
    [
        ("", "", "black"),
        ("", 'fill="red"', "red"),
        ("path{fill:blue}", 'fill="red"', "blue"),  # an attribute weighs less than any rule
        ("path{fill:blue}", 'style="fill:red"', "red"),
        ("path{fill:blue !important}", 'style="fill:red"', "blue"),
        ("path{fill:blue !important}", 'style="fill:red !important"', "red"),
        ("path{fill:blue}path{fill:red}", "", "red"),  # the last of equals
        (".a{fill:blue}path{fill:red}", 'class="a"', "blue"),  # a class before an element
        ("#i{fill:blue}.a.b{fill:red}", 'id="i" class="a b"', "blue"),
        (".a.b{fill:blue}.a{fill:red}", 'class="b a"', "blue"),
        (".a.b{fill:blue}", 'class="a"', "black"),
        (".a{fill:blue}", 'class="ab"', "black"),
        ("rect.a{fill:blue}", 'class="a"', "black"),
        ("path.a{fill:blue !important}#i{fill:red}", 'id="i" class="a"', "blue"),
        ("g path{fill:blue}", "", "blue"),
        ("g>path{fill:blue}", "", "blue"),
        ("svg>path{fill:blue}", "", "black"),
        ("path:first-child{fill:blue}", "", "blue"),
        ("path:nth-child(2){fill:blue}", "", "black"),
        ("path:not(.a){fill:blue}", 'class="a"', "black"),
        ("[data-x=on]{fill:blue}", 'data-x="on"', "blue"),
        ("path,{fill:blue}", "", "black"),  # a broken list is no rule
        ("path{fill:blue;;stroke:red", "", "blue"),
        ("path{fill:bleu}", 'fill="red"', "red"),  # no colour: as if it were not there
        ("path{fill:blue;fill:12px}", "", "blue"),
        ("g{fill:blue}", "", "blue"),  # by inheritance
        ("g{fill:blue}", 'fill="red"', "red"),
        ("g{fill:blue !important}", 'fill="red"', "red"),  # inherited values weigh nothing
        ("g{fill:blue}path{fill:inherit}", 'fill="red"', "blue"),
        ("g{fill:blue}path{fill:unset}", 'fill="red"', "blue"),
        ("g{fill:blue}path{fill:initial}", 'fill="red"', "black"),
        ("@media print{path{fill:blue}}", "", "black"),
        ("@media screen{@media (min-width:1px){path{fill:blue}}}", "", "blue"),
        ("@media screen{@media print{path{fill:blue}}}", "", "black"),
        ("@font-face{font-family:a}path{fill:blue}", "", "blue"),
        ("/*path{fill:red}*/path{fill:blue}", "", "blue"),
        ("PATH{fill:blue}", "", "black"),  # names of XML have their case
        ("path{FILL:blue}", "", "blue"),  # names of properties have none
    ],
)
def test_the_fill_is_that_of_the_cascade(css, attributes, fill):
    (found,) = styles(f"<g><path {attributes}/></g>", css.replace(">", "&gt;"))
    assert found["fill"] == fill


def test_a_size_without_a_unit_is_none():
    (found,) = styles("<path/>", "path{font:12 Arial}")
    assert found["font-size"] == INHERITED["font-size"]


def test_what_is_no_child_s_is_not_inherited():
    (found,) = styles('<g opacity="0.5" transform="scale(2)" display="none"><path/></g>')
    assert (found["opacity"], found["transform"], found["display"]) == ("1", "none", "inline")


@pytest.mark.parametrize(
    ("said", "style", "weight", "size", "family"),
    [
        ("12px Arial", "normal", "normal", "12px", "Arial"),
        ("italic bold 12px/30px Georgia, serif", "italic", "bold", "12px", "Georgia, serif"),
        ("700 oblique .5em monospace", "oblique", "700", ".5em", "monospace"),
    ],
)
def test_the_shorthand_of_fonts(said, style, weight, size, family):
    (found,) = styles("<path/>", f"path{{font-family:x;font-weight:900;font:{said}}}")
    assert found["font-style"] == style
    assert found["font-weight"] == weight
    assert (found["font-size"], found["font-family"]) == (size, family)


@pytest.mark.parametrize(
    ("query", "is_shown"),
    [
        ("", True),
        ("all", True),
        ("screen", True),
        ("only screen and (min-width: 30em)", True),
        ("SCREEN", True),
        ("print", False),
        ("print, screen", True),
        ("not print", True),
        ("not screen", False),
        ("not all and (prefers-color-scheme: dark)", True),
        ("(prefers-color-scheme: light)", True),
        ("(prefers-color-scheme: dark)", False),
        ("screen and (prefers-color-scheme: dark)", False),
        ("(prefers-reduced-motion: no-preference)", True),
        ("(prefers-reduced-motion: reduce)", False),
        ("(max-width: 400px)", False),
        ("speech", False),
    ],
)
def test_media_are_those_of_a_light_screen(query, is_shown):
    assert is_shown_media(query) is is_shown
