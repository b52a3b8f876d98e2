"""The links of one arm follow motions and aims, their backlash allowed for.

Nothing is stopped or held here: whoever lets them follow does that.
"""

import math

from robot.motion.axis import LONG_SETTLING, Tolerances
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
"""A motor stopped at more than this speed leaves its link running on into the backlash, rad/s."""

MAX_CHASE_ERROR = math.radians(5)
"""Greatest error in a chase, rad: a motor faster than described runs ahead on a long way."""


class LinkFollower(object):
    """The links of one arm, and on which side of its backlash each lies.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motors: ArmMotors.
        gravity: robot.motion.gravity.Gravity, what pulls on the joints.

    Attributes:
        sides: per joint, on which side its backlash lies: +1 pushed in the positive direction last,
            or pulled in the negative by gravity; -1 the other way round; 0 unknown; between, it is
            being crossed.
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
        """Somebody else has turned the joints: no side is known."""
        self.sides = (0,) * len(self._joints)  # type: Tuple[float, ...]

    def angles(self):
        # type: () -> FixedPose
        """Joint angles, rad, as the encoders have them, allowing for backlash as far as known."""
        angles = [motor.angle() for motor in self._motors.joints]
        self.sides = self._gravity.sides(angles, self.sides)
        return self._at(angles)

    def follow(self, motions, settle, on_tick):
        # type: (Sequence[LinkMotion], float, Optional[LinkTick]) -> None
        """Follow motions one after the other, see RobotArm.follow."""
        plans = self._planned(motions)
        for plan in plans:
            self._plan = plan
            noting = self._noting(plan, on_tick) if on_tick else None
            if not self._motors.loop.run(
                self._motors.joints, plan, Tolerances(settle), on_tick=noting,
                weigh=self._weigh, bounds=self._bounds
            ):  # fmt: skip
                self._note_braked()
                break
            self.sides = plan.sides
        self._plan = None

    def follow_fed(self, motions, feed, ready):
        # type: (Sequence[LinkMotion], FeedOverride, Callable[[], object]) -> None
        """Follow motions at the rate of a FeedOverride, see RobotArm.follow_fed."""
        plans = self._planned(motions)
        ready()
        for self._plan in feed.each(plans):
            over = self._motors.loop.run(
                self._motors.joints, feed, on_tick=feed.tick, weigh=self._weigh, bounds=self._bounds
            )
            self.sides = feed.sides
            if not over:
                self._note_braked()
        self._plan = None

    def pursue(self, aim, speed, acceleration, within, once, spare):
        # type: (AimAt, float, float, float, bool, Optional[Spare]) -> None
        """Chase an aim, or `once` go where it is at first, see RobotArm.chase."""
        q = self.angles()
        pursuit = OnlineTrajectory(self._joints, q, self.sides, speed, acceleration, self._preload)

        def steer(t, now, angles):
            # type: (float, float, Pose) -> object
            self.sides = pursuit.sides_at(t)
            return pursuit.take(t, aim(now, self._at(angles)), once)

        if not self._motors.loop.run(
            self._motors.joints, pursuit, Tolerances(LONG_SETTLING, within, MAX_CHASE_ERROR), steer,
            spare=spare, weigh=self._weigh, bounds=self._bounds
        ):  # fmt: skip
            self._note_braked()

    def _planned(self, motions):
        # type: (Sequence[LinkMotion]) -> List[BacklashCompensation]
        """All that the motors are to do: between two pieces their dead-man would stop them."""
        plans = []  # type: List[BacklashCompensation]
        sides, joints = self.sides, self._joints
        for motion in motions:
            sides = self._gravity.sides(motion.start, sides)
            plans.append(BacklashCompensation(joints, motion, sides, self._preload))
            sides = plans[-1].sides
        return plans

    def _noting(self, plan, on_tick):
        # type: (BacklashCompensation, LinkTick) -> OnTick
        """What tells `on_tick`, in the control loop, where the links are."""

        def note(t, now, angles):
            # type: (float, float, Pose) -> object
            self.sides = plan.sides_at(t)
            return on_tick(now, self._at(angles))

        return note

    def _at(self, angles):
        # type: (Pose) -> FixedPose
        """The links' angles for these of the motors, rad."""
        return tuple(
            angle - side * joint.backlash / 2
            for angle, side, joint in zip(angles, self.sides, self._joints)
        )

    def note_broken_off(self):
        # type: () -> None
        """An error has ended what they did; the motors are not stopped yet."""
        if self._plan:
            self.sides = self._plan.sides_at(self._motors.loop.plan_time)
            self._plan = None
        self._note_braked()

    def _note_braked(self):
        # type: () -> None
        """Which side of its backlash a joint lies on is unknown where it runs on."""
        self.sides = tuple(
            0 if abs(speed) > COASTING_SPEED else side
            for speed, side in zip(self._motors.speeds(), self.sides)
        )
