"""What a motor under speed regulation does, and whether it does: prediction and stall detection.

Pure.  Angles are those of the motor's side of the joint, rad at the joint; pushes and frictions are
speed set-points, rad/s, as in joint_controller.
"""

import math

STIFFNESS = 0.1
"""The push with which the motor's driver answers a difference of speeds, % per deg/s."""

FRICTION_DOUBT, STANDING_DOUBT = 0.6, 1.4
"""Friction may be greater than what was learned of it by these shares of the first guess: where a
joint turned when it last counted, and where it stood or may meet a link that stands."""

TAKEN_UP_COUNTS, TAKEN_UP_SHARE = 3.5, 1.5
"""Until it has turned one way by so many counts, and so many times its backlash, a motor may meet
a link that stands."""

STOPPING_TIME = 0.015
"""A joint may come to rest by the way of so much time earlier than predicted, s."""


class MotorModel(object):
    """A motor that takes a speed set-point, with friction.

    Args:
        gear: motor turns per joint turn.
        gains: joint_controller.Gains of its kind of motor.

    Attributes:
        loop: gain of the driver's regulation.
        share: of a set-point that becomes speed where nothing acts against it.
        lag: s, with the regulation.
        degree: of the motor, rad at the joint.
        per_duty: set-point per % of duty, rad/s.
    """

    def __init__(self, gear, gains):
        self.loop = STIFFNESS * gains.speed_per_duty
        self.share = self.loop / (1 + self.loop)
        self.lag = gains.lag / (1 + self.loop)
        self.degree = math.radians(1) / gear
        self.per_duty = self.degree / STIFFNESS
        self._constants = self.share, self.lag, self.degree, gains.moving * self.degree

    def after(self, dt, angle, speed, push, friction):
        """Return angle and speed (rad, rad/s) after `dt` (s) of a `push` against a `friction`."""
        share, lag, crawling, moving = self._constants
        if -crawling <= speed <= crawling:
            against = push if -friction < push < friction else math.copysign(friction, push)
        elif -moving < speed < moving:
            against = friction * speed / moving
        else:
            against = math.copysign(friction, speed)
        final = share * (push - against)
        then = final + (speed - final) * math.exp(-dt / lag)
        if then * speed >= 0.0:
            return angle + final * dt + (speed - then) * lag, then
        # It comes to rest on the way; from there on friction acts the other way round.
        stops = lag * math.log((speed - final) / -final)
        angle += final * stops + speed * lag
        dt -= stops
        over = push - friction if push > friction else push + friction if push < -friction else 0.0
        final = share * over
        then = final * (1.0 - math.exp(-dt / lag))
        return angle + final * dt - then * lag, then


class StallDetector(object):
    """Tells by missing counts that a joint does not turn as it is driven.

    From its last count on it predicts how far the joint has turned at the least: with more friction
    than is known.  Where that is well past what the encoder admits, the joint is blocked or its
    encoder is dead; nothing that the motor tells distinguishes these two.

    Args:
        model: MotorModel.
        friction: first guess, rad/s of set-point.
        backlash: rad.
        most_missing: rad.

    Attributes:
        stalled: whether that is so.
        missing: how far past what the encoder admits it should be, rad.
        silent: whether the last reading brought no count.
        friction: how great it may be, rad/s of set-point; `load`: what else was known to push then.
            Of what the observer learns while no counts come, neither takes anything in.
    """

    def __init__(self, model, friction, backlash, most_missing):
        self._model = model
        self._doubts = FRICTION_DOUBT * friction, STANDING_DOUBT * friction
        self._taken_up = TAKEN_UP_COUNTS * model.degree + TAKEN_UP_SHARE * backlash
        self._most = most_missing
        self.begin(0.0, 0.0, friction)

    def begin(self, low, angle, friction):
        """Begin with a joint that stands.

        Args:
            low: angle that it is above by its encoder, rad.
            angle: where it is taken to be, rad.
            friction: as known, rad/s of set-point.
        """
        self._low, self._angle, self._speed = low, angle, 0.0
        self._way, self._turned_at, self._slack = 0.0, low, 0.0
        self.friction, self.load = friction + self._doubts[1], 0.0
        self.missing = 0.0
        self.silent = self.stalled = False

    def take(self, dt, low, high, angle, speed, push, friction, load):
        """Take in a reading.

        Args:
            dt: since the last one, s.
            low, high: between which angles the joint is by it, rad.
            angle, speed: as observed, rad and rad/s.
            push: since the last reading, the weight aside, rad/s of set-point.
            friction, load: as now known, rad/s of set-point.
        """
        before = self._low
        if low != before:
            if (low - before) * self._way <= 0.0:
                self._way, self._turned_at = low - before, before
            self._low, self._angle, self._speed = low, angle, speed
            self._slack = STOPPING_TIME * (speed if speed > 0.0 else -speed)
            doubt = self._doubts[-self._taken_up < low - self._turned_at < self._taken_up]
            self.friction, self.load = friction + doubt, load
            self.silent = self.stalled = False
            return
        self.silent = True
        push -= self.load
        if not self._speed and -self.friction <= push <= self.friction:
            return  # what stands goes on standing
        self._angle, self._speed = angle, _ = self._model.after(
            dt, self._angle, self._speed, push, self.friction
        )
        past = angle - high if angle > high else low - angle
        self.missing = missing = past - self._slack
        self.stalled = missing > self._most
