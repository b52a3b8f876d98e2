"""The image of a chain of revolute joints, learned on the way: no camera is calibrated.  Pure.

    q   joint angles, rad (n)
    s   image features, px (m)
    J   image Jacobian ds/dq, px/rad: m rows, n columns

This model and local_jacobian's have the same door: `observe` takes in what was seen at which joint
angles; `prepare` does so early, in slices, while the arm is still being looked at; `seen_from`
gives what is known at this moment, as an image model that later observations do not change; `shape`
the same but for its place in the image, which costs less; `covariance` says how little that is, of
J there; `doubt_all` is for when the world has changed.
"""

import math
from operator import mul

from robot.servoing.chain_terms import CHAINS
from robot.servoing.image_model import LinearImageModel
from robot.servoing.linear_algebra import (
    apart,
    back_substituted,
    cholesky,
    dot,
    forward_substituted,
)
from robot.servoing.robust import RESIDUAL_SCALE, agrees, trust

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.robust import Learned  # noqa: F401

LINK_SIGMA = 400.0
"""Standard deviation of how far, in px, the sum of the links' directions can move the marker."""

LINK_ERROR_SIGMA = 25.0
"""The same of each link by itself: length, zero and lens may be off, px."""

BASE_SIGMA = 1e4
"""The same of where the base is seen, px."""

DISTANCE_DOUBT = 2.3
"""A key-frame is doubted by so many px per rad of distance from the arm: perspective and lens."""

MIN_KEY_DISTANCE, MAX_KEYS = math.radians(2.5), 24
"""Key-frames nearer to one another (rad, every joint) are one; so many are held."""

REWEIGH_PERIOD = 16
"""After every so manieth fit the key-frames are weighed anew: it makes little difference, and costs
more than all the rest."""

REWEIGH_PERIOD_IN_MOTION = 12
"""The same of fits while the arm moves."""

MOVED_WORLD_SIGMA = 40.0
"""What was seen before the world changed is doubted by so many px from then on."""


def _precision(axes):
    # type: (Matrix) -> List[List[float]]
    """Of the terms' coefficients, px^-2, before anything was seen; the lower triangle.

    Each axis of space may be seen in any way (LINK_SIGMA px along the whole arm); each term by
    itself deviates from that (LINK_ERROR_SIGMA).  The inverse of LINK_ERROR_SIGMA^2 I +
    LINK_SIGMA^2 sum u u', the u being orthogonal unit vectors (Sherman and Morrison 1950); a
    constant offset may be anything.
    """
    units = []
    for axis in axes:
        whole = math.sqrt(dot(axis, axis))
        units.append([a / whole for a in axis])
    share = LINK_SIGMA**2 / (LINK_ERROR_SIGMA**2 + LINK_SIGMA**2)
    precision = [[1 / BASE_SIGMA**2]]
    for i in range(1, len(axes[0])):
        precision.append(
            [0.0]
            + [
                ((i == j) - share * sum(u[i] * u[j] for u in units)) / LINK_ERROR_SIGMA**2
                for j in range(1, i + 1)
            ]
        )
    return precision


class _Key(object):
    """A key-frame: what was seen at one pose.

    products  what a weight of 1 would add to the normal equations
    weight    with which it is in them
    """

    __slots__ = ("q", "terms", "s", "variance", "products", "weight")

    def __init__(self, q, terms, s, variance):
        # type: (Tuple[float, ...], Vector, Features, float) -> None
        self.q, self.terms, self.s, self.variance = q, terms, s, variance
        self.weight = 0.0
        products = [a * b for i, a in enumerate(terms, 1) for b in terms[:i]]
        self.products = products + [a * y for y in s for a in terms]


class ChainModel(object):
    """The image as a linear function of the sines and cosines of a chain of revolute joints.

    A revolute joint moves an image point on a projected circle (Ruf, Horaud and others: visual
    control by projective kinematics); so s = W terms(q), where W holds camera and link lengths.  W
    is fitted to key-frames by least squares: each is weighed by its noise, by its distance from the
    arm, which takes up perspective and lens, and by how well it agreed with the fit before.  The
    lengths of the description are no more than a prior.

    Args:
        rows: m.
        chain: kind of the arm's chain.
        links: their lengths, cm.
    """

    def __init__(self, rows, chain, links):
        # type: (int, str, Vector) -> None
        self._rows = rows
        self._chain, self._slopes_at, axes = CHAINS[chain]
        self._axes = axes(links)
        precision = _precision(self._axes)
        size = len(precision)
        whole = size * (size + 1) // 2
        # The normal equations: the lower triangle row by row, then the right sides.
        self._prior = self._sums = sum(precision, []) + [0.0] * (rows * size)  # type: List[float]
        self._triangle = [slice(i * (i + 1) // 2, (i + 1) * (i + 2) // 2) for i in range(size)]
        self._sides = [slice(whole + k * size, whole + (k + 1) * size) for k in range(rows)]
        self._keys = []  # type: List[_Key]
        self._fits = self._refits = 0
        self._fitted = None  # type: Optional[Matrix]  # W
        self._shape = None  # type: Optional[LinearImageModel]
        # Where the slopes are known; doubt of J there.
        self._here = None  # type: Optional[Tuple[float, ...]]
        self._covariance = None  # type: Optional[Matrix]
        # (q, s, variance) of what is in it before it has been observed.
        self._prepared = None  # type: Optional[Learned]
        self._waiting = False  # are there key-frames that are not in W?

    def observe(self, q, s, variance, standing=True):
        # type: (Pose, Features, float, bool) -> None
        """Keep what was seen as a key-frame, in place of one that is nearly the same.

        Args:
            variance: of each element of s, px^2.
            standing: what was seen in motion does not replace what is known better.
        """
        prepared, self._prepared = self._prepared, None
        if standing and prepared and agrees(prepared, q, s):
            return
        near, first = [], q[0]
        for key in self._keys:
            if (
                -MIN_KEY_DISTANCE < key.q[0] - first < MIN_KEY_DISTANCE
                and apart(key.q, q) < MIN_KEY_DISTANCE
            ):
                near.append(key)
        if near and not standing and min(key.variance for key in near) <= variance:
            return
        new = _Key(tuple(q), self._chain.terms(q), tuple(s), variance)
        old = near or self._keys[: 1 - MAX_KEYS]
        if len(old) == 1:  # most often, and half as much to do
            self._replace(old[0], new)
        else:
            self._weigh(new, 1 / variance)
            for key in old:
                self._weigh(key, 0.0)
        self._keys = [key for key in self._keys if key.weight] + [new]
        self._waiting = True

    def prepare(self, q, s, variance):
        # type: (Pose, Features, float) -> Iterator[None]
        """Learn from what is seen so far of an arm that stands at q: an iterator over slices.

        `observe`, `seen_from` and `covariance` have little left to do then, if that was right.
        """
        self.observe(q, s, variance)
        self._prepared = tuple(q), s, variance
        yield
        self._fit(q)
        yield
        self._stand_at(q)
        self.covariance()

    def seen_from(self, q, s):
        # type: (Pose, Features) -> LinearImageModel
        """The image model of an arm that is at q, where s is seen."""
        W = self._fit(q)
        self._stand_at(q)
        offset = [y - sum(map(mul, w, self._terms)) for y, w in zip(s, W)]
        return LinearImageModel(self._chain, W, offset)

    def _stand_at(self, q):
        # type: (Pose) -> None
        if self._here != tuple(q):
            self._here, self._covariance = tuple(q), None
            self._terms = self._chain.terms(q)
            self._slopes = self._slopes_at(self._terms)

    def refit(self):
        # type: () -> Iterator[None]
        """Fit anew if there is enough that is new: an iterator, each step a slice of the work."""
        if self._fitted is not None and not self._waiting:
            return
        W = self._solve()
        self._refits += 1
        if self._refits % REWEIGH_PERIOD_IN_MOTION:
            return
        q = self._keys[-1].q
        deserved = []
        for key in self._keys:
            yield
            deserved.append((key, self._deserved(key, q, W)))
        for key, weight in deserved:
            yield
            if key.weight:  # it has not been left out meanwhile
                self._weigh(key, weight)
        self._waiting = True

    def shape(self):
        # type: () -> LinearImageModel
        """The same but for its place in the image, as last fitted; the same as long as that."""
        if self._fitted is None or self._shape is None or self._shape.W is not self._fitted:
            W = self._fitted or self._solve()
            self._shape = LinearImageModel(self._chain, W, [0.0] * self._rows)
        return self._shape

    def _weigh(self, key, weight):
        # type: (_Key, float) -> None
        """Let a key-frame count for so much in the normal equations."""
        more = weight - key.weight
        self._sums = [total + more * p for total, p in zip(self._sums, key.products)]
        key.weight = weight

    def _replace(self, old, new):
        # type: (_Key, _Key) -> None
        """Let a new key-frame count in place of an old one."""
        less, more = old.weight, 1 / new.variance
        products = zip(self._sums, old.products, new.products)
        self._sums = [total - less * a + more * b for total, a, b in products]
        old.weight, new.weight = 0.0, more

    def _solve(self):
        # type: () -> Matrix
        """Fit W (m x terms) by least squares, and return it."""
        sums = self._sums
        self._L = L = cholesky([sums[part] for part in self._triangle])
        W = [back_substituted(L, forward_substituted(L, sums[side])) for side in self._sides]
        self._fitted, self._waiting, self._covariance = W, False, None
        return W

    def _fit(self, q):
        # type: (Pose) -> Matrix
        """W, with all that was learned in it."""
        W = self._solve() if self._fitted is None or self._waiting else self._fitted
        self._fits += 1
        if self._fits % REWEIGH_PERIOD == 0 and self._keys:
            self._weigh_all(q, W)
        return W

    def _weigh_all(self, q, W):
        # type: (Pose, Matrix) -> None
        """By how well they agree with W, and by their distance from q.

        Together: weighed one by one, what is right would be doubted before what is false is.
        """
        for key in self._keys:
            key.weight = self._deserved(key, q, W)
        weights = [key.weight for key in self._keys]
        columns = zip(*[key.products for key in self._keys])
        self._fitted = None
        self._sums = [p + sum(map(mul, weights, column)) for p, column in zip(self._prior, columns)]

    def _deserved(self, key, q, W):
        # type: (_Key, Pose, Matrix) -> float
        """The weight of a key-frame."""
        doubt = key.variance
        for a, b in zip(key.q, q):
            doubt += DISTANCE_DOUBT**2 * (a - b) * (a - b)
        terms, excess = key.terms, 0.0
        for off, w in zip(key.s, W):
            for a, b in zip(w, terms):
                off -= a * b
            excess += off * off
        return trust(excess / (doubt * self._rows * RESIDUAL_SCALE**2)) / doubt

    def covariance(self):
        # type: () -> Matrix
        """Of each row of J, n x n, (px/rad)^2, where it was last seen from."""
        if self._covariance is None:
            # slope' N^-1 slope, from one side: N^-1 = L'^-1 L^-1
            halves = [forward_substituted(self._L, slope) for slope in self._slopes]
            self._covariance = [[sum(map(mul, a, b)) for b in halves] for a in halves]
        return self._covariance

    def by_space(self):
        # type: () -> Matrix
        """How the image moves with the tip's place in space, px/cm: m rows, W along the axes."""
        W = self._fit(self._keys[-1].q)
        return [[dot(w, axis) / dot(axis, axis) for axis in self._axes] for w in W]

    def doubt_all(self):
        # type: () -> None
        """The camera was moved, or the like: what was seen before counts little from now on."""
        for key in self._keys:
            key.variance += MOVED_WORLD_SIGMA**2
            self._weigh(key, 1 / key.variance)
        self._fitted = self._prepared = None
