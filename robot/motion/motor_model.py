"""A motor under speed regulation, and whether it turns as it is driven.

Pure.  Angles are those of the motor's side of the joint, rad at the joint; pushes and frictions are
speed set-points, rad/s, as in joint_controller.
"""

import math

MYPY = False
if MYPY:
    from robot.motion.joint_controller import Gains  # noqa: F401

STIFFNESS = 0.1
"""The push with which the motor's driver answers a difference of speeds, % per deg/s."""

MOVING_FRICTION_MARGIN, STANDING_FRICTION_MARGIN = 0.6, 1.4
"""Friction may be greater than what was learned of it by these shares of the first guess: where a
joint goes on as it turned when it last counted, and where it stood, turns round or may meet a link
that stands: then a load that was taken for friction acts the other way."""

TAKEN_UP_COUNTS, TAKEN_UP_SHARE = 3.5, 1.5
"""Until it has turned one way by so many counts, and so many times its backlash, a motor may meet
a link that stands."""

KNOWN_FRICTION_MARGIN = 0.15
"""And for what was pushed on the whole it may be greater by this share of the first guess."""

PEN_SPEED, PEN_ACCELERATION = math.radians(400), math.radians(3000)
"""Greatest of the pen's motor, rad/s and rad/s^2."""

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
        moving: speed below which friction fades, rad/s.
    """

    def __init__(self, gear, gains):
        # type: (float, Gains) -> None
        self.loop = STIFFNESS * gains.speed_per_duty
        self.share = self.loop / (1 + self.loop)
        self.lag = gains.lag / (1 + self.loop)
        self.degree = math.radians(1) / gear
        self.per_duty = self.degree / STIFFNESS
        self.moving = gains.moving * self.degree


class StallDetector(object):
    """Tells by missing counts that a joint does not turn as it is driven.

    From its last count on it predicts how far the joint has turned at the least: with more friction
    than is known.  Where that is well past what the encoder admits, or where the joint was pushed
    for long with somewhat more than its friction as known, it is blocked or its encoder is dead;
    nothing that the motor tells distinguishes these two.

    Args:
        model: MotorModel.
        friction: first guess, rad/s of set-point.
        backlash: rad.
        most_missing, most_pushed: rad.

    Attributes:
        stalled: whether that is so.
        missing: how far past what the encoder admits it should be, rad.
        silent: whether the last reading brought no count.
        friction: how great it may be, rad/s of set-point; `load`: what else was known to push then.
            Of what the observer learns while no counts come, neither takes anything in.
    """

    def __init__(self, model, friction, backlash, most_missing, most_pushed):
        # type: (MotorModel, float, float, float, float) -> None
        self._share, self._lag = model.share, model.lag
        self._friction_margins = (
            MOVING_FRICTION_MARGIN * friction,
            STANDING_FRICTION_MARGIN * friction,
        )
        self._taken_up = TAKEN_UP_COUNTS * model.degree + TAKEN_UP_SHARE * backlash
        self._most, self._most_pushed = most_missing, most_pushed
        self._known_margin = KNOWN_FRICTION_MARGIN * friction
        self.missing = self.friction = self.load = 0.0
        self.begin(0.0, 0.0, friction)

    def begin(self, low, angle, friction):
        # type: (float, float, float) -> None
        """Begin with a joint that stands.

        Args:
            low: angle that it is above by its encoder, rad.
            angle: where it is taken to be, rad.
            friction: as known, rad/s of set-point.
        """
        self._low, self._counted = low, (angle, 0.0, friction, 0.0)
        self._way, self._turned_at = 0.0, low
        self.silent = self.stalled = False

    def _begin_silence(self):
        # type: () -> None
        """Begin the prediction with the last count."""
        self.silent = True
        self._angle, self._speed, friction, self.load = self._counted
        self._slack = STOPPING_TIME * abs(self._speed)
        turned = self._low - self._turned_at
        self.friction = friction + self._friction_margins[-self._taken_up < turned < self._taken_up]
        self._back = friction + self._friction_margins[1]
        self._known, self._pushed = friction + self._known_margin, 0.0

    def update(self, dt, low, high, angle, speed, push, friction, load):
        # type: (float, float, float, float, float, float, float, float) -> None
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
            self._low, self._counted = low, (angle, speed, friction, load)
            self.silent = self.stalled = False
            return
        if not self.silent:
            self._begin_silence()
        push -= self.load
        hard = (push if push > 0.0 else -push) - self._known
        if hard > 0.0:
            self._pushed += self._share * hard * dt
            if self._pushed > self._most_pushed:
                self.missing, self.stalled = self._pushed, True
                return
        # By one implicit step of the same equation: that is precise enough, and cheap.
        friction, before = self.friction, self._speed
        if not before:
            if -friction <= push <= friction:
                return  # what stands goes on standing
            if push * self._way < 0.0 and friction < self._back:
                self.friction = self._back  # the other way it may meet a link that stands
                return
        if before > 0.0 or (not before and push > 0.0):
            push -= friction
            speed = before + (self._share * push - before) * dt / (self._lag + dt)
            if speed < 0.0:
                speed = 0.0
        else:
            push += friction
            speed = before + (self._share * push - before) * dt / (self._lag + dt)
            if speed > 0.0:
                speed = 0.0
        self._speed = speed
        self._angle = angle = self._angle + 0.5 * dt * (before + speed)
        past = angle - high if angle > high else low - angle
        self.missing = missing = past - self._slack
        self.stalled = missing > self._most
