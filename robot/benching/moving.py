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

LEVELS = (0.3, 0.5, 0.75, 1.0)
"""The speeds of the passes, as shares of the fastest."""

FASTEST = 0.9
"""The fastest pass, as a share of what the arm file allows."""

BARE_FASTEST = 0.8
"""The same of a bare motor, of what it can do; it goes at full duty, too."""

STIFFNESS, HARD = 0.3, 1.0
"""The driver's push on the difference between set and seen speed, % per deg/s: in a pass; and so
that the greatest set-point means full duty."""

SPEEDING_UP, SLOWING_DOWN, STEADY = 0.5, 0.5, 0.7
"""Times of a pass, s: until it is steady, what is left for braking at its end, and what must at
least lie between.  The first two alike, so that both ways gravity is the same in the mean."""

BARE_STEADY, LONGEST, LOADED_LONGEST = 1.5, 4.0, 10.0
"""How long a bare motor is looked at, s; and no pass of a joint takes longer, s."""

RENEWED = DEAD_MAN / 4
STILL, COMES_TO_REST = 0.15, 1.0
"""A braked motor that has not moved for so long stands, s; it has so long for that."""

BLOCKED = 0.15
"""A driven motor that has not moved for so long is blocked, s."""

CLEAR, ABOVE_TABLE = math.radians(5), 2.0
"""Joints keep so far from their limits, rad, and links in space from the table, cm."""

TAKING_UP = math.radians(8)
"""Before a pass a joint turns so far the same way, gently: then all play is taken up, rad."""

SWING = math.radians(30)
"""A joint that gravity loads is turned no farther from its home pose, rad."""

TOUCHES = 3
LEAVING = 15.0
"""Push with which a motor leaves a stop, % of duty."""

LEAST_FREE = 1.5
"""Counts of play within which a motor must move alone to tell where it stood at its stop."""


def describe(description, k):
    # type: (Arm, int) -> str
    """Words for people: what joint `k` will do."""
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
    """Whether gravity turns joint `k`."""
    return description.chain in PULLED_DOWN and k > 0


def free_range(description, k):
    # type: (Arm, int) -> Tuple[float, float]
    """Where joint `k` may go while the others are at home, rad."""
    joint = description.joints[k]
    home = [each.home for each in description.joints]
    lower, upper = joint.lower + CLEAR, joint.upper - CLEAR
    if not is_loaded(description, k):
        return lower, upper
    lower, upper = max(lower, joint.home - SWING), min(upper, joint.home + SWING)

    def is_clear(angle):
        # type: (float) -> bool
        q = home[:k] + [angle] + home[k + 1 :]
        places = kinematics.joint_positions(description, q)[1:]
        return min(p[-1] for p in places) > ABOVE_TABLE

    ends = []
    for end in (lower, upper):
        angle, step = joint.home, math.copysign(math.radians(1), end - joint.home)
        while abs(end - angle) > abs(step) and is_clear(angle + step):
            angle += step
        ends.append(angle)
    return ends[0], ends[1]


def fastest_of(description, k):
    # type: (Arm, int) -> float
    """The speed of joint `k` in its fastest pass, rad/s."""
    lower, upper = free_range(description, k)
    return min(
        FASTEST * description.joints[k].max_speed,
        (upper - lower - TAKING_UP) / (SPEEDING_UP + STEADY + SLOWING_DOWN),
    )


class Bench(object):
    """Turns motors and sees what they do.

    Args:
        clock: has `now()` and `sleep(seconds)`.
        volts: gives the battery's voltage, V.
    """

    def __init__(self, clock, volts):
        # type: (Clock, Callable[[], float]) -> None
        self._clock = clock
        self._volts = volts

    def joint(self, arm, k):
        # type: (RobotArm, int) -> Figures
        """Measure joint `k` of a RobotArm whose zero is known; it ends where its home is.

        Returns:
            dict, see `figures`, with "backlash_deg" where two stops tell it.

        Raises:
            Stalled, MotorNotFound, stops.Blocked: the caller stops the arm.
        """
        description = arm.description
        motor, joint = arm.joints[k], description.joints[k]
        home = [each.home for each in description.joints]
        lower, upper = free_range(description, k)
        braking = not is_loaded(description, k)
        pairs = []
        for level in LEVELS:
            speed = level * fastest_of(description, k)
            room = speed * SLOWING_DOWN
            asked = math.radians(_asked(math.degrees(speed) * joint.gear, joint.motor)) / joint.gear
            pair = []
            for sign, start, end in ((1, lower, upper - room), (-1, upper, lower + room)):
                for begin in (start, start + sign * TAKING_UP):
                    gently = (APPROACH_SPEED, APPROACH_ACCELERATION) if begin != start else ()
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
        fastest = BARE_FASTEST * 100 * GAINS[kind].speed_per_duty
        ways = [(_asked(level * fastest, kind), STIFFNESS) for level in LEVELS]
        try:
            pairs = [
                [
                    self._pass(motor, 1.0, sign * math.radians(asked), stiffness, None, True)
                    for sign in (1, -1)
                ]
                for asked, stiffness in ways + [(MOTOR_SPEEDS[kind], HARD)]
            ]
        finally:
            motor.brake()
            motor.disengage()
        return figures(pairs, kind)

    def _pass(self, motor, gear, setpoint, stiffness, end, braking):
        # type: (Motor, float, float, float, Optional[float], bool) -> Pass
        """Turn one way at a set-point, rad/s at the joint, up to the angle `end`; a Pass."""
        now_of = self._clock.now
        longest = LONGEST if braking else LOADED_LONGEST
        if end is None:
            longest = SPEEDING_UP + BARE_STEADY
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
                # Coming this way it is now where this reading begins.
                steps.append((t, angle - sign * motor.resolution / 2))
            elif t - since > BLOCKED:
                raise Stalled(motor, "it stands")
            duties.append((now_of(), motor.duty()))
            if t - began > longest or (end is not None and sign * (angle - end) >= 0):
                break
            if t - renewed >= RENEWED:
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
        seen = [(t, angle) for t, angle in steps if t - began > SPEEDING_UP]
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
        way = rest - last_step - speed * (stopped - t_last)
        return Pass(
            gear * abs(speed),
            sign * duty,
            volts,
            gear * sign * behind,
            sign * extra,
            gear * sign * way if braking else None,
        )

    def _come_to_rest(self, motor, stopped):
        # type: (Motor, float) -> float
        """Where a motor that was stopped at that time stands in the end, rad."""
        now_of = self._clock.now
        last, since = motor.angle(), stopped
        while True:
            angle, t = motor.angle(), now_of()
            if angle != last:
                last, since = angle, t
            elif t - since > STILL:
                return angle
            if t - stopped > COMES_TO_REST:
                raise Stalled(motor, "stopped, it turns on")

    def _backlash(self, arm, k):
        # type: (RobotArm, int) -> Dict[str, float]
        """The play of a joint: what its motor turns from stop to stop beside the link.

        Returns:
            dict: "backlash_deg", and "backlash_within_deg", how well that is known; the stops are
            taken to be where the arm file has them.
        """
        motor, joint = arm.joints[k], arm.description.joints[k]
        fine, coarse = [], []
        for sign in (-1, 1):
            touches = []
            for _ in range(1 + TOUCHES):
                at = stops.push(arm, motor, joint, sign, stops.FIRST_PUSH)
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
        play, within = fine[1] - fine[0] - between, 0.2
        if play < LEAST_FREE * motor.resolution:
            # The link was in the way before the motor had told how fast it speeds up.
            play, within = max(0.0, coarse[1] - coarse[0] - between), 1.0
        return {
            "backlash_deg": round(math.degrees(play), 3),
            "backlash_within_deg": round(math.degrees(within * motor.resolution), 3),
        }

    def _leave(self, arm, k, sign):
        # type: (RobotArm, int, int) -> float
        """Where at its stop a motor stood, rad, finer than its encoder counts.

        From there it speeds up evenly: how long it takes to the first count, and from that to the
        next, tells how far the first one was.
        """
        now_of, motor, joint = self._clock.now, arm.joints[k], arm.description.joints[k]
        nearest = motor.bounds()[0 if sign > 0 else 1]
        motor.engage(stops.PUSH_STIFFNESS)
        last = motor.counts()
        motor.drive(-sign * math.radians(LEAVING / stops.PUSH_STIFFNESS) / joint.gear)
        began = before = now_of()
        times = []  # type: List[float]
        while len(times) < 2 and before - began < RENEWED * 3:
            counts, t = motor.counts(), now_of()
            if counts != last:
                last = counts
                times.append((before + t) / 2 - began)
            before = t
        motor.hold()
        motor.disengage()
        if len(times) < 2:
            raise Stalled(motor, "it does not leave its stop")
        first, second = (_gone(t, GAINS[joint.motor].lag) for t in times)
        return nearest + sign * motor.resolution * min(1.0, first / (second - first))


def _asked(speed, kind):
    # type: (float, str) -> float
    """The set-point at which a motor turns with some speed, deg/s: the driver lags behind."""
    gains = GAINS[kind]
    return speed + (speed / gains.speed_per_duty + gains.friction) / STIFFNESS


def _gone(t, lag):
    # type: (float, float) -> float
    """How far a motor gets in `t` s from rest, in units of its final speed."""
    return t - lag * (1 - math.exp(-t / lag))
