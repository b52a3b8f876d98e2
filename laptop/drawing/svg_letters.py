"""The characters of an SVG's text, and where each of them is put.  Pure."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

from laptop.drawing.svg_css import Style
from laptop.drawing.svg_elements import tag_of
from laptop.drawing.svg_place import SvgElements, SvgPlace
from laptop.drawing.svg_text import Letter
from laptop.drawing.svg_units import UnreadableValue, length

PRESERVE = "{http://www.w3.org/XML/1998/namespace}space"
MAX_LETTERS = 20_000
"""Greatest number of letters of a text that are set."""
INNER = ("tspan", "a", "tref")
WHITE_SPACE = "\n\r\t"


def words_of(element: ET.Element) -> str:
    """Return a text's first words, for people."""
    words = "".join(part[:100] for part in islice(element.itertext(), 10)).split()
    return " ".join(words)


def letters_of(tree: SvgElements, element: ET.Element, place: SvgPlace) -> list[Letter]:
    """Return all visible letters of a `text` element."""
    found: list[Letter] = []
    _collect(tree, element, place.style, place, found, False)
    while found and found[-1].text == " " and not _keep_spaces(found[-1].style):
        found.pop()
    return found


def _keep_spaces(style: Style) -> bool:
    return style["white-space"] in ("pre", "pre-wrap", "break-spaces")


def _collect(
    tree: SvgElements,
    element: ET.Element,
    style: Style,
    place: SvgPlace,
    found: list[Letter],
    keep_spaces: bool,
) -> None:
    first = len(found)
    keep_spaces = (element.get(PRESERVE) == "preserve") or (
        keep_spaces and element.get(PRESERVE) is None
    )
    for part in _parts(element):
        if isinstance(part, str):
            _add(part, style, place.font, found, keep_spaces or _keep_spaces(style))
            continue
        tag = tag_of(part)
        if tag == "textPath":
            tree.left_out.add("text path", words_of(part))
        if tag not in INNER:
            continue
        inner = tree.place(part, replace(place, style=style)) if tag == "a" else None
        own = tree.style(part, style)
        if own["display"] == "none":
            continue
        size = tree.font(own, replace(place, style=style))
        own["font-size"] = f"{size!r}px"
        _collect(tree, part, own, replace(inner or place, font=size, style=own), found, keep_spaces)
    _put(element, place, found, first)


def _parts(element: ET.Element) -> Iterator[Any]:
    """Return the texts and child elements of an element, in order."""
    yield element.text or ""
    for child in element:
        yield child
        yield child.tail or ""


def _add(text: str, style: Style, size: float, found: list[Letter], keep_spaces: bool) -> None:
    for letter in text[:MAX_LETTERS]:
        if len(found) >= MAX_LETTERS:
            return
        if letter in WHITE_SPACE:
            letter = " "
        if letter == " " and not keep_spaces and (not found or found[-1].text == " "):
            continue
        if letter.isprintable():
            found.append(Letter(letter, style, size))


def _put(element: ET.Element, place: SvgPlace, found: list[Letter], first: int) -> None:
    """Give the letters of an element the places that it lists, where none is given yet."""
    for key, axis in (("x", 0), ("y", 1), ("dx", 0), ("dy", 1)):
        words = element.get(key, "").replace(",", " ").split()
        for k, word in zip(range(first, len(found)), words, strict=False):
            try:
                value = length(word, place.viewport[axis], None, place.font)
            except UnreadableValue:
                break
            given = getattr(found[k], key)
            change: Any = {key: value if given is None else given + value}
            if given is None or key in ("dx", "dy"):
                found[k] = replace(found[k], **change)
    turns = element.get("rotate", "").replace(",", " ").split()
    for k in range(first, len(found)) if turns else ():
        word = turns[min(k - first, len(turns) - 1)]
        try:
            found[k] = replace(found[k], turn=float(word))
        except ValueError:
            break
