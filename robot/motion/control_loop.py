"""The control loop: motors follow a timed plan at 50 Hz, watched for anything that goes wrong.

Per motor and tick one access to read and two to set.  The loop never stops a motor: whoever runs it
does, and the motors' own dead-man.
"""

import math

from robot.motion import kinematics
from robot.motion.joint_controller import ALONG, LEAD, STIFFNESS
from robot.motion.motors import DEAD_MAN
from shared.arm_description import ArmError

TICK = 0.02
"""Period, s."""

SLOW_TICK, SLOW_TICKS = 0.06, 4
"""A tick longer than this (s) is slow; so many slow ones in a row control nothing."""

IDLE_CHECK = 20
"""Every so many ticks the motors that are not being driven are checked to be there."""

ASTRAY, ASTRAY_COUNTS = math.radians(3), 5
"""A joint this far (rad, and counts) from where it should be is blocked or blind."""

CRAWLING, NEARLY_SINGULAR = 0.5, 0.1
"""Below this speed of the tip (cm/s) or this singularity measure, across the path means nothing."""

SETTLE = 0.2
"""Longest correction after the end of a path with the pen down, s."""

FINE, COARSE, RESTED = 0.4, 6.0, 3
"""A motor has settled within so many counts, where they matter and where not, for so many ticks."""

CREEP = 4.0
"""Speed towards the end of a path, per distance that is left, 1/s."""

STILL = 10
"""Ticks without a count after the end: what is left is held by friction, or the joint is blind."""

ARRIVED = 3
"""Farther off in the end than so many times the tolerance, a joint has not arrived."""


class Stalled(ArmError):
    """A motor that does not turn as it is driven."""

    def __init__(self, motor, missing):
        super(Stalled, self).__init__(
            "the {} (port {}) does not turn as it is driven, {}: it is blocked, overloaded or its "
            "encoder is dead; free it, check the cable, then home".format(
                motor.name, motor.port, missing
            )
        )


class TooSlow(ArmError):
    """The brick does not keep up with the control loop."""


class ControlLoop(object):
    """The loop of one arm.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        followers: JointMotor -> Follower.
        check: called now and then, to raise if some motor is gone.
    """

    def __init__(self, description, clock, followers, check):
        self._description = description
        self._clock = clock
        self._followers = followers
        self._check = check

    def rest(self, motors):
        """The motors were stopped; their followers begin anew."""
        for motor in motors:
            self._followers[motor].rest()

    def run(
        self, motors, plan, settle=SETTLE, tolerance=FINE, astray=ASTRAY, watch=None, weigh=None
    ):
        """Let `motors` follow `plan` to its end; they are driven still when this returns.

        Args:
            motors: of those with a follower, in the order of the plan's angles.
            plan: has `at(t)`, `rested(t)`, `duration` and `before`: JointMove, TakingUpBacklash,
                Pursuit.
            settle: longest correction after the end, s.
            tolerance: counts within which a motor has settled.
            astray: greatest error on the way, rad.
            watch: called in every tick with the plan's time (s), the clock's (s) and the motors'
                angles as just observed (rad); what it raises goes on.
            weigh: from the motors' angles (rad) to the torques of the weights that they carry, Nm;
                None: unknown.

        Raises:
            Stalled, TooSlow, MotorNotFound: with the motors driven still, for DEAD_MAN at most.
        """
        clock = self._clock
        followers = [self._followers[motor] for motor in motors]
        lost = [max(astray, ASTRAY_COUNTS * motor.resolution) for motor in motors]
        fine = [tolerance * motor.resolution for motor in motors]
        for motor in motors:
            motor.engage(STIFFNESS)
        due = now = clock.now()
        start = now + plan.before
        last = plan.at(LEAD - plan.before).q_dot
        rests = [_Rest(settle, limit) for limit in fine]
        held = set()
        ticks = slow = 0
        while True:
            began = now
            seen = []
            for motor, follower in zip(motors, followers):
                seen.append(motor.bounds())
                follower.observe(clock.now(), seen[-1])
            now = clock.now()
            angles = [follower.angle for follower in followers]
            if watch:
                watch(now - start, now, angles)
            torques = weigh(angles) if weigh else [0.0] * len(angles)
            for follower, torque in zip(followers, torques):
                follower.carry(torque)
            wanted = plan.at(now - start)
            errors = [angle - f.angle for angle, f in zip(wanted.q, followers)]
            self._watch(motors, errors, lost)
            rested = plan.rested(now - start)
            for k, rest in enumerate(rests):
                if not rest.take(rested[k], seen[k], errors[k]):
                    raise self._stalled(motors[k], errors[k])
            over = now - start > plan.duration
            if over and all(rest.over for rest in rests):
                return
            # Watching takes time, by which this command comes later.
            ahead = plan.at(clock.now() - start + LEAD)
            errors = self._across(wanted, ahead, errors)
            for k, (motor, follower) in enumerate(zip(motors, followers)):
                if rests[k].over and not over:
                    # Driven for long, a joint at rest would hunt: its encoder is too coarse.
                    if k not in held:
                        motor.hold()
                        held.add(k)
                    follower.rest()
                    continue
                held.discard(k)
                acceleration = (ahead.q_dot[k] - last[k]) / TICK
                # At rest the last bit is crept: position alone would be held up by friction.
                creep = CREEP * errors[k] if rested[k] > 0 else 0.0
                motor.drive(follower.command(errors[k], ahead.q_dot[k] + creep, acceleration))
            last = ahead.q_dot
            ticks += 1
            if ticks % IDLE_CHECK == 0:
                self._check()
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
        J = kinematics.jacobian(self._description, wanted.q)
        velocity = [sum(a * b for a, b in zip(row, ahead.q_dot)) for row in J]
        fast = math.sqrt(sum(v * v for v in velocity))
        singularity = kinematics.singularity(self._description, wanted.q)
        if fast < CRAWLING or singularity < NEARLY_SINGULAR:
            return errors
        e = [sum(a * b for a, b in zip(row, errors)) for row in J]
        along = (1 - ALONG) * sum(a * v for a, v in zip(e, velocity)) / (fast * fast)
        return kinematics.solve(J, [a - along * v for a, v in zip(e, velocity)])

    def _watch(self, motors, errors, limits):
        for motor, error, limit in zip(motors, errors, limits):
            if abs(error) > limit:
                raise self._stalled(motor, error)

    @staticmethod
    def _stalled(motor, error):
        return Stalled(motor, "{:.1f} deg are missing".format(abs(math.degrees(error))))


class _Rest(object):
    """What is left to correct of one joint when its set-point stands.

    Args:
        longest: time for it, s.
        fine: rad within which it has settled.

    Attributes:
        over: whether nothing is left to correct, or nothing more can be.
    """

    def __init__(self, longest, fine):
        self._longest = longest
        self._fine = fine
        self._near = self._still = 0
        self._seen = None
        self.over = False

    def take(self, rested, seen, error):
        """Take in one tick; False if the joint has not arrived and will not.

        Args:
            rested: for how long the set-point has been standing, s.
            seen: the encoder's bounds.
            error: rad.
        """
        stands = seen == self._seen
        self._seen = seen
        if rested <= 0:
            self._near = self._still = 0
            self.over = False
        elif not self.over:
            self._near = self._near + 1 if abs(error) < self._fine else 0
            self._still = self._still + 1 if stands else 0
            late = rested > self._longest or self._still == STILL
            self.over = late or self._near == RESTED
            return not late or abs(error) <= ARRIVED * self._fine
        return True
