"""Model of a motor under speed regulation, and a stall detector by missing counts.  Pure.

Angles are those of the motor's side of the joint, rad at the joint; pushes and frictions are speed
set-points, rad/s, as in joint_controller.
"""

import math

MYPY = False
if MYPY:
    from robot.motion.joint_controller import Gains  # noqa: F401

STIFFNESS = 0.1
"""Gain of the motor's driver, from a difference of speeds to a push, % per deg/s."""

MOVING_FRICTION_MARGIN, STANDING_FRICTION_MARGIN = 0.6, 1.4
"""Margins of friction over its learned value, shares of the first guess: of a joint that goes on in
its direction, and of one that stood, turns round or may meet a link that stands.  In the second
case a load that was taken for friction acts the other way."""

TAKEN_UP_COUNTS, TAKEN_UP_SHARE = 3.5, 1.5
"""Travel in one direction after which a motor has met its link: counts, plus a multiple of its
backlash."""

KNOWN_FRICTION_MARGIN = 0.15
"""Margin of friction for the sum of all pushes, a share of the first guess."""

HIDDEN_FRICTION = 0.15
"""Friction that a fast motion may hide, a share of the first guess: of a motor that runs faster
than its model, some is learned as that much less friction, and is back where the joint stands."""

PEN_SPEED, PEN_ACCELERATION = math.radians(700), math.radians(6000)
"""Maximum speed and acceleration of the pen's motor, rad/s and rad/s^2: half of its speed without
load, and a third of its torque."""

STOPPING_TIME = 0.015
"""Time whose travel a joint may be missing when it comes to rest, s."""


class MotorModel(object):
    """A motor that takes a speed set-point, with friction.

    Args:
        gear: motor turns per joint turn.
        gains: joint_controller.Gains of its kind of motor.

    Attributes:
        loop: loop gain of the driver's regulation, without unit.
        share: share of a set-point that becomes speed without load.
        lag: time constant with the regulation, s.
        degree: a degree of the motor, rad at the joint.
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
    """A detector of joints that do not turn as they are driven, by missing counts.

    From the last count on it predicts the least travel of the joint, with more friction than is
    known.  If that is well past the encoder's interval, the joint is blocked or its encoder is
    dead; no signal of the motor distinguishes these two.  The same holds for a joint that was
    pushed for long with somewhat more than its known friction.  The obvious test, no count for a
    fixed time, would fail a slow joint, and notice a fast one too late.

    Args:
        model: MotorModel.
        friction: first guess, rad/s of set-point.
        backlash: of the joint, rad.
        max_missing: tolerance of the predicted travel, rad.
        max_pushed: tolerance of the travel by the sum of pushes, rad.

    Attributes:
        stalled: whether one of these is exceeded.
        missing: predicted travel past the encoder's interval, rad.
        silent: whether the last reading brought no count.
        friction: upper bound of friction, rad/s of set-point.
        load: known load, rad/s of set-point.  Both stay at their values of the last count.
    """

    def __init__(self, model, friction, backlash, max_missing, max_pushed):
        # type: (MotorModel, float, float, float, float) -> None
        self._share, self._lag = model.share, model.lag
        self._least_friction = (1.0 - HIDDEN_FRICTION) * friction
        self._friction_margins = (
            MOVING_FRICTION_MARGIN * friction,
            STANDING_FRICTION_MARGIN * friction,
        )
        self._taken_up = TAKEN_UP_COUNTS * model.degree + TAKEN_UP_SHARE * backlash
        self._max_missing, self._max_pushed = max_missing, max_pushed
        self._known_margin = KNOWN_FRICTION_MARGIN * friction
        self.missing = self.friction = self.load = 0.0
        self.begin(0.0, 0.0, friction)

    def begin(self, low, angle, friction):
        # type: (float, float, float) -> None
        """Begin with a joint at rest.

        Args:
            low: lower end of the encoder's interval, rad.
            angle: estimate, rad.
            friction: as known, rad/s of set-point.
        """
        self._low, self._counted = low, (angle, 0.0, friction, 0.0)
        self._direction, self._turned_at = 0.0, low
        self.silent = self.stalled = False

    def _begin_silence(self):
        # type: () -> None
        """Begin the prediction with the last count."""
        self.silent = True
        self._angle, self._speed, friction, self.load = self._counted
        self._slack = STOPPING_TIME * abs(self._speed)
        turned = self._low - self._turned_at
        margin = self._friction_margins[-self._taken_up < turned < self._taken_up]
        self.friction = friction + margin
        friction = max(friction, self._least_friction)
        self._held = friction + margin
        self._back = friction + self._friction_margins[1]
        self._known, self._pushed = friction + self._known_margin, 0.0

    def update(self, dt, low, high, angle, speed, push, friction, load):
        # type: (float, float, float, float, float, float, float, float) -> None
        """Update with a reading.

        Args:
            dt: time since the last one, s.
            low: lower end of the encoder's interval, rad.
            high: its upper end, rad.
            angle: as observed, rad.
            speed: as observed, rad/s.
            push: since the last reading, the weight aside, rad/s of set-point.
            friction: as now known, rad/s of set-point.
            load: as now known, rad/s of set-point.
        """
        before = self._low
        if low != before:
            if (low - before) * self._direction <= 0.0:
                self._direction, self._turned_at = low - before, before
            self._low, self._counted = low, (angle, speed, friction, load)
            self.silent = self.stalled = False
            return
        if not self.silent:
            self._begin_silence()
        push -= self.load
        hard = (push if push > 0.0 else -push) - self._known
        if hard > 0.0:
            self._pushed += self._share * hard * dt
            if self._pushed > self._max_pushed:
                self.missing, self.stalled = self._pushed, True
                return
        # An implicit Euler step of the observer's equation is precise enough, and cheap.
        friction, before = self._held, self._speed
        if not before:
            if -friction <= push <= friction:
                return  # static friction holds it
            if push * self._direction < 0.0 and friction < self._back:
                self.friction = self._held = self._back  # backwards it may meet a link that stands
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
        self.stalled = missing > self._max_missing
