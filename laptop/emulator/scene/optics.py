"""Optics: colours as light, the pinhole camera, the area of polygons in pixels.

Colours are amounts of light (linear, 1 = as bright as the sensor can say at gain 1), never sRGB.
Pixel centres have integer coordinates, u right, v down, as OpenCV has them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from shared.arm_description import ArmError

COLOURS = {
    "red": "#c8141e",
    "orange": "#e8720c",
    "yellow": "#f2c50f",
    "lime": "#93b81c",
    "green": "#0f8f3c",
    "cyan": "#16a5b8",
    "blue": "#1250b4",
    "purple": "#6b2f96",
    "magenta": "#c2277e",
    "pink": "#ee8fb4",
    "white": "#f2f2ee",
    "grey": "#9aa0a4",
    "black": "#1b1c1e",
}
"""Colours of markers and bricks, as sRGB under white light at gain 1."""

# The lamp is up on the left, a little behind: unit vector towards it.
LAMP = np.array([-0.38, 0.30, 0.875])
LAMP = LAMP / np.linalg.norm(LAMP)
"""Unit vector (3,) towards the lamp, in the world."""


class BadLens(ArmError, ValueError):
    """A distortion that no picture can be taken with."""


# ---- light


def to_linear(srgb: np.ndarray | Sequence[float]) -> np.ndarray:
    """Return the light of sRGB values 0 .. 255 (IEC 61966-2-1); any shape."""
    c = np.asarray(srgb, float) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: np.ndarray | Sequence[float]) -> np.ndarray:
    """Return the sRGB values 0 .. 255, not rounded, of light 0 .. 1; any shape."""
    c = np.clip(np.asarray(linear, float), 0, 1)
    return np.asarray(255 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055))


def light_of(colour: str) -> np.ndarray:
    """Return the light (B, G, R) of a word of COLOURS or of #rrggbb."""
    code = COLOURS.get(colour, colour).lstrip("#")
    return to_linear([int(code[i : i + 2], 16) for i in (4, 2, 0)])


def similar_hues(one: str, other: str) -> bool:
    """Return True if two colours could be taken for one another by their hue."""
    pixels = np.array([[to_srgb(light_of(word)) for word in (one, other)]])
    (h1, s1, _), (h2, s2, _) = cv2.cvtColor(pixels.astype(np.float32) / 255, cv2.COLOR_BGR2HSV)[0]
    return bool(min(abs(h1 - h2), 360 - abs(h1 - h2)) < 35 and min(s1, s2) > 0.3) or one == other


# ---- the camera
#
# The lens is the radial part of OpenCV's model (Brown, 1966): a point at (x, y, 1) in the camera's
# frame, r from the axis, lands at focal (x, y) s(r) + centre, with s(r) = 1 + k1 r^2 + k2 r^4.
# This direction is a formula, so vertices are projected without error.  The inverse has none:
# `rays` looks it up in a table of r s(r), which has to rise.  It does up to the least root of its
# derivative, 1 + 3 k1 r^2 + 5 k2 r^4; 0.98 of that is `widest`.  Beyond, radii go on one to one.
# `cv2.projectPoints` would be the obvious way, but beyond the root it folds points from far outside
# back into the picture.  `cv2.undistortPoints` stops after a few steps, short of the inverse.

MAX_TANGENT = 8.0
"""Greatest angle from the axis that a camera here sees, as a tangent."""


MIN_DEPTH = 0.1
"""Least depth before a camera, cm: nearer points are projected as if they were there."""


@functools.lru_cache(maxsize=64)
def _widest(k1: float, k2: float) -> float:
    """Return the radius up to which a lens with this distortion is one-to-one."""
    folds = np.roots([5 * k2, 3 * k1, 1.0])
    folds = folds.real[(abs(folds.imag) < 1e-9) & (folds.real > 0)]
    return 0.98 * math.sqrt(min([*folds, MAX_TANGENT**2]))


class Pinhole:
    """A pinhole camera with radial distortion (Brown 1966: x_d = x (1 + k1 r^2 + k2 r^4)).

    Args:
        position: (3,), cm, in the world.
        rotation: (3, 3), world to camera; the camera's x is right, y down, z forward.
        focal: px.
        size: (width, height), px; the axis goes through the middle.
        k1, k2: distortion.

    Raises:
        BadLens: the distortion folds the picture over.
    """

    def __init__(
        self,
        position: np.ndarray,
        rotation: np.ndarray,
        focal: float,
        size: tuple[int, int],
        k1: float = 0.0,
        k2: float = 0.0,
    ) -> None:
        self.position = np.asarray(position, float)
        self.rotation = np.asarray(rotation, float)
        self.focal = focal
        self.size = size
        self.k1, self.k2 = k1, k2
        self.centre = np.array([(size[0] - 1) / 2, (size[1] - 1) / 2])
        # Beyond `widest` radii go on one to one, so that points outside the picture stay there.
        self.widest = _widest(k1, k2)
        at_fold = self.widest * (1 + k1 * self.widest**2 + k2 * self.widest**4)
        if at_fold < max(size) / 2 / focal:
            raise BadLens(
                f"camera k1 = {k1:g}, k2 = {k2:g}: the picture folds over with "
                f"focal = {focal:g}; take less distortion or a longer focal length"
            )

    @classmethod
    def aimed(
        cls,
        target: Point,
        distance: float,
        angles: tuple[float, float, float],
        focal: float,
        size: tuple[int, int],
        k1: float = 0.0,
        k2: float = 0.0,
    ) -> Pinhole:
        """Return a camera at `distance` from `target` (cm), by tilt, azimuth and roll (rad)."""
        tilt, azimuth, roll = angles
        away = np.array(
            [
                math.sin(azimuth) * math.sin(tilt),
                -math.cos(azimuth) * math.sin(tilt),
                math.cos(tilt),
            ]
        )
        right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        down = np.cross(-away, right)
        c, s = math.cos(roll), math.sin(roll)
        rotation = np.array([c * right + s * down, c * down - s * right, -away])
        return cls(np.asarray(target) + distance * away, rotation, focal, size, k1, k2)

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Return the points (n, 3), cm, in the camera's own frame."""
        return np.asarray((np.asarray(points, float) - self.position) @ self.rotation.T)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Project points (n, 3), cm, into the picture: (n, 2), px.

        Points that the lens would fold back, or behind the camera, land far outside.
        """
        x, y, z = self.seen(points).T
        z = np.maximum(z, MIN_DEPTH)
        x, y = x / z, y / z
        factor = self._factor(np.hypot(x, y))
        return np.asarray(np.stack([x * factor, y * factor], axis=1) * self.focal + self.centre)

    def _factor(self, r: np.ndarray) -> np.ndarray:
        """Return the factor of distortion at each radius."""
        inside = np.minimum(r, self.widest)
        factor = 1 + self.k1 * inside**2 + self.k2 * inside**4
        return np.asarray(
            np.where(r > inside, (inside * factor + r - inside) / np.maximum(r, 1e-12), factor)
        )

    def rays(self) -> np.ndarray:
        """Return (height, width, 2): x, y of each pixel's ray (x, y, 1) in the camera's frame."""
        u, v = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        x, y = (u - self.centre[0]) / self.focal, (v - self.centre[1]) / self.focal
        distorted = np.hypot(x, y)
        # The inverse has no formula: looked up between 10 000 radii.
        r = np.linspace(0, MAX_TANGENT, 10001)
        plain = np.interp(distorted, r * self._factor(r), r)
        factor = plain / np.maximum(distorted, 1e-9)
        factor[distorted < 1e-9] = 1.0
        return np.stack([x * factor, y * factor], axis=2)


# ---- polygons


Point = Sequence[float] | np.ndarray


class Box(NamedTuple):
    """Pixels from (left, top) up to and without (right, bottom)."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Whether there is no pixel in it."""
        return self.right <= self.left or self.bottom <= self.top

    def seen_from(self, window: Box) -> Box:
        """Return the same pixels, counted from a window's corner."""
        x, y = window.left, window.top
        return Box(self.left - x, self.top - y, self.right - x, self.bottom - y)

    def grown(self, margin: int, within: Box) -> Box:
        """Return the box with `margin` more pixels on every side, within another."""
        return _clipped(
            (
                self.left - margin,
                self.top - margin,
                self.right - 1 + margin,
                self.bottom - 1 + margin,
            ),
            within,
        )

    def cut(self, image: np.ndarray) -> np.ndarray:
        """Return the part of the image in this box (a view)."""
        return image[self.top : self.bottom, self.left : self.right]


def box_of(points: np.ndarray, within: Box, margin: int = 0) -> Box:
    """Return the pixels that points (n, 2) span, clipped."""
    low, high = np.floor(points.min(axis=0) + 0.5), np.floor(points.max(axis=0) + 0.5)
    return _clipped((low[0] - margin, low[1] - margin, high[0] + margin, high[1] + margin), within)


def _clipped(edges: Sequence[float], within: Box) -> Box:
    """Return the box with these first and last pixels, within another."""
    return Box(
        int(max(edges[0], within.left)),
        int(max(edges[1], within.top)),
        int(min(edges[2] + 1, within.right)),
        int(min(edges[3] + 1, within.bottom)),
    )


def coverages(groups: Sequence[tuple[Sequence[np.ndarray], Box]]) -> list[np.ndarray]:
    """Compute which part of each pixel the polygons of each group cover, exactly.

    Every edge is cut at the borders of the pixels; each piece adds, to all pixels right of it, the
    height it spans (signed area, as outline fonts are drawn).  All groups go through together:
    with little in each of them, the cost of a call dominates.

    Args:
        groups: per group its polygons' corners, each (n, 2), px, which may overlap (a pixel is full
            once); and the pixels asked for, at least one.

    Returns:
        Per group float32 (height, width), 0 .. 1.
    """
    if not groups:
        return []
    begins, ends, sign, group = _edges(groups)
    # All pixels lie in one long row, group behind group; two columns more than asked for take what
    # is right of them.
    boxes = np.array([box for _, box in groups])
    spans = boxes[:, 2:] - boxes[:, :2]
    cells = (spans[:, 0] + 2) * spans[:, 1]
    bases = np.cumsum(cells) - cells
    origin = boxes[group, :2] - 0.5
    used, a, vector = _between_rows(begins - origin, ends - origin, spans[group, 1])
    sign, group = sign[used], group[used]
    limits = spans[group]
    owner, t, until = _pieces(a, vector, limits)
    middle = a[owner] + (0.5 * (t + until))[:, None] * vector[owner]
    weight = (until - t) * vector[owner, 1] * sign[owner]
    limit = limits[owner]
    x = np.clip(middle[:, 0], 0, limit[:, 0])
    column = np.floor(x).astype(int)
    row = np.clip(np.floor(middle[:, 1]).astype(int), 0, limit[:, 1] - 1)
    place = bases[group[owner]] + row * (limit[:, 0] + 2) + column
    share = weight * (x - column)
    total = int(cells.sum())
    steps = np.bincount(place, weight - share, total) + np.bincount(place + 1, share, total)
    # A polygon is closed, so every row sums to nothing and the next one starts afresh.
    covered = np.clip(np.cumsum(steps), 0, 1).astype(np.float32)
    return [
        covered[base : base + size].reshape(height, width + 2)[:, :width]
        for base, size, (width, height) in zip(bases, cells, spans)
    ]


def _edges(groups: Sequence[tuple[Sequence[np.ndarray], Box]]) -> tuple[np.ndarray, ...]:
    """Return the edges of all polygons of all groups.

    Returns:
        Begin and end of each, (n, 2), px; -1 where its polygon goes round clockwise, else 1; and
        the number of its group.
    """
    rings = [ring for own, _ in groups for ring in own]
    sizes = np.array([len(ring) for ring in rings])
    a = np.concatenate(rings)
    firsts = np.cumsum(sizes) - sizes
    following = np.arange(1, len(a) + 1)
    following[firsts + sizes - 1] = firsts
    b = a[following]
    area = np.add.reduceat(a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1], firsts)
    sign = np.repeat(np.where(area > 0, -1.0, 1.0), sizes)
    group = np.repeat(np.repeat(np.arange(len(groups)), [len(own) for own, _ in groups]), sizes)
    return a, b, sign, group


def _between_rows(
    begins: np.ndarray, ends: np.ndarray, bottom: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut edges (n, 2) to the rows from 0 to the bottom row of each, (n,), px.

    Returns:
        Which edges cross rows there; and of those, where that begins, and the vector to its end.
    """
    rise = ends[:, 1] - begins[:, 1]
    slope = np.where(rise == 0, 1.0, rise)
    shares = np.stack([-begins[:, 1] / slope, (bottom - begins[:, 1]) / slope])
    low, high = np.clip(shares.min(axis=0), 0, 1), np.clip(shares.max(axis=0), 0, 1)
    used = (rise != 0) & (high > low)
    vector = (ends - begins)[used]
    return used, begins[used] + low[used, None] * vector, (high - low)[used, None] * vector


def _pieces(a: np.ndarray, vector: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, ...]:
    """Cut edges at the borders of the pixels.

    Args:
        a: where each edge begins, (n, 2), px from its box's corner.
        vector: from there to its end.
        limits: columns and rows of its box.

    Returns:
        Of each piece, edge by edge and in order: the number of its edge, and the shares of it
        at which it begins and ends.
    """
    b = a + vector
    number = np.arange(len(a))
    owners, cuts = [number], [np.zeros(len(a))]
    for axis in (0, 1):
        one, other = a[:, axis], b[:, axis]
        limit = limits[:, axis]
        first = np.ceil(np.clip(np.minimum(one, other), 0, limit))
        last = np.floor(np.clip(np.maximum(one, other), 0, limit))
        count = np.maximum(last - first + 1, 0).astype(int)
        owner = np.repeat(number, count)
        line = np.arange(len(owner)) + np.repeat(first - np.cumsum(count) + count, count)
        step = vector[owner, axis]
        t = (line - one[owner]) / np.where(step == 0, 1.0, step)
        inside = (t > 0) & (t < 1) & (step != 0)
        owners.append(owner[inside])
        cuts.append(t[inside])
    owner, t = np.concatenate(owners), np.concatenate(cuts)
    order = np.argsort(owner + 0.999999 * t, kind="stable")
    owner, t = owner[order], t[order]
    until = np.ones_like(t)
    same = owner[1:] == owner[:-1]
    until[:-1][same] = t[1:][same]
    return owner, t, until


def coverage(rings: Sequence[np.ndarray], box: Box) -> np.ndarray:
    """Compute which part of each pixel of a box polygons cover, see `coverages`."""
    return coverages([(rings, box)])[0]


def circle(radius: float, corners: int) -> np.ndarray:
    """Return a polygon (corners, 2) about the origin, of the same area as the circle."""
    angle = np.arange(corners) * (2 * math.pi / corners)
    even = radius * math.sqrt(2 * math.pi / corners / math.sin(2 * math.pi / corners))
    return even * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rectangle(x0: float, y0: float, x1: float, y1: float, pieces: int = 6) -> np.ndarray:
    """Return a rectangle's outline (4 pieces, 2), its sides in pieces, which a lens can bend."""
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)
    share = np.arange(pieces)[:, None] / pieces
    return np.concatenate(
        [a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0))]
    )


# ---- markers


def bit_rings(number: int) -> list[np.ndarray]:
    """Return the white cells (4, 2) of an ArUco marker whose black square spans -1 .. 1; y up."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)  # begins as 4X4_50
    bits = cv2.aruco.generateImageMarker(dictionary, number, 6)
    cell = 1 / 3
    return [
        np.array([(0, 0), (cell, 0), (cell, -cell), (0, -cell)])
        + (column * cell - 1, 1 - row * cell)
        for row, column in zip(*np.nonzero(bits))
    ]


def ball_light(
    light: Any, normals: np.ndarray, to_eye: np.ndarray, to_lamp: np.ndarray
) -> np.ndarray:
    """Return the light of a glossy ball: a quarter from all around, Lambert's cosine, a highlight.

    Args:
        light: (3,), of its colour.
        normals: (height, width, 3), of any length.
        to_eye: unit vectors, of the same shape; (1, 1, 3) if the eye is far away.
        to_lamp: unit vector.

    Returns:
        (height, width, 3)
    """
    normals = normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-9)
    half = to_eye + to_lamp
    half = half / np.linalg.norm(half, axis=2, keepdims=True)
    lambert = np.maximum(normals @ to_lamp, 0)
    gloss = np.maximum((normals * half).sum(axis=2), 0) ** 60
    return np.asarray(
        np.asarray(light) * (0.25 + 0.85 * lambert)[..., None] + 0.5 * gloss[..., None]
    )
