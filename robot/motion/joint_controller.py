"""Following a moving set-point with one joint: an observer of what the motor does, and the law.

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
from collections import namedtuple

STIFFNESS = 0.1
"""The push with which the motor's driver answers a difference of speeds, % per deg/s."""

LEAD = 0.035
"""Speed and acceleration are fed forward so much early, s."""

ALONG = 0.8
"""Weight of the error along a path beside that across it."""

Gains = namedtuple(
    "Gains",
    "speed_per_duty lag torque_per_duty friction position velocity "
    "observe_position observe_velocity learn_push learn_friction deadband "
    "turning moving most_error",
)
"""Tuned on emulated plants (see README: which seeds); motor's degrees and percent of duty.

speed_per_duty      deg/s per %, no load
lag                 s, of the motor alone
torque_per_duty     Nm per %, at a standstill
friction            %, first guess
position, velocity  % per deg, % per deg/s: feedback
observe_position    1: share of the encoder's surprise that corrects the position
observe_velocity    1/s: the same for the speed
learn_push          % per deg: the same for the constant push
learn_friction      % per deg: the same for the friction
deadband            deg: surprise below this corrects nothing
turning, moving     deg/s: below these speeds, wanted and seen, friction fades with speed
most_error          deg: the feedback acts on no larger error, so that a blind joint does not race
"""

_LARGE = Gains(
    speed_per_duty=8.6,
    lag=0.07,
    torque_per_duty=0.004,
    friction=6.7,
    position=7.7,
    velocity=0.091,
    observe_position=0.46,
    observe_velocity=2.2,
    learn_push=0.044,
    learn_friction=0.19,
    deadband=0.022,
    turning=1.3,
    moving=3.7,
    most_error=1.5,
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
    ),
}
"""By kind of motor.  The medium one moves the pen, is faster, and so takes only a softer hand."""

FORGETS = 0.0029
"""The share of what was learned of friction that each tick takes back towards the first guess."""

FRICTION, PUSH = (3.0, 20.0), 8.0
"""Bounds of what is learned, % of duty: in steady motion the two cannot be told apart."""


def _faded(speed, threshold):
    """Sign of a speed, fading linearly to 0 below the threshold."""
    return max(-1.0, min(1.0, speed / threshold))


class Follower(object):
    """One joint; what it has learned of friction stays, where it is and what pushes it does not.

    Args:
        gear: motor turns per joint turn; the gains count at the motor.
        gains: Gains of its kind of motor.

    Attributes:
        angle, speed: as observed, rad and rad/s; None until the first reading.
    """

    def __init__(self, gear, gains):
        loop = STIFFNESS * gains.speed_per_duty
        self._share = loop / (1 + loop)
        self._lag = gains.lag / (1 + loop)
        self._gains = gains
        # From the motor's degrees and percent of duty to rad and rad/s of set-point at the joint.
        degree = math.radians(1) / gear
        self._degree = degree
        self._per_duty = degree / STIFFNESS
        self._friction = gains.friction * self._per_duty
        self._push = 0.0
        self._weight = 0.0
        self._per_newton_metre = self._per_duty / gains.torque_per_duty / gear
        self._turning = 0.0
        self._w = 0.0
        self._t = None
        self.angle = None
        self.speed = 0.0

    def observe(self, t, bounds):
        """Take in that at time `t` (s) the angle lies within `bounds` (rad)."""
        low, high = bounds
        if self._t is None:
            self.angle, self.speed, self._push = (low + high) / 2, 0.0, 0.0
        else:
            self._predict(t - self._t)
            self._correct((low + high) / 2 - self.angle)
            self.angle = min(max(self.angle, low), high)
        self._t = t

    def carry(self, torque):
        """From now on a weight turns the joint with this torque, Nm."""
        self._weight = -torque * self._per_newton_metre

    def rest(self):
        """The joint is held now; begin anew with the next reading."""
        self._t = None
        self.speed = 0.0

    def _predict(self, dt):
        push = self._w - self._push - self._weight
        if abs(self.speed) > self._degree:
            friction = self._friction * _faded(self.speed, self._gains.moving * self._degree)
        else:
            friction = max(-self._friction, min(self._friction, push))
        final = self._share * (push - friction)
        caught = 1 - math.exp(-dt / self._lag)
        self.angle += final * dt + (self.speed - final) * self._lag * caught
        self.speed += (final - self.speed) * caught

    def _correct(self, surprise):
        gains = self._gains
        dead = gains.deadband * self._degree
        surprise -= max(-dead, min(dead, surprise))
        self.angle += gains.observe_position * surprise
        self.speed += gains.observe_velocity * surprise
        per_degree = self._per_duty / self._degree
        least, most = (duty * self._per_duty for duty in FRICTION)
        learned = self._friction - gains.learn_friction * per_degree * surprise * self._turning
        learned += FORGETS * (gains.friction * self._per_duty - learned)
        self._friction = max(least, min(most, learned))
        most = PUSH * self._per_duty
        learned = self._push - gains.learn_push * per_degree * surprise
        self._push = max(-most, min(most, learned))

    def command(self, error, speed, acceleration):
        """The speed set-point, rad/s.

        Args:
            error: wanted minus observed angle, rad.
            speed, acceleration: wanted, rad/s and rad/s^2, `lead` ahead.
        """
        gains = self._gains
        per_degree = self._per_duty / self._degree
        self._turning = _faded(speed, gains.turning * self._degree)
        most = gains.most_error * self._degree
        error = max(-most, min(most, error))
        self._w = (
            (speed + acceleration * self._lag) / self._share
            + self._friction * self._turning
            + self._push
            + self._weight
            + per_degree * (gains.position * error + gains.velocity * (speed - self.speed))
        )
        return self._w
