"""Visible colour of a fill or stroke of SVG: a colour, a gradient or a pattern.  Pure."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from laptop.drawing.svg_elements import href_of, tag_of
from laptop.drawing.svg_paint import Paint, colour_paint, reference, share
from laptop.drawing.svg_place import SvgElements, SvgPlace

MAX_GRADIENT_CHAIN = 10
"""Longest chain of gradients that take their colours from one another."""
GRADIENTS = ("linearGradient", "radialGradient")


def paint_of(tree: SvgElements, key: str, place: SvgPlace) -> Paint | None:
    """Return the visible effect of a fill or stroke; None if there is none."""
    style = place.style
    opacity = place.opacity * (share(style[f"{key}-opacity"]) or 0.0)
    text = style[key]
    found = reference(text)
    if found is not None:
        server = tree.find(found[0])
        if server is not None and tag_of(server) in GRADIENTS:
            return _gradient_paint(tree, server, place, opacity)
        if server is not None and tag_of(server) == "pattern":
            return Paint(0.5, opacity, "a pattern") if opacity else None
        text = found[1] or "none"
    if text in ("none", "context-fill", "context-stroke", ""):
        return None
    return colour_paint(text, style["color"], opacity)


def _gradient_paint(
    tree: SvgElements, server: ET.Element, place: SvgPlace, opacity: float
) -> Paint | None:
    """Return the mean of a gradient's stops, None where nothing of it is seen."""
    stops: list[ET.Element] = []
    for _ in range(MAX_GRADIENT_CHAIN):
        stops = [child for child in server if tag_of(child) == "stop"]
        href = href_of(server)
        further = tree.find(href)
        if stops or further is None or tag_of(further) not in GRADIENTS:
            break
        server = further
    found = []
    for stop in stops:
        style = tree.style(stop, place.style)
        thin = share(style["stop-opacity"])
        seen = colour_paint(style["stop-color"], style["color"], opacity * (thin or 0.0))
        found.append(seen or Paint(0.0, 0.0))
    if not any(paint.opacity for paint in found):
        return None
    darkness, through = np.mean([paint[:2] for paint in found], axis=0)
    # One colour and the next: it is neither black nor white, and is not seen through evenly
    return Paint(float(darkness), float(through), "a gradient")
