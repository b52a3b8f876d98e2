"""Areas with holes: what a closed line surrounds, and lines cut at their edge.  Pure.

GEOS cuts, by way of shapely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

MAX_FACES = 3000
"""Most parts into which crossing edges may divide an area."""

EDGE_MARGIN = 1e-6
"""Distance from an edge that still counts as inside, as a share of the area's greater side."""

SHORTEST_HATCH = 0.6
"""Least length of a hatching line, in distances between two lines."""

NOTHING: BaseGeometry = shapely.Polygon()


class TooTangled(Exception):
    """Edges that cross one another too often."""


def area_of(contours: Sequence[np.ndarray], is_even_odd: bool) -> BaseGeometry:
    """Return the area inside closed contours (n, 2); open ones are closed.

    Args:
        contours: closed or open lines, each (n, 2).
        is_even_odd: whether overlaps are inside and outside by turns; else all is inside around
            which the contours wind (SVG 1.1, `fill-rule`).

    Raises:
        TooTangled: See there.
    """
    rings = []
    for points in contours:
        closed = np.vstack([points, points[:1]])
        closed = closed[np.append(True, (np.diff(closed, axis=0) != 0).any(axis=1))]
        if len(closed) >= 4:
            rings.append(closed)
    if not rings:
        return NOTHING
    if len(rings) == 1:
        ring = shapely.LinearRing(rings[0])
        if ring.is_simple:
            return shapely.Polygon(ring)
    lines = shapely.union_all(shapely.linestrings(rings[0]) if len(rings) == 1 else _lines(rings))
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
    if len(faces) > MAX_FACES:
        raise TooTangled
    inner = shapely.get_coordinates(shapely.point_on_surface(faces))
    winding = sum(_winding(ring, inner) for ring in rings)
    chosen = winding % 2 == 1 if is_even_odd else winding != 0
    return shapely.union_all(faces[chosen])


def _lines(rings: Sequence[np.ndarray]) -> list[BaseGeometry]:
    return [shapely.LineString(ring) for ring in rings]


def _winding(ring: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the winding number of a closed ring (n, 2) at points (m, 2), anticlockwise: (m,).

    By the edges that a ray to the right crosses: upwards and downwards.
    """
    begin, end = ring[:-1, None], ring[1:, None]
    up = (begin[..., 1] <= points[:, 1]) & (end[..., 1] > points[:, 1])
    down = (begin[..., 1] > points[:, 1]) & (end[..., 1] <= points[:, 1])
    edge, offset = end - begin, points - begin
    left = edge[..., 0] * offset[..., 1] - edge[..., 1] * offset[..., 0]
    return (up & (left > 0)).sum(axis=0) - (down & (left < 0)).sum(axis=0)


def widened(area: BaseGeometry) -> BaseGeometry:
    """Return the area grown by EDGE_MARGIN, so that a line along its edge is inside."""
    if area.is_empty:
        return area
    x0, y0, x1, y1 = area.bounds
    return area.buffer(EDGE_MARGIN * max(x1 - x0, y1 - y0), join_style="mitre")


def outlines(area: BaseGeometry) -> list[np.ndarray]:
    """Return the closed boundary lines (n, 2) of an area and its holes."""
    found = []
    for part in shapely.get_parts(area):
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            for ring in (part.exterior, *part.interiors):
                found.append(np.asarray(ring.coords, float))
    return found


def cut_at(points: np.ndarray, area: BaseGeometry) -> list[np.ndarray]:
    """Return the parts of a line through points (n, 2) inside an area, in order, each (m, 2).

    A closed line of which its begin is inside, and another part outside, begins elsewhere.
    """
    shapely.prepare(area)
    line = shapely.LineString(points)
    if area.covers(line):
        return [points]
    if not area.intersects(line):
        return []
    segments = shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1))
    inside = shapely.covers(area, segments)
    crossing = ~inside & shapely.intersects(area, segments)
    found: list[list[np.ndarray]] = []
    for k, segment in enumerate(segments):
        if inside[k]:
            spans = [points[k : k + 2]]
        elif crossing[k]:
            spans = _spans(segment, area, points[k], points[k + 1])
        else:
            continue
        for span in spans:
            if found and (found[-1][-1] == span[0]).all():
                found[-1].append(span[1])
            else:
                found.append([span[0], span[1]])
    parts = [np.array(part) for part in found]
    if len(parts) > 1 and (points[0] == points[-1]).all():
        first, last = parts[0], parts[-1]
        if (first[0] == last[-1]).all():
            parts = [np.vstack([last, first[1:]]), *parts[1:-1]]
    return parts


def _spans(
    segment: BaseGeometry, area: BaseGeometry, begin: np.ndarray, end: np.ndarray
) -> list[np.ndarray]:
    """Return the parts (2, 2) of a segment inside an area, in order; its ends stay exact."""
    edge = end - begin
    found = []
    for part in shapely.get_parts(segment.intersection(area)):
        if isinstance(part, shapely.LineString) and part.length > 0:
            ends = np.asarray(part.coords, float)[[0, -1]]
            shares = np.clip((ends - begin) @ edge / (edge @ edge), 0.0, 1.0)
            found.append((min(shares), max(shares)))
    spans = []
    for low, high in sorted(found):
        first = begin if low < 1e-9 else begin + low * edge
        last = end if high > 1 - 1e-9 else begin + high * edge
        spans.append(np.array([first, last]))
    return spans


def hatching(area: BaseGeometry, angle: float, distance: float) -> list[np.ndarray]:
    """Return the hatching of an area: parallel lines (2, 2), in alternating direction.

    Args:
        area: what is hatched.
        angle: of the lines from x, rad.
        distance: from line to line; all areas have theirs at the same places.
    """
    if area.is_empty:
        return []
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    x0, y0, x1, y1 = area.bounds
    corners = np.array([[x0, y0], [x1, y0], [x0, y1], [x1, y1]])
    low, high = np.sort(corners @ across)[[0, -1]] / distance
    begin, end = np.sort(corners @ along)[[0, -1]]
    places = distance * np.arange(math.ceil(low), math.floor(high) + 1)
    if len(places) > MAX_FACES:
        raise TooTangled
    ends = np.array([begin, end])
    lines = places[:, None, None] * across + ends[None, :, None] * along
    found = []
    for k, line in enumerate(shapely.intersection(area, shapely.linestrings(lines))):
        parts = [
            np.asarray(part.coords, float)[[0, -1]]
            for part in shapely.get_parts(line)
            if isinstance(part, shapely.LineString) and part.length >= SHORTEST_HATCH * distance
        ]
        parts.sort(key=lambda ends: float(ends.mean(axis=0) @ along), reverse=bool(k % 2))
        for part in parts:
            is_forth = float((part[1] - part[0]) @ along) > 0
            found.append(part if is_forth != bool(k % 2) else part[::-1])
    return found
