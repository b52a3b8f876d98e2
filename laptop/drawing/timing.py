"""Estimate of the time that the brick takes for a drawing.  Pure.

Motions last what the brick's own code says, crossings of the backlash included.  What that does not
tell is measured on the emulated brick: how long joints settle where a motion ends, and what the
brick computes between motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from laptop.drawing.planning import PlannedStroke
from robot.motion import kinematics, parking
from robot.motion.backlash import (
    APPROACH_ACCELERATION,
    APPROACH_SPEED,
    BacklashCompensation,
    pose_behind,
)
from robot.motion.gravity import Gravity
from robot.motion.motor_model import PEN_ACCELERATION, PEN_SPEED
from robot.motion.trajectory import JointMove, Trajectory
from shared.arm_description import Arm, Joint, move_accelerations
from shared.job import JOIN_TOLERANCE

DIRECT, GEARED, IN_SPACE = "direct", "geared", "in space"

MOVE_SETTLES = {DIRECT: 0.092, GEARED: 0.145, IN_SPACE: 0.13}
"""Settling time of a move to where the arm rests, by the kind of arm, s."""

NEAR_SETTLES = {DIRECT: 0.085, GEARED: 0.139, IN_SPACE: 0.104}
"""Settling time of a fast move with the pen up to where a run-up begins, s."""

APPROACH_SETTLES = {DIRECT: 0.068, GEARED: 0.07, IN_SPACE: 0.1}
"""Settling time of the slow move to where a stroke begins, s."""

CORNER_SETTLES = {DIRECT: 0.061, GEARED: 0.078, IN_SPACE: 0.09}
"""Settling time of a piece of a stroke that another one follows, s."""

END_SETTLES = {DIRECT: 0.099, GEARED: 0.122, IN_SPACE: 0.144}
"""Settling time of a stroke's last piece, s."""

PEN_SETTLES = 0.085
"""Settling time of the pen, s."""

BETWEEN_STROKES = {DIRECT: 0.025, GEARED: 0.025, IN_SPACE: 0.055}
"""Time the brick needs to compute and store each stroke, s."""

READING = {DIRECT: 0.0026, GEARED: 0.0025, IN_SPACE: 0.0056}
"""Time the brick needs to read each cubic of a stroke's motions, s."""


@dataclass(frozen=True)
class Estimate:
    """Estimated times of a drawing.

    seconds     from the start to where the arm rests again
    starts      when the pen comes down on each stroke, s
    drawing_s   of it with the pen down
    """

    seconds: float
    starts: tuple[float, ...]
    drawing_s: float


def estimate(arm: Arm, strokes: Sequence[PlannedStroke]) -> Estimate:
    """Return the time the brick takes for strokes, from its home pose to its rest."""
    run = _Run(arm)
    starts, drawing = [], 0.0
    for stroke in strokes:
        run.read(stroke)
        if not run.is_at(stroke.motions[0].start):
            run.lift()
            run.approach(stroke.motions[0])
        run.lower()
        starts.append(run.seconds)
        for motion in stroke.motions[:-1]:
            run.follow(motion, CORNER_SETTLES)
        run.follow(stroke.motions[-1], END_SETTLES)
        drawing += run.seconds - starts[-1]
    run.lift()
    run.rest()
    return Estimate(run.seconds, tuple(starts), drawing)


class _Run:
    """The brick's course through a drawing: where it is, and how late it is, s."""

    def __init__(self, arm: Arm) -> None:
        self._arm, self._joints = arm, arm.joints
        self._gravity = Gravity(arm)
        self._preload = self._gravity.preload_sides if self._gravity.loaded else None
        self._q = tuple(joint.home for joint in arm.joints)
        self._sides: tuple[float, ...] = (0,) * len(arm.joints)
        self._pen_is_down = False
        self._kind = kind_of(arm)
        self.seconds = 0.0

    def read(self, stroke: PlannedStroke) -> None:
        self.seconds += BETWEEN_STROKES[self._kind] + READING[self._kind] * stroke.segments()

    def is_at(self, q: Sequence[float]) -> bool:
        return self._pen_is_down and max(abs(a - b) for a, b in zip(q, self._q, strict=True)) <= (
            JOIN_TOLERANCE
        )

    def lift(self) -> None:
        self._move_pen(False)

    def lower(self) -> None:
        self._move_pen(True)

    def _move_pen(self, down: bool) -> None:
        pen = self._arm.pen
        if pen and self._pen_is_down is not down:
            move = JointMove([pen.up], [pen.down], [PEN_SPEED], [PEN_ACCELERATION])
            self.seconds += move.duration + PEN_SETTLES
        self._pen_is_down = down

    def approach(self, motion: Trajectory) -> None:
        """Advance the clock as `RobotArm.pre_approach` does."""
        behind, most = pose_behind(self._joints, motion), move_accelerations(self._joints)
        self._go(behind, accelerations=most, settles=NEAR_SETTLES)
        gently = [APPROACH_ACCELERATION] * len(most)
        self._go(motion.start, APPROACH_SPEED, gently, APPROACH_SETTLES)

    def follow(self, motion: Trajectory, settles: dict[str, float]) -> None:
        self._add(motion, settles)

    def rest(self) -> None:
        """Advance the clock as `RobotArm.go_low` does."""
        if any(joint.park_angle is not None for joint in self._joints):
            try:
                for place in parking.way_down(self._arm, self._q):
                    self._go(place, parking.PARKING_SPEED)
            except kinematics.Unreachable:
                pass  # it is held where it is

    def _go(
        self,
        q: Sequence[float],
        speed: float = 1.0,
        accelerations: Sequence[float] | None = None,
        settles: dict[str, float] = MOVE_SETTLES,
    ) -> None:
        fastest = [speed * joint.max_speed for joint in self._joints]
        self._add(JointMove(self._q, q, fastest, accelerations), settles)

    def _add(self, motion: Trajectory | JointMove, settles: dict[str, float]) -> None:
        sides = self._gravity.sides(motion.start, self._sides)
        plan = BacklashCompensation(self._joints, motion, sides, self._preload)
        self._sides, self._q = plan.sides, tuple(motion.end)
        self.seconds += plan.before + plan.duration + settles[self._kind]


def kind_of(arm: Arm) -> str:
    """Return the kind of an arm, by which its joints settle: DIRECT, GEARED or IN_SPACE."""
    joints: Sequence[Joint] = arm.joints
    if arm.chain == "spatial":
        return IN_SPACE
    return DIRECT if all(joint.gear == 1 for joint in joints) else GEARED


def in_minutes(seconds: float) -> str:
    """Return a time as text: 45 s, 5 min 12 s, 1 h 20 min; 0 s for a negative one."""
    total = max(0, round(seconds))
    if total < 60:
        return f"{total} s"
    if total < 3600:
        return f"{total // 60} min {total % 60} s"
    return f"{total // 3600} h {total % 3600 // 60} min"
