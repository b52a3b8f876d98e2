"""A motor written down in ten lines, first order with friction, and paths for it to follow."""

import math

from robot.motion.motor_model import STIFFNESS

TICK = 0.02
SPEED_PER_DUTY, LAG = 9.1, 0.096  # deg/s per %, s: an EV3 large motor at 8 V, roughly
COUNT = 1.0  # deg


class Motor:
    """Duty of the driver's speed regulation turns it; friction and a load act against it.

    Args:
        friction, load: % of duty.
    """

    def __init__(self, friction=4.0, load=0.0, speed_per_duty=SPEED_PER_DUTY, lag=LAG):
        self.friction = friction
        self.load = load
        self.speed_per_duty = speed_per_duty
        self.lag = lag
        self.angle = 0.3
        self.speed = 0.0

    def run(self, w, seconds):
        """Let it turn at the set-point w, deg/s."""
        for _ in range(int(round(seconds / 0.001))):
            duty = max(-100, min(100, STIFFNESS * (w - self.speed))) - self.load
            still = abs(self.speed) < 1e-9
            if still and abs(duty) <= self.friction:
                continue
            against = math.copysign(self.friction, duty if still else self.speed)
            after = (
                self.speed
                + 0.001 * (self.speed_per_duty * (duty - against) - self.speed) / self.lag
            )
            if self.speed * after < 0:
                after = 0.0
            self.speed = after
            self.angle += 0.001 * after

    def bounds(self):
        """What an encoder of whole counts allows, deg."""
        n = math.floor(self.angle / COUNT)
        return n * COUNT, (n + 1) * COUNT


def steady(speed, start=0.3):
    """A path that speeds up within 0.3 s and then keeps its speed, deg/s."""

    def path(t):
        if t < 0.3:
            x = t / 0.3
            return start + speed * 0.3 * (x**3 - x**4 / 2), speed * (3 * x * x - 2 * x**3)
        return start + speed * (t - 0.15), speed

    return path


def swing(amplitude, period):
    """To and fro, from rest."""
    rate = 2 * math.pi / period
    return lambda t: (
        0.3 + amplitude * (1 - math.cos(rate * t)),
        amplitude * rate * math.sin(rate * t),
    )
