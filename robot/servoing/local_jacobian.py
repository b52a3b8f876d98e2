"""The image Jacobian at one place, by Broyden's update or a Kalman filter.  Pure.

q   joint angles, rad (n)
s   image features, px (m)
J   image Jacobian ds/dq, px/rad: m rows, n columns
"""

from operator import mul, sub

from robot.motion.linear_systems import broyden_update
from robot.servoing.image_model import straight
from robot.servoing.linear_algebra import dot
from robot.servoing.robust import RESIDUAL_SCALE, agrees, trust

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.robust import Learned  # noqa: F401

    _State = Tuple[Matrix, List[List[float]], Optional[Learned]]  # J, P and what was observed last

FIRST_SIGMA = 2000.0
"""Standard deviation of an element of J before anything was seen, and the greatest, px/rad."""

MIN_SIGMA = 0.5
"""The least: it never freezes, px/rad."""

CHANGE_PER_RADIAN = 0.7
"""By which share of itself J may change per radian of joint motion."""

MIN_STEP_SIGMAS = 4.0
"""Plain Broyden learns from steps of at least so many standard deviations in the image."""


class LocalJacobian(object):
    """J by Broyden's update, plain or weighed against the noise.

    With `noise_aware`, J is the state of a Kalman filter whose measurements are the pairs (dq, ds)
    (Qian and Su 2002): the gain is Broyden's 1 on long moves and falls to 0 on moves that noise
    outweighs, and every direction has a doubt of its own.  Without, it is Broyden's update (1965).

    Args:
        rows, joints: m, n.
        noise_aware: see above.

    Attributes:
        J: a tuple of rows; zeros at first.
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
            variance: of each element of s, px^2.
            standing: whether the arm stood; plain Broyden takes nothing else.
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
            if any(dq) and (self._noise_aware or self._tells(dq, ds, variance + variance_before)):
                self._update(dq, ds, variance + variance_before)
        self._last = tuple(q), tuple(s), variance

    def _tells(self, dq, ds, variance):
        # type: (Vector, Vector, float) -> bool
        """Whether a step is long enough for plain Broyden, which takes noise for truth."""
        expected = [dot(row, dq) for row in self.J]
        return max(dot(ds, ds), dot(expected, expected)) > MIN_STEP_SIGMAS**2 * variance

    def _update(self, dq, ds, variance):
        # type: (Vector, Vector, float) -> None
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
            weight = trust(excess)
            gain = [weight * a / expected for a in along]
            self.J = tuple(
                [tuple([a + r * g for a, g in zip(row, gain)]) for row, r in zip(self.J, missed)]
            )
        else:
            self.J = broyden_update(self.J, dq, ds)
            along = [dot(row, dq) for row in P]
            gain = [d / square for d in dq]
        # (I - gain dq') P, and for a gain that is not Kalman's the same from the right
        P = [[p - g * a for p, a in zip(row, along)] for row, g in zip(P, gain)]
        if not self._noise_aware:
            along = [dot(row, dq) for row in P]
            P = [[p - a * g for p, g in zip(row, gain)] for row, a in zip(P, along)]
        for k in range(n):
            P[k][k] = max(P[k][k], MIN_SIGMA**2)
        self._P = P

    def prepare(self, q, s, variance):
        # type: (Pose, Features, float) -> Iterator[None]
        """Learn from what is seen so far of an arm that stands at q: an iterator over slices."""
        before = self.J, [list(row) for row in self._P], self._last
        self.observe(q, s, variance)
        self._prepared = (tuple(q), s, variance), before
        yield

    def seen_from(self, q, s):
        # type: (Pose, Features) -> LinearImageModel
        """The image model of an arm that is at q, where s is seen."""
        return straight(self.J, [y - dot(row, q) for row, y in zip(self.J, s)])

    def refit(self):
        # type: () -> Iterator[None]
        """There is nothing to fit."""
        return iter(())

    def shape(self):
        # type: () -> LinearImageModel
        """The same but for its place in the image."""
        return straight(self.J)

    def covariance(self):
        # type: () -> Matrix
        """Of each row of J, n x n, (px/rad)^2."""
        return [list(row) for row in self._P]

    def doubt_all(self):
        # type: () -> None
        """The camera was moved, or the like: J is kept, but half of it may be wrong."""
        if self._prepared is not None:  # what was learned early is taken back
            _, (self.J, self._P, self._last) = self._prepared
            self._prepared = None
        size = sum(dot(row, row) for row in self.J) / len(self.J)
        for k in range(len(self._P)):
            self._P[k][k] = max(self._P[k][k], 0.25 * size)
        self._last = None
