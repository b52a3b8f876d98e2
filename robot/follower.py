"""Following a moving set-point with one joint: an observer of what the motor does, and the law.

Pure: readings and times in, a speed set-point out.  The motor takes a speed set-point w and pushes in
proportion to w - v; so behind the gear it behaves, to first order, like

    dv/dt = (SHARE (w - f) - v) / LAG

with f the friction (as a set-point, with the sign of the motion).  The encoder says only between which
two angles the motor is.  The observer predicts with this model, moves towards the middle of what the
encoder allows, and learns f and a constant push `d` on the way, so that neither battery nor friction
need be known.  All angles are those of the motor's side of the joint, in rad at the joint.
"""

import math
from collections import namedtuple

Gains = namedtuple(
    "Gains",
    "stiffness speed_per_duty lag friction lead position velocity "
    "observe_position observe_velocity learn_push learn_friction deadband turning moving along",
)
"""Tuned on emulated plants (see README: which seeds); motor's degrees and percent of duty.

stiffness           % per deg/s, the motor driver's push on the difference of speeds
speed_per_duty      deg/s per %, no load
lag                 s, of the motor alone
friction            %, first guess
lead                s, by which speed and acceleration are fed forward early
position, velocity  % per deg, % per deg/s: feedback
observe_position    1: share of the encoder's surprise that corrects the position
observe_velocity    1/s: the same for the speed
learn_push          % per deg: the same for the constant push
learn_friction      % per deg: the same for the friction
deadband            deg: surprise below this corrects nothing
turning, moving     deg/s: below these speeds, wanted and seen, friction fades with speed
along               1: weight of the error along the path beside that across it
"""

GAINS = Gains(
    stiffness=0.14,
    speed_per_duty=11.0,
    lag=0.1,
    friction=6.9,
    lead=0.037,
    position=25.0,
    velocity=0.51,
    observe_position=0.11,
    observe_velocity=1.1,
    learn_push=0.046,
    learn_friction=0.18,
    deadband=0.011,
    turning=1.8,
    moving=3.3,
    along=0.61,
)


FORGOTTEN = 0.1
"""After this time without a reading the joint is taken to be at rest, s."""


def _faded(speed, threshold):
    """Sign of a speed, fading linearly to 0 below the threshold."""
    return max(-1.0, min(1.0, speed / threshold))


class Follower(object):
    """One joint; what it has learned of friction and push stays, where it is does not.

    Args:
        gear: motor turns per joint turn; the gains count at the motor.
        gains: Gains.

    Attributes:
        angle, speed: as observed, rad and rad/s; None until the first reading.
    """

    def __init__(self, gear, gains=GAINS):
        loop = gains.stiffness * gains.speed_per_duty
        self._share = loop / (1 + loop)
        self._lag = gains.lag / (1 + loop)
        self._gains = gains
        # From the motor's degrees and percent of duty to rad and rad/s of set-point at the joint.
        degree = math.radians(1) / gear
        self._degree = degree
        self._per_duty = degree / gains.stiffness
        self._friction = gains.friction * self._per_duty
        self._most_friction = 25 * self._per_duty
        self._push = 0.0
        self._turning = 0.0
        self._w = 0.0
        self._t = None
        self.angle = None
        self.speed = 0.0

    def observe(self, t, bounds):
        """Take in that at time `t` (s) the angle lies within `bounds` (rad)."""
        low, high = bounds
        if self._t is None or t - self._t > FORGOTTEN:
            self.angle, self.speed = (low + high) / 2, 0.0
        else:
            self._predict(t - self._t)
            self._correct((low + high) / 2 - self.angle)
            self.angle = min(max(self.angle, low), high)
        self._t = t

    def _predict(self, dt):
        push = self._w - self._push
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
        self._push -= gains.learn_push * per_degree * surprise
        learned = self._friction - gains.learn_friction * per_degree * surprise * self._turning
        self._friction = max(0.0, min(self._most_friction, learned))

    def command(self, error, speed, acceleration):
        """The speed set-point, rad/s.

        Args:
            error: wanted minus observed angle, rad.
            speed, acceleration: wanted, rad/s and rad/s^2, `lead` ahead.
        """
        gains = self._gains
        per_degree = self._per_duty / self._degree
        self._turning = _faded(speed, gains.turning * self._degree)
        self._w = (
            (speed + acceleration * self._lag) / self._share
            + self._friction * self._turning
            + self._push
            + per_degree * (gains.position * error + gains.velocity * (speed - self.speed))
        )
        return self._w
