"""One motor, its gear and the link behind the gap: two masses that meet.

The rotor (seen through the gear) and the link are separated by a real gap, the backlash; where the
gap is closed they move as one (contact is rigid, impacts are inelastic).  All friction is
Coulomb's, solved as an impulse per step, so that things at rest stay at rest.
Units are SI: rad, s, Nm, kg m2, V.
"""

import math
from typing import Optional, Tuple

MYPY = False
if MYPY:
    from laptop.emulator.device.plant_constants import MotorConstants  # noqa: F401


def _slowed(speed: float, by: float) -> float:
    """Coulomb friction: `speed` after an impulse that can take away at most `by`."""
    if speed > by:
        return speed - by
    if speed < -by:
        return speed + by
    return 0.0


class Drive(object):
    """One motor's rotor and, behind gear and gap, the link it moves.

    Args:
        motor: MotorConstants.
        voltage: battery, V.
        ratio: motor turns per joint turn, negative where the gear train reverses.
        link: None for a bare motor, else DrivenLink.
        angle: where rotor and link start, rad at the joint; the encoder reads 0 there.
    """

    def __init__(
        self,
        motor: "MotorConstants",
        voltage: float,
        ratio: float = 1.0,
        link: Optional["DrivenLink"] = None,
        angle: float = 0.0,
    ) -> None:
        self.motor = motor
        self.voltage = voltage
        self.ratio = ratio
        self.link = link
        self.angle = angle
        self.speed = 0.0
        self._start = angle
        self.duty = None  # type: Optional[float]
        """-1 .. 1; 0 shorts the motor (brake), None leaves it open (coast)."""
        self.jammed = False
        """True if a bare motor is blocked; behind a gear the link jams, and the gap stays."""
        self._step = None  # type: Optional[float]  # s, what these are for
        self._electric = self._per_step = ()  # type: Tuple[float, ...]

    def _prepare(self, h: float) -> None:
        """Work out once what never changes of a step of `h` seconds: there are thousands."""
        motor, ratio, link = self.motor, self.ratio, self.link
        inertia = motor.inertia * ratio * ratio
        drag = h * abs(ratio) * motor.friction / inertia
        link_inertia = link_drag = both = both_drag = 0.0
        if link is not None:
            link_inertia = link.inertia
            link_drag = h * link.friction / link_inertia
            both = inertia + link_inertia
            both_drag = (inertia * drag + link_inertia * link_drag) / both
        self._step = h
        self._electric = motor.torque_constant, motor.emf_constant, motor.resistance, ratio
        self._per_step = h * ratio, inertia, drag, link_inertia, link_drag, both, both_drag

    @property
    def shaft(self) -> float:
        """Angle of the motor's shaft since the start, rad."""
        return (self.angle - self._start) * self.ratio

    def step(self, h: float) -> None:
        """Advance by `h` seconds."""
        duty, speed, link = self.duty, self.speed, self.link
        if not (duty or speed) and (
            link is None
            or not (link.speed or link.load)
            and abs(self.angle - link.angle) <= link.half_backlash
            and link.lower <= link.angle <= link.upper
        ):
            return  # what stands goes on standing
        if h != self._step:
            self._prepare(h)
        push, inertia, drag, link_inertia, link_drag, both, both_drag = self._per_step
        pushed = speed
        if duty is not None:
            torque_constant, emf_constant, resistance, ratio = self._electric
            current = duty * self.voltage - emf_constant * speed * ratio
            pushed += push * (torque_constant * current / resistance) / inertia
        speed = _slowed(pushed, drag)
        if link is None:
            self.speed = speed = 0.0 if self.jammed else speed
            self.angle += h * speed
            return
        half_gap, imposed = link.half_backlash, link.imposed
        link_pushed = link.speed + h * link.load / link_inertia
        link_speed = _slowed(link_pushed, link_drag) if imposed is None else imposed
        gap = self.angle - link.angle
        closing = speed - link_speed
        after = gap + h * closing
        if -half_gap <= after <= half_gap:
            link_angle = link.angle + h * link_speed
            angle = self.angle + h * speed
        else:
            # Apart until they meet (at once where they touched already), from there on together.
            touching = half_gap if after > 0.0 else -half_gap
            alone = (touching - gap) / closing if closing else 0.0
            alone = 0.0 if alone <= 0.0 else h if alone > h else alone
            link_angle = link.angle + alone * link_speed
            together = (inertia * pushed + link_inertia * link_pushed) / both
            speed = link_speed = _slowed(together, both_drag) if imposed is None else imposed
            link_angle += (h - alone) * speed
            angle = link_angle + touching
        if not link.lower <= link_angle <= link.upper:
            stop = link.lower if link_angle < link.lower else link.upper
            side = math.copysign(1.0, link_angle - stop)
            link_angle = stop
            link_speed = 0.0
            if side * (angle - stop) >= link.half_backlash:
                angle = stop + side * link.half_backlash
                speed = 0.0
        link.angle = link_angle
        link.speed = link_speed
        self.angle = angle
        self.speed = speed


FINGER = 1e-5
"""Inertia of what a motor turns against its stops, a small beam, kg m2."""


def between(stops: Tuple[float, float]) -> "DrivenLink":
    """Return the DrivenLink that a motor turns between its stops, lower and upper, rad."""
    return DrivenLink(0.0, FINGER, 0.0, 0.0, *stops)


class DrivenLink(object):
    """The link behind the gap: inertia, friction, stops and the torque on it.

    Attributes:
        imposed: the speed that something far stronger gives it, rad/s; None: it is free.
    """

    def __init__(
        self,
        angle: float,
        inertia: float,
        friction: float,
        backlash: float,
        lower: float,
        upper: float,
    ) -> None:
        self.angle = angle
        self.speed = 0.0
        self.inertia = inertia
        self.friction = friction
        self.half_backlash = backlash / 2.0
        self.lower = lower
        self.upper = upper
        self.load = 0.0
        self.imposed = None  # type: Optional[float]
        self._jammed = False

    @property
    def jammed(self) -> bool:
        """Whether it is blocked."""
        return self._jammed

    @jammed.setter
    def jammed(self, blocked: bool) -> None:
        self._jammed = blocked
        self.imposed = 0.0 if blocked else None
