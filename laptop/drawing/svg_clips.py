"""Clips and masks of SVG, as areas on the sheet that cut a shape.

A mask of opaque white and black shapes is an area, too; any other shows through in part, which no
pen can draw.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from laptop.drawing.areas import NOTHING, TooTangled, area_of, widened
from laptop.drawing.curves import flatten
from laptop.drawing.svg_css import Style
from laptop.drawing.svg_paint import reference
from laptop.drawing.svg_place import Box, Shape, SvgElements, SvgPlace
from laptop.drawing.svg_servers import paint_of
from laptop.drawing.svg_units import UnreadableValue, compose
from laptop.drawing.xml_guard import MAX_DEPTH

EDGE_TOLERANCE = 3e-4
"""Greatest distance of an area's edge from a curve, as a share of the area's greater side."""
MAX_POINTS = 20_000
"""Greatest number of points of an edge."""
MAX_CACHED = 500
"""Greatest number of cached areas, for other shapes that have the same."""

Area: TypeAlias = BaseGeometry | None


def clips_of(
    tree: SvgElements, style: Style, element: ET.Element, place: SvgPlace
) -> tuple[Area, ...]:
    """Return the areas that clip an element; None in place of one that cannot be cut.

    Args:
        tree: the elements that clips and masks refer to.
        style: that names the clips: the element's own, or that of a clip of it.
        element: what is clipped.
        place: where the element is.
    """
    found: list[Area] = []
    for key, kind in (("clip-path", "clipPath"), ("mask", "mask")):
        value = style[key]
        if value == "none":
            continue
        led = reference(value)
        if led is None:
            tree.left_out.add("clip", value)  # a shape of CSS, such as circle(50%)
            continue
        target = tree.find(led[0])
        if target is None or not target.tag.endswith(kind):
            continue  # as if it were absent (SVG 2, section 14.3)
        found.append(_area(tree, target, element, place, kind))
    return tuple(found)


def _area(
    tree: SvgElements, target: ET.Element, element: ET.Element, place: SvgPlace, kind: str
) -> Area:
    if target in place.uses or len(place.uses) > MAX_DEPTH:
        return None
    box = None
    if "objectBoundingBox" in (target.get("clipPathUnits"), target.get("maskContentUnits")):
        box = tree.extent(element, place)
        if box is None:
            return NOTHING
    key = (target, place.affine.tobytes(), place.viewport, box)
    if key not in tree.areas:
        if len(tree.areas) >= MAX_CACHED:
            tree.areas.clear()
        with tree.muted():
            try:
                tree.areas[key] = _inside(tree, target, element, place, kind, box)
            except (TooTangled, UnreadableValue, shapely.GEOSException):
                tree.areas[key] = None
    return tree.areas[key]


def _inside(
    tree: SvgElements,
    target: ET.Element,
    element: ET.Element,
    place: SvgPlace,
    kind: str,
    box: Box | None,
) -> Area:
    """Return the area of a clip or mask for an element; in parts of `box` if its units say so."""
    place = replace(place, clips=(), opacity=1.0, uses=(*place.uses, target))
    own = tree.place(target, replace(place, style=tree.first_style))
    if own is None:
        return NOTHING
    cuts = clips_of(tree, own.style, element, place)
    if box is not None:
        within = np.array([[box[2], 0.0, box[0]], [0.0, box[3], box[1]]])
        own = replace(own, affine=compose(own.affine, within))
    is_alpha = own.style["mask-type"] == "alpha"
    area, points = NOTHING, 0
    for shape in tree.shapes([(child, own) for child in target]):
        points += sum(len(piece.hull()) for line in shape.pieces for piece in line)
        if points > MAX_POINTS or None in shape.place.clips:
            return None
        adds = kind == "clipPath"
        if kind == "mask":
            paint = paint_of(tree, "fill", shape.place)
            if paint is None:
                continue
            light = 1.0 if is_alpha else 1.0 - paint.darkness
            if min(light, 1.0 - light, key=abs) > 0.01 or paint.opacity < 0.99:
                return None
            adds = light > 0.5
        part = filled(shape, "clip-rule" if kind == "clipPath" else "fill-rule")
        for clip in shape.place.clips:
            part = part.intersection(clip)
        area = area.union(part) if adds else area.difference(part)
    for clip in cuts:
        if clip is None:
            return None
        area = area.intersection(clip)
    return widened(area)


def filled(shape: Shape, rule: str) -> BaseGeometry:
    """Return the area on the sheet that a shape fills.

    Args:
        shape: whose lines bound the area.
        rule: property that defines what is inside.

    Raises:
        TooTangled: Its edge crosses itself too often.
    """
    if shape.tag == "line" or not shape.pieces:
        return NOTHING
    hull = np.concatenate([piece.hull() for line in shape.pieces for piece in line])
    fine = max(float(np.ptp(hull, axis=0).max()) * EDGE_TOLERANCE, 1e-9)
    contours = [flatten(line, fine) for line in shape.pieces]
    return area_of(contours, shape.place.style[rule] == "evenodd")
