"""Test cards: drawings that show an arm's faults at a glance.

grid     lines to and fro, both ways: scale, straightness, whether corners are square
star     lines through one point: they miss it where there is backlash
circles  one inside the other, every other one the other way round: backlash leaves steps where
         a joint turns round
iso9283  square, diagonals and two circles in a test plane, after ISO 9283
reach    the boundary of what an arm reaches, at a margin
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from laptop.drawing.artwork import SMOOTH_TURN, Artwork, BadArtwork
from robot.motion.kinematics import Unreachable, branches, coordinates, forward
from shared.arm_description import Arm

MIN_SIZE, MAX_SIZE = 1.0, 100.0
"""Least and greatest side of a card, cm."""

MARGIN = 0.3
"""Distance from the boundary of the reach at which an arm draws that boundary, cm: nothing may
happen beyond it."""

STAR_LINES = 12
CIRCLES = 4
GRID_SPACING = 1.0
"""Least distance of the grid's lines, cm; of larger cards it is an eighth of the side."""


def draw_test_pattern(name: str, size: float = 8.0, arm: Arm | None = None) -> Artwork:
    """Return the Artwork of a test card.

    Args:
        name: one of TEST_PATTERNS, or "reach".
        size: side of the card's square sheet, cm; "reach" is as large as it is.
        arm: whose reach; the others are of no arm.

    Raises:
        BadArtwork: There is no such card, or none of that size.
    """
    if name == "reach":
        if arm is None:
            raise BadArtwork("reach: is the boundary of an arm's reach; say of which arm")
        return reach_pattern(arm)
    if name not in TEST_PATTERNS:
        known = ", ".join((*TEST_PATTERNS, "reach"))
        raise BadArtwork(f"{name[:30]}: there is no such test card; there are {known}")
    if not MIN_SIZE <= size <= MAX_SIZE:
        raise BadArtwork(
            f"size = {size:g} cm: a test card's side must be from {MIN_SIZE:g} to {MAX_SIZE:g} cm"
        )
    strokes = tuple(TEST_PATTERNS[name](size))
    return Artwork(name, strokes, ("",) * len(strokes), (size, size))


def _grid(size: float) -> Iterator[np.ndarray]:
    count = max(1, min(8, int(size / GRID_SPACING)))
    for turned in (False, True):
        for number, place in enumerate(np.linspace(0.0, size, count + 1)):
            line = np.array([[0.0, place], [size, place]])
            line = line[::-1] if number % 2 else line  # to and fro
            yield line[:, ::-1] if turned else line


def _star(size: float) -> Iterator[np.ndarray]:
    centre = np.array([size / 2, size / 2])
    for number in range(STAR_LINES):
        angle = math.pi * number / STAR_LINES
        arm = size / 2 * np.array([math.cos(angle), math.sin(angle)])
        yield np.array([centre - arm, centre + arm][:: -1 if number % 2 else 1])


def _circles(size: float) -> Iterator[np.ndarray]:
    centre = np.array([size / 2, size / 2])
    for number in range(1, CIRCLES + 1):
        circle = _circle(centre, size / 2 * number / CIRCLES)
        yield circle if number % 2 else circle[::-1]


def _iso9283(size: float) -> Iterator[np.ndarray]:
    """Return poses P1 (the middle) and P2 to P5 on the diagonals, a tenth of these from their ends.

    The large circle's diameter is 0.8 of the side, the small one's a tenth of that.
    """
    near, far, middle = 0.1 * size, 0.9 * size, np.array([size / 2, size / 2])
    corners = np.array([[near, near], [far, near], [far, far], [near, far]])
    yield np.vstack([corners, corners[:1]])
    yield corners[[0, 2]]
    yield corners[[3, 1]]
    yield _circle(middle, 0.4 * size)
    yield _circle(middle, 0.04 * size)


TEST_PATTERNS: dict[str, Callable[[float], Iterator[np.ndarray]]] = {
    "grid": _grid,
    "star": _star,
    "circles": _circles,
    "iso9283": _iso9283,
}
"""Cards that need no arm, by name."""


def _circle(centre: np.ndarray, radius: float) -> np.ndarray:
    angles = np.linspace(0.0, 2 * math.pi, math.ceil(360 / SMOOTH_TURN) + 13)
    circle = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    circle[-1] = circle[0]
    return circle


# ---- the boundary of an arm's reach


def reach_pattern(arm: Arm, margin: float = MARGIN) -> Artwork:
    """Return the boundary of the tip's reach on the paper, drawn at a margin inside of it.

    Its strokes are in the arm's own frame, x forward and y left, cm: they are drawn where they are,
    not placed. Every point of them, and all around it within 0.8 margins, can be reached.

    Raises:
        BadArtwork: Nothing is left of the reach at this margin.
    """
    strokes = []
    for curve in _boundary_curves(arm):
        is_ring = np.allclose(curve[0], curve[-1])
        padded = np.vstack([curve[-2:-1], curve, curve[1:2]]) if is_ring else curve
        along = np.gradient(padded, axis=0)[1:-1] if is_ring else np.gradient(curve, axis=0)
        across = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        for side in (1.0, -1.0):
            inside = curve + side * margin * across
            outside = curve - side * margin / 20 * across
            is_boundary = [
                not _is_reachable(arm, out) and _has_room(arm, point, 0.8 * margin)
                for out, point in zip(outside, inside, strict=True)
            ]
            if is_ring and not all(is_boundary):
                # What goes on over the end of a ring is one stroke
                first = is_boundary.index(False)
                inside = np.vstack([inside[first:-1], inside[: first + 1]])
                is_boundary = is_boundary[first:-1] + is_boundary[: first + 1]
            edges = np.flatnonzero(np.diff([False, *is_boundary, False]))
            strokes += [inside[a:b] for a, b in edges.reshape(-1, 2) if b - a > 1]
    if not strokes:
        raise BadArtwork(f"{arm.name}: reaches nothing on the paper at a margin of {margin:g} cm")
    return Artwork(f"reach of {arm.name}", tuple(strokes), ("",) * len(strokes))


def _is_reachable(arm: Arm, point: np.ndarray) -> bool:
    x, y = (float(c) for c in point)
    try:
        return bool(branches(arm, (x, y, 0.0)[: coordinates(arm)]))
    except Unreachable:
        return False


def _has_room(arm: Arm, point: np.ndarray, radius: float) -> bool:
    around = [radius * np.array([math.cos(a), math.sin(a)]) for a in np.arange(8) * math.pi / 4]
    return all(_is_reachable(arm, point + step) for step in around)


def _boundary_curves(arm: Arm) -> Iterator[np.ndarray]:
    """Return curves (n, 2), cm, that contain the boundary of the reach.

    It is where a joint is at a limit, or the arm is stretched out or folded: only there can the tip
    not go on in some direction (Craig, Introduction to Robotics, section 4.2).
    """
    if coordinates(arm) == 3:
        yield from _spatial_curves(arm)
        return
    shoulder, elbow = arm.joints
    bends = [elbow.lower, elbow.upper]
    bends += [bend for bend in (0.0, math.pi, -math.pi) if elbow.lower < bend < elbow.upper]
    # All around, whatever the shoulder's limits are: what is no boundary is left out later
    sweep = _angles(shoulder.lower, shoulder.lower + 2 * math.pi)
    for radius in sorted({round(math.hypot(*forward(arm, (0.0, bend))), 9) for bend in bends}):
        yield radius * np.column_stack([np.cos(sweep), np.sin(sweep)])
    for heading in (shoulder.lower, shoulder.upper):
        sweep = _angles(elbow.lower, elbow.upper)
        yield np.array([forward(arm, (heading, q)) for q in sweep])


def _spatial_curves(arm: Arm) -> Iterator[np.ndarray]:
    """Return arcs around the base at the ends of the reach, and lines at the base's limits."""
    base = arm.joints[0]
    far = sum(joint.link for joint in arm.joints[1:])
    middle = (base.lower + base.upper) / 2
    ahead = np.array([math.cos(middle), math.sin(middle)])
    radii = np.linspace(0.0, far * 1.01, 400)
    is_inside = [_is_reachable(arm, radius * ahead) for radius in radii]
    for k in np.flatnonzero(np.diff(is_inside)):
        low, high = radii[k], radii[k + 1]
        for _ in range(40):  # where it changes, by halving
            half = (low + high) / 2
            low, high = (
                (half, high) if _is_reachable(arm, half * ahead) == is_inside[k] else (low, half)
            )
        sweep = _angles(base.lower, base.upper)
        yield low * np.column_stack([np.cos(sweep), np.sin(sweep)])
    for heading in (base.lower, base.upper):
        yield radii[:, None] * np.array([math.cos(heading), math.sin(heading)])


def _angles(lower: float, upper: float) -> np.ndarray:
    """Return angles from one limit to the other, at most 2 degrees between neighbours."""
    return np.linspace(lower, upper, max(2, math.ceil(math.degrees(upper - lower) / 2) + 1))
