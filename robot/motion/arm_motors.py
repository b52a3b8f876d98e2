"""The motors of one arm, each with its controller, and the loop that drives them."""

import math

from robot.ev3.brick_lock import BrickLock
from robot.ev3.motors import JointMotor, motors_folder
from robot.motion.control_loop import ControlLoop
from robot.motion.joint_controller import JointController
from robot.motion.zero import ADVICE, NOT_LOADED, NotHomed, check_not_reset
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Callable, Dict, List, NoReturn, Optional, Sequence  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.interfaces import AtPort  # noqa: F401
    from robot.motion.joint_controller import GainsByKind  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401
    from robot.motion.zero import Zero  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    MotorKind = Callable[[str, str, str, float, int], Motor]  # name, port, kind, gear, direction

MAX_PEN_OFFSET = math.radians(10)
"""Tolerance of a pen that is held, rad: beyond it, something else has turned the pen."""


class PenDisplaced(ArmError):
    """A pen that is not where its motor holds it.

    Args:
        pen: its motor, which has a port.
        offset: from where it is held, rad.
    """

    def __init__(self, pen, offset):
        # type: (AtPort, float) -> None
        super(PenDisplaced, self).__init__(
            "the pen (port {}) was turned away by {:.0f} deg from where it is held; free it, then "
            "draw again".format(pen.port, abs(math.degrees(offset)))
        )


class ArmMotors(object):
    """All motors of one arm.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        gains: joint_controller.Gains by kind of motor.
        report: called with a line for people on the timing of the control loop.
        kind: makes a motor from name, port, motor's kind, gear and direction.

    Attributes:
        joints: JointMotors from the base outwards.
        pen: JointMotor; None where the arm has none.
        loop: ControlLoop of them all.
        controllers: motor -> JointController.
        homed: whether the counts at joint angle zero are known.
        lock: BrickLock, held by the program that moves them.

    Raises:
        MotorNotFound: a motor of the description is not there.
    """

    def __init__(self, description, clock, gains, report, kind=JointMotor):
        # type: (Arm, Timepiece, GainsByKind, ReportLine, MotorKind) -> None
        self.joints = [  # type: List[Motor]
            kind(joint.name, joint.port, joint.motor, joint.gear, joint.direction)
            for joint in description.joints
        ]
        for motor in self.joints:
            motor.falls = any(joint.mass for joint in description.joints)
        pen = description.pen
        self.pen = None  # type: Optional[Motor]
        self._all = list(self.joints)
        self.controllers = {
            motor: JointController(joint.gear, gains[joint.motor], joint.backlash)
            for motor, joint in zip(self.joints, description.joints)
        }
        if pen:
            self.pen = kind("pen", pen.port, pen.motor, 1.0, 1)
            self._all.append(self.pen)
            self.controllers[self.pen] = JointController(1.0, gains[pen.motor])
        self.homed = False
        self._doubt = None  # type: Optional[str] # what put the zeros in doubt, for people
        self._rest = {}  # type: Dict[str, int] # when last the zeros were known and all stood
        self._checked = 0
        self._pen_held_at = None  # type: Optional[float] # rad, once it is held there
        self.lock = BrickLock(motors_folder())
        self.loop = ControlLoop(clock, self.controllers, self._check_next, report)

    def counts(self):
        # type: () -> Dict[str, int]
        """Return the encoders' readings, counts, by port."""
        return {motor.port: motor.counts() for motor in self._all}

    def zeros(self):
        # type: () -> Dict[str, float]
        """Return the counts at joint angle zero, by port."""
        return {motor.port: motor.zero for motor in self._all}

    def devices(self):
        # type: () -> Dict[str, str]
        """Return the system's device names of the motors, by port."""
        return {motor.port: motor.device for motor in self._all}

    def load_zeros(self, zero):
        # type: (Zero) -> None
        """Load the stored counts at joint angle zero.

        Args:
            zero: robot.motion.zero.Zero.

        Raises:
            NotHomed: there are none, or the encoders or the arm contradict them.
            BrickInUse: they are refused because another program is moving the motors.
        """
        if self._doubt:
            raise NotHomed(self._doubt + "; since then the zero is in doubt" + ADVICE)
        try:
            zeros = zero.confirmed(self.at_rest())
        except NotHomed:
            self.lock.check_free()
            raise
        for motor in self._all:
            motor.zero = zeros[motor.port]
        pen = self.pen.angle() if self.pen else None
        zero.check_angles([motor.angle() for motor in self.joints], pen)
        self.homed = True

    def at_rest(self):
        # type: () -> Dict[str, int]
        """Return the counts of an arm at rest, by port; `confirm_not_reset` compares with them."""
        self._rest = self.counts()
        return self._rest

    def confirm_not_reset(self):
        # type: () -> None
        """Raise NotHomed if something else has reset the motors since `at_rest`."""
        self.homed = False
        check_not_reset(self.counts(), self._rest)
        self.homed = True

    def doubt_zeros(self, why):
        # type: (Optional[str]) -> None
        """Mark the zeros as unknown until they are found anew.

        Args:
            why: the fact that puts them in doubt, for people; None: they are about to be found.
        """
        self.homed, self._doubt = False, why

    def refuse_unhomed(self, zero):
        # type: (Zero) -> NoReturn
        """Raise the error that tells a program why it cannot move an arm of unknown zero.

        Args:
            zero: robot.motion.zero.Zero.

        Raises:
            NotHomed, and BrickInUse as `load_zeros`: always.
        """
        self.load_zeros(zero)  # its refusal is the reason
        self.homed = False  # the caller's goal was counted from another zero
        raise NotHomed(NOT_LOADED)

    def speeds(self):
        # type: () -> List[float]
        """Return the joints' observed speeds, rad/s."""
        return [self.controllers[motor].speed for motor in self.joints]

    def check(self):
        # type: () -> None
        """Check that every motor is plugged in, and that a held pen is in its place.

        The pen costs one access while it is held.

        Raises:
            MotorNotFound: naming the motor.
            PenDisplaced: saying by how much.
        """
        self._check_pen()
        for motor in self._all:
            motor.check_plugged_in()

    def _check_next(self):
        # type: () -> None
        """Check the next motor in turn; a held pen by its angle."""
        self._checked = (self._checked + 1) % len(self._all)
        motor = self._all[self._checked]
        if motor is self.pen and self._pen_held_at is not None:
            self._check_pen()
        else:
            motor.check_plugged_in()

    def _check_pen(self):
        # type: () -> None
        """Raise PenDisplaced if a held pen has been turned."""
        if self.pen and self._pen_held_at is not None:
            offset = self.pen.angle() - self._pen_held_at
            if abs(offset) > MAX_PEN_OFFSET:
                raise PenDisplaced(self.pen, offset)

    def release_pen(self):
        # type: () -> None
        """Stop checking the pen's angle until it is held again."""
        self._pen_held_at = None

    def hold(self, motors):
        # type: (Sequence[Motor]) -> None
        """Stop these motors; each holds its position."""
        for motor in motors:
            motor.hold()
            if motor is self.pen:
                self._pen_held_at = motor.angle()
        self.loop.reset(motors)

    def halt(self):
        # type: () -> Optional[Exception]
        """Stop and hold every motor that still answers; return the first error, or None."""
        lost = None  # type: Optional[Exception]
        self.release_pen()  # from now on it is held wherever it is
        # All motors stand before any is tidied up: an access may be slow.
        for act in ("brake", "clamp", "disengage"):
            for motor in self._all:
                try:
                    getattr(motor, act)()
                except Exception as error:  # one motor's trouble must not keep the next one running
                    lost = lost or error
        self.loop.reset(self._all)
        return lost
