"""The image Jacobian at one place, by Broyden's update or a Kalman filter.  Pure.

q   joint angles, rad (n)
s   image features, px (m)
J   image Jacobian ds/dq, px/rad: m rows, n columns
"""

from operator import mul, sub

from robot.motion.linear_systems import broyden_update
from robot.servoing.image_model import straight
from robot.servoing.linear_algebra import dot
from robot.servoing.robust import RESIDUAL_SCALE, agrees, robust_weight

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.robust import Learned  # noqa: F401

    _State = Tuple[Matrix, List[List[float]], Optional[Learned]]  # J, P and what was observed last

FIRST_SIGMA = 2000.0
"""Standard deviation of an element of J before anything was seen, its greatest, px/rad."""

MIN_SIGMA = 0.5
"""Standard deviation of an element of J at the least, px/rad: the filter never freezes."""

CHANGE_PER_RADIAN = 0.7
"""Share of itself by which J may change per radian of joint motion, 1/rad."""

MIN_STEP_SIGMAS = 4.0
"""Least step in the image from which plain Broyden learns, standard deviations."""


# Broyden's update (1965), J + (ds - J dq) dq' / dq'dq, is the least change of J that explains the
# step (Dennis and Schnabel 1983, chapter 8).  It takes noise for truth: noise/|dq| enters J in
# full, so short steps near the goal spoil it.
#
# The Kalman filter (Qian and Su 2002) has the rows of J as its state, which drifts as the joints
# move, and ds = J dq + noise as its measurement:
#
#     gain g = P dq / (dq'P dq + variance),    J + (ds - J dq) g',    (I - g dq') P
#
# On long moves with P = p I this is Broyden's update; it falls to 0 where noise outweighs the move.
# Each direction has a variance of its own in P, one n x n matrix for all rows, since all of them
# have the same dq and variance.  Least squares over a window of steps would do the same at more
# cost, and fail where the steps do not span the joints' space.


class LocalJacobian(object):
    """The image Jacobian at one place, by Broyden's update, plain or weighed against the noise.

    Args:
        rows: m.
        joints: n.
        noise_aware: Kalman's gain instead of Broyden's.

    Attributes:
        J: px/rad, a tuple of m rows of n; zeros at first.
    """

    def __init__(self, rows, joints, noise_aware=True):
        # type: (int, int, bool) -> None
        self.J = tuple((0.0,) * joints for _ in range(rows))  # type: Matrix
        self._P = [[FIRST_SIGMA**2 * (i == j) for j in range(joints)] for i in range(joints)]
        self._noise_aware = noise_aware
        self._last = None  # type: Optional[Learned]
        # (q, s, variance) that is in it already, and (J, P, last) before.
        self._prepared = None  # type: Optional[Tuple[Learned, _State]]

    def observe(self, q, s, variance, standing=True):
        # type: (Pose, Features, float, bool) -> None
        """Learn from the step that led here from what was observed before.

        Args:
            q: joint angles, rad (n).
            s: px (m).
            variance: of each element of s, px^2.
            standing: whether the arm stood; plain Broyden learns from nothing else.
        """
        if not (standing or self._noise_aware):
            return
        if self._prepared is not None:
            early, before = self._prepared
            self._prepared = None
            if standing and agrees(early, q, s):
                return
            self.J, self._P, self._last = before
        if self._last is not None:
            q_before, s_before, variance_before = self._last
            dq, ds = list(map(sub, q, q_before)), list(map(sub, s, s_before))
            if any(dq) and (
                self._noise_aware or self._is_significant(dq, ds, variance + variance_before)
            ):
                self._update(dq, ds, variance + variance_before)
        self._last = tuple(q), tuple(s), variance

    def _is_significant(self, dq, ds, variance):
        # type: (Vector, Vector, float) -> bool
        """Return whether a step is long enough for plain Broyden, which takes noise for truth."""
        expected = [dot(row, dq) for row in self.J]
        return max(dot(ds, ds), dot(expected, expected)) > MIN_STEP_SIGMAS**2 * variance

    def _update(self, dq, ds, variance):
        # type: (Vector, Vector, float) -> None
        """Correct J and its covariance P by one step.

        Args:
            dq: rad (n).
            ds: px (m).
            variance: of each element of ds, px^2.
        """
        P, n = self._P, len(dq)
        square = dot(dq, dq)
        if self._noise_aware:
            size = 0.0
            for row in self.J:
                size += sum(map(mul, row, row))
            bent = CHANGE_PER_RADIAN**2 * square * size / len(self.J)
            for k in range(n):
                P[k][k] = min(P[k][k] + bent, FIRST_SIGMA**2)
            along = [dot(row, dq) for row in P]
            expected = dot(dq, along) + variance
            missed = [moved - dot(row, dq) for row, moved in zip(self.J, ds)]
            excess = dot(missed, missed) / (len(missed) * expected * RESIDUAL_SCALE**2)
            weight = robust_weight(excess)
            gain = [weight * a / expected for a in along]
            self.J = tuple(
                [tuple([a + r * g for a, g in zip(row, gain)]) for row, r in zip(self.J, missed)]
            )
        else:
            self.J = broyden_update(self.J, dq, ds)
            along = [dot(row, dq) for row in P]
            gain = [d / square for d in dq]
        # (I - g dq') P, and for a gain that is not Kalman's the same from the right
        P = [[p - g * a for p, a in zip(row, along)] for row, g in zip(P, gain)]
        if not self._noise_aware:
            along = [dot(row, dq) for row in P]
            P = [[p - a * g for p, g in zip(row, gain)] for row, a in zip(P, along)]
        for k in range(n):
            P[k][k] = max(P[k][k], MIN_SIGMA**2)
        self._P = P

    def prepare(self, q, s, variance):
        # type: (Pose, Features, float) -> Iterator[None]
        """Learn early from what is seen of an arm that stands at q: an iterator over slices.

        Args:
            q: joint angles, rad (n).
            s: px (m).
            variance: of each element of s, px^2.
        """
        before = self.J, [list(row) for row in self._P], self._last
        self.observe(q, s, variance)
        self._prepared = (tuple(q), s, variance), before
        yield

    def seen_from(self, q, s):
        # type: (Pose, Features) -> LinearImageModel
        """Return the image model of an arm that is at q (rad), where s (px) is seen."""
        return straight(self.J, [y - dot(row, q) for row, y in zip(self.J, s)])

    def refit(self):
        # type: () -> Iterator[None]
        """Return an empty iterator: there is nothing to fit."""
        return iter(())

    def shape(self):
        # type: () -> LinearImageModel
        """Return the image model without its offset."""
        return straight(self.J)

    def covariance(self):
        # type: () -> Matrix
        """Return the covariance of each row of J, n x n, (px/rad)^2."""
        return [list(row) for row in self._P]

    def inflate_variances(self):
        # type: () -> None
        """Inflate the variances: the camera has moved, or the like; half of J may be wrong."""
        if self._prepared is not None:  # what was learned early is taken back
            _, (self.J, self._P, self._last) = self._prepared
            self._prepared = None
        size = sum(dot(row, row) for row in self.J) / len(self.J)
        for k in range(len(self._P)):
            self._P[k][k] = max(self._P[k][k], 0.25 * size)
        self._last = None
