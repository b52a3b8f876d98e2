"""A motor's constants from how it turned: speed per volt, friction, braking, inertia.  Pure.

The model is the brushed DC motor with dry friction, its inductance neglected (e.g. N. S. Nise,
Control Systems Engineering, ch. 2), times R / Kt, so that all terms are volts at the motor's shaft:

    u = Ke w + F + J dw/dt

u is duty times battery, w the speed, rad/s.  Steady speeds in both directions give Ke and F by the
least-squares line; what pulls one way only, such as gravity, drops out of their mean.

J is from the integral over the time T of speeding up, so that no speed need be differentiated:

    J w = integral of (u - u_steady) dt + Ke (w T - angle turned)

(Not from braking: then the link runs on in its backlash, and its share is missing.)
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
"""One pass, at the motor's shaft and positive in its direction.

speed, duty  when steady, rad/s and %
volts        voltage of the battery, V
behind       angle by which speeding up left it behind the steady motion, rad
extra        integral of the duty beyond the steady motion's while it sped up, % s
braked       angle from where it was braked to where it stood, rad; None: it was held
"""


def figures(pairs, kind):
    # type: (Sequence[Sequence[Pass]], str) -> Figures
    """Return a motor's constants, from pairs of Passes there and back.

    Args:
        pairs: pairs of Passes, each at another speed.
        kind: "large" | "medium".

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
        fastest, angle = max(braked, key=lambda pair: pair[0].speed)
        found["brake_from_deg_per_s"] = math.degrees(fastest.speed)
        found["brake_deg"] = math.degrees(angle)
        found["brake_time_s"] = inertia / emf
        found["inertia_volts_s2_per_rad"] = inertia
    for name, value in found.items():
        if name != "kind":
            found[name] = float("{:.5g}".format(value))
    return found


def _inertia(passes, emf):
    # type: (Sequence[Pass], float) -> float
    """Return J, V s^2/rad: the least-squares line through 0 of momenta over speeds."""
    momenta = [each.volts * each.extra / 100 + emf * each.behind for each in passes]
    return sum(p * each.speed for p, each in zip(momenta, passes)) / sum(
        each.speed**2 for each in passes
    )


def _line(points):
    # type: (Sequence[Tuple[float, float]]) -> Tuple[float, float]
    """Return (slope, height at 0) of the least-squares line through points (x, y)."""
    n = float(len(points))
    x_mean, y_mean = sum(x for x, _ in points) / n, sum(y for _, y in points) / n
    slope = sum((x - x_mean) * (y - y_mean) for x, y in points) / sum(
        (x - x_mean) ** 2 for x, _ in points
    )
    return slope, y_mean - slope * x_mean
