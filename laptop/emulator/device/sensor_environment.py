"""Quantities of the emulated world for its sensors: the tip, the turning of a link or robot."""

import math
from typing import Callable, Dict, List, Sequence, Tuple

from laptop.emulator.device.plant import ArmPlant
from laptop.emulator.device.sensor_orders import BadSensor

MYPY = False
if MYPY:
    from laptop.emulator.device.brick import EmulatedBrick  # noqa: F401
    from laptop.emulator.device.motor_and_link import DrivenLink  # noqa: F401
    from laptop.emulator.device.sensors import SensedWorld  # noqa: F401
    from laptop.emulator.device.wheels import BarePlant  # noqa: F401

    SensorPlace = Dict[str, float]  # x, y and z, where they are, cm


ROBOT, TIP, WALL, LINE = "robot", "tip", "wall", "line"
"""Words of an order for quantities of the emulated world."""

STRAIGHT_LENGTH, BEND_RADIUS = 60.0, 30.0
"""Length of the straights of the line on the floor, and radius of the half circles between, cm.

A robot that starts at 0, 0 and looks along y stands on the middle of the right straight."""
LINE_WIDTH = 2.0
"""Width of the line on the floor, cm."""
SPOT_WIDTH = 1.0
"""Width of the spot of floor that a colour sensor sees, cm."""
FLOOR_LIGHT, LINE_LIGHT = 85.0, 6.0
"""Light that comes back from the floor and from the line, %."""


class _WorldQuantity(object):
    """A quantity of the world now, as a Signal is one over time.

    Args:
        value, slope: callables that give the quantity, and its rate of change, 1/s.
    """

    def __init__(
        self, value: Callable[[], float], slope: Callable[[], float] = lambda: 0.0
    ) -> None:
        self._value = value
        self._slope = slope

    def value(self, t: float) -> float:
        """Return the value now, which must be `t`."""
        return self._value()

    def slope(self, t: float) -> float:
        """Return its rate of change now, 1/s."""
        return self._slope()


def environment_of(brick: "EmulatedBrick") -> "SensedWorld":
    """Return `environment(word, place)` for an EmulatedBrick, see `sensors.Measuring`.

    It raises BadSensor for what this brick does not have.
    """

    def environment(word: str, place: "SensorPlace") -> _WorldQuantity:
        plant = brick.plant
        known = []  # type: List[str]
        if isinstance(plant, ArmPlant):
            links = _links(plant)
            known = [TIP] + sorted(links)
            if word == TIP:
                return _tip(plant, place)
            if word in links:
                return _turning(links[word])
        elif plant.wheels is not None:
            known = [ROBOT, WALL, LINE]
            if word == ROBOT:
                return _heading(plant)
            if word == WALL:
                return _wall(plant, place)
            if word == LINE:
                return _line(plant, place)
        raise BadSensor(
            "sensor: there is no {} for it to see here; write a value, or one of {}".format(
                word, ", ".join(known) or "nothing: this brick has neither arm nor wheels"
            )
        )

    return environment


def _tip(plant: ArmPlant, place: "SensorPlace") -> _WorldQuantity:
    """Return the distance from the sensor to the arm's true tip, cm."""

    def distance() -> float:
        x, y, z = plant.tip()
        across = math.hypot(x - place["x"], y - place["y"])
        return math.hypot(across, (z or 0.0) - place["z"])

    return _WorldQuantity(distance)


def _heading(plant: "BarePlant") -> _WorldQuantity:
    """Return the angle and rate of the robot, deg, clockwise as seen from above."""
    return _WorldQuantity(
        lambda: -math.degrees(plant.heading), lambda: -math.degrees(plant.turning)
    )


def _wall(plant: "BarePlant", place: "SensorPlace") -> _WorldQuantity:
    """Return the distance of the robot, the way it looks, to a wall across at the place's x, cm."""

    def distance() -> float:
        x, _, _ = plant.tip()
        ahead = place["x"] - x
        towards = math.cos(plant.heading)
        # Beside a wall, or looking away from it, there is nothing to hear.
        return ahead / towards if ahead * towards > 0 else math.inf

    return _WorldQuantity(distance)


def _line(plant: "BarePlant", place: "SensorPlace") -> _WorldQuantity:
    """Return the light from the floor below a sensor that is fixed to the robot, %."""

    def reflect() -> float:
        x, y, _ = plant.tip()
        ahead, left = math.cos(plant.heading), math.sin(plant.heading)
        x += place["x"] * ahead - place["y"] * left
        y += place["x"] * left + place["y"] * ahead
        beside = line_distance(x, y) - LINE_WIDTH / 2
        share = min(1.0, max(0.0, 0.5 + beside / SPOT_WIDTH))  # of the spot that is on the floor
        return LINE_LIGHT + share * (FLOOR_LIGHT - LINE_LIGHT)

    return _WorldQuantity(reflect)


def line_distance(x: float, y: float) -> float:
    """Return the distance of a point from the middle of the line on the floor, cm."""
    from_straight = max(abs(y) - STRAIGHT_LENGTH / 2, 0.0)
    return abs(math.hypot(x + BEND_RADIUS, from_straight) - BEND_RADIUS)


def line_points(steps: int = 60) -> List[Tuple[float, float]]:
    """Return points (x, y) along the middle of the line, cm, the last again the first."""
    half = [math.pi * k / steps for k in range(steps + 1)]
    top = [
        (
            BEND_RADIUS * math.cos(a) - BEND_RADIUS,
            BEND_RADIUS * math.sin(a) + STRAIGHT_LENGTH / 2,
        )
        for a in half
    ]
    return top + [(-2 * BEND_RADIUS - x, -y) for x, y in top] + top[:1]


def _links(plant: ArmPlant) -> Dict[str, List["DrivenLink"]]:
    """Return link name -> the links that turn it about its own axis, from the base outwards."""
    turned_by = {}  # type: Dict[str, List[DrivenLink]]
    turning = []  # type: List[DrivenLink]
    for joint, link in zip(plant.arm.joints, plant.links):
        turning.append(link)
        turned_by[joint.name] = list(turning)
        if joint.name == "base":
            turning = []  # about the vertical, which no other joint of an arm in space turns about
    return turned_by


def _turning(links: Sequence["DrivenLink"]) -> _WorldQuantity:
    """Return the angle, deg, and rate of a link, clockwise where its joints' are the other way."""
    return _WorldQuantity(
        lambda: -math.degrees(sum(link.angle for link in links)),
        lambda: -math.degrees(sum(link.speed for link in links)),
    )
