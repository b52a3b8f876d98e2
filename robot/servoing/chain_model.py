"""The image of a chain of revolute joints, learned on the way: no camera is calibrated.  Pure.

    q   joint angles, rad (n)
    s   image features, px: u and v
    J   image Jacobian ds/dq, px/rad: 2 rows, n columns

This model and local_jacobian's have one interface: `observe` learns from what was seen at which
joint angles; `prepare` does so early, in slices, while the arm is still being measured; `seen_from`
gives the present knowledge as an image model that later observations do not change; `shape` the
same but for its offset in the image, which costs less; `covariance` is that of J's rows there;
`inflate_variances` inflates all variances when the world has changed.
"""

import math
from operator import mul

from robot.servoing.chain_terms import CHAINS
from robot.servoing.image_model import LinearImageModel
from robot.servoing.linear_algebra import distance, sandwiched
from robot.servoing.robust import RESIDUAL_SCALE, agrees, robust_weight

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.robust import Learned  # noqa: F401

    KeyFrame = Tuple[Sequence[float], Features, float]  # q, rad; s, px; variance, px^2

SIGMA_PER_RADIAN = 6.0
"""Model error per radian of a key-frame's distance from the arm, px/rad: perspective and lens."""

MIN_KEY_DISTANCE, MAX_KEYS = math.radians(2.5), 24
"""Distance in every joint below which two key-frames are one, rad; and the most that are held."""

REWEIGH_PERIOD = 16
"""Number of fits between two reweightings: these change little, and cost more than all the rest."""

REWEIGH_PERIOD_IN_MOTION = 12
"""Number of fits between two reweightings while the arm moves."""

MOVED_WORLD_SIGMA = 40.0
"""Error of what was seen before the world changed, from then on, px."""

RECALLED_SIGMA = 6.0
"""Additional error of what an earlier run has seen, px."""

MAX_MISS, MISS_PER_RADIAN = 8.0, 0.25
"""Distance of a place from what an earlier run lets expect up to which that still holds, px, and
what is added to it for each radian from the nearest key-frame, as a share of |J|."""


class _Key(object):
    """A key-frame: what was seen at one pose.

    Args:
        q: joint angles, rad (n).
        terms: the chain's terms at q.
        s: px (m).
        variance: of each element of s, px^2.

    Attributes:
        products: what a weight of 1 adds to the normal equations.
        weight: with which it is in them, px^-2.
    """

    __slots__ = ("q", "terms", "s", "variance", "products", "weight")

    def __init__(self, q, terms, s, variance):
        # type: (Tuple[float, ...], Vector, Features, float) -> None
        self.q, self.terms, self.s, self.variance = q, terms, s, variance
        self.weight = 0.0
        products = [a * b for i, a in enumerate(terms, 1) for b in terms[:i]]
        self.products = products + [a * y for y in s for a in terms]


# Fitting the chain.  A camera far off sees space by an affine map (Mundy and Zisserman 1992), so
# s = W t(q), linear in the terms t of chain_terms: 1 and the tip's place by the described links.
# W minimizes sum_k w_k |s_k - W t_k|^2 over key-frames k, beside what is known of cameras before
# (affine_camera).  It is made of sum_k w_k t_k t_k' and sum_k w_k t_k s_k' alone, so a key-frame
# enters, leaves or changes its weight as w t t' is added or subtracted: recursive least squares in
# information form.  The usual form, an update of the inverse, costs more where frames are replaced.
# The weight is w = robust_weight / (variance + (SIGMA_PER_RADIAN distance)^2): robust by the
# residual of the fit before (iteratively reweighted least squares); the distance from the arm makes
# it a locally weighted regression (Atkeson, Moore and Schaal 1997), which takes up perspective,
# lens and links that are not as described.


class ChainModel(object):
    """A camera's image as a linear function of where the tip of a chain of revolute joints is.

    Args:
        chain: kind of the arm's chain, a key of CHAINS.
        links: their lengths, cm (n).
    """

    def __init__(self, chain, links):
        # type: (str, Vector) -> None
        terms = CHAINS[chain](links)
        self._chain, self._slopes_at = terms.chain, terms.slopes
        self._size = size = terms.size
        # The normal equations: the lower triangle row by row, then the right sides.
        self._sums = [0.0] * (size * (size + 1) // 2 + 2 * size)
        self._camera = terms.camera
        self._keys = []  # type: List[_Key]
        self._fits = self._refits = 0
        self._fitted = None  # type: Optional[Matrix]  # W
        self._shape = None  # type: Optional[LinearImageModel]
        # Where the slopes were evaluated last; covariance of J there.
        self._here = None  # type: Optional[Tuple[float, ...]]
        self._covariance = None  # type: Optional[Matrix]
        # (q, s, variance) of what is in it before it has been observed.
        self._prepared = None  # type: Optional[Learned]
        self._waiting = False  # are there key-frames that are not in W?

    def observe(self, q, s, variance, standing=True):
        # type: (Pose, Features, float, bool) -> None
        """Keep what was seen as a key-frame, in place of one that is nearly the same.

        Args:
            q: joint angles, rad (n).
            s: u and v, px.
            variance: of each element of s, px^2.
            standing: whether the arm stood; frames in motion do not replace better key-frames.
        """
        prepared, self._prepared = self._prepared, None
        if standing and prepared and agrees(prepared, q, s):
            return
        near, first = [], q[0]
        for key in self._keys:
            if (
                -MIN_KEY_DISTANCE < key.q[0] - first < MIN_KEY_DISTANCE
                and distance(key.q, q) < MIN_KEY_DISTANCE
            ):
                near.append(key)
        if near and not standing and min(key.variance for key in near) <= variance:
            return
        new = _Key(tuple(q), self._chain.terms(q)[: self._size], tuple(s), variance)
        old = near or self._keys[: 1 - MAX_KEYS]
        if len(old) == 1:  # most often, and half as much to do
            self._replace(old[0], new)
        else:
            self._weigh(new, 1 / variance)
            for key in old:
                self._weigh(key, 0.0)
        self._keys = [key for key in self._keys if key.weight] + [new]
        self._waiting = True

    @property
    def key_frames(self):
        # type: () -> List[KeyFrame]
        """What it goes by: [(q, s, variance)], rad, px and px^2."""
        return [(key.q, key.s, key.variance) for key in self._keys]

    def recall(self, key_frames):
        # type: (Sequence[KeyFrame]) -> None
        """Begin with the key-frames of an earlier run."""
        for q, s, variance in key_frames[-MAX_KEYS:]:
            terms = self._chain.terms(q)[: self._size]
            key = _Key(tuple(q), terms, tuple(s), variance + RECALLED_SIGMA**2)
            self._weigh(key, 1 / key.variance)
            self._keys.append(key)
        self._waiting = True

    def expects(self, q, s):
        # type: (Pose, Features) -> bool
        """Return whether s (px) at q (rad) is about what its key-frames let expect."""
        image = self.shape()
        size = math.sqrt(sum([a * a for row in image.jacobian(q) for a in row]))
        near = min([distance(key.q, q) for key in self._keys])
        return distance(image.predict(q), s) < MAX_MISS + MISS_PER_RADIAN * size * near

    def prepare(self, q, s, variance):
        # type: (Pose, Features, float) -> Iterator[None]
        """Learn early from what is seen of an arm that stands at q: an iterator over slices.

        `observe`, `seen_from` and `covariance` have little left to do if that proves right.

        Args:
            q: joint angles, rad (n).
            s: px (m).
            variance: of each element of s, px^2.
        """
        self.observe(q, s, variance)
        self._prepared = tuple(q), s, variance
        yield
        self._fit(q)
        yield
        self._linearize_at(q)
        self.covariance()

    def seen_from(self, q, s):
        # type: (Pose, Features) -> LinearImageModel
        """Return the image model of an arm that is at q (rad), where s (px) is seen."""
        W = self._fit(q)
        self._linearize_at(q)
        offset = [y - sum(map(mul, w, self._terms)) for y, w in zip(s, W)]
        return LinearImageModel(self._chain, W, offset)

    def _linearize_at(self, q):
        # type: (Pose) -> None
        """Evaluate the terms and their derivatives at q (rad), unless they are of there."""
        if self._here != tuple(q):
            self._here, self._covariance = tuple(q), None
            self._terms = self._chain.terms(q)
            self._slopes = self._slopes_at(self._terms)

    def refit(self):
        # type: () -> Iterator[None]
        """Fit anew if there is something new: an iterator, each step a slice of the work."""
        self._refits += self._waiting
        if self._refits < REWEIGH_PERIOD_IN_MOTION:
            return
        self._refits, W = 0, self._solve()
        q = self._keys[-1].q
        deserved = []
        for key in self._keys:
            yield
            deserved.append((key, self._weight_for(key, q, W)))
        for key, weight in deserved:
            yield
            if key.weight:  # it has not been left out meanwhile
                self._weigh(key, weight)
        self._waiting = True

    def shape(self):
        # type: () -> LinearImageModel
        """Return the image model as last fitted, without its offset; the same until the next."""
        W = self._up_to_date()
        if self._shape is None or self._shape.W is not W:
            self._shape = LinearImageModel(self._chain, W, [0.0, 0.0])
        return self._shape

    def _weigh(self, key, weight):
        # type: (_Key, float) -> None
        """Set the weight of a key-frame in the normal equations, px^-2."""
        more = weight - key.weight
        self._sums = [total + more * p for total, p in zip(self._sums, key.products)]
        key.weight = weight

    def _replace(self, old, new):
        # type: (_Key, _Key) -> None
        """Put a new key-frame in the place of an old one in the normal equations."""
        less, more = old.weight, 1 / new.variance
        products = zip(self._sums, old.products, new.products)
        self._sums = [total - less * a + more * b for total, a, b in products]
        old.weight, new.weight = 0.0, more

    def _solve(self):
        # type: () -> Matrix
        """Fit W (2 x terms, px) by least squares, and return it."""
        W, self._C = self._camera(self._sums)
        self._fitted, self._waiting, self._covariance = W, False, None
        return W

    def _up_to_date(self):
        # type: () -> Matrix
        """Return W, with all that was observed in it."""
        return self._solve() if self._fitted is None or self._waiting else self._fitted

    def _fit(self, q):
        # type: (Pose) -> Matrix
        """Return W, up to date; now and then weigh the key-frames anew."""
        W = self._up_to_date()
        self._fits += 1
        if self._fits % REWEIGH_PERIOD == 0 and self._keys:
            self._weigh_all(q, W)
        return W

    def _weigh_all(self, q, W):
        # type: (Pose, Matrix) -> None
        """Weigh all key-frames by their agreement with W and their distance from q, rad.

        Together: weighed one by one, inliers would lose weight before outliers do.
        """
        for key in self._keys:
            key.weight = self._weight_for(key, q, W)
        weights = [key.weight for key in self._keys]
        columns = zip(*[key.products for key in self._keys])
        self._fitted = None
        self._sums = [sum(map(mul, weights, column)) for column in columns]

    def _weight_for(self, key, q, W):
        # type: (_Key, Pose, Matrix) -> float
        """Return the weight of a key-frame by its residual against W, the arm being at q, px^-2."""
        variance = key.variance
        for a, b in zip(key.q, q):
            variance += SIGMA_PER_RADIAN**2 * (a - b) * (a - b)
        terms, excess = key.terms, 0.0
        for off, w in zip(key.s, W):
            for a, b in zip(w, terms):
                off -= a * b
            excess += off * off
        return robust_weight(excess / (2 * variance * RESIDUAL_SCALE**2)) / variance

    def covariance(self):
        # type: () -> Matrix
        """Return the covariance of each row of J where it was last seen from, n x n, (px/rad)^2."""
        if self._covariance is None:
            self._covariance = sandwiched(self._slopes, self._C)
        return self._covariance

    def by_space(self):
        # type: () -> Matrix
        """Return the image Jacobian by the tip's place, px/cm: 2 rows, a column for each axis."""
        return [w[1:] for w in self._fit(self._keys[-1].q)]

    def inflate_variances(self):
        # type: () -> None
        """Inflate the variances of all key-frames: the camera has moved, or the like."""
        for key in self._keys:
            key.variance += MOVED_WORLD_SIGMA**2
            self._weigh(key, 1 / key.variance)
        self._fitted = self._prepared = None
