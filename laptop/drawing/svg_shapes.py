"""The shapes of SVG as pieces of strokes.  Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from laptop.drawing.curves import Elliptic, Piece, Straight
from laptop.drawing.svg_path import Subpaths, path_pieces, polyline_pieces

Get = Callable[[str, float], "float | None"]


class NoShape(Exception):
    """A shape without size, which SVG does not show."""


def shape_pieces(
    tag: str, attributes: Mapping[str, str], get: Get, viewport: tuple[float, float], most: int
) -> Subpaths:
    """Return the strokes of a shape as consecutive pieces, in its own coordinates, px.

    Args:
        tag: one of svg_elements.SHAPES.
        attributes: with `d` or `points` of a path or a list of points.
        get: `get(name, full)` is a length of it, px, of which `full` are 100 %; None where
            nothing says it.
        viewport: width and height that percentages are of.
        most: so many points it may have.

    Raises:
        NoShape: It has no size.
        BadShape: It is broken or too long.
    """
    if tag == "path":
        return path_pieces(attributes.get("d", ""), most)
    if tag in ("polyline", "polygon"):
        return polyline_pieces(attributes.get("points", ""), tag == "polygon", most)
    across, down = viewport
    if tag == "line":
        ends = [[get(f"x{k}", across) or 0.0, get(f"y{k}", down) or 0.0] for k in (1, 2)]
        return [[Straight(np.array(ends))]]
    if tag == "circle":  # SVG 1.1, section 7.10: per cent of what is neither width nor height
        rx = ry = get("r", math.hypot(across, down) / math.sqrt(2)) or 0.0
    else:
        rx, ry = _radii(get, across, down)
    if tag == "rect":
        return _rectangle(get, across, down, rx, ry)
    if rx <= 0 or ry <= 0:
        raise NoShape
    centre = np.array([get("cx", across) or 0.0, get("cy", down) or 0.0])
    axes = np.array([rx, 0.0]), np.array([0.0, ry])
    return [[Elliptic(centre, *axes, 0.0, 2 * math.pi)]]


def _radii(get: Get, across: float, down: float) -> tuple[float, float]:
    """Return both radii of an ellipse or of corners; one that is not given equals the other."""
    rx, ry = (get(key, full) for key, full in (("rx", across), ("ry", down)))
    rx, ry = (None if r is None or r < 0 else r for r in (rx, ry))
    return (ry if rx is None else rx) or 0.0, (rx if ry is None else ry) or 0.0


def _rectangle(get: Get, across: float, down: float, rx: float, ry: float) -> Subpaths:
    x, y = get("x", across) or 0.0, get("y", down) or 0.0
    width, height = get("width", across) or 0.0, get("height", down) or 0.0
    if width <= 0 or height <= 0:
        raise NoShape
    rx, ry = min(rx, width / 2), min(ry, height / 2)
    if not (rx and ry):
        corners = [(0, 0), (width, 0), (width, height), (0, height), (0, 0)]
        return [[Straight(np.array(corners) + [x, y])]]
    far, low = x + width, y + height
    sides = [
        [(x + rx, y), (far - rx, y)], [(far, y + ry), (far, low - ry)],
        [(far - rx, low), (x + rx, low)], [(x, low - ry), (x, y + ry)],
    ]  # fmt: skip
    centres = [(far - rx, y + ry), (far - rx, low - ry), (x + rx, low - ry), (x + rx, y + ry)]
    u, v = np.array([rx, 0.0]), np.array([0.0, ry])
    pieces: list[Piece] = []
    for k, (side, centre) in enumerate(zip(sides, centres, strict=True)):
        if side[0] != side[1]:
            pieces.append(Straight(np.array(side)))
        pieces.append(Elliptic(np.array(centre), u, v, (k - 1) * math.pi / 2, math.pi / 2))
    return [pieces]
