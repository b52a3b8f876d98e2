"""Placing of a drawing on the table.  Pure.

A sheet lies so that whoever sits behind the arm and looks the way it points (along x) sees the
drawing upright: up on the sheet is x, to the right is -y.  It is turned by `rotate` from there,
counter-clockwise as seen from above.  180 is upright for who sits opposite.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.drawing import reach
from laptop.drawing.artwork import Artwork, BadArtwork, bounds, is_dot
from shared.arm_description import Arm

PAPERS = {"a6": (10.5, 14.8), "a5": (14.8, 21.0), "a4": (21.0, 29.7), "letter": (21.59, 27.94)}
"""Widths and heights of sheets by name, cm."""

LARGEST = 200.0
"""Greatest size of a sheet or drawing, cm."""

PAPER_MARGIN = 1.0
"""Width of the blank margin of a sheet, cm."""

STAND_RADIUS = 3.0
"""Distance from the arm's axis within which no sheet can lie, cm: the arm stands there."""

LEAST_SIZE = 0.2
"""Least size of a drawing, cm."""

COARSE_STEP, FINE_STEP = 1.0, 0.2
"""Grid spacings of the search for a place, cm: over the whole table, and near the best place."""

MIN_SHARE_AHEAD = 0.93
"""Share of the greatest size that suffices for a drawing to lie straight ahead of the arm."""

COARSE_CELLS, FINE_CELLS = 24, 96
"""Cells along the drawing's greater side, coarse and fine: of each stroke one point in a cell is
tried."""

MAX_TRIED_POINTS = 2500
"""Number of points above which the cells are enlarged."""

OUTLINE_POINTS = 24
"""Number of points of the outline that are tried before all others."""

HALVINGS = 12
"""Number of halvings in the bisection for the greatest size."""

SHRINK_FACTOR, MAX_SHRINKS = 0.99, 30
"""Factor by which a drawing that is a little too large is reduced, and greatest number of
reductions."""


class BadPlace(BadArtwork):
    """A place or size at which nothing can be drawn."""


def paper_size(text: str) -> tuple[float, float]:
    """Return the width and height of a sheet, cm, by its name (a5, a4, letter) or as WxH.

    Raises:
        BadPlace: no such sheet.
    """
    name, _, turned = text.lower().partition("-")
    if name in PAPERS and turned in ("", "landscape"):
        width, height = PAPERS[name]
        return (height, width) if turned else (width, height)
    size = re.fullmatch(r"(\d+\.?\d*)x(\d+\.?\d*)", text.lower())
    if size is None:
        raise BadPlace(
            f"paper {text!r} is no sheet; give one of {', '.join(PAPERS)}, with -landscape where "
            "it lies across, or WIDTHxHEIGHT in cm"
        )
    width, height = float(size[1]), float(size[2])
    if not (min(width, height) > 2 * PAPER_MARGIN and max(width, height) <= LARGEST):
        raise BadPlace(
            f"paper of {width:g} x {height:g} cm: give sides of more than {2 * PAPER_MARGIN:g} and "
            f"at most {LARGEST:g} cm"
        )
    return width, height


@dataclass(frozen=True, eq=False)
class Placement:
    """A drawing on the table, in the arm's coordinates, cm.

    strokes  (n, 2) each: x forward, y left
    scale    from the artwork's size to that on the table
    size     width and height of the drawing, as its viewer has them
    centre   of the drawing: x, y
    paper    corners of the sheet (4, 2), or None
    notes    sentences for people
    """

    strokes: tuple[np.ndarray, ...]
    scale: float
    size: tuple[float, float]
    centre: tuple[float, float]
    paper: np.ndarray | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlacementRequest:
    """Requested place and size of a drawing; see laptop.drawing.options."""

    paper: tuple[float, float] | None = None
    at: tuple[float, float] | None = None
    size: tuple[float, float | None] | None = None
    rotate: float = 0.0
    height: float = 0.0
    clip: bool = False
    scale: float | None = None


def place(
    artwork: Artwork, arm: Arm, request: PlacementRequest, postures: tuple[str, ...]
) -> Placement:
    """Place a drawing: where it is requested, or else as large and where the arm draws it easily.

    Raises:
        BadPlace: there is no such place, or none for the size.
        BadArtwork: there is nothing to draw.
    """
    low, high = bounds(artwork.strokes, artwork.name)
    size = np.maximum(high - low, 0.0)
    if not size.max() > 0 or not np.isfinite(size).all():
        raise BadPlace(f"{artwork.name}: all of it lies in one point; give lines")
    middle = (low + high) / 2
    turn = _turn(request.rotate)
    shapes = [(stroke - middle) @ turn.T for stroke in artwork.strokes]
    scale, most, notes = _requested_scale(artwork, request, size)
    offset = np.zeros(2)  # from the sheet's middle to the drawing's, not yet scaled
    if request.paper and scale and artwork.size and not (request.size or request.scale):
        offset = turn @ (middle - np.array(artwork.size) / 2)
    finder = _Finder(shapes, arm, request, postures, turn, offset)
    centre: np.ndarray
    if request.at is not None:
        at = np.array(request.at, float)
        if scale is None:
            scale = finder.largest_at(at, most)
        centre = at + scale * offset
    elif scale is not None:
        centre = finder.centre_for(scale) + scale * offset
    else:
        scale, centre = finder.largest(most)
    if most and scale < 0.98 * most and request.paper:
        notes.append(
            f"of the sheet {scale * size[0]:.1f} x {scale * size[1]:.1f} cm are drawn on: "
            "the arm reaches no more of it"
        )
    sheet = None
    if request.paper:
        sheet = _corners(request.paper) @ turn.T + (centre - scale * offset)
        if _covers_stand(sheet):
            notes.append("the sheet reaches under the arm: cut it there, or give --at")
    width, height = float(scale * size[0]), float(scale * size[1])
    strokes = tuple(_scaled(shape, scale) + centre for shape in shapes)
    return Placement(
        strokes,
        float(scale),
        (width, height),
        (float(centre[0]), float(centre[1])),
        sheet,
        tuple(notes),
    )


def _scaled(shape: np.ndarray, scale: float) -> np.ndarray:
    """Return a stroke (n, 2) scaled for the table; a dot keeps a pen's size."""
    if not is_dot(shape):
        return scale * shape
    middle = shape.mean(axis=0)
    return scale * middle + (shape - middle)


def _turn(rotate: float) -> np.ndarray:
    """Return the matrix from the sheet's x (right), y (up) to the arm's, at `rotate` degrees."""
    angle = math.radians(rotate + 90)
    # The sheet's right is the arm's -y.
    return np.array(
        [[math.cos(angle - math.pi), -math.sin(angle - math.pi)],
         [math.sin(angle - math.pi), math.cos(angle - math.pi)]]
    )  # fmt: skip


def _requested_scale(
    artwork: Artwork, request: PlacementRequest, size: np.ndarray
) -> tuple[float | None, float | None, list[str]]:
    """Return (scale or None: the largest, the greatest allowed or None, notes)."""
    scale = request.scale
    if request.size is not None:
        ratios = [
            side / own
            for side, own in zip(request.size, size, strict=True)
            if side is not None and own > 0
        ]
        if not ratios:
            raise BadPlace(
                f"{artwork.name}: it has no width; give its height, too, as --size WxH in cm"
            )
        scale = min(ratios)
    if scale is not None:
        if request.paper is not None and (scale * size > request.paper).any():
            across, along = scale * size
            raise BadPlace(
                f"{across:.1f} x {along:.1f} cm do not fit on a sheet of {request.paper[0]:g} x "
                f"{request.paper[1]:g} cm; make it smaller, or give a larger --paper"
            )
        return scale, None, []
    if request.paper is None:
        return None, None, []
    if artwork.size and np.allclose(artwork.size, request.paper, atol=0.1):
        return 1.0, None, []  # it is made for this sheet
    room = np.array(request.paper) - 2 * PAPER_MARGIN
    with np.errstate(divide="ignore"):
        return None, float((room / size).min()), []


def _corners(paper: tuple[float, float]) -> np.ndarray:
    width, height = paper
    return np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (width / 2, height / 2)


def _covers_stand(sheet: np.ndarray) -> bool:
    return cv2.pointPolygonTest(sheet.astype(np.float32), (0.0, 0.0), True) > -STAND_RADIUS


class _Finder:
    """Search for a drawing's place and size."""

    def __init__(
        self,
        shapes: list[np.ndarray],
        arm: Arm,
        request: PlacementRequest,
        postures: tuple[str, ...],
        turn: np.ndarray,
        offset: np.ndarray,
    ) -> None:
        self._arm, self._request, self._postures = arm, request, postures
        self._shapes, self._turn, self._offset = shapes, turn, offset
        self._map = reach.reach_map(
            arm, request.height, postures, reach.EASY_MARGIN, reach.EASY_SINGULARITY
        )
        self._coarse = _thinned(shapes, COARSE_CELLS)
        self._fine = _thinned(shapes, FINE_CELLS)
        self._extent = max(float(np.ptp(np.vstack(shapes), axis=0).max()), 1e-9)
        outline = cv2.convexHull(np.vstack(shapes).astype(np.float32))[:, 0]
        self._outline = outline[:: max(1, len(outline) // OUTLINE_POINTS)]
        edge = -self._map.origin
        places = np.arange(-math.floor(edge), math.floor(edge) + 1) * COARSE_STEP
        x, y = np.meshgrid(places, places)
        self._centres = np.column_stack([x.ravel(), y.ravel()])
        self._row = len(places)

    def largest(self, most: float | None) -> tuple[float, np.ndarray]:
        """Return (scale, centre) at which the drawing is largest."""
        top = min(most or math.inf, -2 * self._map.origin / self._extent)
        scale = self._halved(top, lambda s: self._best(s, self._centres, self._coarse))
        if scale is None:
            raise self._nowhere()
        ahead = self._centres[
            (np.abs(self._centres[:, 1]) < COARSE_STEP / 2) & (self._centres[:, 0] > 0)
        ]
        straight = self._halved(top, lambda s: self._best(s, ahead, self._coarse))
        if straight is not None and straight > MIN_SHARE_AHEAD * scale:
            centre, scale = self._best(straight, ahead, self._coarse), straight
        else:
            centre = self._best(scale, self._centres, self._coarse)
        assert centre is not None
        near = self._near(centre)
        finer = self._halved(
            min(top, 1.3 * scale), lambda s: self._best(s, near, self._fine), 0.7 * scale
        )
        best = None if finer is None else self._best(finer, near, self._fine)
        if finer is not None and best is not None:
            scale, centre = finer, best
        return self._shrunk(scale, centre), centre

    def largest_at(self, at: np.ndarray, most: float | None) -> float:
        """Return the greatest scale around a place."""
        top = min(most or math.inf, -2 * self._map.origin / self._extent)
        scale = self._halved(top, lambda s: self._best(s, at[None] + s * self._offset, self._fine))
        if scale is None:
            raise BadPlace(
                f"around ({at[0]:g}, {at[1]:g}) cm nothing of {LEAST_SIZE:g} cm can be drawn; give "
                "--at a place that the arm reaches, or leave it out"
            )
        return self._shrunk(scale, at)

    def centre_for(self, scale: float) -> np.ndarray:
        """Return the sheet's middle with most room around it for a drawing of this scale."""
        found = self._best(scale, self._centres + scale * self._offset, self._coarse)
        if found is not None:
            return found - scale * self._offset
        reached, centre = self.largest(scale)
        if reached == scale or self._request.clip:
            return centre
        sides = np.ptp(np.vstack(self._shapes) @ self._turn, axis=0)
        wanted, fits = scale * sides, np.floor(9.9 * reached * sides) / 10
        raise BadPlace(
            f"{wanted[0]:.1f} x {wanted[1]:.1f} cm are nowhere in the arm's reach; at most "
            f"{fits[0]:.1f} x {fits[1]:.1f} cm are: give --size {fits[0]:.1f}x{fits[1]:.1f}, or "
            "--clip to leave out what is beyond"
        )

    def _nowhere(self) -> BadPlace:
        reason = "there is no place at which the arm can draw it whole"
        if len(self._postures) == 1:
            return BadPlace(f"{reason} with its elbow {self._postures[0]}; leave --elbow out")
        if self._arm.chain == "spatial":
            height = f"{self._request.height:g} cm above the table"
            return BadPlace(f"{reason}, {height}; give another --paper-height")
        return BadPlace(f"{reason}; give --size, --at and --clip to draw what can be reached")

    def _near(self, centre: np.ndarray) -> np.ndarray:
        steps = np.arange(-COARSE_STEP, COARSE_STEP + FINE_STEP / 2, FINE_STEP)
        x, y = np.meshgrid(steps, steps)
        return centre + np.column_stack([x.ravel(), y.ravel()])

    def _halved(
        self, top: float, found: Callable[[float], object], bottom: float | None = None
    ) -> float | None:
        """Return the greatest scale for which `found` finds a place, or None."""
        low = bottom or LEAST_SIZE / self._extent
        if found(top) is not None:
            return top
        if found(low) is None:
            return None
        for _ in range(HALVINGS):
            middle = math.sqrt(low * top)
            if found(middle) is not None:
                low = middle
            else:
                top = middle
        return low

    def _best(
        self, scale: float, centres: np.ndarray, thinned: tuple[np.ndarray, np.ndarray]
    ) -> np.ndarray | None:
        """Return the most interior centre at which every stroke is in reach, or None."""
        points, firsts = thinned
        # Most places are out by the outline alone.
        reachable = (self._map.at(centres[:, None, :] + scale * self._outline[None]) != 0).all(
            axis=1
        )
        left = centres[reachable]
        bits = self._map.at(left[:, None, :] + scale * points[None])
        reachable[reachable] = (np.bitwise_and.reduceat(bits, firsts, axis=1) != 0).all(axis=1)
        if self._request.paper and reachable.any():
            clear = reachable & ~self._over_stand(centres - scale * self._offset)
            reachable = clear if clear.any() else reachable
        if not reachable.any():
            return None
        if len(centres) == len(self._centres):
            # Amid the good ones: farthest from what is not.
            grid = np.pad(reachable.reshape(self._row, self._row).astype(np.uint8), 1)
            depth = cv2.distanceTransform(grid, cv2.DIST_L2, 5)[1:-1, 1:-1].ravel()
        else:
            depth = -np.linalg.norm(centres - centres[reachable].mean(axis=0), axis=1)
        depth = np.where(reachable, depth, -np.inf)
        # Of all but equal ones, that nearest to straight ahead.
        tied = np.flatnonzero(depth >= depth.max() - 0.7)
        return centres[tied[np.argmin(np.abs(centres[tied, 1]))]]

    def _over_stand(self, middles: np.ndarray) -> np.ndarray:
        """Return which middles (n,) would put the sheet under the arm, bool."""
        assert self._request.paper is not None
        half = np.array(self._request.paper) / 2
        own = np.abs(middles @ self._turn)  # the axis, seen from the sheet
        return np.hypot(*np.maximum(own - half, 0.0).T) < STAND_RADIUS

    def _shrunk(self, scale: float, centre: np.ndarray) -> float:
        """Return the scale at which all points, tried or not, can be drawn in one posture."""
        for _ in range(MAX_SHRINKS):
            middle = centre if self._request.at is None else centre + scale * self._offset
            tried = reach.try_strokes(
                self._arm,
                [scale * shape + middle for shape in self._shapes],
                self._request.height,
                self._postures,
            )
            if np.any(list(tried.is_complete.values()), axis=0).all():
                return scale
            scale *= SHRINK_FACTOR
        raise self._nowhere()


def _thinned(shapes: list[np.ndarray], cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (points (n, 2), first index of each stroke): one point a stroke in every cell."""
    extent = max(float(np.ptp(np.vstack(shapes), axis=0).max()), 1e-9)
    cell = extent / cells
    points, stroke = reach.densified(shapes, cell)
    while True:
        keys = np.column_stack([stroke, np.rint(points / cell).astype(np.int64)])
        _, first = np.unique(keys, axis=0, return_index=True)
        if len(first) <= MAX_TRIED_POINTS or cell > extent / 4:
            break
        cell *= 1.5
    if len(first) > MAX_TRIED_POINTS:  # so many strokes: their places alone, as if they were one
        _, first = np.unique(np.rint(points / (extent / 40)).astype(int), axis=0, return_index=True)
        return points[first], np.array([0])
    first.sort()
    return points[first], np.flatnonzero(np.diff(stroke[first], prepend=-1))
