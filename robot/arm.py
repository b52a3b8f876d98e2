"""An arm built from its description and its motors: where it is, go there, follow this, stop.

The only place that clamps to limits.  Every wait here has a deadline, every way out stops the
motors.
"""

import contextlib
import math

from robot import homing, kinematics
from robot.follower import ALONG, GAINS, LEAD, STIFFNESS, Follower
from robot.motors import DEAD_MAN, JointMotor
from robot.trajectory import JOINT_ACCELERATION, JointMove, TakingUpBacklash
from robot.zero import Zero
from shared.arm_description import ArmError

TICK = 0.02
"""Period of the control loop, s."""

SLOW_TICK, SLOW_TICKS = 0.06, 4
"""A tick longer than this (s) is slow; so many slow ones in a row control nothing."""

IDLE_CHECK = 20
"""Every so many ticks the motors that are not being driven are checked to be there."""

ASTRAY, ASTRAY_COUNTS = math.radians(3), 5
"""A joint this far (rad, and counts) from where it should be is blocked or blind."""

CRAWLING, NEARLY_SINGULAR = 0.5, 0.1
"""Below this speed of the tip (cm/s) or this singularity measure, across the path means nothing."""

SETTLE, UNHURRIED = 0.2, 0.8
"""Longest correction after the end of a path with the pen down, and of a move, s."""

FINE, COARSE = 0.4, 6.0
"""A joint has settled within this many counts; the pen."""

CREEP = 4.0
"""Speed towards the end of a path, per distance that is left, 1/s."""

RESTED = 3
"""Ticks for which it must have."""

STILL = 10
"""Ticks without a count after the end: what is left is held by friction, or the joint is blind."""

ARRIVED = 3
"""Times as far off after the settling time, it has not arrived."""

STEP_SPEED = math.radians(100)
"""The speed of the report's joint steps, rad/s."""

BEHIND, SLOWLY = math.radians(2), 0.3
"""A start is approached from the play and so much more (rad), at this share of full speed."""

GENTLE = math.radians(15)
"""Acceleration at which links do not leave the side of the play they are pushed by, rad/s^2."""

PEN_ASTRAY = math.radians(25)
PEN_SPEED, PEN_ACCELERATION = math.radians(400), math.radians(3000)
"""Greatest of the pen's motor, rad/s and rad/s^2."""

SETTLED_FOR = 0.06
SETTLE_DEADLINE = 0.4


class Stalled(ArmError):
    """A joint that does not move as it should."""


class TooSlow(ArmError):
    """The brick does not keep up with the control loop."""


class RobotArm(object):
    """The arm on this brick.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        zero: robot.zero.Zero, where the zero is remembered; the arm's own file if None.
        gains: robot.follower.Gains by kind of motor.

    Attributes:
        sides: per joint, on which side its play lies: +1 pushed in the positive direction last,
            -1 in the negative, 0 unknown.

    Raises:
        MotorNotFound: a motor of the description is not there.
    """

    def __init__(self, description, clock, zero=None, gains=GAINS):
        self.description = description
        self.clock = clock
        self.zero = zero or Zero(description.name)
        self.joints = [
            JointMotor(joint.name, joint.port, joint.motor, joint.gear, joint.direction)
            for joint in description.joints
        ]
        pen = description.pen
        self.pen = JointMotor("pen", pen.port, pen.motor, 1.0, 1) if pen else None
        self._motors = self.joints + ([self.pen] if pen else [])
        self._followers = {
            motor: Follower(joint.gear, gains[joint.motor])
            for motor, joint in zip(self.joints, description.joints)
        }
        if pen:
            self._followers[self.pen] = Follower(1.0, gains[pen.motor])
        self.sides = (0,) * len(self.joints)
        self._engaged = False
        self._standing = True
        self._homed = False

    # Where it is

    def counts(self):
        """The encoders' readings by port."""
        return {motor.port: motor.counts() for motor in self._motors}

    def wake(self):
        """Believe the remembered zero; from now on the arm is on record as moving.

        Raises:
            NotHomed: there is none, or the encoders contradict it.
        """
        zero = self.zero.confirmed(self.counts())
        for motor in self._motors:
            motor.zero = zero[motor.port]
        self._homed = True

    def angles(self):
        """Joint angles, rad, as the encoders have them, allowing for play as far as known."""
        return tuple(
            motor.angle() - side * joint.backlash / 2
            for motor, side, joint in zip(self.joints, self.sides, self.description.joints)
        )

    def position(self):
        """The tip, cm, as the encoders have it."""
        return kinematics.forward(self.description, self.angles())

    # Motion

    def _engage(self):
        """The arm is about to move, which goes on record."""
        self._standing = False
        if self._engaged:
            return
        self._engaged = True
        if self._homed:
            self.zero.save(self._zeros(), None)

    def _zeros(self):
        return {motor.port: motor.zero for motor in self._motors}

    def go_to(self, q, speed=1.0, acceleration=JOINT_ACCELERATION):
        """Move all joints together to `q` (rad), each at most at `speed` times its greatest.

        `acceleration` is the greatest of any joint, rad/s^2.

        Raises:
            kinematics.Unreachable: a joint angle past its limit; nothing has moved.
        """
        self.check(q)
        fastest = [speed * joint.max_speed for joint in self.description.joints]
        self.follow([JointMove(self.angles(), q, fastest, acceleration)], UNHURRIED)

    def check(self, q):
        """Refuse joint angles (rad) past the limits.

        Raises:
            kinematics.Unreachable: naming the joint, its angle and the limit.
        """
        for joint, angle in zip(self.description.joints, q):
            if not joint.lower - 1e-9 <= angle <= joint.upper + 1e-9:
                raise kinematics.Unreachable(
                    "the {} cannot go to {:.1f} deg: its limits are {:.1f} and {:.1f} deg; "
                    "choose another pose".format(
                        joint.name, *(math.degrees(a) for a in (angle, joint.lower, joint.upper))
                    )
                )

    def approach(self, motion):
        """Go to the start of `motion` from behind, so that all play is taken up its way."""
        behind = []
        for joint, start, direction in zip(
            self.description.joints, motion.start, motion.directions
        ):
            back = start - direction * (joint.backlash + BEHIND)
            behind.append(min(max(back, joint.lower), joint.upper))
        self.go_to(behind)
        self.go_to(motion.start, SLOWLY, GENTLE)

    def follow(self, motions, settle=SETTLE):
        """Let the links follow Trajectories or JointMoves, one after the other; end at rest, held.

        Args:
            settle: longest correction after each, s.

        Raises:
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        self._engage()
        with self._stopping_on_error():
            for motion in motions:
                plan = TakingUpBacklash(self.description.joints, motion, self.sides)
                self._track(self.joints, plan, settle, FINE)
                self.sides = plan.sides
            self._hold(self.joints)

    def _track(self, motors, plan, settle, tolerance, astray=ASTRAY):
        """The control loop: 50 Hz, two accesses to set and one to read per motor and tick."""
        clock = self.clock
        followers = [self._followers[motor] for motor in motors]
        lost = [max(astray, ASTRAY_COUNTS * motor.resolution) for motor in motors]
        fine = [tolerance * motor.resolution for motor in motors]
        for motor in motors:
            motor.engage(STIFFNESS)
        due = now = clock.now()
        start = now + plan.before
        last = plan.at(LEAD - plan.before).q_dot
        before = None
        ticks = resting = slow = still = 0
        while True:
            began = now
            seen = []
            for motor, follower in zip(motors, followers):
                seen.append(motor.bounds())
                follower.observe(clock.now(), seen[-1])
            now = clock.now()
            wanted = plan.at(now - start)
            errors = [angle - f.angle for angle, f in zip(wanted.q, followers)]
            self._watch(motors, errors, lost)
            overtime = now - start - plan.duration
            still = still + 1 if seen == before and overtime > 0 else 0
            before = seen
            if overtime > settle or still == STILL:
                self._watch(motors, errors, [ARRIVED * limit for limit in fine])
                return
            near = all(abs(error) < limit for error, limit in zip(errors, fine))
            resting = resting + 1 if near and overtime > 0 else 0
            if resting == RESTED:
                return
            ahead = plan.at(now - start + LEAD)
            errors = self._across(wanted, ahead, errors)
            for k, (motor, follower) in enumerate(zip(motors, followers)):
                acceleration = (ahead.q_dot[k] - last[k]) / TICK
                # At rest the last bit is crept: position alone would be held up by friction.
                creep = CREEP * errors[k] if overtime > 0 else 0.0
                motor.drive(follower.command(errors[k], ahead.q_dot[k] + creep, acceleration))
            last = ahead.q_dot
            ticks += 1
            if ticks % IDLE_CHECK == 0:
                self.check_plugged_in()
            # The plan goes by the clock, so that a late tick costs accuracy only.
            due = max(due + TICK, clock.now())
            slow = slow + 1 if due - began > SLOW_TICK else 0
            if slow == SLOW_TICKS or due - began > DEAD_MAN:
                raise TooSlow(
                    "a control tick took {:.2f} s, more than {:.2f} s will not do; end other "
                    "programs on the brick".format(due - began, SLOW_TICK)
                )
            clock.sleep(due - clock.now())
            now = clock.now()

    def _across(self, wanted, ahead, errors):
        """The errors with what lies along the path weighted less: straightness before timing."""
        if wanted.p is None:
            return errors
        J = kinematics.jacobian(self.description, wanted.q)
        velocity = [sum(a * b for a, b in zip(row, ahead.q_dot)) for row in J]
        fast = math.sqrt(sum(v * v for v in velocity))
        singularity = kinematics.singularity(self.description, wanted.q)
        if fast < CRAWLING or singularity < NEARLY_SINGULAR:
            return errors
        e = [sum(a * b for a, b in zip(row, errors)) for row in J]
        along = (1 - ALONG) * sum(a * v for a, v in zip(e, velocity)) / (fast * fast)
        return kinematics.solve(J, [a - along * v for a, v in zip(e, velocity)])

    def _watch(self, motors, errors, limits):
        for motor, error, limit in zip(motors, errors, limits):
            if abs(error) > limit or self._followers[motor].blind:
                raise self._stalled(
                    motor, "{:.1f} deg are missing".format(abs(math.degrees(error)))
                )

    def _stalled(self, motor, missing):
        # Blocked or blind looks the same; blind, its counts are worth nothing from now on.
        self._homed = False
        return Stalled(
            "the {} (port {}) does not turn as it is driven, {}: it is blocked, overloaded or its "
            "encoder is dead; free it, check the cable, then home".format(
                motor.name, motor.port, missing
            )
        )

    @contextlib.contextmanager
    def _stopping_on_error(self):
        """Whatever goes wrong, every motor is stopped before anybody hears of it."""
        try:
            yield
        except BaseException:
            self._halt()
            raise

    def check_plugged_in(self):
        """Notice a pulled cable, also of a motor that is idle; costs no access.

        Raises:
            MotorNotFound: naming the motor.
        """
        for motor in self._motors:
            motor.check_plugged_in()

    def _hold(self, motors):
        for motor in motors:
            motor.hold()
            self._followers[motor].rest()

    def move_pen(self, angle):
        """Turn the pen's motor to `angle`, rad.

        Raises:
            Stalled: it does not get there.
        """
        self._engage()
        move = JointMove([self.pen.angle()], [angle], [PEN_SPEED], PEN_ACCELERATION)
        with self._stopping_on_error():
            self._track([self.pen], move, SETTLE, COARSE, PEN_ASTRAY)
            self._hold([self.pen])

    def move_motor(self, k, move):
        """Let one joint's motor alone follow a JointMove of one angle, without limits; then hold.

        For homing, when angles are not known yet.
        """
        self._engage()
        with self._stopping_on_error():
            self._track([self.joints[k]], move, SETTLE, COARSE)
            self._hold([self.joints[k]])

    def home(self, here=False, say=print):
        """Find the zero, or with `here` take the joints to be at the home pose; remember it.

        The pen is taken to be up.

        Returns:
            One homing.Found per joint; empty with `here`.

        Raises:
            homing.Blocked, Stalled, MotorNotFound: after stopping.
        """
        self._homed = False
        self.zero.forget()
        if self.pen:
            homing.take_as_it_stands(self.pen, self.description.pen.up)
        found = []
        if here:
            for motor, joint in zip(self.joints, self.description.joints):
                homing.take_as_it_stands(motor, joint.home)
        else:
            self._engage()
            with self._stopping_on_error():
                self._hold(self.joints)
                found = homing.find_zero(self, say)
        self._homed = True
        self.sides = (0,) * len(self.joints)
        self.zero.save(self._zeros(), None if self._engaged else self.counts())
        return found

    def step_to(self, q):
        """The report's move: both joints commanded together, then settled to a count for 60 ms.

        Raises:
            Stalled: a joint does not get there in time.
        """
        self.check(q)
        self._engage()
        with self._stopping_on_error():
            self._go_and_settle(q)
        self.sides = (0,) * len(self.joints)

    def _go_and_settle(self, q):
        clock = self.clock
        longest = max(abs(a - b) for a, b in zip(q, self.angles())) / STEP_SPEED
        targets = [motor.go(angle, STEP_SPEED) for motor, angle in zip(self.joints, q)]
        deadline = clock.now() + longest + SETTLE_DEADLINE
        settled = None
        self.check_plugged_in()
        while settled is None or clock.now() - settled < SETTLED_FOR:
            off = [motor.counts() - target for motor, target in zip(self.joints, targets)]
            if all(abs(counts) <= 1 for counts in off):
                settled = clock.now() if settled is None else settled
            else:
                settled = None
                if clock.now() > deadline:
                    worst = max(range(len(off)), key=lambda k: abs(off[k]))
                    raise self._stalled(
                        self.joints[worst], "{:.0f} counts are missing".format(abs(off[worst]))
                    )
            clock.sleep(TICK)

    # Ending

    def stop(self):
        """Stop and hold every motor that still answers; then tell of the first that does not.

        Raises:
            MotorNotFound, or what else a motor answered.
        """
        lost = self._halt()
        if lost:
            raise lost

    def _halt(self):
        """Stop and hold every motor that still answers; the first trouble, or None."""
        lost = None
        # All stand before anything is tidied up: an access may be slow.
        for act in (JointMotor.hold, JointMotor.disengage):
            for motor in self._motors:
                try:
                    act(motor)
                except Exception as error:  # one motor's trouble must not keep the next one running
                    lost = lost or error
        for follower in self._followers.values():
            follower.rest()
        self._standing = True
        return lost

    def park(self):
        """Stop for good, and put on record where; nothing if nothing was moved."""
        if not self._engaged:
            return
        if not self._standing:
            self.stop()
        self._engaged = False
        if self._homed:
            self.clock.sleep(0.1)
            self.zero.save(self._zeros(), self.counts())
