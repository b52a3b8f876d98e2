"""A brick that was measured, as constants of the plant: the file of `robot/bench_brick.py`.

Motion alone tells no torques: friction and inertia are as of motors with the nominal torque per
ampere and resistance.  A bare motor tells what of a joint is its motor's; without one of that kind
the motor is taken as nominal, and the rest is the link's.  Of an arm in space the inertias stay
those of its masses.  A clock's jitter and Python's start are told to people only.
"""

import contextlib
import io
import json
import math
import os
import statistics
import tempfile
from typing import Any, Dict, Iterable, Optional, Tuple

from laptop.emulator.bundled_scripts import BENCH_BRICK
from laptop.emulator.device.plant_constants import CONSTANTS, MOTORS, TABLE, BadPlant
from laptop.emulator.rig import Rig
from robot.benching.laps import EMPTY_LAP
from robot.benching.measuring import FORMAT, VERSION

MYPY = False
if MYPY:
    from shared.arm_description import Arm  # noqa: F401

    Figures = Dict[str, Any]  # as bench_brick.py has written them, whoever has changed them since


NOT_COMPUTING = (EMPTY_LAP, "start: ", "motor: ", "late ", "read ", "write ")
"""Beginnings of pieces of work that do not tell how slowly a brick computes."""

MIN_PIECES = 5
"""Least number of pieces of work to estimate how slowly a brick computes."""

MIN_SLOWNESS = 0.002
"""Slowness up to which a brick computes in no time, times the real one's time."""

ADVICE = "; measure it anew: robot/bench_brick.py"


class BadConstants(BadPlant):
    """A file of measured constants that is missing, unreadable or implausible."""


def read_constants(file: str, arm: Optional["Arm"]) -> Dict[str, Any]:
    """Read what was measured of a brick, for `read_plant`.

    Args:
        file: its path.
        arm: shared.arm_description.Arm that is emulated.

    Returns:
        dict, name of the constant -> float, and "ports": port -> the same of the motor there.

    Raises:
        BadConstants: in one line.
    """
    figures = _load(file)
    measured = {"ports": {}}  # type: Dict[str, Any]
    try:
        _fill(measured, figures, arm)
        everywhere = {key: value for key, value in measured.items() if key != "ports"}
        for constants in [everywhere, *measured["ports"].values()]:
            for key, value in constants.items():
                TABLE.check(key, repr(value))
    except BadPlant as error:
        raise BadConstants("{}: {}".format(file, error)) from None
    except (KeyError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise BadConstants(
            "{}: a figure is missing or is not a number ({}: {}){}".format(
                file, type(error).__name__, error, ADVICE
            )
        ) from None
    return measured


def _load(file: str) -> "Figures":
    try:
        with open(file, encoding="utf-8") as text:
            figures = json.loads(text.read())
    except OSError as error:
        raise BadConstants(
            "cannot read {}: {}; give the file that robot/bench_brick.py has written".format(
                file, error.strerror
            )
        ) from None
    except ValueError:
        figures = None
    if not isinstance(figures, dict) or figures.get("format") != FORMAT:
        raise BadConstants(
            "{} was not written by robot/bench_brick.py; give the file that was".format(file)
        )
    if figures.get("version") != VERSION:
        raise BadConstants(
            "{} is of version {}, and this program reads {}{}".format(
                file, figures.get("version"), VERSION, ADVICE
            )
        )
    return figures


def _fill(measured: Dict[str, Any], figures: "Figures", arm: Optional["Arm"]) -> None:
    measured["cpu"] = _cpu(figures["laps_s"])
    if figures["access_s"] is not None:
        measured["access"] = max(0.0, float(figures["access_s"]))
    motors = figures["motors"]
    name = "none" if arm is None else arm.name
    if any("joint" in motor for motor in motors.values()) and figures["arm"] != name:
        raise BadPlant(
            "it was measured on the arm {}, not on {}; choose --arm {}".format(
                figures["arm"], name, figures["arm"]
            )
        )
    if motors:
        measured["voltage"] = statistics.mean(float(motor["volts"]) for motor in motors.values())
    rotors = _rotors(motors.values())
    for port, motor in motors.items():
        own = {}  # type: Dict[str, float]
        measured["ports"][port] = own
        nominal = MOTORS[motor["kind"]]
        own["emf_constant"] = motor["emf_volts_s_per_rad"] / nominal.emf_constant
        rotor = rotors[motor["kind"]]
        if "joint" not in motor:
            friction, inertia = _friction(motor), _inertia(motor)
        else:
            friction, inertia = _share(measured, own, motor, rotor, arm)
        own["rotor_friction"] = friction / nominal.friction
        own["rotor_inertia"] = inertia / nominal.inertia
        if "backlash_deg" in motor:
            own["backlash"] = float(motor["backlash_deg"])


def _torque(motor: "Figures") -> float:
    """Return the torque of such a motor per volt, Nm/V."""
    nominal = MOTORS[motor["kind"]]
    return nominal.torque_constant / nominal.resistance


def _friction(motor: "Figures") -> float:
    """Return the friction at the shaft of a measured motor, Nm."""
    return _torque(motor) * float(motor["friction_volts"])


def _inertia(motor: "Figures") -> float:
    """Return the inertia at the shaft of a measured motor, kg m2."""
    return _torque(motor) * float(motor["inertia_volts_s2_per_rad"])


def _rotors(motors: Iterable["Figures"]) -> Dict[str, Tuple[float, float]]:
    """Friction and inertia of a rotor by kind: the mean of the bare ones, or the nominal one."""
    rotors = {kind: (nominal.friction, nominal.inertia) for kind, nominal in MOTORS.items()}
    bare = [motor for motor in motors if "joint" not in motor]
    for kind in {motor["kind"] for motor in bare}:
        alike = [each for each in bare if each["kind"] == kind]
        rotors[kind] = statistics.mean(map(_friction, alike)), statistics.mean(map(_inertia, alike))
    return rotors


def _share(
    measured: Dict[str, Any],
    own: Dict[str, float],
    motor: "Figures",
    rotor: Tuple[float, float],
    arm: Optional["Arm"],
) -> Tuple[float, float]:
    """Give a joint's link what is not its rotor's; friction and inertia of the rotor."""
    gear = float(motor["gear"])
    all_friction = _friction(motor)
    friction = min(rotor[0], all_friction)
    own["link_friction"] = gear * (all_friction - friction)
    key = motor["joint"] + "_inertia"
    known = motor.get("inertia_volts_s2_per_rad") is not None and key in CONSTANTS
    if arm is None or arm.chain != "planar" or not known:
        return friction, rotor[1]
    all_inertia = _inertia(motor)
    least = CONSTANTS[key].allowed[0] / gear**2
    inertia = min(rotor[1], all_inertia - least)
    measured[key] = gear**2 * (all_inertia - inertia)
    return friction, inertia


# How slowly it computes


def _cpu(laps: Dict[str, Any]) -> float:
    """Return the median of how many times as long as at cpu=1 the pieces took."""
    reference = _laps_at_true_pace()
    ratios = [
        (_middle(laps, name) - _middle(laps, EMPTY_LAP))
        / (_middle(reference, name) - _middle(reference, EMPTY_LAP))
        for name in sorted(set(laps) & set(reference))
        if not name.startswith(NOT_COMPUTING)
    ]
    if len(ratios) < MIN_PIECES:
        raise BadPlant(
            "it tells how long {} known pieces of work take, of {} at least".format(
                len(ratios), MIN_PIECES
            )
        )
    slowness = statistics.median(ratios)
    if not math.isfinite(slowness):
        raise ValueError("laps_s")
    return slowness if slowness > MIN_SLOWNESS else 0.0


def _middle(laps: Dict[str, Any], name: str) -> float:
    return statistics.median_high(float(lap) for lap in laps[name])


def _laps_at_true_pace() -> Dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "brick.json")
        with contextlib.redirect_stdout(io.StringIO()), Rig("planar", plant="cpu=1") as rig:
            rig.run(BENCH_BRICK, "planar", "--json", file)
        with open(file, encoding="utf-8") as text:
            laps = json.loads(text.read())["laps_s"]  # type: Dict[str, Any]
            return laps


def in_words(measured: Dict[str, Any]) -> str:
    """Return a line for people."""
    parts = [
        "{} = {:.4g} {}".format(key, value, CONSTANTS[key].unit).rstrip()
        for key, value in measured.items()
        if key != "ports"
    ]
    parts += [
        "at {} {}".format(port, ", ".join("{} {:.3g}".format(*item) for item in own.items()))
        for port, own in measured["ports"].items()
    ]
    return "; ".join(parts)
