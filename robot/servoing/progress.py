"""Progress of a run's moves towards its goal, and what to do if there is none.  Pure.

improving          go on
stagnant           start elsewhere; after so many starts, give up
diverging          explore anew
at a dead end      explore anew, then try another posture; none is left: out of reach
"""

import math

MYPY = False  # which a type checker takes for true
if MYPY:
    from random import Random  # noqa: F401
    from typing import Callable, List, Optional  # noqa: F401

    from robot.servoing.image_model import Pose  # noqa: F401

GO_ON, EXPLORE_ANEW, START_ELSEWHERE, TRY_POSTURE, GIVE_UP = (
    "go on", "explore anew", "start elsewhere", "try another posture", "give up",
)  # fmt: skip
"""Actions that follow from a run's progress."""

FAR_ERROR = 30.0
"""Error beyond which two starts that end equally far off end where the arm ends, px."""

NEAR_TOLERANCES = 3.0
"""Distance of a goal that is near, tolerances."""

IMPROVED_SHARE, STAGNANT_MOVES, STAGNANT_MOVES_NEAR = 0.9, 4, 10
"""Share of the best error below which a move improves; number of moves without, far off and near,
after which it starts elsewhere."""

STALLED_SHARE, MAX_STALLS = 0.9, 2
"""Share of the error beyond which what a target leaves over is a stall; number of stalls on the
way to a goal, with a model that is right lately, before all is explored anew. Then the goal is
out of reach, unless there is another posture to try."""

MAX_RESTARTS, MAX_EQUAL_ENDS, EQUAL_END_SHARE = 4, 3, 0.1
"""Number of starts from elsewhere, and of those that end equally far off (to this share), after
which the goal counts as out of reach."""

DIVERGED_SHARE, DIVERGING_MOVES, DIVERGED_ERROR = 1.3, 3, 25.0
"""Error beyond which moves diverge: multiple of the best, number of moves in a row, and px
beside."""

RIGHT_SHARE = 0.6
"""Greatest share of its last steps that a model that is right lately has predicted wrongly."""

FIRST_STEP, MIN_STEP, MAX_STEP = (math.radians(x) for x in (35, 3, 60))
"""Trust region: the greatest step of a joint at first, at the least and at the most, rad."""

GROW_BELOW, SHRINK_ABOVE, GROWTH, SHRINKAGE = 0.3, 0.6, 2.0, 0.5
"""Share of a step predicted wrongly below which the region grows, and above which it shrinks; the
factors, by which it becomes so many times the step."""


RESTART_RANGE = 0.25, 0.75
"""Range of shares of the joints' ranges where a restart begins."""


def restart_draws(seed):
    # type: (int) -> Callable[[int], List[float]]
    """Return a function that draws so many shares of RESTART_RANGE.

    (The module random is imported only where it is needed.)
    """
    rng = []  # type: List[Random]

    def draw(n):
        # type: (int) -> List[float]
        if not rng:
            import random

            rng.append(random.Random(seed))
        return [rng[0].uniform(*RESTART_RANGE) for _ in range(n)]

    return draw


# The trust region bounds the next step by how well the last one was predicted.  Textbooks compare
# the reduction of the cost with the predicted one (Conn, Gould and Toint 2000, chapter 6).  Here
# the error of the predicted place is compared with the step, |s_predicted - s| / |ds|: near the
# goal the cost's reduction is mostly noise, and a detour to another posture may raise the cost
# though the model is right.  The region shrinks to a share of the step that was made, not of the
# region, since a short step proves nothing of the region.  It grows only after a good prediction.
# It has no effect on exploring, whose steps are short by themselves.


def next_region(region, step, wrong):
    # type: (float, float, float) -> float
    """Return the greatest next step of a joint, rad.

    Args:
        region: the last one, rad.
        step: the greatest step of a joint that was made of it, rad.
        wrong: share of the step that was predicted wrongly.
    """
    if wrong > SHRINK_ABOVE:
        return max(MIN_STEP, SHRINKAGE * step)
    if wrong < GROW_BELOW:
        return min(MAX_STEP, max(region, GROWTH * step))
    return region


class Progress(object):
    """The progress on the way to one goal.

    Args:
        tolerance: px.
        known: the models need no exploring.

    Attributes:
        target_pose: where the arm is going, rad, as long as that is the best that is known.
        postures: joint angles (rad) of the postures that have been tried.
        refined: whether it was within the tolerance before.
        flat: whether the cameras were once found to see the same.
        detours: whether the last move leads to another posture.
    """

    def __init__(self, tolerance, known=False):
        # type: (float, bool) -> None
        self._tolerance = tolerance
        self._known = known
        self._best, self._stagnant, self._diverging = None, 0, 0  # type: Optional[float], int, int
        self._stuck_at = []  # type: List[float]  # the errors at which starts have ended, px
        self._stalled = 0
        self._checked = False  # by exploring anew, that it is out of reach
        self.target_pose = None  # type: Optional[Pose]
        self.postures = []  # type: List[Pose]
        self.refined = self.flat = self.detours = False

    def assess(self, error):
        # type: (float) -> str
        """Return the action that follows from the error of a measurement, px."""
        if self._best is None or error < IMPROVED_SHARE * self._best:
            self._best, self._stagnant = error, 0
        else:
            self._stagnant += 1
        self._diverging = (
            self._diverging + 1 if error > DIVERGED_SHARE * self._best + DIVERGED_ERROR else 0
        )
        if self._stagnant >= (STAGNANT_MOVES_NEAR if self.near else STAGNANT_MOVES):
            return self._give_up_or(self._best, START_ELSEWHERE)
        if self._diverging >= DIVERGING_MOVES and not self._known:
            return EXPLORE_ANEW
        return GO_ON

    def _give_up_or(self, best, action):
        # type: (float, str) -> str
        """Return the action, or GIVE_UP if enough starts have ended, the last one at `best`, px."""
        self._stuck_at.append(best)
        equal_ends = [
            error for error in self._stuck_at if abs(error - best) < EQUAL_END_SHARE * best
        ]
        if len(self._stuck_at) > MAX_RESTARTS or (
            best > FAR_ERROR and len(equal_ends) == MAX_EQUAL_ENDS
        ):
            return GIVE_UP
        return action

    def stalls(self, error, left):
        # type: (float, float) -> bool
        """Return whether a target that leaves over `left` of `error`, px, is a stall."""
        return left > max(self._tolerance, STALLED_SHARE * error)

    def assess_stall(self, left, wrong):
        # type: (float, float) -> str
        """Return the action that follows from a target that stalls.

        Args:
            left: what it would leave over though all were known, px.
            wrong: share of its steps that the model in use has predicted wrongly.
        """
        self._stalled += 1
        if self._stalled <= MAX_STALLS or left <= self._tolerance or wrong >= RIGHT_SHARE:
            return GO_ON
        if not (self._checked or self._known):
            self._checked = True
            return EXPLORE_ANEW
        return TRY_POSTURE

    @property
    def near(self):
        # type: () -> bool
        """Whether the best so far was near the goal."""
        return self._best is not None and self._best < NEAR_TOLERANCES * self._tolerance

    @property
    def nearest(self):
        # type: () -> float
        """Least error at which a start has ended, px."""
        return min(self._stuck_at)

    @property
    def gain(self):
        # type: () -> float
        """Share of a step to make: near the goal, to and fro without end means unknown backlash."""
        return 1.0 / (1.0 + 0.5 * self._stagnant) if self.near else 1.0

    def detour(self):
        # type: () -> None
        """Allow the path to lead farther off at first."""
        self._best, self.detours = float("inf"), True

    def begin_elsewhere(self):
        # type: () -> None
        """Start from another posture."""
        self._best, self._stagnant, self._stalled, self.target_pose = None, 0, 0, None

    def begin_exploring(self):
        # type: () -> None
        """Explore anew."""
        self._best, self._diverging, self.target_pose = None, 0, None
