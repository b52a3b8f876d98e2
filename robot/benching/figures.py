"""What a motor is, from how it turned: speed per volt, friction, brake distance, inertia.  Pure.

What is measured, at the motor's shaft and in volts (the DC motor's equation times R / Kt):

    u = Ke w + F + J dw/dt

u is duty times battery, w the speed.  Steady speeds in both directions give Ke and F by a straight
line; what pulls one way only drops out.  J is what speeding up takes beside that: the integral of
u - Ke w over what it is when steady.  (Not what braking takes: then the link runs on in its play.)
"""

import collections
import math

from shared.arm_description import ArmError
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Any, Dict, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    Figures = Dict[str, Any]  # as they stand in the file: words and numbers

if MYPY:
    Pass = NamedTuple(
        "Pass",
        [
            ("speed", float),
            ("duty", float),
            ("volts", float),
            ("behind", float),
            ("extra", float),
            ("braked", Optional[float]),
        ],
    )
else:
    Pass = record("Pass", "speed duty volts behind extra braked")
"""One pass, at the motor's shaft and positive the way it went.

speed, duty  when steady, rad/s and %
volts        of the battery, V
behind       how far speeding up left it behind the steady motion, rad
extra        duty beside that of the steady motion while it sped up, % s
braked       from where it was braked to where it stood, rad; None: it was held
"""


def figures(pairs, kind):
    # type: (Sequence[Sequence[Pass]], str) -> Figures
    """What a motor is, from pairs of Passes there and back.

    Returns:
        OrderedDict: "kind", "volts", "no_load_deg_per_s" (at full duty; of a joint it is
        extrapolated), "emf_volts_s_per_rad", "friction_volts", "friction_duty_percent"; and where
        it was braked "brake_from_deg_per_s", "brake_deg" of the fastest pass, "brake_time_s" (in
        which the speed falls to 1/e without friction), "inertia_volts_s2_per_rad".

    Raises:
        ArmError: the speeds do not rise with the voltage.
    """
    points = []
    for pair in pairs:
        speed = sum(each.speed for each in pair) / 2
        points.append((speed, sum(each.duty * each.volts for each in pair) / 200))
    emf, friction = _line(points)
    if emf <= 0:
        raise ArmError("the motor's speed does not rise with the voltage: is it free to turn?")
    passes = [each for pair in pairs for each in pair]
    volts = sum(each.volts for each in passes) / len(passes)
    found = collections.OrderedDict(
        (
            ("kind", kind),
            ("volts", volts),
            ("no_load_deg_per_s", math.degrees((volts - friction) / emf)),
            ("emf_volts_s_per_rad", emf),
            ("friction_volts", friction),
            ("friction_duty_percent", 100 * friction / volts),
        )
    )  # type: Figures
    braked = [(each, each.braked) for each in passes if each.braked is not None]
    if braked:
        inertia = _inertia([each for each, _ in braked], emf)
        fastest, way = max(braked, key=lambda pair: pair[0].speed)
        found["brake_from_deg_per_s"] = math.degrees(fastest.speed)
        found["brake_deg"] = math.degrees(way)
        found["brake_time_s"] = inertia / emf
        found["inertia_volts_s2_per_rad"] = inertia
    for name, value in found.items():
        if name != "kind":
            found[name] = float("{:.5g}".format(value))
    return found


def _inertia(passes, emf):
    # type: (Sequence[Pass], float) -> float
    """J from speeding up, the fast passes counting for more."""
    momenta = [each.volts * each.extra / 100 + emf * each.behind for each in passes]
    return sum(p * each.speed for p, each in zip(momenta, passes)) / sum(
        each.speed**2 for each in passes
    )


def _line(points):
    # type: (Sequence[Tuple[float, float]]) -> Tuple[float, float]
    """(slope, height at 0) of the straight line nearest to points (x, y)."""
    n = float(len(points))
    x_mean, y_mean = sum(x for x, _ in points) / n, sum(y for _, y in points) / n
    slope = sum((x - x_mean) * (y - y_mean) for x, y in points) / sum(
        (x - x_mean) ** 2 for x, _ in points
    )
    return slope, y_mean - slope * x_mean
