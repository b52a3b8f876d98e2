"""The elements of SVG by name, and what they say of themselves.  Pure."""

from __future__ import annotations

import xml.etree.ElementTree as ET

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
HREF = ("href", "{http://www.w3.org/1999/xlink}href")
LANGUAGE = "en"
"""The reader's language, for `systemLanguage`."""

SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
CONTAINERS = ("g", "a", "svg", "switch")
DRAWABLE = (*SHAPES, *CONTAINERS, "use", "text", "image")


def tag_of(element: ET.Element) -> str:
    """Return the name of an SVG element, "" for one of another kind."""
    tag = element.tag
    return tag.removeprefix(SVG) if tag.startswith(SVG) or "}" not in tag else ""


def is_for_us(element: ET.Element) -> bool:
    """Return whether an element is meant for a reader of LANGUAGE, and needs no extension."""
    if element.get("requiredExtensions", "").strip():
        return False
    languages = element.get("systemLanguage")
    if languages is None:
        return True
    tags = (tag.strip().lower() for tag in languages.split(","))
    return any(t == LANGUAGE or t.startswith(f"{LANGUAGE}-") for t in tags)


def layer_of(element: ET.Element) -> str:
    """Return the name of the layer that a group is; "" where it is none."""
    if element.attrib.get(INKSCAPE + "groupmode") != "layer":
        return ""
    return element.attrib.get(INKSCAPE + "label") or element.attrib.get("id") or "layer"


def href_of(element: ET.Element) -> str:
    """Return the target of an element's reference; "" for none."""
    return next((element.attrib[key] for key in HREF if key in element.attrib), "").strip()
