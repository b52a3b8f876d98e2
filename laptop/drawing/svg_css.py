"""CSS for the elements of an SVG: attributes, style sheets and `style`.  Pure.

tinycss2 parses and cssselect2 matches; here is what a screen with light colours shows.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any

import cssselect2
import tinycss2

from laptop.drawing.svg_paint import is_number, is_paint

INHERITED = {
    **{"fill": "black", "fill-opacity": "1", "fill-rule": "nonzero", "clip-rule": "nonzero"},
    **{"stroke": "none", "stroke-opacity": "1", "stroke-width": "1", "stroke-linecap": "butt"},
    **{"stroke-dasharray": "none", "color": "black", "visibility": "visible"},
    **{"marker-start": "none", "marker-mid": "none", "marker-end": "none"},
    **{"font-family": "serif", "font-size": "16px", "font-style": "normal"},
    **{"font-weight": "normal", "letter-spacing": "normal", "text-anchor": "start"},
    **{"white-space": "normal"},
}
"""Inherited properties that matter here, with their initial values (SVG 2, appendix F)."""

NOT_INHERITED = {
    **{"display": "inline", "opacity": "1", "clip-path": "none", "mask": "none", "overflow": ""},
    **{"transform": "none", "transform-origin": "", "transform-box": "view-box"},
    **{"translate": "none", "rotate": "none", "scale": "none"},
    **{"dominant-baseline": "auto", "baseline-shift": "0", "mask-type": "luminance"},
    **{"stop-color": "black", "stop-opacity": "1"},
}
"""Properties that are not inherited, with their initial values."""

GEOMETRY = ("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "d")
"""Attributes that a style sheet may set, too (SVG 2, section 7); of the properties that only an
element itself has, these alone are in `Style`, and only where CSS gives them."""

MARKERS = ("marker-start", "marker-mid", "marker-end")
UNLESS_CSS = ("translate", "rotate", "scale")
"""Properties that exist in CSS only, not as attributes."""
MAX_SHEETS = 20
MAX_RULES = 20_000
"""Greatest number of style sheets and rules of a drawing."""
MAX_TRIED = 2_000_000
"""Greatest number of times that rules are tried on elements."""

Style = Mapping[str, str]


class TooManyRules(Exception):
    """Style sheets have more rules than can be tried on so many elements."""


class StyleSheets:
    """The rules of all `style` elements of a drawing.

    imports  what they import from elsewhere, which is not read
    unreadable  selectors that are not understood
    """

    def __init__(self, root: ET.Element, is_style: Callable[[ET.Element], bool]) -> None:
        self.imports: list[str] = []
        self.unreadable: list[str] = []
        self._matcher = cssselect2.Matcher()
        self._count = self._tried = 0
        for element in [e for e in root.iter() if is_style(e)][:MAX_SHEETS]:
            kind = element.get("type", "").split(";")[0].strip().lower()
            if kind in ("", "text/css") and is_shown_media(element.get("media", "")):
                text = "".join(element.itertext())
                self._read(tinycss2.parse_stylesheet(text, True, True))
        self._wrapped: dict[ET.Element, Any] = {}
        if self._count:
            top = cssselect2.ElementWrapper.from_xml_root(root)
            self._wrapped = {wrapper.etree_element: wrapper for wrapper in top.iter_subtree()}

    def _read(self, rules: Iterable[Any]) -> None:
        for rule in rules:
            if rule.type == "at-rule":
                self._at_rule(rule)
            if rule.type != "qualified-rule" or self._count >= MAX_RULES:
                continue
            try:
                selectors = cssselect2.compile_selector_list(rule.prelude)
            except cssselect2.SelectorError:
                self.unreadable.append(tinycss2.serialize(rule.prelude).strip()[:60])
                continue
            declared = _declared(tinycss2.parse_blocks_contents(rule.content, True, True))
            for selector in selectors:
                self._count += 1
                self._matcher.add_selector(selector, declared)

    def _at_rule(self, rule: Any) -> None:
        if rule.lower_at_keyword == "import":
            self.imports.append(tinycss2.serialize(rule.prelude).strip()[:60])
        elif rule.content is not None and rule.lower_at_keyword in ("media", "supports", "layer"):
            query = tinycss2.serialize(rule.prelude)
            if rule.lower_at_keyword != "media" or is_shown_media(query):
                self._read(tinycss2.parse_rule_list(rule.content, True, True))

    def of(self, element: ET.Element) -> tuple[dict[str, str], dict[str, str]]:
        """Return an element's declarations from the rules: the normal and the important ones.

        Raises:
            TooManyRules: They are more than can be tried on so many elements.
        """
        usual: dict[str, str] = {}
        important: dict[str, str] = {}
        wrapper = self._wrapped.get(element)
        if wrapper is not None:
            self._tried += self._candidates(wrapper)
            if self._tried > MAX_TRIED:
                raise TooManyRules
            for _, _, pseudo, declared in self._matcher.match(wrapper):
                if pseudo is None:
                    usual.update(declared[0])
                    important.update(declared[1])
        return usual, important

    def _candidates(self, wrapper: Any) -> int:
        """Return the number of rules that the matcher tries on an element."""
        by = self._matcher
        return (
            len(by.other_selectors)
            + len(by.id_selectors.get(wrapper.id, ()))
            + sum(len(by.class_selectors.get(name, ())) for name in wrapper.classes)
            + len(by.lower_local_name_selectors.get(wrapper.local_name.lower(), ()))
            + len(by.namespace_selectors.get(wrapper.namespace_url, ()))
            + len(by.lang_attr_selectors)
        )


def is_shown_media(text: str) -> bool:
    """Return whether a list of media queries is for a screen with light colours."""
    return not text.strip() or any(_query(part) for part in text.lower().split(","))


def _query(text: str) -> bool:
    words = text.replace("(", " ( ").replace(")", " ) ").split()
    is_not = words[:1] == ["not"]
    parts = " ".join(words[is_not:]).split(" and ")
    return is_not != all(_feature(part.strip()) for part in parts)


def _feature(text: str) -> bool:
    if text.removeprefix("only").strip() in ("all", "screen"):
        return True
    name, _, value = text.strip("() ").partition(":")
    name, value = name.strip(), value.strip()
    if name == "prefers-color-scheme":
        return value == "light"
    # A window is wide and high, has colours, and no wish of its own.
    return name in ("min-width", "min-height", "color", "hover", "any-hover") or (
        name.startswith("prefers-") and value == "no-preference"
    )


Declared = tuple[dict[str, str], dict[str, str]]


def _declared(parsed: Iterable[Any]) -> Declared:
    """Return the relevant valid declarations: the normal and the important ones."""
    usual: dict[str, str] = {}
    important: dict[str, str] = {}
    for declaration in parsed:
        if declaration.type != "declaration":
            continue
        value = tinycss2.serialize(declaration.value).strip()
        into = important if declaration.important else usual
        for name, longhand in _long(declaration.lower_name, value):
            if _is_valid(name, longhand):
                into[name] = longhand
    return usual, important


def _long(name: str, value: str) -> list[tuple[str, str]]:
    """Return a declaration as its longhand properties."""
    if name == "marker":
        return [(marker, value) for marker in MARKERS]
    if name == "font":
        return _font(value)
    if name in INHERITED or name in NOT_INHERITED or name in GEOMETRY:
        return [(name, value)]
    return []


def _font(value: str) -> list[tuple[str, str]]:
    """Return the longhands of the shorthand `font`: style, weight, size, families."""
    words = value.split()
    for k, word in enumerate(words):
        size = word.partition("/")[0]
        if (size[:1].isdigit() or size[:1] == ".") and not size.isdigit():  # that is a weight
            before = words[:k]
            weight = next((w for w in before if w in ("bold", "bolder") or w.isdigit()), "normal")
            style = next((w for w in before if w in ("italic", "oblique")), "normal")
            family = " ".join(words[k + 1 :])
            return [
                *(("font-style", style), ("font-weight", weight)),
                *(("font-size", size), ("font-family", family)),
            ]
    return []


def _is_valid(name: str, value: str) -> bool:
    """Return whether CSS accepts this value; an invalid one is ignored."""
    if not value or len(value) > 100_000:
        return False
    if value in ("inherit", "initial", "unset"):
        return True
    if name in ("fill", "stroke", "color", "stop-color"):
        return is_paint(value)
    if name in ("opacity", "fill-opacity", "stroke-opacity", "stop-opacity"):
        return is_number(value)
    return True


@lru_cache(maxsize=4096)
def _of_attribute(text: str) -> Declared:
    return _declared(tinycss2.parse_blocks_contents(text, True, True))


def style_of(element: ET.Element, parent: Style, sheets: StyleSheets) -> dict[str, str]:
    """Return the computed style of an element: inherited properties, and its own.

    Its attributes weigh least, then the style sheets, then its attribute `style`, then what is
    important, in the same order.
    """
    attributes = element.attrib
    given = {}
    for key, value in attributes.items():
        name = key
        if (name in INHERITED or name in NOT_INHERITED) and name not in UNLESS_CSS:
            value = value.strip()
            if _is_valid(name, value):
                given[name] = value
    usual, important = sheets.of(element)
    given.update(usual)
    own: Declared = ({}, {})
    if "style" in attributes:
        own = _of_attribute(attributes["style"][:100_000])
        given.update(own[0])
    given.update(important)
    given.update(own[1])
    style = {key: parent[key] for key in INHERITED}
    style.update(NOT_INHERITED)
    for key, value in given.items():
        if value == "inherit" or (value == "unset" and key in INHERITED):
            value = parent.get(key, "")
        elif value in ("initial", "unset"):
            value = INHERITED.get(key) or NOT_INHERITED.get(key, "")
        style[key] = value
    return style
