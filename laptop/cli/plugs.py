"""What is plugged into the outputs of the emulated brick, as the options of `simulate` say it."""

from __future__ import annotations

from typing import Any

from laptop.simulator import session
from laptop.simulator.device.wheels import read_wheels
from shared.arm_description import Arm

NO_ARM = "none"
"""Name of no arm: a bare brick."""

FREE_MOTOR = ("D", "large")
"""Port and kind of the motor beside an arm, where that leaves the port free and nothing is said."""


def plugged(
    arm: Arm | None, plugs: tuple[str, ...], wheels: dict[str, Any] | None
) -> dict[str, str]:
    """Return port -> kind of the motors beside the arm's.

    Raises:
        InvalidSimulationOption: it is no motor, or its port is taken.
    """
    taken = {} if arm is None else {joint.port: f"its {joint.name}" for joint in arm.joints}
    if arm and arm.pen:
        taken[arm.pen.port] = "its pen"
    extra: dict[str, str] = {}
    for text in plugs:
        port, _, kind = text.partition("=")
        if port not in tuple("ABCD") or kind not in ("large", "medium"):
            raise session.InvalidSimulationOption(
                f"plug '{text}': write PORT=KIND with a port from A to D and large or medium"
            )
        if arm and port in taken:
            raise session.InvalidSimulationOption(
                f"plug '{text}': at port {port} the arm {arm.name} has {taken[port]}; choose "
                f"another port, or --arm {NO_ARM} for a brick without an arm"
            )
        if port in extra:
            raise session.InvalidSimulationOption(
                f"plug '{text}': port {port} is plugged twice; give it once"
            )
        extra[port] = kind
    if arm and FREE_MOTOR[0] not in taken:
        extra.setdefault(*FREE_MOTOR)
    if wheels:
        for side in ("left", "right"):
            extra.setdefault(wheels[side], "large")
    return extra


def wheels_of(text: str | None, arm: Arm | None) -> dict[str, Any] | None:
    """Return the constants of the robot's wheels, None without.

    Raises:
        InvalidSimulationOption, BadWheels
    """
    if text is None:
        return None
    if arm is not None:
        raise session.InvalidSimulationOption(
            f"wheels '{text}': they carry a robot without an arm; add --arm {NO_ARM}"
        )
    return read_wheels(text)
