"""One motor, its gear and the link behind the gap: two masses that meet.

The motor, with duty d (-1 .. 1), battery U, gear ratio n and joint speed w of the rotor:

    i = (d U - Ke n w) / R            the winding, whose inductance is left out
    n^2 J dw/dt = n Kt i - friction   the rotor, seen through its gear; i = 0 while it coasts
    J2 dw2/dt = load - friction2      the link

Kt is below Ke, as the losses of the gears within the motor are in it.  The gap, the backlash b, is
an exact dead zone (Nordin and Gutman, 2002): inside |angle - angle2| <= b/2 the two move freely.
Where it closes, the impact is inelastic, w = (J w + J2 w2) / (J + J2), and they go on as one mass.
A stiff spring in the gap would be the obvious model, but it needs far shorter steps.
Friction is Coulomb's.  A step takes at most h friction / J away from a speed and stops at 0
(time stepping with impulses, Stewart and Trinkle, 1996).  So what rests stays at rest, where
sign(w) would chatter.  Angles follow from the new speeds (semi-implicit Euler).
Units are SI: rad, s, Nm, kg m2, V.
"""

import math
from typing import Optional, Tuple

MYPY = False
if MYPY:
    from laptop.emulator.device.plant_constants import MotorConstants  # noqa: F401


def _slowed(speed: float, by: float) -> float:
    """Return `speed` after an impulse of Coulomb friction that takes away at most `by`."""
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

    Attributes:
        angle, speed: of the rotor, rad and rad/s at the joint.
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
        """Duty, -1 .. 1; 0 shorts the motor (brake), None leaves it open (coast)."""
        self.jammed = False
        """Whether a bare motor is blocked; behind a gear the link jams, and the gap stays."""
        self._step = None  # type: Optional[float]  # s, what these are for
        self._electric = self._per_step = ()  # type: Tuple[float, ...]

    def _prepare(self, h: float) -> None:
        """Compute once the factors of a step of `h` seconds: there are thousands of steps."""
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
            # Free until they meet (at once where they touched already), then together.
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


BEAM_INERTIA = 1e-5
"""Inertia of a small beam that a bare motor turns between stops, kg m2."""


def between(stops: Tuple[float, float]) -> "DrivenLink":
    """Return the DrivenLink that a motor turns between its stops, lower and upper, rad."""
    return DrivenLink(0.0, BEAM_INERTIA, 0.0, 0.0, *stops)


class DrivenLink(object):
    """The link behind the gap: inertia, friction, stops and the torque on it.

    Args:
        angle: where it starts, rad.
        inertia: kg m2.
        friction: of its bearing, Nm.
        backlash: width of the gap, rad.
        lower, upper: angles of its stops, rad; infinite where there is none.

    Attributes:
        speed: rad/s.
        load: torque on it, Nm.
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
