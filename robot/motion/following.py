"""Motions and aims followed by an arm's links, with compensation of their backlash.

Nothing is stopped or held here: the caller does that.
"""

import math

from robot.motion.axis import CORNER, LONG_SETTLING, TOLERANCES, Tolerances
from robot.motion.backlash import BacklashCompensation, motor_bounds
from robot.motion.online_trajectory import OnlineTrajectory

MYPY = False
if MYPY:
    from typing import Callable, List, Optional, Sequence, Tuple, Union  # noqa: F401

    from robot.motion.arm_motors import ArmMotors  # noqa: F401
    from robot.motion.chains import FixedPose, Pose  # noqa: F401
    from robot.motion.control_loop import OnTick, Spare  # noqa: F401
    from robot.motion.feed import FeedOverride  # noqa: F401
    from robot.motion.gravity import Gravity  # noqa: F401
    from robot.motion.interfaces import LinkMotion  # noqa: F401
    from robot.motion.online_trajectory import Aim  # noqa: F401
    from shared.arm_description import Joint  # noqa: F401

    LinkTick = Callable[[float, FixedPose], object]  # time, s, and the links' angles, rad
    AimAt = Callable[[float, FixedPose], Aim]  # the same

COASTING_SPEED = math.radians(10)
"""Maximum speed at which a stopped motor keeps its link on its side of the backlash, rad/s."""

MAX_CHASE_ERROR = math.radians(5)
"""Tolerance of the error in a chase, rad: a motor faster than described runs ahead."""


class LinkFollower(object):
    """The links of one arm, and the side of its backlash on which each lies.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motors: ArmMotors.
        gravity: robot.motion.gravity.Gravity of the arm.

    Attributes:
        sides: per joint, the side of its backlash: +1 after a push in the positive direction, or
            under a pull of gravity in the negative one; -1 the other way round; 0 unknown; between,
            it is being crossed.
    """

    def __init__(self, joints, motors, gravity):
        # type: (Sequence[Joint], ArmMotors, Gravity) -> None
        self._joints = joints
        self._motors = motors
        self._gravity = gravity
        self._plan = None  # type: Union[BacklashCompensation, FeedOverride, None]
        self._bounds = motor_bounds(joints)
        self._preload = gravity.preload_sides if gravity.loaded else None
        self._weigh = gravity.torques if gravity.loaded else None
        self.forget_sides()

    def forget_sides(self):
        # type: () -> None
        """Mark all sides as unknown: something else has turned the joints."""
        self.sides = (0,) * len(self._joints)  # type: Tuple[float, ...]

    def angles(self):
        # type: () -> FixedPose
        """Return the links' angles by the encoders, rad, with the backlash where it is known."""
        angles = [motor.angle() for motor in self._motors.joints]
        self.sides = self._gravity.sides(angles, self.sides)
        return self._at(angles)

    def follow(self, motions, tolerances, on_tick):
        # type: (Sequence[LinkMotion], Tolerances, Optional[LinkTick]) -> bool
        """Follow motions one after the other, see RobotArm.follow."""
        plans = self._planned(motions)
        for plan in plans:
            self._plan = plan
            within = tolerances if plan is plans[-1] else CORNER
            reporting = self._reporting(plan, on_tick) if on_tick else None
            if not self._motors.loop.run(
                self._motors.joints, plan, within, on_tick=reporting,
                weigh=self._weigh, bounds=self._bounds
            ):  # fmt: skip
                self._mark_braked()
                self._plan = None
                return False
            self.sides = plan.sides
        self._plan = None
        return True

    def follow_fed(self, motions, feed, ready):
        # type: (Sequence[LinkMotion], FeedOverride, Callable[[], object]) -> None
        """Follow motions at the rate of a FeedOverride, see RobotArm.follow_fed."""
        plans = self._planned(motions)
        ready()
        for self._plan in feed.each(plans):
            within = TOLERANCES if feed.index == len(plans) - 1 else CORNER
            over = self._motors.loop.run(
                self._motors.joints, feed, within, on_tick=feed.tick, weigh=self._weigh,
                bounds=self._bounds
            )  # fmt: skip
            self.sides = feed.sides
            if not over:
                self._mark_braked()
        self._plan = None

    def pursue(self, aim, speed, within, once, spare):
        # type: (AimAt, float, float, bool, Optional[Spare]) -> None
        """Chase an aim, or `once` go where it is at first, see RobotArm.chase."""
        q = self.angles()
        pursuit = OnlineTrajectory(self._joints, q, self.sides, speed, self._preload)

        def steer(t, now, angles):
            # type: (float, float, Pose) -> object
            self.sides = pursuit.sides_at(t)
            return pursuit.handle(t, aim(now, self._at(angles)), once)

        if not self._motors.loop.run(
            self._motors.joints, pursuit, Tolerances(LONG_SETTLING, within, MAX_CHASE_ERROR), steer,
            spare=spare, weigh=self._weigh, bounds=self._bounds
        ):  # fmt: skip
            self._mark_braked()

    def _planned(self, motions):
        # type: (Sequence[LinkMotion]) -> List[BacklashCompensation]
        """Plan all motions before the first: a plan between two would exceed the dead-man."""
        plans = []  # type: List[BacklashCompensation]
        sides, joints = self.sides, self._joints
        for motion in motions:
            sides = self._gravity.sides(motion.start, sides)
            plans.append(BacklashCompensation(joints, motion, sides, self._preload))
            sides = plans[-1].sides
        return plans

    def _reporting(self, plan, on_tick):
        # type: (BacklashCompensation, LinkTick) -> OnTick
        """Return a tick handler of the control loop that calls `on_tick` with the links' angles."""

        def report(t, now, angles):
            # type: (float, float, Pose) -> object
            self.sides = plan.sides_at(t)
            return on_tick(now, self._at(angles))

        return report

    def _at(self, angles):
        # type: (Pose) -> FixedPose
        """Return the links' angles for these of the motors, rad."""
        return tuple(
            angle - side * joint.backlash / 2
            for angle, side, joint in zip(angles, self.sides, self._joints)
        )

    def mark_interrupted(self):
        # type: () -> None
        """Update the sides after an error has ended a motion; the motors are not stopped yet."""
        if self._plan:
            self.sides = self._plan.sides_at(self._motors.loop.plan_time)
            self._plan = None
        self._mark_braked()

    def _mark_braked(self):
        # type: () -> None
        """Mark the side as unknown of every joint that is too fast to stop on its side."""
        self.sides = tuple(
            0 if abs(speed) > COASTING_SPEED else side
            for speed, side in zip(self._motors.speeds(), self.sides)
        )
