"""Mapping of the table into a camera's picture, learned from the tip's own moves.

The brick tells its joints' angles, and so where the tip's marker is, cm; the camera sees it at the
same time, px.  Of an arm in a plane such pairs give a homography, that of the plane in which the
marker rides: whatever lies below it is seen elsewhere.  Where the paper is seen follows from the
marker's height, if that is known, by `paper_below`.  The pen is beside the marker, by a way that
turns with the last link.  Of an arm in space they give the camera's matrix (DLT; Hartley and
Zisserman, Multiple View Geometry, chapters 4 and 7), and that a homography for every height.  Pure.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.page.paper_below import PaperBelow
from laptop.see.serve.pipeline import Point

CELL_SIZE = 1.0
"""Side of the cubes of each of which the place is kept where the tip was slowest, cm."""
MAX_PLACES = 600
"""Greatest number of places that are kept."""
MIN_PLACES = 8
"""Fewest places from which their misfit can be judged."""
MIN_AREA, MIN_WIDTH = 0.10, 0.18
"""Area that the places cover, as a share of the reach squared, and their least width as a share of
the reach: on what lies far outside nothing is known."""
MAX_TIP_SPEED = 250.0
"""Greatest speed of a tip that tells its place, px/s: when it was where is not known to the
millisecond."""
MAX_MISFIT = 5.0
"""Greatest misfit of places, px (RMS): worse ones come of no camera that stands still before this
arm."""
MOVED_MISFIT, MOVED_PLACES = 8.0, 6
"""Misfit of so many places in a row by which the camera counts as moved, px."""


@dataclass(frozen=True, eq=False)
class TableView:
    """View of a plane of the table in a picture.

    matrix  3 x 3: from (x, y, 1), cm, to (u, v, 1), px, up to scale
    places  number of places of the tip that it rests on; 0: it does not
    misfit  RMS of these, and how unsure the paper is below the marker: mm on the table
    source  of it, for people: "the tip's own moves", "the board on the table"
    is_paper  it is the paper; if not, the plane above it in which the marker rides
    """

    matrix: np.ndarray
    places: int = 0
    misfit: float = 0.0
    source: str = "the tip's own moves"
    is_paper: bool = False

    def to_picture(self, points: np.ndarray) -> np.ndarray:
        """Return where points (n, 2), cm, are in the picture: (n, 2), px."""
        return _mapped(self.matrix, points)

    def to_table(self, pixels: np.ndarray) -> np.ndarray:
        """Return which points of the plane, (n, 2) cm, are at these pixels (n, 2)."""
        return _mapped(np.linalg.inv(self.matrix), pixels)

    def px_per_cm(self, point: np.ndarray) -> float:
        """Return the scale of the picture around a point (2,), cm: that of areas, rooted."""
        corners = self.to_picture(point + 0.5 * np.array([(-1, -1), (1, -1), (-1, 1)]))
        along, across = corners[1] - corners[0], corners[2] - corners[0]
        return math.sqrt(abs(along[0] * across[1] - along[1] * across[0]))


def _mapped(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    points = np.asarray(points, float).reshape(-1, 2)
    homogeneous = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    with np.errstate(divide="ignore", invalid="ignore"):  # on the horizon
        return homogeneous[:, :2] / homogeneous[:, 2:]


class TableMapping:
    """Learns where the table is in one camera's picture.

    Args:
        reach: of the arm, cm.
        height: of the paper, cm; it counts for arms in space only.

    Attributes:
        view: the TableView, of the paper as soon as that is known, or None.
        why: why not, for people; "" where it is known.
        moved: number of times that the camera was found to have been moved.
    """

    def __init__(self, reach: float, height: float = 0.0) -> None:
        self._reach, self._height = reach, height
        self._places: dict[tuple[int, ...], tuple[float, np.ndarray, Point]] = {}
        self._misfits: deque[float] = deque(maxlen=MOVED_PLACES)
        self._camera: np.ndarray | None = None  # 3 x 4, of an arm in space
        self._plane: TableView | None = None  # in which the marker of an arm in a plane rides
        self._below = PaperBelow()
        self._marker_height: float | None = None  # cm
        self.view: TableView | None = None
        self.why = "the arm has not moved before this camera yet"
        self.moved = 0

    @property
    def places(self) -> int:
        """Number of places that are known."""
        return len(self._places)

    def lay_paper(self, height: float | None) -> None:
        """Set the height over the paper of a planar arm's marker, cm; None: unknown."""
        self._marker_height = height
        self._show_paper()

    def add(
        self, p: Sequence[float], pixel: Point, speed: float, size: tuple[int, int] | None = None
    ) -> None:
        """Add a pair: the marker's place p (x, y[, z]), cm, and its pixel (u, v) at that time.

        Args:
            p: cm.
            pixel: px.
            speed: of the marker in the picture, px/s.
            size: of the picture, px; without it the paper below the marker is not found.
        """
        if speed > MAX_TIP_SPEED or not np.isfinite([*p, *pixel]).all():
            return
        if self._plane:
            off = self._plane.to_picture(np.array([p]))[0] - pixel
            self._misfits.append(float(np.hypot(*off)))
            if len(self._misfits) == MOVED_PLACES and min(self._misfits) > MOVED_MISFIT:
                self.forget()
                self.moved += 1
        key = tuple(math.floor(x / CELL_SIZE) for x in p)
        known = self._places.get(key)
        if known is None and len(self._places) >= MAX_PLACES:
            return
        if known is None or speed <= known[0]:
            self._places[key] = speed, np.array(p, float), pixel
            self._fit(size)

    def pen(self, pixels: np.ndarray, shifts: np.ndarray) -> np.ndarray | None:
        """Return where on the table the pen was, (n, 2), cm; None: that is not known.

        Args:
            pixels: of the marker, (n, 2).
            shifts: from the pen to the marker, cm, (n, 2 or 3).
        """
        if self.view is None:
            return None
        if self._plane:
            return self._plane.to_table(pixels) - shifts[:, :2]
        assert self._camera is not None
        # The marker's plane is another one for each height at which it sits over the pen.
        planes = np.repeat(self._camera[None, :, [0, 1, 3]], len(pixels), axis=0)
        planes[:, :, 2] += np.outer(self._height + shifts[:, 2], self._camera[:, 2])
        seen = np.column_stack([pixels, np.ones(len(pixels))])
        places = np.linalg.solve(planes, seen[..., None])[..., 0]
        return np.asarray(places[:, :2] / places[:, 2:] - shifts[:, :2])

    def forget(self) -> None:
        """Reset: the camera or the arm has moved."""
        self._places.clear()
        self._misfits.clear()
        self._below.forget()
        self.view = self._plane = None
        self.why = "the camera was moved; let the arm look around again"

    def _fit(self, size: tuple[int, int] | None) -> None:
        points = np.array([point for _, point, _ in self._places.values()])
        pixels = np.array([pixel for _, _, pixel in self._places.values()])
        self.why = self._too_few(points)
        self.view = self._plane = None
        if self.why:
            return
        matrix: np.ndarray
        flat = points.shape[1] == 2
        if flat:
            found, _ = cv2.findHomography(points, pixels, cv2.RANSAC, 2 * MAX_MISFIT)
            matrix = np.full((3, 3), np.nan) if found is None else found
            fitted = _mapped(matrix, points)
        else:
            camera = self._camera = _camera_matrix(points, pixels)
            fitted = _projected(camera, points)
            along = camera[:, 3] + self._height * camera[:, 2]
            matrix = np.column_stack([camera[:, :2], along])
        off = np.hypot(*(fitted - pixels).T)
        fits = off <= 2 * MAX_MISFIT
        misfit = float(np.sqrt(np.mean(off[fits] ** 2))) if fits.any() else math.inf
        if fits.mean() < 0.7 or misfit > MAX_MISFIT:
            self.why = (
                f"what camera and joints say differs by {np.nan_to_num(np.median(off)):.0f} px; is "
                "it the arm of this file, with its zero found?"
            )
            return
        view = TableView(matrix / matrix[2, 2], len(points))
        scale = view.px_per_cm(points[:, :2].mean(axis=0))
        view = TableView(view.matrix, len(points), 10 * misfit / scale, is_paper=not flat)
        self.view = view
        if flat:
            self._plane = view
            if size:
                self._below.learn(points[fits], pixels[fits], size)
            self._show_paper()

    def _show_paper(self) -> None:
        """Give the view of the paper below the marker's plane, if that is known."""
        plane, height = self._plane, self._marker_height
        if plane is None:
            return
        self.view = plane
        points = np.array([point for _, point, _ in self._places.values()])
        below = None if height is None else self._below.paper(height, points)
        if below is not None:
            matrix, unsure = below
            misfit = math.hypot(plane.misfit, unsure)
            self.view = TableView(matrix, plane.places, misfit, plane.source, True)

    def _too_few(self, points: np.ndarray) -> str:
        """Return why these places (n, 2 or 3), cm, are not enough, or ""."""
        if len(points) < MIN_PLACES:
            many = f"{len(points)} place{'s' * (len(points) != 1)}"
            return f"the tip was seen at {many} so far; more must tell"
        flat = points[:, :2].astype(np.float32)
        area = cv2.contourArea(cv2.convexHull(flat))
        width = min(cv2.minAreaRect(flat)[1])
        if area < MIN_AREA * self._reach**2 or width < MIN_WIDTH * self._reach:
            return "the tip was seen in a small part of its reach so far; more must tell"
        if points.shape[1] == 3:
            spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
            if spread[2] / math.sqrt(len(points)) < 0.04 * self._reach:
                return "the tip was seen at one height so far; let it go up and down, too"
        return ""


def _camera_matrix(points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Return the 3 x 4 matrix that projects points (n, 3), cm, to pixels (n, 2): DLT."""
    to_points, to_pixels = _normal(points), _normal(pixels)
    p = np.column_stack([points, np.ones(len(points))]) @ to_points.T
    s = np.column_stack([pixels, np.ones(len(pixels))]) @ to_pixels.T
    zeros = np.zeros_like(p)
    rows = np.vstack([np.hstack([p, zeros, -s[:, :1] * p]), np.hstack([zeros, p, -s[:, 1:2] * p])])
    # (All of the left vectors, of which none is needed, would take a second for 600 places.)
    camera = np.linalg.svd(rows, full_matrices=False)[2][-1].reshape(3, 4)
    return np.linalg.inv(to_pixels) @ camera @ to_points


def _normal(points: np.ndarray) -> np.ndarray:
    """Return the matrix that brings points (n, d) around 0, as far from it as there are axes."""
    middle = points.mean(axis=0)
    size = np.sqrt(np.mean(np.sum((points - middle) ** 2, axis=1)))
    axes = points.shape[1]
    matrix = np.eye(axes + 1) * (math.sqrt(axes) / size)
    matrix[:axes, axes] = -middle * math.sqrt(axes) / size
    matrix[axes, axes] = 1.0
    return matrix


def _projected(camera: np.ndarray, points: np.ndarray) -> np.ndarray:
    homogeneous = np.column_stack([points, np.ones(len(points))]) @ camera.T
    with np.errstate(divide="ignore", invalid="ignore"):  # beside the camera
        return homogeneous[:, :2] / homogeneous[:, 2:]
