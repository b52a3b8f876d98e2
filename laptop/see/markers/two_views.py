"""A place of one camera's picture in another's, learned from a tip that both see.

Nothing is known of the cameras.  A tip that has moved through space teaches their epipolar geometry
(the fundamental matrix): a place in A is a line in B.  One that has moved in a plane teaches how
that plane is seen (a homography), and then a place in A is a place in B, as long as it lies in the
plane.  One that has moved along a line teaches neither.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

Point = tuple[float, float]
"""A place in an image (u, v), px."""

MIN_PAIRS, MAX_PAIRS = 16, 150
"""Least number of pairs of tip positions to learn from, and greatest number that is kept."""
PAIR_SPACING = 6.0
"""Least distance of a pair from all others, in one picture or the other, px."""
MIN_WIDTH = 8.0
"""Least width of the positions across their longest extent, RMS, px; below, they are a line."""
PLANE_ERROR, LINE_ERROR, TRUE_SHARE = 3.0, 3.0, 0.85
"""Greatest error of an inlier under a homography, and under a fundamental matrix, px; and least
share of inliers."""
MAX_DISAGREEMENT = 15.0
"""Greatest distance of the lines that each half of the pairs teaches, px."""


class TwoViews:
    """Pairs of places of one tip in the pictures of two cameras, and what they teach."""

    def __init__(self) -> None:
        self._pairs: list[tuple[float, float, float, float]] = []
        self._learned: tuple[int, np.ndarray | None, list[np.ndarray]] | None = None

    def add(self, one: Point, other: Point) -> None:
        """Add a pair of the tip's pixels in both pictures at one time, if it is new."""
        pair = (*one, *other)
        for known in self._pairs:
            distance = max(math.dist(known[:2], pair[:2]), math.dist(known[2:], pair[2:]))
            if distance < PAIR_SPACING:
                return
        self._pairs.append(pair)
        del self._pairs[:-MAX_PAIRS]
        self._learned = None

    def where(self, place: Point, size: tuple[int, int]) -> tuple[Point, ...]:
        """Return the places in the other picture, px, of something at `place` in the first.

        Args:
            place: in the first picture, (u, v), px.
            size: width and height of the other picture, px.

        Returns:
            the two ends of a line in the picture; one place; or nothing: that is not known yet, or
            it is outside the picture.
        """
        plane, lines = self._teach()
        if plane is not None:
            u, v = (float(x) for x in _through(plane, np.array([place]))[0])
            return ((u, v),) if _inside((u, v), size) else ()
        if not lines:
            return ()
        ends, *halves = (_ends(_line(matrix, place), size) for matrix in lines)
        if not ends or not all(halves):
            return ()
        seen = np.array(self._pairs)[:, 2:]
        near = [_nearest(ends, middle) for middle in (seen.mean(0), seen.min(0), seen.max(0))]
        if any(_from_line(_line(m, place), p) > MAX_DISAGREEMENT for m in lines[1:] for p in near):
            return ()
        return ends

    def _teach(self) -> tuple[np.ndarray | None, list[np.ndarray]]:
        """Return (homography or None; fundamental matrices by all pairs and by each half)."""
        if self._learned is None or self._learned[0] != len(self._pairs):
            self._learned = (len(self._pairs), *_taught(np.array(self._pairs)))
        return self._learned[1:]


# A place a of the first picture and the same point's place b in the second have b . F a = 0: b lies
# on the line F a (H. C. Longuet-Higgins, 1981).  F has seven degrees of freedom; of points in one
# plane a homography, b ~ H a, explains all, and infinitely many F do.  So H is tried first.
# Both are fitted by the least median of squares (P. J. Rousseeuw, 1984): the candidate from few
# pairs is best whose residuals have the least median, so that almost half of the pairs may be
# false.  RANSAC needs to be told how many px a true pair may be off, which nobody knows of unknown
# cameras; the median tells it.  F is then fitted anew to all pairs that belong to it, by the
# eight-point algorithm.  A median may be small by chance: F is believed where each half of the
# pairs teaches the same lines (`where`).
def _taught(pairs: np.ndarray) -> tuple[np.ndarray | None, list[np.ndarray]]:
    if len(pairs) < MIN_PAIRS:
        return None, []
    one, other = pairs[:, :2], pairs[:, 2:]
    if min(_width(one), _width(other)) < MIN_WIDTH:
        return None, []
    plane, _ = cv2.findHomography(one, other, cv2.LMEDS)
    if plane is not None:
        off = np.linalg.norm(_through(plane, one) - other, axis=1)
        if np.quantile(off, TRUE_SHARE) < PLANE_ERROR:
            return plane, []
    found = [_fundamental(pairs), _fundamental(pairs[::2]), _fundamental(pairs[1::2])]
    matrices = [matrix for matrix in found if matrix is not None]
    if len(matrices) < len(found):
        return None, []
    off = np.array([_from_line(_line(matrices[0], a), b) for a, b in zip(one, other, strict=True)])
    if np.quantile(off, TRUE_SHARE) > LINE_ERROR:
        return None, []
    return None, matrices


def _fundamental(pairs: np.ndarray) -> np.ndarray | None:
    """Return the fundamental matrix, 3 x 3, from the inlier pairs; None if it is not unique."""
    _, inlier_mask = cv2.findFundamentalMat(pairs[:, :2], pairs[:, 2:], cv2.FM_LMEDS)
    if inlier_mask is None or np.count_nonzero(inlier_mask) < MIN_PAIRS // 2:
        return None
    # The least median is that of a few pairs; all that belong to it tell more.
    pairs = pairs[inlier_mask.ravel() == 1]
    matrix, _ = cv2.findFundamentalMat(pairs[:, :2], pairs[:, 2:], cv2.FM_8POINT)
    return matrix if matrix is not None and matrix.shape == (3, 3) else None


def _width(places: np.ndarray) -> float:
    """Return the RMS width of places (n x 2) about the line through them, px."""
    spread = np.linalg.svd(places - places.mean(0), compute_uv=False)
    return float(spread[1] / math.sqrt(len(places)))


def _through(plane: np.ndarray, places: np.ndarray) -> np.ndarray:
    return cv2.perspectiveTransform(places.reshape(-1, 1, 2).astype(float), plane).reshape(-1, 2)


def _line(matrix: np.ndarray, place: Sequence[float]) -> tuple[float, float, float]:
    """Return the epipolar line (a, b, c) of a place: a u + b v + c = 0, with a^2 + b^2 = 1."""
    line = cv2.computeCorrespondEpilines(np.array([[place]], float), 1, matrix).reshape(3)
    return float(line[0]), float(line[1]), float(line[2])


def _from_line(line: tuple[float, float, float], place: Sequence[float]) -> float:
    return abs(line[0] * place[0] + line[1] * place[1] + line[2])


def _ends(line: tuple[float, float, float], size: tuple[int, int]) -> tuple[Point, ...]:
    """Return the places at which a line enters and leaves a picture, px; () if it misses it."""
    a, b, c = line
    width, height = size[0] - 1, size[1] - 1
    crossings = [(0.0, -c / b), (width, -(a * width + c) / b)] if abs(b) > 1e-9 else []
    if abs(a) > 1e-9:
        crossings += [(-c / a, 0.0), (-(b * height + c) / a, height)]
    inside = sorted({(float(u), float(v)) for u, v in crossings if _inside((u, v), size)})
    return (inside[0], inside[-1]) if len(inside) > 1 else ()


def _nearest(ends: tuple[Point, ...], place: np.ndarray) -> Point:
    """Return the nearest place between two ends, px."""
    (u0, v0), (u1, v1) = ends
    du, dv = u1 - u0, v1 - v0
    share = ((place[0] - u0) * du + (place[1] - v0) * dv) / (du**2 + dv**2)
    share = min(max(share, 0.0), 1.0)
    return u0 + share * du, v0 + share * dv


def _inside(place: Point, size: tuple[int, int]) -> bool:
    return -1e-6 <= place[0] <= size[0] - 1 + 1e-6 and -1e-6 <= place[1] <= size[1] - 1 + 1e-6
