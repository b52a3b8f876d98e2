"""The control loop: motors follow a timed plan, and faults end it.

Per motor and tick there is one access to read and at most two to set.  The loop never stops a
motor: its caller does, and the motors' own dead-man.
"""

import gc
import math

from robot.ev3.motors import DEAD_MAN
from robot.motion.axis import LONG_SETTLING, STOP_STEPS, TOLERANCES, Axis
from robot.motion.joint_controller import ALONG_WEIGHT
from robot.motion.motor_model import STIFFNESS
from robot.motion.online_trajectory import STOP
from robot.motion.pace import HOPELESS_TICKS, MIN_PERIOD, LoopTiming
from robot.motion.settling import STANDSTILL_TIME
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Callable, Dict, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.axis import Tolerances  # noqa: F401
    from robot.motion.backlash import Bounds  # noqa: F401
    from robot.motion.interfaces import MotorPlan  # noqa: F401
    from robot.motion.joint_controller import JointController  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401

    Controllers = Dict[Motor, JointController]
    # By the plan's time, the clock's and the motors' angles.
    OnTick = Callable[[float, float, List[float]], object]
    Weigh = Callable[[List[float]], Sequence[float]]  # from the motors' angles, rad, to Nm
    Spare = Callable[[float], object]  # until when there is time, s

CHECK_PERIOD = 0.1
"""Period of the checks that a motor, the next in turn, is plugged in, and the pen in place, s."""

STALL_TIMEOUT = 0.5
"""Longest time without a count under full feedback, s: then it is blocked or its encoder dead."""

START_TIME = 0.1
"""Time from the start of a motion without spare time, s: a longer tick would lengthen the push
that sets a joint going through its backlash."""

IDLE_SHARE, SPARE_TIME = 0.15, 0.016
"""Share of a period that is left to the system; and spare time of a tick, s: a longer period leaves
more of the processor to whatever uses it."""

BRAKING_TIME = 0.05
"""Time whose travel at the present speed a joint needs to stop, s."""

UNBOUNDED = -math.inf, math.inf, math.inf
"""Bounds of a motor without limits: lower, upper, fastest, rad and rad/s."""

CREEP_GAIN = 4.0
"""Gain from the error at rest to a speed towards the end, 1/s."""


class Stalled(ArmError):
    """A motor that does not turn as it is driven.

    Args:
        motor: JointMotor.
        missing: the evidence, for people.
        angle: least angle that a free joint would have turned, rad; 0 where unknown.
        turning: whether it counts, but too slowly.

    Attributes:
        motor, angle, turning: as given.
        fact: first part of the message, for people.
    """

    def __init__(self, motor, missing, angle=0.0, turning=False):
        # type: (Motor, str, float, bool) -> None
        self.motor, self.angle, self.turning = motor, angle, turning
        self.fact = "the {} (port {}) does not turn as it is driven, {}".format(
            motor.name, motor.port, missing
        )
        super(Stalled, self).__init__(
            self.fact + ": it is blocked, overloaded or its encoder is dead; free it, check the "
            "cable, then home"
        )

    def mention_battery(self, clock):
        # type: (Timepiece) -> None
        """Add to the message that the battery is flat, if so: it makes motors slow."""
        from robot.ev3 import battery  # not above: only now it is needed

        volts = battery.flat(clock)
        if volts is None:
            return
        if self.turning:
            fact = self.fact.replace("does not turn as it is driven", "turns, but too slowly")
            text = "{}: {}, then home".format(fact, battery.ADVICE)
        else:
            text = "{}; and {}".format(self, battery.ADVICE)
        self.args = (text.format(volts),)


class TooSlow(ArmError):
    """A brick that does not keep up with the control loop.

    Args:
        seconds: time of the tick, s.
        missing: more for the message.
    """

    def __init__(self, seconds, missing=""):
        # type: (float, str) -> None
        super(TooSlow, self).__init__(
            "the brick is too slow: a control tick took {:.2f} s{}; end other programs on the brick"
            "".format(seconds, missing)
        )


class OutOfBounds(ArmError):
    """A set-point outside the bounds of its joint."""


class ControlLoop(object):
    """The loop of one arm.

    Args:
        clock: has `now()` and `sleep(seconds)`.
        controllers: JointMotor -> JointController.
        check: called every CHECK_PERIOD; raises if a motor is unplugged or the pen displaced.
        report: called with a line for people on its timing.

    Attributes:
        pace: LoopTiming.
        plan_time: the plan's time, s.
    """

    def __init__(self, clock, controllers, check, report):
        # type: (Timepiece, Controllers, Callable[[], object], ReportLine) -> None
        self._clock = clock
        self._controllers = controllers
        self._check = check
        self.pace = LoopTiming(report)
        self.plan_time = 0.0

    def reset(self, motors):
        # type: (Sequence[Motor]) -> None
        """Reset the controllers of motors that were stopped."""
        for motor in motors:
            self._controllers[motor].reset()

    def run(
        self,
        motors,  # type: Sequence[Motor]
        plan,  # type: MotorPlan
        tolerances=TOLERANCES,  # type: Tolerances
        on_tick=None,  # type: Optional[OnTick]
        weigh=None,  # type: Optional[Weigh]
        spare=None,  # type: Optional[Spare]
        bounds=None,  # type: Optional[Sequence[Bounds]]
    ):
        # type: (...) -> bool
        """Let `motors` follow `plan` to its end; they are driven still when this returns.

        Meanwhile no garbage is collected, which would take five ticks.

        Args:
            motors: JointMotors with a controller, in the order of the plan's angles.
            plan: interfaces.MotorPlan: JointMove, BacklashCompensation, OnlineTrajectory.
            tolerances: Tolerances.
            on_tick: called in every tick with the plan's time (s), the clock's (s) and the motors'
                angles as just observed (rad); if it returns STOP, the motion is over, and an error
                that it raises goes on.
            weigh: from the motors' angles (rad) to the torques of the weights that they carry, Nm;
                None: unknown.
            spare: called in every tick after the motors were driven with the time (s) until which
                the loop is idle; None: nothing uses that time.
            bounds: per motor, (lower, upper, fastest) of its set-points, rad and rad/s; None: any.

        Returns:
            Whether it came to the end of the plan.

        Raises:
            Stalled, TooSlow, OutOfBounds, MotorNotFound: with the motors driven still, for DEAD_MAN
                at most.
        """
        settle = tolerances.settle
        settle = max(settle, min(LONG_SETTLING, settle * self.pace.period / MIN_PERIOD))
        axes = [
            Axis(motor, self._controllers[motor], tolerances, settle, own)
            for motor, own in zip(motors, bounds or [UNBOUNDED] * len(motors))
        ]
        for axis, begin in zip(axes, plan.at(-plan.before)[0]):
            # A motor that begins beyond a limit may come back.
            axis.lower, axis.upper = min(axis.lower, begin), max(axis.upper, begin)
        collecting = gc.isenabled()
        gc.disable()
        try:
            return self._run(axes, plan, on_tick, weigh, spare)
        finally:
            if collecting:
                gc.enable()

    def _run(self, axes, plan, on_tick, weigh, spare):
        # type: (List[Axis], MotorPlan, Optional[OnTick], Optional[Weigh], Optional[Spare]) -> bool
        now_of, sleep, pace = self._clock.now, self._clock.sleep, self.pace
        # (Looked up once: a tick has little time.)
        read, watch, drive = self._read, self._watch, self._drive
        for axis in axes:
            axis.motor.engage(STIFFNESS)
        due = began = now = check_at = now_of()
        for axis in axes:
            axis.slack_at = now
        pace.begin()
        delay = None  # type: Optional[float]
        t = -plan.before
        t_ahead = t + pace.rate * pace.lead
        last = plan.speeds(t_ahead)
        while True:
            before = now
            angles, now = read(axes, now_of)
            if delay != pace.delay:
                delay = pace.delay
                for axis in axes:
                    axis.controller.delay = delay
            rate = pace.rate
            self.plan_time = t = t + rate * (now - before)
            if on_tick and on_tick(t, now, angles) is STOP:
                return False
            if weigh:
                for axis, torque in zip(axes, weigh(angles)):
                    axis.controller.carry(torque)
            q, path = plan.at(t)
            errors, settled = watch(axes, plan, t, now, q, angles)
            if settled and t > plan.duration:
                return True
            # Watching takes time, by which this command comes later.
            before_ahead, t_ahead = t_ahead, t + rate * (now_of() - now + pace.lead)
            speeds = plan.speeds(t_ahead)
            if path:
                self._weigh_along(errors, path)
            drive(axes, plan, t, q, errors, speeds, last, t_ahead - before_ahead)
            last = speeds
            end = now_of()
            if end > check_at:
                self._check()
                check_at = end + CHECK_PERIOD
            # The plan goes by the clock, so that a late tick costs accuracy only.
            due = max(due + pace.period, end)
            computing = end - began
            if spare and t > START_TIME:
                spare(due - IDLE_SHARE * pace.period)
                end = now_of()
                pace.add_spare(max(0.0, end - due) + SPARE_TIME)
            since = max(due, end) - began
            pace.update(end, since, computing)
            if pace.slow == HOPELESS_TICKS or since > DEAD_MAN:
                raise TooSlow(since)
            sleep(due - end)
            began = now_of()

    def _read(self, axes, now_of):
        # type: (List[Axis], Callable[[], float]) -> Tuple[List[float], float]
        """Read all encoders; return the observed angles, rad, and the time of the last reading, s.

        Raises:
            Stalled: counts are missing that a free joint would give.
        """
        angles = []
        for axis in axes:
            controller = axis.controller
            low, high = axis.bounds()
            read_at = now_of()
            controller.observe(read_at, low, high)
            if low != axis.seen:
                axis.seen, axis.stands_since = low, read_at
            elif controller.stall.stalled and not self._may_be_late(axis, read_at):
                raise self._tracking_failure(axis, controller.stall.missing, read_at)
            angles.append(controller.angle)
        return angles, read_at

    def _watch(self, axes, plan, t, now, q, angles):
        # type: (List[Axis], MotorPlan, float, float, Vector, Vector) -> Tuple[List[float], bool]
        """Compare the joints' `angles` with the set-points `q` (rad) at the plan's time `t` (s).

        Returns:
            (Error of each, rad; whether all have settled at their end.)

        Raises:
            Stalled, TooSlow: an error is too large.
        """
        errors, settled = [], True
        for axis, angle, wanted, since in zip(axes, angles, q, plan.rests_from):
            error = wanted - angle
            errors.append(error)
            most = axis.max_error
            if not -most < error < most:
                # A joint that turns may lag in proportion to the length of a tick.
                lag = most * self.pace.period / MIN_PERIOD
                if now - axis.stands_since > STANDSTILL_TIME or not -lag < error < lag:
                    raise self._tracking_failure(axis, error, now)
            full = axis.controller.full_error
            if -full < error < full or t > since:  # at rest friction may hold it
                axis.slack_at = now
            elif now - axis.slack_at > STALL_TIMEOUT and now - axis.stands_since > STALL_TIMEOUT:
                raise self._tracking_failure(axis, error, now)
            settling = axis.settling
            if t <= since:
                settled = False
                if settling.begun:
                    settling.begin_again()
            else:
                if not settling.update(now, t - since, axis.seen, error):
                    if not self.pace.is_coarse(now):
                        raise self._tracking_failure(axis, error, now)
                    settling.over = True  # so slow a loop gets it no nearer
                settled = settled and settling.over
        return errors, settled

    def _drive(self, axes, plan, t, q, errors, speeds, last, step):
        # type: (List[Axis], MotorPlan, float, Vector, Vector, Vector, Vector, float) -> None
        """Give every motor its command at the plan's time `t` (s).

        The set-points `q` and the `errors` (rad) are those of `t`; the `speeds` (rad/s) are ahead
        of it by the lead, and `last` are those of `step` s of the plan's time before them.

        Raises:
            OutOfBounds: a set-point that a joint may not have.
        """
        rate, over = self.pace.rate, t > plan.duration
        for axis, wanted, error, speed, before, since in zip(
            axes, q, errors, speeds, last, plan.rests_from
        ):
            if not over and axis.settling.over:
                # Driven for long, a joint at rest would hunt: its encoder is too coarse.
                if axis.held < STOP_STEPS:
                    axis.stop_by_a_step()
                axis.controller.reset()
                continue
            axis.held = 0
            most = axis.fastest
            if (
                not -most <= speed <= most
                or not axis.lower <= wanted + BRAKING_TIME * speed <= axis.upper
            ):
                raise _out_of_bounds(axis, wanted, speed)
            acceleration = (speed - before) / step if step > 0 else 0.0
            # At rest the end is approached by a creeping speed: friction stops a small push.
            if t > since:
                speed += CREEP_GAIN * error
            if rate != 1.0:
                speed *= rate
                acceleration *= rate * rate
            axis.drive(axis.command(error, speed, acceleration))

    def _tracking_failure(self, axis, error, now):
        # type: (Axis, float, float) -> ArmError
        """Return the error to raise for a joint that is off by `error` (rad)."""
        missing = "{:.1f} deg are missing".format(abs(math.degrees(error)))
        if self._may_be_late(axis, now):
            return TooSlow(self.pace.latest, ", and of the {} {}".format(axis.motor.name, missing))
        turning = now - axis.stands_since < self.pace.period / 2  # it has just counted
        return Stalled(axis.motor, missing, max(0.0, axis.controller.stall.missing), turning)

    def _may_be_late(self, axis, now):
        # type: (Axis, float) -> bool
        """Return whether late ticks may explain a joint's error.

        A motor turns without ticks, but its set-point changes only by them.
        """
        return self.pace.was_late(now) and now - axis.stands_since < STANDSTILL_TIME

    @staticmethod
    def _weigh_along(errors, path):
        # type: (List[float], Tuple[Vector, Vector]) -> None
        """Weigh the errors' part along the path less, in place: straightness before timing."""
        across, slopes = path
        along = 0.0
        for a, error in zip(across, errors):
            along += a * error
        along *= 1 - ALONG_WEIGHT
        for k, slope in enumerate(slopes):
            errors[k] -= along * slope


def _out_of_bounds(axis, angle, speed):
    # type: (Axis, float, float) -> OutOfBounds
    """Return the error for a set-point of `angle` (rad) and `speed` (rad/s)."""
    return OutOfBounds(
        "the {} was to be at {:.1f} deg and {:.0f} deg/s, and its bounds are {:.1f} to {:.1f} deg "
        "and {:.0f} deg/s: the motion was ended; ask for less".format(
            axis.motor.name,
            *[math.degrees(x) for x in (angle, speed, axis.lower, axis.upper, axis.fastest)]
        )
    )  # fmt: skip
