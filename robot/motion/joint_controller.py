"""The controller of one joint: an observer with friction learning, and feed-forward with feedback.

Pure: readings and times in, a speed set-point out.  All angles are those of the motor's side of the
joint, rad at the joint.  The driver pushes in proportion to w - v, set-point minus speed; with the
motor's share s and lag T the joint behaves, to first order, like

    T dv/dt = s (w - f sgn v - d) - v

with f the friction and d another load, both as set-points; d is a known weight plus an unknown rest
p.  The control law inverts this model for the wanted speed and acceleration, and adds feedback:

    w = (v* + T a*) / s + f sgn v* + d + Kp (q* - q) + Kv (v* - v)

The observer (Luenberger, 1964) predicts q and v by the model.  Its innovation e is the distance to
the middle of the interval in which the encoder shows the motor, less a dead band: a count of 1 deg
is coarse.  It corrects q and v, and by a gradient step f and p (for friction: Friedland and Park,
IEEE TAC 37(10), 1992):  f <- f - Lf e sgn v* dt,  p <- p - Lp e dt.  In steady motion f and p
cannot be distinguished; so f forgets towards its first guess, and both are bounded.

An integrator would also remove the static error, but each reversal needs 2 f at once, and it takes
time to unwind; at rest it makes the joint hunt (Armstrong-Helouvry et al., Automatica 30(7), 1994).
"""

import math

from robot.motion.motor_model import MotorModel, StallDetector
from shared.record import record

MYPY = False
if MYPY:
    from typing import Mapping, NamedTuple, Optional, Tuple  # noqa: F401

LEAD = 0.035
"""Lead of the feed-forward of speed and acceleration, s."""

ALONG_WEIGHT = 0.8
"""Weight of the error along a path beside that across it."""

TUNED_DELAY, DELAY_SOFTENING, FORESEEN_SHARE = 0.013, 20.0, 0.7
"""Delay of the command for which the gains hold, s; share by which the position's gain falls per
second beyond it, 1/s; and share of that excess over which the error is predicted."""

if MYPY:
    Gains = NamedTuple(
        "Gains",
        [
            ("speed_per_duty", float),
            ("lag", float),
            ("torque_per_duty", float),
            ("friction", float),
            ("position", float),
            ("velocity", float),
            ("observe_position", float),
            ("observe_velocity", float),
            ("learn_push", float),
            ("learn_friction", float),
            ("deadband", float),
            ("turning", float),
            ("moving", float),
            ("max_error", float),
            ("max_missing", float),
            ("max_pushed", float),
        ],
    )
    GainsByKind = Mapping[str, Gains]
else:
    Gains = record(
        "Gains",
        "speed_per_duty lag torque_per_duty friction position velocity "
        "observe_position observe_velocity learn_push learn_friction deadband "
        "turning moving max_error max_missing max_pushed",
    )
"""Tuned on emulated plants of seeds 100 to 127; motor's degrees and percent of duty.

speed_per_duty      deg/s per %, no load
lag                 s, of the motor alone
torque_per_duty     Nm per %, at a standstill
friction            %, first guess
position, velocity  % per deg, % per deg/s: feedback
observe_position    1/s: gain from the encoder's innovation to the position
observe_velocity    1/s^2: the same for the speed
learn_push          % per deg s: the same for the unknown load
learn_friction      % per deg s: the same for the friction
deadband            deg: innovation below which nothing is corrected
turning, moving     deg/s: below these speeds, wanted and seen, friction fades with speed
max_error           deg: error at which feedback saturates: without encoder a joint must not race
max_missing         deg: least predicted travel without counts at which a joint has stalled
max_pushed          deg: the same for the travel predicted with friction as known
"""

_LARGE = Gains(
    speed_per_duty=8.6,
    lag=0.07,
    torque_per_duty=0.004,
    friction=6.7,
    position=7.7,
    velocity=0.091,
    observe_position=42.6,
    observe_velocity=110.0,
    learn_push=2.2,
    learn_friction=9.5,
    deadband=0.022,
    turning=1.3,
    moving=3.7,
    max_error=1.8,
    max_missing=2.0,
    max_pushed=14.0,
)

GAINS = {
    "large": _LARGE,
    "medium": _LARGE._replace(
        speed_per_duty=16.0,
        lag=0.075,
        torque_per_duty=0.0018,
        friction=13.0,
        position=8.0,
        velocity=0.1,
        max_error=5.0,
        max_missing=20.0,
        max_pushed=100.0,
    ),
}
"""Gains by kind of motor.  The medium one moves the pen; it is faster and needs lower gains."""

FRICTION_FORGETTING = 0.145
"""Rate at which learned friction returns to its first guess, 1/s."""

FRICTION_BOUNDS, MAX_PUSH = (3.0, 20.0), 8.0
"""Bounds of the learned friction and of the learned load, % of duty."""

SILENT_RESERVE = 4.0
"""Maximum push beyond the need while no counts come, % of duty: with a dead encoder nothing else
keeps the joint from racing."""

MAX_LEARNING_INTERVAL = 0.06
"""Longest interval between readings that counts for learning, s."""


class JointController(object):
    """Observer and control law of one joint; a reset keeps its friction, not its angle and load.

    Args:
        gear: motor turns per joint turn; the gains count at the motor.
        gains: Gains of its kind of motor.
        backlash: of the joint, rad.

    Attributes:
        angle, speed: as observed, rad and rad/s; 0 until the first reading.
        full_error: error at which the position's feedback saturates, rad; it grows as the gain
            falls.
        model, stall: MotorModel and StallDetector.
        delay: time from a reading to the middle of its command's action, s.  A longer one lowers
            the gain of position and raises that of speed.
    """

    def __init__(self, gear, gains, backlash=0.0):
        # type: (float, Gains, float) -> None
        self.model = model = MotorModel(gear, gains)
        degree, per_duty = model.degree, model.per_duty
        self._constants = model.share, model.lag, degree, model.moving
        # From the motor's degrees and percent of duty to rad and rad/s of set-point at the joint.
        per_degree = per_duty / degree
        self._turning_at = gains.turning * degree
        self._gains = gains.position * per_degree, gains.velocity * per_degree
        self._max_feedback = gains.max_error * degree * gains.position * per_degree
        self._friction = gains.friction * per_duty
        self._observer = (
            gains.deadband * degree,
            gains.observe_position,
            gains.observe_velocity,
            gains.learn_friction * per_degree,
            gains.learn_push * per_degree,
            MAX_PUSH * per_duty,
            self._friction,
        )
        self._least, self._most = (duty * per_duty for duty in FRICTION_BOUNDS)
        self._per_newton_metre = per_duty / gains.torque_per_duty / gear
        self._push = self._weight = self._turning = self._w = 0.0
        self.stall = StallDetector(
            model,
            self._friction,
            backlash,
            gains.max_missing * degree,
            gains.max_pushed * degree,
        )
        self._reserve = SILENT_RESERVE * per_duty
        self._t = None  # type: Optional[float]
        self.angle = self.speed = 0.0
        self.delay = TUNED_DELAY

    @property
    def delay(self):
        # type: () -> float
        """Delay from a reading to the middle of its command's action, s."""
        return self._delay

    @delay.setter
    def delay(self, delay):
        # type: (float) -> None
        self._delay = delay
        position, velocity = self._gains
        excess = max(0.0, delay - TUNED_DELAY)
        self._position = position / (1 + DELAY_SOFTENING * excess)
        self.full_error = self._max_feedback / self._position
        # The error that counts is that at the time of the action: error + excess (v* - v).
        self._velocity = velocity + self._position * excess * FORESEEN_SHARE

    def observe(self, t, low, high):
        # type: (float, float, float) -> None
        """Update the observer: at time `t` (s) the angle lies between `low` and `high`, rad."""
        middle = 0.5 * (low + high)
        if self._t is None:
            self._t, self.angle, self.speed, self._push = t, middle, 0.0, 0.0
            self.stall.begin(low, middle, self._friction)
            return
        dt = t - self._t
        self._t = t
        friction, speed = self._friction, self.speed
        # Predict.
        share, lag, crawling, moving = self._constants
        push = self._w - self._weight
        driven = push - self._push
        if -crawling <= speed <= crawling:
            against = driven if -friction < driven < friction else math.copysign(friction, driven)
        elif -moving < speed < moving:
            against = friction * speed / moving
        else:
            against = math.copysign(friction, speed)
        final = share * (driven - against)
        left = math.exp(-dt / lag)
        angle = self.angle
        then = final + (speed - final) * left
        if then * speed < 0.0:
            angle, speed = self._through_rest(dt, angle, speed, final, driven)
        else:
            angle += final * dt + (speed - then) * lag
            speed = then
        # Correct.
        if dt > MAX_LEARNING_INTERVAL:
            dt = MAX_LEARNING_INTERVAL
        dead, to_angle, to_speed, to_friction, to_push, most, guess = self._observer
        innovation = middle - angle
        if innovation > dead:
            innovation -= dead
        elif innovation < -dead:
            innovation += dead
        else:
            innovation = 0.0
        if innovation:
            to_angle *= dt
            angle += innovation * to_angle / (1.0 + to_angle)
            innovation *= dt
            speed += to_speed * innovation
            friction -= to_friction * innovation * self._turning
            learned = self._push - to_push * innovation
            self._push = learned if -most < learned < most else math.copysign(most, learned)
        friction += FRICTION_FORGETTING * dt * (guess - friction)
        if friction < self._least:
            friction = self._least
        elif friction > self._most:
            friction = self._most
        self.stall.update(dt, low, high, angle, speed, push, friction, self._push)
        self._friction = friction
        self.speed = speed
        self.angle = low if angle < low else high if angle > high else angle

    def _through_rest(self, dt, angle, speed, final, driven):
        # type: (float, float, float, float, float) -> Tuple[float, float]
        """Return (angle, speed) in `dt` (s) of a joint that comes to rest, where friction reverses.

        The `angle` (rad) and `speed` (rad/s) are those of now; `final` is the speed that it would
        approach without the reversal of friction, rad/s, and `driven` the set-point that drives it,
        friction aside, rad/s.
        """
        share, lag, _, _ = self._constants
        friction = self._friction
        stops = lag * math.log((speed - final) / -final)
        angle += final * stops + speed * lag
        dt -= stops
        over = (
            driven - friction
            if driven > friction
            else driven + friction
            if driven < -friction
            else 0.0
        )
        final = share * over
        speed = final * (1.0 - math.exp(-dt / lag))
        return angle + (final * dt - speed * lag), speed

    def carry(self, torque):
        # type: (float) -> None
        """Set the known torque of the weight on the joint, Nm."""
        self._weight = -torque * self._per_newton_metre

    def reset(self):
        # type: () -> None
        """Reset the observer, which begins anew with the next reading: the joint is held."""
        self._t = None
        self.speed = 0.0

    def command(self, error, speed, acceleration):
        # type: (float, float, float) -> float
        """Return the speed set-point, rad/s.

        Args:
            error: wanted minus observed angle, rad.
            speed: wanted, `LEAD` ahead, rad/s.
            acceleration: wanted, `LEAD` ahead, rad/s^2.
        """
        at = self._turning_at
        if speed > at:
            turning = 1.0
        elif speed < -at:
            turning = -1.0
        else:
            turning = speed / at
        self._turning = turning
        most = self.full_error
        if error > most:
            error = most
        elif error < -most:
            error = -most
        model, stall = self.model, self.stall
        push = (
            (speed + acceleration * model.lag) / model.share
            + self._position * error
            + self._velocity * (speed - self.speed)
            + self._friction * turning
            + self._push
        )
        if stall.silent:
            # Without counts the driver sees no speed, and a smaller push keeps the motor at it.
            most = (speed if speed > 0.0 else -speed) / model.loop + stall.friction + self._reserve
            if push > stall.load + most:
                push = stall.load + most
            elif push < stall.load - most:
                push = stall.load - most
        self._w = w = push + self._weight
        return w
