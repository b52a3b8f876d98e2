"""The arm of this brick, built from its description and its motors; the door to all motion.

Each wait has a deadline, and each error stops the motors before it is raised.
"""

import contextlib
import math
import os

from robot.motion import kinematics, motor_model
from robot.motion.arm_motors import ArmMotors
from robot.motion.axis import (
    COARSE_COUNTS,
    EXACT,
    FINE_COUNTS,
    MAX_ERROR,
    NEAR,
    TOLERANCES,
    Tolerances,
)
from robot.motion.backlash import APPROACH_ACCELERATION, APPROACH_SPEED, pose_behind
from robot.motion.checked import Checked
from robot.motion.control_loop import Stalled
from robot.motion.following import LinkFollower
from robot.motion.gravity import Gravity
from robot.motion.joint_controller import GAINS
from robot.motion.online_trajectory import STOP
from robot.motion.trajectory import JointMove
from robot.motion.zero import Zero
from shared.arm_description import move_accelerations

MYPY = False
if MYPY:
    from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.chains import FixedPoint, FixedPose, Pose  # noqa: F401
    from robot.motion.control_loop import OnTick, Spare  # noqa: F401
    from robot.motion.feed import FeedOverride  # noqa: F401
    from robot.motion.following import AimAt, LinkTick  # noqa: F401
    from robot.motion.interfaces import LinkMotion  # noqa: F401
    from robot.motion.joint_controller import GainsByKind  # noqa: F401
    from robot.motion.online_trajectory import Aim  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401
    from robot.motion.stops import Found  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

MAX_PEN_ERROR = math.radians(25)
"""Tolerance of the pen's motor while it turns, rad."""


class RobotArm(object):
    """The arm on this brick.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        zero: robot.motion.zero.Zero, where the zero is remembered; the arm's own file if None.
        gains: robot.motion.joint_controller.Gains by kind of motor.
        gravity: robot.motion.gravity.Gravity; that of the description if None.
        say: called with a line for people on the timing of the control loop.
        motors: ArmMotors; those of the description if None.
        checked: robot.motion.checked.Checked, beside the zero's file if None.

    Attributes:
        motors: ArmMotors.
        checked: Checked: nothing moves until that is confirmed.
        joints, pen: its JointMotors.

    Raises:
        MotorNotFound: a motor of the description is not there.
    """

    def __init__(
        self,
        description,  # type: Arm
        clock,  # type: Timepiece
        zero=None,  # type: Optional[Zero]
        gains=GAINS,  # type: GainsByKind
        gravity=None,  # type: Optional[Gravity]
        say=print,  # type: ReportLine
        motors=None,  # type: Optional[ArmMotors]
        checked=None,  # type: Optional[Checked]
    ):
        # type: (...) -> None
        self.description = description
        self.clock = clock
        self.zero = zero or Zero(description)
        self.checked = checked or Checked(description, os.path.dirname(self.zero.file))
        self.motors = motors or ArmMotors(description, clock, gains, say)
        self.joints, self.pen = self.motors.joints, self.motors.pen
        self._gravity = gravity or Gravity(description)
        self._links = LinkFollower(description.joints, self.motors, self._gravity)
        self._engaged, self._standing, self._zero_needed = False, True, True

    @property
    def homed(self):
        # type: () -> bool
        """Whether its zero is known: nothing moves before; a stall puts it in doubt."""
        return self.motors.homed

    @property
    def backlash_sides(self):
        # type: () -> Tuple[float, ...]
        """Side of its backlash on which each joint lies, -1 .. +1, see LinkFollower."""
        return self._links.sides

    def counts(self):
        # type: () -> Dict[str, int]
        """Return the encoders' readings, counts, by port."""
        return self.motors.counts()

    def confirm_checked(self):
        # type: () -> None
        """Raise NotChecked if it is unconfirmed which motor turns which joint."""
        self.checked.confirm(self.motors.devices)

    def load_zero(self):
        # type: () -> None
        """Load the stored zero; raises NotHomed or BrickInUse, see ArmMotors.load_zeros."""
        self.motors.load_zeros(self.zero)

    def angles(self):
        # type: () -> FixedPose
        """Return the links' angles by the encoders, rad, with the backlash where it is known."""
        return self._links.angles()

    def position(self):
        # type: () -> FixedPoint
        """Return the position of the tip by the encoders, cm, in the base frame."""
        return kinematics.forward(self.description, self.angles())

    # Motion

    def _engage(self, zero_needed=True):
        # type: (bool) -> None
        """Get ready to move, and store that the arm is no longer parked.

        Every motion comes through here.  Raises NotChecked, NotHomed, or BrickInUse if another
        program may move the arm.
        """
        if not self._engaged:
            self.confirm_checked()
        self.motors.lock.begin()
        if zero_needed and not self.homed:
            self.motors.refuse_unhomed(self.zero)
        engaged, self._engaged, self._standing = self._engaged, True, False
        if self.homed and not engaged:
            self.motors.confirm_not_reset()
            self.zero.save(self.motors.zeros(), None)

    def go_to(self, q, speed=1.0, accelerations=None, on_tick=None, tolerances=EXACT):
        # type: (Pose, float, Optional[Sequence[float]], Optional[LinkTick], Tolerances) -> bool
        """Move all joints together to `q` (rad), each at most at `speed` times its maximum.

        `accelerations` are the joints' maxima, rad/s^2; JOINT_ACCELERATION if None.  With more, a
        link runs ahead at the end.  Else, and what it returns, as `follow`.

        Raises:
            kinematics.Unreachable: a joint angle past its limit; nothing has moved.
        """
        kinematics.check_limits(self.description.joints, q)
        fastest = [speed * joint.max_speed for joint in self.description.joints]
        move = JointMove(self.angles(), q, fastest, accelerations)
        return self.follow([move], tolerances, on_tick)

    def pre_approach(self, motion, on_tick=None):
        # type: (LinkMotion, Optional[LinkTick]) -> bool
        """Go to the start of `motion` from behind, so that its direction has taken up backlash.

        `on_tick`, and what it returns, as `follow`.
        """
        joints = self.description.joints
        behind, gently = pose_behind(joints, motion), [APPROACH_ACCELERATION] * len(joints)
        return self.go_to(
            behind, accelerations=move_accelerations(joints), on_tick=on_tick, tolerances=NEAR
        ) and self.go_to(motion.start, APPROACH_SPEED, gently, on_tick)

    def follow(self, motions, tolerances=TOLERANCES, on_tick=None):
        # type: (Sequence[LinkMotion], Tolerances, Optional[LinkTick]) -> bool
        """Let the links follow Trajectories or JointMoves, one after the other; end at rest, held.

        Args:
            motions: Trajectories or JointMoves; each starts where the one before ends.
            tolerances: of each.
            on_tick: called in every control tick, right after the encoders were read, with the
                time (s) and the links' observed angles (rad), which allow for known backlash.  If
                it returns STOP or raises, the motions end, all motors held.

        Returns:
            Whether it came to the end: `on_tick` has not stopped it.

        Raises:
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        self._engage()
        with self._stopping_on_error():
            done = self._links.follow(motions, tolerances, on_tick)
            self.motors.hold(self.joints)
        return done

    def follow_fed(self, motions, feed, ready):
        # type: (Sequence[LinkMotion], FeedOverride, Callable[[], object]) -> None
        """Follow as `follow` does, at the rate of a robot.motion.feed.FeedOverride.

        `ready` is called when all is planned and nothing moves yet: the pen may come down then.
        """
        self._engage()
        with self._stopping_on_error():
            self._links.follow_fed(motions, feed, ready)
            self.motors.hold(self.joints)

    def reach(
        self,
        q,  # type: Pose
        speed=1.0,  # type: float
        on_tick=None,  # type: Optional[LinkTick]
        within=FINE_COUNTS,  # type: float
        spare=None,  # type: Optional[Spare]
    ):
        # type: (...) -> None
        """Move to `q`, each joint by itself, as fast as `chase` and with as soft an end.

        A long move takes less time than by `go_to`, and the links end nearer to `q`; but the joints
        do not move in proportion.

        Args:
            q: joint angles, rad.
            speed: share of each joint's maximum speed.
            on_tick: as for `follow`.
            within: tolerance at the end, counts, as for `chase`.
            spare: as for ControlLoop.run.

        Raises as `go_to`.
        """
        kinematics.check_limits(self.description.joints, q)

        def aim(t, links):
            # type: (float, FixedPose) -> Aim
            return STOP if on_tick and on_tick(t, links) is STOP else q

        self._engage()
        with self._stopping_on_error():
            self._links.pursue(aim, speed, within, True, spare)
            self.motors.hold(self.joints)

    def chase(self, aim, speed=1.0, within=FINE_COUNTS, spare=None):
        # type: (AimAt, float, float, Optional[Spare]) -> None
        """Let the links follow an aim that may move at will; end at rest, held.

        Args:
            aim: called in every control tick as `on_tick` of `follow` is; returns where the joints
                should be, see OnlineTrajectory.handle.  An aim past a limit means the limit.  It is
                called until the joints are at rest.
            speed: share of each joint's maximum.
            within: counts from its end at which a joint has settled; a caller that measures the
                position needs no closer end, which takes long in a slow loop.
            spare: as for ControlLoop.run.

        Raises as `follow`, and kinematics.Unreachable for an aim that is not a number.
        """
        self._engage()
        with self._stopping_on_error():
            self._links.pursue(aim, speed, within, False, spare)
            self.motors.hold(self.joints)

    @contextlib.contextmanager
    def _stopping_on_error(self):
        # type: () -> Iterator[None]
        """Stop every motor before an error of the `with` block goes on."""
        try:
            yield
        except BaseException as error:
            # A blocked joint looks like a dead encoder, whose counts are invalid from now on.
            if self.homed and isinstance(error, Stalled):
                self.motors.doubt_zeros(error.fact)
            self._links.mark_interrupted()
            self._halt()
            if isinstance(error, Stalled):
                error.mention_battery(self.clock)
            raise

    def move_pen(self, angle):
        # type: (float) -> None
        """Turn the pen's motor to `angle`, rad; raises Stalled if it does not get there."""
        pen = self.pen
        assert pen is not None  # nobody lifts a pen that is not there
        self._engage()
        self.motors.release_pen()
        move = JointMove(
            [pen.angle()], [angle], [motor_model.PEN_SPEED], [motor_model.PEN_ACCELERATION]
        )
        self.move_motor(pen, move, MAX_PEN_ERROR)

    def move_motor(self, motor, move, max_error=MAX_ERROR, on_tick=None):
        # type: (Motor, JointMove, float, Optional[OnTick]) -> None
        """Let a motor follow a JointMove, without limits, then hold it; see ControlLoop.run."""
        self._engage(self._zero_needed)
        with self._stopping_on_error():
            tolerances = Tolerances(counts=COARSE_COUNTS, error=max_error)
            self.motors.loop.run([motor], move, tolerances, on_tick)
            self.motors.hold([motor])

    @contextlib.contextmanager
    def lend_motors(self, zero_needed=True):
        # type: (bool) -> Iterator[None]
        """Hold the joints, and let a `with` block turn the motors; no backlash side is known then.

        Homing and the check of the mounting need no zero; nor does `move_motor` inside the block.
        """
        self._engage(zero_needed)
        with self._stopping_on_error():
            try:
                self._zero_needed = zero_needed
                self.motors.hold(self.joints)
                yield
            finally:
                self._zero_needed = True
                self._links.forget_sides()

    def home(self, here=False, say=print, seek=False):
        # type: (bool, ReportLine, bool) -> List[Found]
        """Find the zero of an arm that stands near its home pose, as its file says; store it.

        With `here` the arm stands at home exactly; with `seek` its stops are sought from anywhere.
        The pen must be up.  Returns one stops.Found per joint, none if nothing was sought.  Raises
        stops.Blocked, Stalled or MotorNotFound after stopping.
        """
        from robot.motion import homing  # not above: most programs find the zero remembered

        self.confirm_checked()
        self.motors.lock.begin_anew()
        self.motors.doubt_zeros(None)
        self.zero.forget()
        found = homing.home(self, self._gravity, here, seek, say)
        self.motors.homed = True
        self._links.forget_sides()
        self.zero.save(self.motors.zeros(), None if self._engaged else self.motors.at_rest())
        return found

    def step_to(self, q):
        # type: (Pose) -> None
        """Make the lab report's move: all joints at once, then within a count of `q` for 60 ms."""
        kinematics.check_limits(self.description.joints, q)
        self._engage()
        with self._stopping_on_error():
            from robot.motion.joint_steps import go_and_settle  # only the report's method needs it

            go_and_settle(self.joints, q, self.angles(), self.clock, self.motors.check)
        self._links.forget_sides()

    # Ending

    def stop(self):
        # type: () -> None
        """Stop and hold every motor that still answers; raise the first error of the others.

        Raises MotorNotFound, or another error of a motor.
        """
        lost = self._halt()
        if lost:
            raise lost

    def _halt(self):
        # type: () -> Optional[Exception]
        """Stop and hold every motor; return the first error of one without answer, or None."""
        self._standing = True
        return self.motors.halt()

    def go_low(self):
        # type: () -> bool
        """Go slowly to the resting pose of the arm's description; the base stays.

        Returns whether it went: not if nothing was moved, or no resting pose is described.
        Raises as `go_to`: kinematics.Unreachable where no path there keeps off the table.
        """
        from robot.motion import parking  # only at the end of a run

        return self._engaged and self.homed and parking.go_low(self)

    def park(self, low=False):
        # type: (bool) -> None
        """Stop, and store the counts at which the arm is parked; nothing if nothing was moved.

        With `low` it goes to its resting pose first if it can, see `go_low`.
        """
        if not self._engaged:
            return
        if low:
            with contextlib.suppress(kinematics.Unreachable):
                self.go_low()
        if not self._standing:
            self.stop()
        if self.homed:
            self.clock.sleep(0.1)
            self.zero.save(self.motors.zeros(), self.motors.at_rest())
        self.motors.lock.end()
        self._engaged = False  # only now: a program stopped meanwhile parks again
