"""Plugs in the outputs of the emulated brick, as the options of `simulate` say it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from laptop.emulator.device.wheels import read_wheels
from laptop.emulator.faults import InvalidSimulationOption
from shared.arm_description import Arm

if TYPE_CHECKING:
    from laptop.emulator.device.wheels import Wheels

NO_ARM = "none"
"""Name of no arm: a bare brick."""

FREE_MOTOR = ("D", "large")
"""Port and kind of the motor beside an arm, where that leaves the port free and nothing is said."""


MAX_STOP_DEG = 100000.0
"""Farthest stop of a motor, deg."""


def plugged(
    arm: Arm | None, plugs: Sequence[str], wheels: Wheels | None
) -> tuple[dict[str, str], dict[str, tuple[float, float]]]:
    """Return port -> kind of the motors beside the arm's, and port -> stops of some of them, rad.

    Raises:
        InvalidSimulationOption: it is no motor, its port is taken, or its stops are none.
    """
    taken = {} if arm is None else {joint.port: f"its {joint.name}" for joint in arm.joints}
    if arm and arm.pen:
        taken[arm.pen.port] = "its pen"
    extra: dict[str, str] = {}
    stops = {}
    for text in plugs:
        port, _, rest = text.partition("=")
        kind, colon, limits = rest.partition(":")
        if port not in tuple("ABCD") or kind not in ("large", "medium"):
            raise InvalidSimulationOption(
                f"plug '{text}': write PORT=KIND with an output from A to D and large or medium, "
                "behind it :LOW..HIGH if it has stops, or an input from in1 to in4 and a sensor"
            )
        if arm and port in taken:
            raise InvalidSimulationOption(
                f"plug '{text}': at port {port} the arm {arm.name} has {taken[port]}; choose "
                f"another port, or --arm {NO_ARM} for a brick without an arm"
            )
        if port in extra:
            raise InvalidSimulationOption(
                f"plug '{text}': port {port} is plugged twice; give it once"
            )
        extra[port] = kind
        if colon:
            stops[port] = _stops(text, limits)
        if colon and wheels and port in (wheels["left"], wheels["right"]):
            raise InvalidSimulationOption(
                f"plug '{text}': the motor at port {port} turns a wheel, which has no stops; leave "
                f":{limits} out"
            )
    if arm and FREE_MOTOR[0] not in taken:
        extra.setdefault(*FREE_MOTOR)
    if wheels:
        for side in ("left", "right"):
            extra.setdefault(wheels[side], "large")
    return extra, stops


def _stops(text: str, limits: str) -> tuple[float, float]:
    """Return the stops that a plug names in degrees, rad."""
    number = r"[+-]?(?:\d+\.?\d*|\.\d+)"
    match = re.fullmatch(rf"({number})\.\.({number})", limits)
    lower, upper = map(float, match.groups()) if match else (1.0, -1.0)
    if not -MAX_STOP_DEG <= lower <= 0 <= upper <= MAX_STOP_DEG or lower == upper:
        raise InvalidSimulationOption(
            f"plug '{text}': the motor starts at 0 deg, so write its stops as LOW..HIGH from "
            f"{-MAX_STOP_DEG:g} to 0 and from 0 to {MAX_STOP_DEG:g} deg, like -90..40"
        )
    return math.radians(lower), math.radians(upper)


def wheels_of(text: str | None, arm: Arm | None) -> Wheels | None:
    """Return the constants of the robot's wheels, None without.

    Raises:
        InvalidSimulationOption, BadWheels
    """
    if text is None:
        return None
    if arm is not None:
        raise InvalidSimulationOption(
            f"wheels '{text}': they carry a robot without an arm; add --arm {NO_ARM}"
        )
    return read_wheels(text)
