"""One joint follows a moving set-point: an observer of what the motor does, and the control law.

Pure: readings and times in, a speed set-point out.  The motor takes a speed set-point w and pushes
in proportion to w - v; so behind the gear it behaves, to first order, like

    dv/dt = (SHARE (w - f - d) - v) / LAG

with f the friction (as a set-point, with the sign of the motion) and d what else it must hold out
against: a weight, which is told, and the rest.  The encoder says only between
which two angles the motor is.  The observer predicts with this model, moves towards the middle of
what the encoder allows, and learns f and the rest of d on the way, so that neither battery
nor friction need be known.  All angles are those of the motor's side of the joint, in rad at the
joint.
"""

import math

from robot.motion.motor_model import MotorModel, StallDetector
from shared.record import record

MYPY = False
if MYPY:
    from typing import Mapping, NamedTuple, Optional, Tuple  # noqa: F401

LEAD = 0.035
"""Speed and acceleration are fed forward so much early, s."""

ALONG_WEIGHT = 0.8
"""Weight of the error along a path beside that across it."""

TUNED_DELAY, DELAY_SOFTENING, FORESEEN_SHARE = 0.013, 20.0, 0.7
"""The gains are those for commands that act so late, s; for later ones the position's falls by this
share of itself, 1/s; and for so much of what is later the error is foreseen."""

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
            ("most_error", float),
            ("most_missing", float),
            ("most_pushed", float),
        ],
    )
    GainsByKind = Mapping[str, Gains]
else:
    Gains = record(
        "Gains",
        "speed_per_duty lag torque_per_duty friction position velocity "
        "observe_position observe_velocity learn_push learn_friction deadband "
        "turning moving most_error most_missing most_pushed",
    )
"""Tuned on emulated plants (see README: which seeds); motor's degrees and percent of duty.

speed_per_duty      deg/s per %, no load
lag                 s, of the motor alone
torque_per_duty     Nm per %, at a standstill
friction            %, first guess
position, velocity  % per deg, % per deg/s: feedback
observe_position    1/s: how fast the encoder's surprise corrects the position
observe_velocity    1/s^2: the same for the speed
learn_push          % per deg s: the same for the constant push
learn_friction      % per deg s: the same for the friction
deadband            deg: surprise below this corrects nothing
turning, moving     deg/s: below these speeds, wanted and seen, friction fades with speed
most_error          deg: the feedback acts on no larger error, so that a blind joint does not race
most_missing        deg: what should have turned so much further, at least, is blocked or blind
most_pushed         deg: so is what would have turned so much further, were friction as known
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
    most_error=1.8,
    most_missing=2.0,
    most_pushed=14.0,
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
        most_error=5.0,
        most_missing=20.0,
        most_pushed=100.0,
    ),
}
"""By kind of motor.  The medium one moves the pen, is faster, and so takes only a softer hand."""

FRICTION_FORGETTING = 0.145
"""What was learned of friction goes back towards the first guess at this rate, 1/s."""

FRICTION_BOUNDS, MAX_PUSH = (3.0, 20.0), 8.0
"""Bounds of what is learned, % of duty: in steady motion the two cannot be told apart."""

SILENT_RESERVE = 4.0
"""While no counts come a joint is pushed by so much more than it may need, % of duty, and no more:
where its encoder is dead, nothing else keeps it from racing."""

MAX_LEARNING_INTERVAL = 0.06
"""After a longer time without a reading no more is learned from the next one than after this, s."""


class JointController(object):
    """One joint; what it has learned of friction stays, where it is and what pushes it does not.

    Args:
        gear: motor turns per joint turn; the gains count at the motor.
        gains: Gains of its kind of motor.
        backlash: rad.

    Attributes:
        angle, speed: as observed, rad and rad/s; 0 until the first reading.
        full_error: from an error of so much on the hand is as firm as it gets, rad: the softer it
            is, the later.
        model, stall: MotorModel and StallDetector.
        delay: s; from a reading to the middle of the time for which the command acts that it leads
            to.  The later that is, the softer the hand, and the more does speed count.
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
        self._hand = gains.most_error * degree * gains.position * per_degree
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
            gains.most_missing * degree,
            gains.most_pushed * degree,
        )
        self._reserve = SILENT_RESERVE * per_duty
        self._t = None  # type: Optional[float]
        self.angle = self.speed = 0.0
        self.delay = TUNED_DELAY

    @property
    def delay(self):
        # type: () -> float
        """See above."""
        return self._delay

    @delay.setter
    def delay(self, delay):
        # type: (float) -> None
        self._delay = delay
        position, velocity = self._gains
        late = max(0.0, delay - TUNED_DELAY)
        self._position = position / (1 + DELAY_SOFTENING * late)
        self.full_error = self._hand / self._position
        # What is missing when the command acts, not when it was read.
        self._velocity = velocity + self._position * late * FORESEEN_SHARE

    def observe(self, t, low, high):
        # type: (float, float, float) -> None
        """Take in that at time `t` (s) the angle lies between these two, rad."""
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
        surprise = middle - angle
        if surprise > dead:
            surprise -= dead
        elif surprise < -dead:
            surprise += dead
        else:
            surprise = 0.0
        if surprise:
            to_angle *= dt
            angle += surprise * to_angle / (1.0 + to_angle)
            surprise *= dt
            speed += to_speed * surprise
            friction -= to_friction * surprise * self._turning
            learned = self._push - to_push * surprise
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
        """Predict a joint that comes to rest on the way, where friction turns round.

        Args:
            dt: from now on, s.
            angle, speed: now, rad and rad/s.
            final: the speed that it would get to if friction did not turn round, rad/s.
            driven: what drives it, friction aside, rad/s of set-point.

        Returns:
            (angle, speed) then.
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
        """From now on a weight turns the joint with this torque, Nm."""
        self._weight = -torque * self._per_newton_metre

    def reset(self):
        # type: () -> None
        """The joint is held now; begin anew with the next reading."""
        self._t = None
        self.speed = 0.0

    def command(self, error, speed, acceleration):
        # type: (float, float, float) -> float
        """The speed set-point, rad/s.

        Args:
            error: wanted minus observed angle, rad.
            speed, acceleration: wanted, rad/s and rad/s^2, `LEAD` ahead.
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
            # The driver sees no speed: what keeps the motor at `speed` is a smaller push.
            most = (speed if speed > 0.0 else -speed) / model.loop + stall.friction + self._reserve
            if push > stall.load + most:
                push = stall.load + most
            elif push < stall.load - most:
                push = stall.load - most
        self._w = w = push + self._weight
        return w
