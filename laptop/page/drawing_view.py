"""The drawing over a camera's picture: how it looks there, and how a hand moves, turns, scales it.

Pure: pixels in, SVG and placings out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import Enum

import cv2
import numpy as np

from laptop.page.drag_path import simplified
from laptop.page.drawing_snapshots import DrawingSnapshot, PlacedDrawing, Placing
from laptop.page.table_mapping import TableView
from laptop.see.serve.pipeline import Point

REACHABLE_COLOUR, MISSED_COLOUR, MOVING_COLOUR, BOX_COLOUR = (
    "#0e9f4f",
    "#ff2436",
    "#d97700",
    "#1c62ad",
)
"""Colours of what can be drawn, of what cannot, of what is just moved, of the box with handles."""
HALO = "#fffc"
MAX_POINTS = 2500
"""Greatest number of points of a drawing that are shown."""
MIN_THINNING = 0.02
"""Least tolerance by which lines are thinned, cm."""
HANDLE_RADIUS = 9.0
"""Radius of a handle, px of a picture of 640."""
GRASP_RADIUS = 20.0
"""Distance within which a handle is grasped, the same px."""
HANDLE_ARM = 1.5
"""Distance of the turning handle above the box, cm."""
SIDE_LIMITS = 0.5, 60.0
"""Least and greatest side of a drawing that hands make, cm."""


class Grip(Enum):
    """Grip of a hand on a drawing."""

    MOVE = "move"
    TURN = "turn"
    SCALE = "scale"


class DrawingView:
    """A drawing in one camera's picture, in one browser.

    Attributes:
        snapshot: the newest that is known.
        moved: where a hand has it just now, not yet answered by the tracker; or None.
    """

    def __init__(self, camera: str) -> None:
        self._camera = camera
        self.snapshot = DrawingSnapshot(None, {})
        self.moved: Placing | None = None
        self._lines: list[tuple[np.ndarray, str]] = []
        self._grip: Grip | None = None
        self._pressed = np.zeros(2)  # cm

    @property
    def view(self) -> TableView | None:
        """View of the table in this picture."""
        return self.snapshot.views.get(self._camera)

    @property
    def is_held(self) -> bool:
        """Return True while a hand has it."""
        return self._grip is not None

    def update(self, snapshot: DrawingSnapshot) -> None:
        """Update the drawing; a drag that is under way continues."""
        self.snapshot = snapshot
        placed = snapshot.placed
        self._lines = []
        if placed:
            reachable, missed = thinned([placed.reachable, placed.missed])
            self._lines = [(line, REACHABLE_COLOUR) for line in reachable] + [
                (line, MISSED_COLOUR) for line in missed
            ]
        if not self.is_held:
            self.moved = None

    # The hand

    def press(self, pixel: Point, width: int) -> bool:
        """Begin a drag; return whether the drawing or a handle is at this pixel (u, v).

        Args:
            pixel: px.
            width: of the picture, px.
        """
        placed, view = self.snapshot.placed, self.view
        if placed is None or view is None:
            return False
        near = GRASP_RADIUS * width / 640
        corners, turner = self._handles(placed, self._placing(placed))
        seen = view.to_picture(np.vstack([corners, turner]))
        off = np.hypot(*(seen - pixel).T)
        at = view.to_table(np.array([pixel]))[0]
        if off[4] <= near:
            self._grip = Grip.TURN
        elif off[:4].min() <= near:
            self._grip = Grip.SCALE
        elif cv2.pointPolygonTest(seen[:4].astype(np.float32), pixel, True) > -near:
            self._grip = Grip.MOVE
        else:
            return False
        self._pressed = at
        self._began = self.moved = self._placing(placed)
        return True

    def move(self, pixel: Point) -> None:
        """Take it along to a pixel (u, v)."""
        view, began = self.view, self._began
        if self._grip is None or view is None:
            return
        at = view.to_table(np.array([pixel]))[0]
        centre = np.array([began.x, began.y], float)
        if not np.isfinite(at).all() or np.hypot(*(at - centre)) > 3 * SIDE_LIMITS[1]:
            return  # beyond the horizon
        if self._grip is Grip.MOVE:
            x, y = centre + at - self._pressed
            self.moved = began._replace(x=float(x), y=float(y))
            return
        one, other = self._pressed - centre, at - centre
        if min(np.hypot(*one), np.hypot(*other)) < 0.05:
            return
        if self._grip is Grip.TURN:
            turn = math.degrees(math.atan2(*other[::-1]) - math.atan2(*one[::-1]))
            self.moved = began._replace(rotate=(began.rotate + turn + 180) % 360 - 180)
        else:
            size = (began.size or 0.0) * float(np.hypot(*other) / np.hypot(*one))
            self.moved = began._replace(size=min(max(SIDE_LIMITS[0], size), SIDE_LIMITS[1]))

    _began = Placing()

    def release(self) -> Placing | None:
        """End the drag; return the new placement, or None if it was not moved."""
        self._grip, held = None, self.is_held
        if not held or self.moved == self._began:
            self.moved = None
            return None
        return self.moved

    def cancel(self) -> None:
        """Cancel the drag: the placement stays."""
        self._grip = self.moved = None

    def _placing(self, placed: PlacedDrawing) -> Placing:
        """Return where it lies, or where a hand has it."""
        return self.moved or placing_of(placed)

    def _handles(self, placed: PlacedDrawing, at: Placing) -> tuple[np.ndarray, np.ndarray]:
        """Return corners (4, 2) of its box and where the handle is that turns it (2,), cm."""
        scale = (at.size or 0.0) / max(max(placed.size), 1e-9)
        width, height = (max(scale * side, 0.6) / 2 for side in placed.size)
        angle = math.radians(at.rotate)
        up = np.array([math.cos(angle), math.sin(angle)])
        right = np.array([up[1], -up[0]])
        centre = np.array([at.x, at.y], float)
        corners = [
            centre + a * width * right + b * height * up
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        return np.array(corners), centre + (height + HANDLE_ARM) * up

    # Rendering

    def svg(self, width: int, handles: bool) -> str:
        """Return it as SVG in a picture's pixels; "" where there is none, or nobody knows where.

        Args:
            width: of the picture, px.
            handles: show what it is moved by.
        """
        placed, view = self.snapshot.placed, self.view
        if placed is None or view is None:
            return ""
        k = width / 640
        at = self._placing(placed)
        parts = [
            '<g transform="translate(.5 .5)" fill="none" stroke-linecap="round" '
            'stroke-linejoin="round">'
        ]
        moved = self.moved is not None
        paths: dict[str, list[str]] = {}
        for line, color in self._lines:
            points = view.to_picture(_moved(line, placed, at) if moved else line)
            paths.setdefault(MOVING_COLOUR if moved else color, []).append(_svg_path(points))
        for color, lines in paths.items():
            path = "".join(lines)
            parts.append(
                f'<path d="{path}" stroke="{HALO}" stroke-width="{4.5 * k:g}"/>'
                f'<path d="{path}" stroke="{color}" stroke-width="{2 * k:g}" '
                f'data-drawing="{_NAMES[color]}"/>'
            )
        if handles:
            parts.append(self._box(placed, at, view, k))
        return "".join([*parts, "</g>"])

    def _box(self, placed: PlacedDrawing, at: Placing, view: TableView, k: float) -> str:
        corners, turner = self._handles(placed, at)
        seen = view.to_picture(np.vstack([corners, turner]))
        top = (seen[2] + seen[3]) / 2
        frame = _svg_path(np.vstack([seen[:4], seen[:1]])) + _svg_path(np.vstack([top, seen[4]]))
        dots = "".join(
            f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{HANDLE_RADIUS * k:g}" fill="{fill}" '
            f'stroke="#fff" stroke-width="{2 * k:g}" data-handle="{name}"/>'
            for (u, v), name, fill in [
                *((corner, "scale", BOX_COLOUR) for corner in seen[:4]),
                (seen[4], "turn", MOVING_COLOUR),
            ]
        )
        return (
            f'<path d="{frame}" stroke="{HALO}" stroke-width="{3 * k:g}"/>'
            f'<path d="{frame}" stroke="{BOX_COLOUR}" stroke-width="{1.5 * k:g}" '
            f'stroke-dasharray="{5 * k:g} {4 * k:g}" data-drawing="box"/>{dots}'
        )


_NAMES = {REACHABLE_COLOUR: "good", MISSED_COLOUR: "missed", MOVING_COLOUR: "moving"}


def placing_of(placed: PlacedDrawing) -> Placing:
    """Return where a drawing lies."""
    return Placing(*placed.centre, max(placed.size), placed.rotate)


def _moved(line: np.ndarray, placed: PlacedDrawing, at: Placing) -> np.ndarray:
    """Return a line (n, 2), cm, of a placed drawing where another placing has it."""
    angle = math.radians(at.rotate - placed.rotate)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    scale = (at.size or 0.0) / max(max(placed.size), 1e-9)
    return scale * (line - placed.centre) @ turn.T + (at.x, at.y)


def _svg_path(points: np.ndarray) -> str:
    return "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in points)


def thinned(groups: Iterable[Iterable[np.ndarray]]) -> list[list[np.ndarray]]:
    """Return groups of lines (n, 2), cm, with no more than MAX_POINTS of them all, about."""
    lines = [list(group) for group in groups]
    by = MIN_THINNING
    while True:
        thin = [[simplified(line, by) for line in group if len(line)] for group in lines]
        if sum(len(line) for group in thin for line in group) <= MAX_POINTS or by > 2.0:
            return thin
        by *= 1.6


def figure(snapshot: DrawingSnapshot) -> str:
    """Return wish and ink over each other as an SVG of its own, in the arm's coordinates; or ""."""
    placed, deviation = snapshot.placed, snapshot.deviation
    if placed is None or deviation is None or not placed.reachable:
        return ""
    wish, ink = thinned([placed.reachable, deviation.ink])
    # Seen from behind the arm: its x is up, its y to the left.
    drawn = [[np.column_stack([-line[:, 1], -line[:, 0]]) for line in part] for part in (wish, ink)]
    points = np.vstack([line for part in drawn for line in part])
    low, high = points.min(axis=0) - 0.4, points.max(axis=0) + 0.4
    wide, tall = high - low
    thick = max(wide, tall) / 160
    paths = "".join(
        f'<path d="{"".join(_fine(line) for line in part)}" fill="none" stroke="{color}" '
        f'stroke-width="{thick * width:.4g}" stroke-linejoin="round" data-part="{name}"/>'
        for part, color, width, name in (
            (drawn[0], REACHABLE_COLOUR, 2.4, "wish"),
            (drawn[1], "#1547c8", 1.0, "ink"),
        )
    )
    return (
        f'<svg viewBox="{low[0]:.3f} {low[1]:.3f} {wide:.3f} {tall:.3f}" class="compared" '
        f'role="img" aria-label="wish and ink over each other">{paths}</svg>'
    )


def _fine(points: np.ndarray) -> str:
    return "M" + "L".join(f"{x:.3f} {y:.3f}" for x, y in points)
