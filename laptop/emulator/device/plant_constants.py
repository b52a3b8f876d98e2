"""The plant's constants: their table, and the parsing of texts such as `backlash=3,seed=4`.

Constants of the EV3 motors: derived from the loaded and no-load points of published measurements,
with the rotor inertia set so that the stopping distances of real motors come out.
"""

import random
from typing import Any, Dict, Mapping, NamedTuple, Optional, cast

from laptop.emulator.constants import Constant, ConstantTable, Wording
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import TypedDict  # noqa: F401

    # The true plant: constants in the units of their table; None: not given.
    PlantConstants = TypedDict(
        "PlantConstants",
        {
            "voltage": float,
            "torque_constant": float,
            "emf_constant": float,
            "resistance": float,
            "rotor_inertia": float,
            "rotor_friction": float,
            "link_friction": float,
            "shoulder_inertia": float,
            "elbow_inertia": float,
            "pen_drag": float,
            "load": float,
            "backlash": Optional[float],
            "zero_error": float,
            "phase": Optional[float],
            "access": Optional[float],
            "cpu": float,
            "encoder": int,
            "spread": float,
            "seed": Optional[float],
            "gravity": float,
            "upper_arm_mass": float,
            "forearm_mass": float,
            "motor_mass": float,
            "tip_mass": float,
            "base_inertia": float,
        },
    )
    # The constants that may differ from port to port, as they are at one of them.
    PortConstants = TypedDict(
        "PortConstants",
        {
            "torque_constant": float,
            "emf_constant": float,
            "resistance": float,
            "rotor_inertia": float,
            "rotor_friction": float,
            "link_friction": float,
            "backlash": Optional[float],
            "zero_error": float,
            "phase": float,
        },
    )


MotorConstants = NamedTuple(
    "MotorConstants",
    [
        ("torque_constant", float),
        ("emf_constant", float),
        ("resistance", float),
        ("friction", float),
        ("inertia", float),
    ],
)
"""Constants of a motor: Nm/A, V s/rad, ohm, Nm and kg m2, at its output shaft."""

MOTORS = {
    "large": MotorConstants(0.275, 0.473, 5.50, 0.0165, 0.0014),
    "medium": MotorConstants(0.246, 0.291, 10.7, 0.0246, 0.0005),
}
"""Nominal constants by kind of motor."""

CONSTANTS = {
    "voltage": Constant(8.0, (4.5, 10.0), "V", "battery voltage at the motors"),
    "torque_constant": Constant(1.0, (0.5, 2.0), "x", "motor torque per ampere, times nominal"),
    "emf_constant": Constant(1.0, (0.5, 2.0), "x", "back-EMF per speed, times nominal"),
    "resistance": Constant(1.0, (0.5, 2.0), "x", "winding resistance, times nominal"),
    "rotor_inertia": Constant(1.0, (0.2, 5.0), "x", "rotor inertia, times nominal"),
    "rotor_friction": Constant(1.0, (0.0, 5.0), "x", "friction in the motor, times nominal"),
    "link_friction": Constant(0.01, (0.0, 0.2), "Nm", "friction of the bearing behind the gap"),
    "shoulder_inertia": Constant(0.003, (1e-5, 0.1), "kg m2", "first link and all it carries"),
    "elbow_inertia": Constant(0.0006, (1e-5, 0.1), "kg m2", "second link with the pen"),
    "pen_drag": Constant(
        0.04, (0.0, 2.0), "N", "pen on paper, in the plane; a pen of 10 g resting on it"
    ),
    "load": Constant(0.0, (-0.4, 0.4), "Nm", "constant torque on every joint"),
    "backlash": Constant(
        None, (0.0, 20.0), "deg", "play at every joint; as described if not given"
    ),
    "zero_error": Constant(0.0, (-5.0, 5.0), "deg", "true joint angles where the zero is believed"),
    "phase": Constant(
        None,
        (0.0, 0.5),
        "deg",
        "where between two encoder edges a shaft starts; 0.25 if not given, anywhere with a seed",
    ),
    "access": Constant(
        None,
        (0.0, 0.1),
        "s",
        "time of one sysfs access; if not given cpu x 0.00044, 0.001 where that is 0",
    ),
    "cpu": Constant(
        1.0,
        (0.0, 20.0),
        "x",
        "how slowly the brick computes: 1 as it truly does, 2 half as fast, 0 in no time",
    ),
    "encoder": Constant(
        1,
        (1, 100),
        "counts/deg",
        "resolution of the encoders, a whole number; with a much finer one the brick may wait for "
        "joints that friction holds",
        int,
    ),
    "spread": Constant(0.2, (0.0, 0.5), "", "half-width of the random draw, as a fraction"),
    "seed": Constant(None, (0, 2**31), "", "draw the scattered constants with this seed"),
}

CPU = CONSTANTS["cpu"].default
"""Default slowness of an emulated brick, times the real one's time."""

IN_SPACE = {
    "gravity": Constant(9.81, (0.0, 25.0), "m/s2", "gravity; 0 lets nothing weigh"),
    "upper_arm_mass": Constant(30.0, (1.0, 500.0), "g", "beams of the upper arm"),
    "forearm_mass": Constant(15.0, (1.0, 500.0), "g", "beams of the forearm"),
    "motor_mass": Constant(1.0, (0.2, 3.0), "x", "motors that are carried, times nominal"),
    "tip_mass": Constant(5.0, (0.0, 500.0), "g", "the tip: a ball, or what it holds"),
    "base_inertia": Constant(
        0.001, (1e-5, 0.1), "kg m2", "the turntable with the shoulder's motor, without links"
    ),
}
"""Constants of arms in space only."""

CONSTANTS.update(IN_SPACE)

SCATTERED = {
    "voltage", "shoulder_inertia", "elbow_inertia", "pen_drag", "upper_arm_mass", "forearm_mass",
    "motor_mass", "tip_mass", "base_inertia",
}  # fmt: skip
"""Constants that a seed draws around their value once for the whole plant."""

SCATTERED_BY_PORT = {
    "torque_constant", "emf_constant", "resistance", "rotor_inertia", "rotor_friction",
    "link_friction", "phase",
}  # fmt: skip
"""Constants that a seed draws for every motor by itself."""

_DRAW_ORDER = sorted(
    CONSTANTS, key=lambda key: (key == "encoder", key == "cpu", key in IN_SPACE, key)
)
"""Order in which a seed draws: newer keys last, so that its plants stay the same."""


class BadPlant(ArmError, ValueError):
    """A plant constant that is unknown or out of range."""


TABLE = ConstantTable(
    "plant",
    CONSTANTS,
    BadPlant,
    Wording("no plant constant '{key}' in '{item}'; known: {known}", "NUMBER", "{}"),
    ranged=set(CONSTANTS) - {"seed", "spread"},
)


def read_plant(text: str = "", measured: Optional[Dict[str, Any]] = None) -> "PlantConstants":
    """Read the plant constants of a text such as `backlash=3,voltage=7.2,load=-0.1..0.1,seed=4`.

    `KEY=LOW..HIGH` draws uniformly; `seed` scatters the frictions, inertias and the voltage by up
    to `spread` around their values, and (see `at_port`) every motor's own constants.  The same text
    draws the same plant.

    Args:
        text: KEY=VALUE pairs with commas between them; "" for the defaults.
        measured: name -> float, in place of the defaults; and "ports": port -> such a dict, for
            that port alone.  Constants in the text hold at all ports.

    Returns:
        dict, name -> float or None (not given and without a default); and "ports" as measured.

    Raises:
        BadPlant: naming the key, the value and its range.
    """
    given = TABLE.parse(text)[""]
    measured = measured or {}
    seed = given.get("seed", [None])[0]
    rng = random.Random(int(seed or 0))
    spread = given.get("spread", [CONSTANTS["spread"].default])[0]
    plant = {}  # type: Dict[str, Any]
    for key in _DRAW_ORDER:
        bounds = given.get(key, [measured.get(key, CONSTANTS[key].default)])
        deviate = rng.uniform(-1, 1)
        if len(bounds) == 2:
            plant[key] = (bounds[0] + bounds[1]) / 2 + deviate * (bounds[1] - bounds[0]) / 2
        elif seed is not None and key in SCATTERED:
            plant[key] = bounds[0] * (1 + spread * deviate)
        else:
            plant[key] = bounds[0]
    if "ports" in measured:
        plant["ports"] = {
            port: {key: value for key, value in own.items() if key not in given}
            for port, own in measured["ports"].items()
        }
    return cast("PlantConstants", plant)


def at_port(plant: Mapping[str, Any], port: str) -> "PortConstants":
    """Return the plant's constants as they are at one port: no two motors are alike if drawn.

    The phase of its encoder is always a number, deg.
    """
    own = dict(plant)  # type: Dict[str, Any]
    own.update(own.get("ports", {}).get(port, {}))
    rng = random.Random("{}/{}".format(plant["seed"], port))
    for key in _DRAW_ORDER:
        deviate = rng.uniform(-1, 1)
        if plant["seed"] is not None and key in SCATTERED_BY_PORT and key != "phase":
            own[key] *= 1 + plant["spread"] * deviate
        elif key == "phase" and plant["phase"] is None:
            own[key] = 0.25 if plant["seed"] is None else 0.25 * (1 + deviate)
    return cast("PortConstants", own)


def motor_constants(kind: str, plant: "PortConstants") -> MotorConstants:
    """Return the MotorConstants of one motor of this plant."""
    nominal = MOTORS[kind]
    return MotorConstants(
        nominal.torque_constant * plant["torque_constant"],
        nominal.emf_constant * plant["emf_constant"],
        nominal.resistance * plant["resistance"],
        nominal.friction * plant["rotor_friction"],
        nominal.inertia * plant["rotor_inertia"],
    )
