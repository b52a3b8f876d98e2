"""Crossings of planes across a line or a circle by the tip.  Pure; lengths are cm.

By the arc length along the path, not by time: a clock or a slow start has no influence here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MAX_SIGHT_GAP = 1.5
"""Greatest distance between the two sights beside a plane, cm; else it counts as not crossed."""
END_TOLERANCE = 0.5
"""Distance from a plane within which a first or last sight counts as on it, cm."""
INTERPOLATION_NODES = 4
"""Number of sights that interpolate the tip's place between the middle two."""
MAX_SLOPE = 3.0
"""Greatest share of an error along a path that counts as one across it."""
PLANE_SAMPLES = 33
"""Number of places between two sights that are tried for a plane."""


class Crossings(NamedTuple):
    """Crossings of a path's planes in one run.

    values  across the path, (planes, d - 1); nan where nothing was seen near the plane
    noise   covariance of each, (planes, d - 1, d - 1), cm^2
    common  derivatives by what all have in common, (planes, d - 1, c)
    """

    values: np.ndarray
    noise: np.ndarray
    common: np.ndarray


@dataclass(frozen=True, eq=False)
class StraightPath:
    """A straight path from start to end, each (d,)."""

    start: np.ndarray
    end: np.ndarray

    @property
    def length(self) -> float:
        """Length of the whole path, cm."""
        return float(np.linalg.norm(self.end - self.start))

    def points(self) -> np.ndarray:
        """Return the path for who plans it, (2, d)."""
        return np.array([self.start, self.end])

    def along(self, points: np.ndarray) -> np.ndarray:
        """Return how far along the path each point is, (n,)."""
        return np.asarray((points - self.start) @ ((self.end - self.start) / self.length))

    def tangents(self, points: np.ndarray) -> np.ndarray:
        """Return the unit tangent at each point, (n, d)."""
        return np.broadcast_to((self.end - self.start) / self.length, points.shape)

    def across(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where points are across the path, (n, d - 1), and by which axes, (n, d - 1, d)."""
        axes = _across((self.end - self.start) / self.length)
        return (points - self.start) @ axes.T, np.broadcast_to(axes, (len(points), *axes.shape))


@dataclass(frozen=True, eq=False)
class CirclePath:
    """A whole circle in the plane of two unit vectors, from `u` to `v`; all are (d,)."""

    centre: np.ndarray
    radius: float
    u: np.ndarray
    v: np.ndarray

    @property
    def length(self) -> float:
        """Length of the whole path, cm."""
        return 2 * math.pi * self.radius

    def points(self, count: int = 181) -> np.ndarray:
        """Return the path for who plans it, (count, d), closed."""
        angles = np.linspace(0.0, 2 * math.pi, count)[:, None]
        directions = np.cos(angles) * self.u + np.sin(angles) * self.v
        directions[-1] = directions[0]
        return np.asarray(self.centre + self.radius * directions)

    def along(self, points: np.ndarray) -> np.ndarray:
        """Return how far along the path each point is, (n,), in the order of time."""
        off = points - self.centre
        angles = np.unwrap(np.arctan2(off @ self.v, off @ self.u))
        # The first sight is near the start, wherever the angle has its seam.
        if len(angles):
            angles = angles - 2 * math.pi * np.round(angles[0] / (2 * math.pi))
        return np.asarray(self.radius * angles)

    def tangents(self, points: np.ndarray) -> np.ndarray:
        """Return the unit tangent at each point, (n, d)."""
        off = points - self.centre
        a, b = off @ self.u, off @ self.v
        return (a[:, None] * self.v - b[:, None] * self.u) / np.hypot(a, b)[:, None]

    def across(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where points are across the path, (n, d - 1), and by which axes, (n, d - 1, d).

        First outwards, in space then along the normal of the circle's plane.
        """
        off = points - self.centre
        flat = np.stack([off @ self.u, off @ self.v], axis=-1)
        far = np.linalg.norm(flat, axis=-1, keepdims=True)
        outwards = flat @ np.array([self.u, self.v]) / far
        values, axes = far - self.radius, outwards[:, None, :]
        if points.shape[1] == 3:
            normal = np.cross(self.u, self.v)
            values = np.column_stack([values, off @ normal])
            axes = np.concatenate([axes, np.broadcast_to(normal, (len(off), 1, 3))], axis=1)
        return values, axes


CommandedPath = StraightPath | CirclePath


def _across(direction: np.ndarray) -> np.ndarray:
    """Return unit vectors (d - 1, d) across a unit vector; the last one is as upright as can be."""
    if len(direction) == 2:
        return np.array([[-direction[1], direction[0]]])
    up = np.eye(3)[2] if abs(direction[2]) < 0.9 else np.eye(3)[0]
    level = np.cross(up, direction)
    level /= np.linalg.norm(level)
    return np.array([level, np.cross(direction, level)])


def stations(path: CommandedPath, planes: int) -> np.ndarray:
    """Return where on a path its planes are, (planes,): evenly, half a spacing from its ends."""
    return path.length * (np.arange(planes) + 0.5) / planes


def crossings(
    path: CommandedPath,
    planes: int,
    points: np.ndarray,
    noise: np.ndarray | None = None,
    common: np.ndarray | None = None,
) -> Crossings:
    """Find where one run crossed planes across its path, between two sights each.

    Args:
        path: that was commanded.
        planes: how many.
        points: where the tip was seen, (n, d), in the order of time.
        noise: covariance of each, (n, d, d); None: there is none.
        common: derivatives of each by what all have in common, (n, d, c).
    """
    d = points.shape[1]
    noise = np.zeros((len(points), d, d)) if noise is None else noise
    common = np.zeros((len(points), d, 0)) if common is None else common
    finite = np.isfinite(points).all(axis=1)
    points, noise, common = points[finite], noise[finite], common[finite]
    empty = Crossings(
        np.full((planes, d - 1), np.nan),
        np.zeros((planes, d - 1, d - 1)),
        np.zeros((planes, d - 1, common.shape[2])),
    )
    if len(points) < 2:
        return empty
    s = path.along(points)
    values, axes = path.across(points)
    at = stations(path, planes)
    passed = (s[:-1] < at[:, None]) & (s[1:] >= at[:, None]) & (np.diff(s) <= MAX_SIGHT_GAP)
    before, seen = passed.argmax(axis=1), passed.any(axis=1)
    # Where a run begins or ends just beside a plane, its first or last sight is taken for that.
    ahead, behind = s[0] - at, at - s.max()
    before[ahead >= 0], before[behind > 0] = 0, len(s) - 2
    seen |= ((ahead >= 0) & (ahead <= END_TOLERANCE)) | ((behind > 0) & (behind <= END_TOLERANCE))
    window, weights = _crossing_weights(np.flatnonzero(finite), s, before, at)
    found = np.einsum("pk,pkd->pd", weights, values[window])
    found[~seen] = np.nan
    # The projector across the path.  A place is p = s t + A^T y, with the tangent t and the axes A
    # (d - 1, d) across it, A t = 0.  The plane s = s0 is crossed at y(s0).  An error e of a place
    # has a part across, A e, and a part along, t . e, by which s is wrong, too: the plane is found
    # that much elsewhere, where y differs by the slope m = dy/ds.  So dy = (A - m t^T) e.  This is
    # the oblique projector along the tip's own direction t + A^T m, for which it is 0: to move a
    # sight along the way that the tip goes changes no crossing.  The orthogonal projector A alone
    # would do for m = 0 only.  The noise follows by first order: S C S^T with S = A - m t^T (ISO
    # GUM, 5.2).
    ends = window[:, 0], window[:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (values[ends[1]] - values[ends[0]]) / (s[ends[1]] - s[ends[0]])[:, None]
    slope = np.clip(np.nan_to_num(slope), -MAX_SLOPE, MAX_SLOPE)
    sides = axes[window] - slope[:, None, :, None] * path.tangents(points)[window][:, :, None, :]
    across_noise = sides @ noise[window] @ sides.swapaxes(-1, -2)
    return Crossings(
        found,
        np.einsum("pk,pkij->pij", weights**2, across_noise),
        np.einsum("pk,pkic->pic", weights, sides @ common[window]),
    )


def _crossing_weights(
    t: np.ndarray, s: np.ndarray, before: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return which sights tell of each plane, and by how much, (planes, INTERPOLATION_NODES) each.

    The tip shakes faster than a webcam looks, and a straight line between two pictures cuts off its
    turns.  J. L. Lagrange's polynomial through the pictures around them does not.

    Args:
        t: of all sights, in pictures, (n,).
        s: how far along the path they are, (n,).
        before: the sight after which a plane is crossed, (planes,).
        at: where the planes are along the path, (planes,).
    """
    nodes = min(INTERPOLATION_NODES, len(t))
    first = np.clip(before - (nodes // 2 - 1), 0, len(t) - nodes)
    window = first[:, None] + np.arange(nodes)
    share = np.linspace(0.0, 1.0, PLANE_SAMPLES)[:, None]
    u = t[before] + share * (t[before + 1] - t[before])  # (steps, planes)
    basis = np.ones((*u.shape, nodes))
    for k in range(nodes):
        for other in set(range(nodes)) - {k}:
            one, two = t[window[:, k]], t[window[:, other]]
            basis[..., k] *= (u - two) / (one - two)
    places = (basis * s[window]).sum(axis=-1)
    nearest = np.abs(places - at).argmin(axis=0)
    return window, basis[nearest, np.arange(len(at))]
