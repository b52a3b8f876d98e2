"""The lab report's algorithm, one of the methods of a run.  Pure."""

import math
from operator import sub

from robot.motion.linear_systems import Singular, broyden_update, damped_solve, solve
from robot.servoing.decision import Decision, end_of_run
from robot.servoing.linear_algebra import length
from robot.servoing.measurement import ReportEstimator, error_of
from robot.servoing.rows import Rows
from shared.verdicts import CONVERGED, SINGULAR

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Dict, Iterable, Iterator, List, Optional, Sequence  # noqa: F401

    from robot.servoing.image_model import Features, Pixel, Pose  # noqa: F401
    from robot.servoing.image_models import ImageModels  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.measurement import Frames, Measurement  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401


NAME = "report"
"""Name of the method, and of the model in its log."""


def make(method, arm, tolerance, rows, seed):
    # type: (str, Arm, float, Rows, int) -> ReportServo
    """Make the servo; see robot.servoing.runs.model_servo."""
    return ReportServo(arm.joints, tolerance, rows)


class LookThenMoveServo(object):
    """Base of a servo that looks, then moves: what is seen in motion teaches it nothing.

    Attributes:
        LEARNS: False: the next run goes on with nothing that this one has learned.
        far_models: None: it has none that may be recalled.
        detour_pose: None: it knows no other postures.
        explores_in_motion: False: it moves a joint at a time.
    """

    LEARNS = explores_in_motion = False
    far_models = None  # type: Optional[ImageModels]
    detour_pose = None  # type: Optional[Pose]

    def observe_in_motion(self, camera, q, s):
        # type: (str, Pose, Pixel) -> None
        """Ignore what is seen in motion."""

    def known(self, camera):
        # type: (str) -> None
        """Return None: no camera is asked why a joint stands."""

    def learn_shape(self, camera, q, s):
        # type: (str, Pose, Pixel) -> Iterator[None]
        """Return an empty iterator: there is nothing to learn."""
        return iter(())

    def prepare(self, q, frames):
        # type: (Pose, Frames) -> Iterator[None]
        """Return an empty iterator: there is nothing to prepare."""
        return iter(())


class ReportServo(LookThenMoveServo):
    """The lab report's algorithm: Broyden with gamma = 1, steps of 10, 5 and 2 degrees.

    What it leaves open: the exploring steps are of 10 degrees and not taken back; dx is the step as
    it was commanded, of which a joint limit may have taken some; at the tolerance it ends; the
    cameras that it begins with are those that it needs.

    Args:
        joints: of the arm's description.
        tolerance: px.
        rows: Rows; all if None.
        robust: measure by medians.

    Attributes:
        using: the model in use, for the log.
        J: px/rad, its rows those that count; None at first.
        rows: Rows.
        cameras: those that it goes by; none at first.
    """

    EXPLORING_STEP = math.radians(10)
    """Size of a joint's exploring step, rad."""
    FAR_ERROR, NEAR_ERROR = 30.0, 15.0
    """Errors from which on the first and the second of the steps are made, px."""
    STEP_SIZES = tuple(math.radians(x) for x in (10, 5, 2))
    """Sizes of the steps, far off and nearer, rad."""

    def __init__(self, joints, tolerance, rows=None, robust=False):
        # type: (Sequence[Joint], float, Optional[Rows], bool) -> None
        self.using, self.J = NAME, None  # type: Optional[str], Optional[Matrix]
        self.rows = rows or Rows("stereo", len(joints))
        self.estimator = ReportEstimator(robust)
        self.cameras = ()  # type: Sequence[str]
        self._low = [joint.lower for joint in joints]
        self._high = [joint.upper for joint in joints]
        self._tolerance = tolerance
        self._columns = []  # type: List[Dict[str, List[float]]]  # of J as explored, by camera
        self._seen = None  # type: Optional[Dict[str, Features]]
        self._dx, self._x = [], []  # type: Vector, List[float]

    def suffices(self, cameras):
        # type: (Iterable[str]) -> bool
        """Return what Servo.suffices does."""
        if not self.cameras:
            return self.rows.suffice(cameras)
        return set(self.cameras) <= set(cameras)

    def decide(self, q, measurements, chase=()):
        # type: (Pose, Sequence[Measurement], Sequence[MarkerFrame]) -> Decision
        """Decide as Servo.decide; the report has no chases."""
        if not self.cameras:
            self.cameras = [measurement.camera for measurement in measurements]
        measurements = [m for m in measurements if m.camera in self.cameras]
        n = len(q)
        self._x = self._x or list(q)
        seen = {measurement.camera: measurement.s for measurement in measurements}
        before, self._seen = self._seen, seen
        if before is not None and self.J is None:
            self._columns.append(
                {
                    camera: [
                        (a - b) / self.EXPLORING_STEP for a, b in zip(seen[camera], before[camera])
                    ]
                    for camera in seen
                }
            )
            if len(self._columns) == n:
                J = {c: tuple(zip(*[column[c] for column in self._columns])) for c in seen}
                self.rows.choose(J)
                self.cameras = [c for c in self.cameras if self.rows.count([c])]
                self.J, before = tuple(self.rows.values(J)), None
        e = error_of(measurements, self.rows)
        if length(e) < self._tolerance or not any(e):
            return end_of_run(CONVERGED)
        if self.J is None:
            dx = [self.EXPLORING_STEP * (k == len(self._columns)) for k in range(n)]
            return self._step("explore", dx)
        if before is not None:
            dy = map(sub, self.rows.values(seen), self.rows.values(before))
            self.J = broyden_update(self.J, self._dx, list(dy))
        try:
            wanted = [-x for x in e]
            square = len(self.J) == n
            dx = solve(self.J, wanted) if square else damped_solve(self.J, wanted, 0.0)
        except Singular:
            return end_of_run(SINGULAR, "the Jacobian has no inverse")
        mu = self.STEP_SIZES[
            0 if length(e) >= self.FAR_ERROR else 1 if length(e) >= self.NEAR_ERROR else 2
        ]
        return self._step("move", [mu * d / length(dx) for d in dx])

    def _step(self, action, dx):
        # type: (str, Vector) -> Decision
        """Return the Decision to move by dx (rad), within the joints' limits."""
        self._dx = dx
        moved = [a + d for a, d in zip(self._x, dx)]
        box = zip(moved, self._low, self._high)
        self._x = [min(max(a, low), high) for a, low, high in box]
        return Decision(action, list(self._x), "", "")
