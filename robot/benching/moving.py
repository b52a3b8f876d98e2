"""Motors turned to and fro at several speeds, and joints against their stops.

Every set-point is renewed, so that a motor stops by itself when the program dies (DEAD_MAN).
"""

import math

from robot.benching.figures import Pass, figures
from robot.ev3.motors import DEAD_MAN, JointMotor
from robot.motion import kinematics, stops
from robot.motion.backlash import APPROACH_ACCELERATION, APPROACH_SPEED
from robot.motion.control_loop import Stalled
from robot.motion.joint_controller import GAINS
from shared.arm_keys import MOTOR_SPEEDS, PULLED_DOWN

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Optional, Tuple  # noqa: F401

    from robot.benching.figures import Figures  # noqa: F401
    from robot.clock import Clock  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

SPEED_LEVELS = (0.3, 0.5, 0.75, 1.0)
"""Speeds of the passes, as shares of the fastest."""

MAX_SPEED_SHARE = 0.9
"""Speed of the fastest pass, as a share of what the arm file allows."""

MAX_BARE_SPEED_SHARE = 0.8
"""Speed of a bare motor's fastest pass below full duty, as a share of what it can do."""

STIFFNESS, FULL_DUTY_STIFFNESS = 0.3, 1.0
"""Duty that the driver gives per difference between set and measured speed, % per deg/s: in a pass;
and such that the greatest set-point means full duty."""

SPEED_UP_TIME, SLOW_DOWN_TIME, MIN_STEADY_TIME = 0.5, 0.5, 0.7
"""Times of a pass, s: until it is steady, for braking at its end, and the least time between.  The
first two are equal, so that in both directions gravity is the same in the mean."""

BARE_STEADY_TIME, MAX_PASS_TIME, MAX_LOADED_PASS_TIME = 1.5, 4.0, 10.0
"""Time for which a bare motor is measured, s; and longest pass of a joint, s, not loaded and loaded
by gravity."""

RENEWAL_PERIOD = DEAD_MAN / 4
STILL_TIME, REST_TIMEOUT = 0.15, 1.0
"""Time without a count after which a braked motor stands, s; and longest wait for that, s."""

BLOCKED_TIME = 0.15
"""Time without a count after which a driven motor is blocked, s."""

LIMIT_CLEARANCE, TABLE_CLEARANCE = math.radians(5), 2.0
"""Least distance of joints from their limits, rad, and of links in space from the table, cm."""

TAKE_UP_ANGLE = math.radians(8)
"""Angle by which a joint first turns gently in a pass's direction, rad, to take up backlash."""

MAX_SWING = math.radians(30)
"""Greatest angle from its home pose of a joint that gravity loads, rad."""

TOUCHES = 3
"""Number of touches of a stop that count, after a first one."""
LEAVING_DUTY = 15.0
"""Duty with which a motor leaves a stop, %."""

MIN_FREE_COUNTS = 1.5
"""Least backlash, counts, in which a motor moves alone long enough for its place to be found."""


def describe(description, k):
    # type: (Arm, int) -> str
    """Return words for people about what joint `k` will do."""
    joint = description.joints[k]
    lower, upper = free_range(description, k)
    return "{} (port {}): {:.0f} to {:.0f} deg, at most {:.0f} deg/s{}".format(
        joint.name,
        joint.port,
        math.degrees(lower),
        math.degrees(upper),
        math.degrees(fastest_of(description, k)),
        "; then gently against both stops" if joint.seek == "both" else "",
    )


def is_loaded(description, k):
    # type: (Arm, int) -> bool
    """Return whether gravity turns joint `k`."""
    return description.chain in PULLED_DOWN and k > 0


def free_range(description, k):
    # type: (Arm, int) -> Tuple[float, float]
    """Return the least and greatest angle of joint `k` while the others are at home, rad."""
    joint = description.joints[k]
    home = [each.home for each in description.joints]
    lower, upper = joint.lower + LIMIT_CLEARANCE, joint.upper - LIMIT_CLEARANCE
    if not is_loaded(description, k):
        return lower, upper
    lower, upper = max(lower, joint.home - MAX_SWING), min(upper, joint.home + MAX_SWING)

    def is_clear(angle):
        # type: (float) -> bool
        q = home[:k] + [angle] + home[k + 1 :]
        places = kinematics.joint_positions(description, q)[1:]
        return min(p[-1] for p in places) > TABLE_CLEARANCE

    ends = []
    for end in (lower, upper):
        angle, step = joint.home, math.copysign(math.radians(1), end - joint.home)
        while abs(end - angle) > abs(step) and is_clear(angle + step):
            angle += step
        ends.append(angle)
    return ends[0], ends[1]


def fastest_of(description, k):
    # type: (Arm, int) -> float
    """Return the speed of joint `k` in its fastest pass, rad/s."""
    lower, upper = free_range(description, k)
    return min(
        MAX_SPEED_SHARE * description.joints[k].max_speed,
        (upper - lower - TAKE_UP_ANGLE) / (SPEED_UP_TIME + MIN_STEADY_TIME + SLOW_DOWN_TIME),
    )


class Bench(object):
    """A bench on which motors are turned and measured.

    Args:
        clock: has `now()` and `sleep(seconds)`.
        volts: called for the battery's voltage, V.
    """

    def __init__(self, clock, volts):
        # type: (Clock, Callable[[], float]) -> None
        self._clock = clock
        self._volts = volts

    def joint(self, arm, k):
        # type: (RobotArm, int) -> Figures
        """Measure joint `k` of a RobotArm whose zero is known; it ends in its home pose.

        Returns:
            dict, see `figures`, with "backlash_deg" where there are two stops.

        Raises:
            Stalled, MotorNotFound, stops.Blocked: the caller stops the arm.
        """
        description = arm.description
        motor, joint = arm.joints[k], description.joints[k]
        home = [each.home for each in description.joints]
        lower, upper = free_range(description, k)
        braking = not is_loaded(description, k)
        pairs = []
        for level in SPEED_LEVELS:
            speed = level * fastest_of(description, k)
            room = speed * SLOW_DOWN_TIME
            asked = (
                math.radians(_setpoint_for(math.degrees(speed) * joint.gear, joint.motor))
                / joint.gear
            )
            pair = []
            for sign, start, end in ((1, lower, upper - room), (-1, upper, lower + room)):
                for begin in (start, start + sign * TAKE_UP_ANGLE):
                    gently = (
                        (APPROACH_SPEED, [APPROACH_ACCELERATION] * len(home))
                        if begin != start
                        else ()
                    )
                    arm.go_to(home[:k] + [begin] + home[k + 1 :], *gently)
                with arm.lend_motors():
                    pair.append(
                        self._pass(motor, joint.gear, sign * asked, STIFFNESS, end, braking)
                    )
            pairs.append(pair)
        arm.go_to(home)
        found = figures(pairs, joint.motor)
        if joint.seek == "both":
            with arm.lend_motors():
                found.update(self._backlash(arm, k))
            arm.go_to(home)
        return found

    def bare(self, port, kind):
        # type: (str, str) -> Figures
        """Measure a motor that turns nothing, for some turns to and fro.

        Returns:
            dict, see `figures`; its last speed is that of full duty.

        Raises:
            Stalled, MotorNotFound: after stopping it.
        """
        motor = JointMotor("bare motor", port, kind, 1.0, 1)
        fastest = MAX_BARE_SPEED_SHARE * 100 * GAINS[kind].speed_per_duty
        passes = [(_setpoint_for(level * fastest, kind), STIFFNESS) for level in SPEED_LEVELS]
        try:
            pairs = [
                [
                    self._pass(motor, 1.0, sign * math.radians(asked), stiffness, None, True)
                    for sign in (1, -1)
                ]
                for asked, stiffness in passes + [(MOTOR_SPEEDS[kind], FULL_DUTY_STIFFNESS)]
            ]
        finally:
            motor.brake()
            motor.disengage()
        return figures(pairs, kind)

    def _pass(self, motor, gear, setpoint, stiffness, end, braking):
        # type: (Motor, float, float, float, Optional[float], bool) -> Pass
        """Turn in one direction, and return a Pass.

        Args:
            motor: robot.ev3.motor.Motor.
            gear: motor turns per joint turn.
            setpoint: speed, rad/s at the joint; its sign is the direction.
            stiffness: see Motor.engage.
            end: angle at which it ends, rad; None: after BARE_STEADY_TIME seconds.
            braking: whether it is braked at its end, and not held.
        """
        now_of = self._clock.now
        longest = MAX_PASS_TIME if braking else MAX_LOADED_PASS_TIME
        if end is None:
            longest = SPEED_UP_TIME + BARE_STEADY_TIME
        sign = math.copysign(1.0, setpoint)
        motor.engage(stiffness)
        last = rested = motor.angle()
        # Where the reading changed: (s, rad); and (s, %).
        steps, duties = [], []  # type: List[Tuple[float, float]], List[Tuple[float, float]]
        motor.drive(setpoint)
        began = since = renewed = now_of()
        while True:
            angle, t = motor.angle(), now_of()
            if angle != last:
                last, since = angle, t
                # In this direction it is now where this reading begins.
                steps.append((t, angle - sign * motor.resolution / 2))
            elif t - since > BLOCKED_TIME:
                raise Stalled(motor, "it stands")
            duties.append((now_of(), motor.duty()))
            if t - began > longest or (end is not None and sign * (angle - end) >= 0):
                break
            if t - renewed >= RENEWAL_PERIOD:
                motor.drive(setpoint)
                renewed = t
        volts = self._volts()
        if braking:
            motor.brake()
        else:
            motor.hold()
        stopped = now_of()
        rest = self._come_to_rest(motor, stopped)
        motor.hold()
        motor.disengage()
        seen = [(t, angle) for t, angle in steps if t - began > SPEED_UP_TIME]
        if len(seen) < 3:
            raise Stalled(motor, "in {:.1f} s it moved too little".format(stopped - began))
        (t_first, first), (t_last, last_step) = seen[0], seen[-1]
        speed = (last_step - first) / (t_last - t_first)
        pushed = [duty for t, duty in duties if t_first <= t <= t_last]
        duty = sum(pushed) / len(pushed)
        extra, t_before, before = 0.0, began, duties[0][1]
        for t, pushes in duties:
            if t <= t_first:
                extra += ((pushes + before) / 2 - duty) * (t - t_before)
                t_before, before = t, pushes
        behind = speed * (t_first - began) - (first - rested)
        angle = rest - last_step - speed * (stopped - t_last)
        return Pass(
            gear * abs(speed),
            sign * duty,
            volts,
            gear * sign * behind,
            sign * extra,
            gear * sign * angle if braking else None,
        )

    def _come_to_rest(self, motor, stopped):
        # type: (Motor, float) -> float
        """Return the angle where a motor stands that was stopped at the time `stopped` (s), rad."""
        now_of = self._clock.now
        last, since = motor.angle(), stopped
        while True:
            angle, t = motor.angle(), now_of()
            if angle != last:
                last, since = angle, t
            elif t - since > STILL_TIME:
                return angle
            if t - stopped > REST_TIMEOUT:
                raise Stalled(motor, "stopped, it turns on")

    def _backlash(self, arm, k):
        # type: (RobotArm, int) -> Dict[str, float]
        """Measure the backlash of a joint: the turn of its motor from stop to stop less the link's.

        Returns:
            dict: "backlash_deg", and its accuracy "backlash_within_deg"; the stops are taken to be
            where the arm file has them.
        """
        motor, joint = arm.joints[k], arm.description.joints[k]
        fine, coarse = [], []
        for sign in (-1, 1):
            touches = []
            for _ in range(1 + TOUCHES):
                at = stops.push(arm, motor, joint, sign, stops.SEARCH_PUSH)
                touches.append(
                    ((at - motor.zero) / motor.in_counts(1.0), self._leave(arm, k, sign))
                )
                stops.back_off(arm, motor, at, sign)
            stands, leaves = zip(*touches[1:])  # the first one came from afar
            if max(stands) - min(stands) > stops.MAX_TOUCH_SPREAD * motor.resolution:
                raise stops.Blocked(
                    "the {}'s stop was found at places {:.1f} deg apart; clear its way".format(
                        joint.name, math.degrees(max(stands) - min(stands))
                    )
                )
            coarse.append(sum(stands) / TOUCHES)
            fine.append(sum(leaves) / TOUCHES)
        assert joint.stop_lower is not None  # of joints with two stops alone
        assert joint.stop_upper is not None
        between = joint.stop_upper - joint.stop_lower
        backlash, within = fine[1] - fine[0] - between, 0.2
        if backlash < MIN_FREE_COUNTS * motor.resolution:
            # The motor met the link before its acceleration was known.
            backlash, within = max(0.0, coarse[1] - coarse[0] - between), 1.0
        return {
            "backlash_deg": round(math.degrees(backlash), 3),
            "backlash_within_deg": round(math.degrees(within * motor.resolution), 3),
        }

    def _leave(self, arm, k, sign):
        # type: (RobotArm, int, int) -> float
        """Return the angle where at its stop a motor stood, rad, finer than its encoder counts.

        From rest, with a constant duty, it gets f(t) = t - lag (1 - exp(-t / lag)), see _gone. The
        first count comes at t1, the second at t2, one count later: so the first was
        f(t1) / (f(t2) - f(t1)) counts away. The unknown final speed drops out.
        """
        now_of, motor, joint = self._clock.now, arm.joints[k], arm.description.joints[k]
        nearest = motor.bounds()[0 if sign > 0 else 1]
        motor.engage(stops.PUSH_STIFFNESS)
        last = motor.counts()
        motor.drive(-sign * math.radians(LEAVING_DUTY / stops.PUSH_STIFFNESS) / joint.gear)
        began = before = now_of()
        times = []  # type: List[float]
        while len(times) < 2 and before - began < RENEWAL_PERIOD * 3:
            counts, t = motor.counts(), now_of()
            if counts != last:
                last = counts
                times.append((before + t) / 2 - began)
            before = t
        motor.hold()
        motor.disengage()
        if len(times) < 2:
            raise Stalled(motor, "it does not leave its stop")
        first, second = (_travelled(t, GAINS[joint.motor].lag) for t in times)
        return nearest + sign * motor.resolution * min(1.0, first / (second - first))


def _setpoint_for(speed, kind):
    # type: (float, str) -> float
    """Return the set-point at which a motor turns with a speed, both deg/s: the driver lags."""
    gains = GAINS[kind]
    return speed + (speed / gains.speed_per_duty + gains.friction) / STIFFNESS


def _travelled(t, lag):
    # type: (float, float) -> float
    """Return how far a motor of first-order lag (s) gets in `t` s from rest, over its speed, s."""
    return t - lag * (1 - math.exp(-t / lag))
