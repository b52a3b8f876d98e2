"""What the emulated world itself shows a sensor: the tip, the turning of a link or of the robot."""

import math
from typing import Callable, Dict, List, Sequence, Tuple

from laptop.emulator.device.plant import ArmPlant
from laptop.emulator.device.sensor_orders import BadSensor

MYPY = False
if MYPY:
    from laptop.emulator.device.brick import EmulatedBrick  # noqa: F401
    from laptop.emulator.device.motor_and_link import DrivenLink  # noqa: F401
    from laptop.emulator.device.sensors import Scenery  # noqa: F401
    from laptop.emulator.device.wheels import BarePlant  # noqa: F401

    SensorPlace = Dict[str, float]  # x, y and z, where they are, cm


ROBOT, TIP, WALL, LINE = "robot", "tip", "wall", "line"

STRAIGHT, RADIUS = 60.0, 30.0
"""Of the line on the floor, cm: two straights, joined by half circles.  A robot that starts at 0, 0
and looks along y stands on the middle of the right one."""
LINE_WIDTH = 2.0
SPOT = 1.0
"""Across the spot of floor that a colour sensor sees, cm."""
FLOOR, INK = 85.0, 6.0
"""Light that comes back from the floor and from the line, %."""


class _Seen(object):
    """A quantity of the world now, as a Signal is one over time.

    Args:
        value, slope: callables; what it is and how fast it changes, 1/s.
    """

    def __init__(
        self, value: Callable[[], float], slope: Callable[[], float] = lambda: 0.0
    ) -> None:
        self._value = value
        self._slope = slope

    def value(self, t: float) -> float:
        """The value now, which must be `t`."""
        return self._value()

    def slope(self, t: float) -> float:
        """How fast it changes now, 1/s."""
        return self._slope()


def scene_of(brick: "EmulatedBrick") -> "Scenery":
    """Return `scene(word, place)` for the sensors of an EmulatedBrick, see `sensors.Measuring`.

    It raises BadSensor for what this brick has not.
    """

    def scene(word: str, place: "SensorPlace") -> _Seen:
        plant = brick.plant
        has = []  # type: List[str]
        if isinstance(plant, ArmPlant):
            links = _links(plant)
            has = [TIP] + sorted(links)
            if word == TIP:
                return _tip(plant, place)
            if word in links:
                return _turning(links[word])
        elif plant.wheels is not None:
            has = [ROBOT, WALL, LINE]
            if word == ROBOT:
                return _heading(plant)
            if word == WALL:
                return _wall(plant, place)
            if word == LINE:
                return _line(plant, place)
        raise BadSensor(
            "sensor: there is no {} for it to see here; write a value, or one of {}".format(
                word, ", ".join(has) or "nothing: this brick has neither arm nor wheels"
            )
        )

    return scene


def _tip(plant: ArmPlant, place: "SensorPlace") -> _Seen:
    """Distance from the sensor to the arm's true tip, cm."""

    def distance() -> float:
        x, y, z = plant.tip()
        across = math.hypot(x - place["x"], y - place["y"])
        return math.hypot(across, (z or 0.0) - place["z"])

    return _Seen(distance)


def _heading(plant: "BarePlant") -> _Seen:
    """Angle and rate of the robot, deg, clockwise as seen from above."""
    return _Seen(lambda: -math.degrees(plant.heading), lambda: -math.degrees(plant.turning))


def _wall(plant: "BarePlant", place: "SensorPlace") -> _Seen:
    """Distance of the robot, the way it looks, to a wall across at the place's x, cm."""

    def distance() -> float:
        x, _, _ = plant.tip()
        ahead = place["x"] - x
        towards = math.cos(plant.heading)
        # Beside a wall, or looking away from it, there is nothing to hear.
        return ahead / towards if ahead * towards > 0 else math.inf

    return _Seen(distance)


def _line(plant: "BarePlant", place: "SensorPlace") -> _Seen:
    """Light from the floor below a sensor that is fixed to the robot, %."""

    def reflect() -> float:
        x, y, _ = plant.tip()
        ahead, left = math.cos(plant.heading), math.sin(plant.heading)
        x += place["x"] * ahead - place["y"] * left
        y += place["x"] * left + place["y"] * ahead
        beside = line_distance(x, y) - LINE_WIDTH / 2
        share = min(1.0, max(0.0, 0.5 + beside / SPOT))  # of the spot that is on the floor
        return INK + share * (FLOOR - INK)

    return _Seen(reflect)


def line_distance(x: float, y: float) -> float:
    """Return the distance of a point from the middle of the line on the floor, cm."""
    from_straight = max(abs(y) - STRAIGHT / 2, 0.0)
    return abs(math.hypot(x + RADIUS, from_straight) - RADIUS)


def line_points(steps: int = 60) -> List[Tuple[float, float]]:
    """Return points (x, y) along the middle of the line, cm, the last again the first."""
    half = [math.pi * k / steps for k in range(steps + 1)]
    top = [(RADIUS * math.cos(a) - RADIUS, RADIUS * math.sin(a) + STRAIGHT / 2) for a in half]
    return top + [(-2 * RADIUS - x, -y) for x, y in top] + top[:1]


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


def _turning(links: Sequence["DrivenLink"]) -> _Seen:
    """Angle and rate of a link, clockwise where the joints' angles are counter-clockwise, deg."""
    return _Seen(
        lambda: -math.degrees(sum(link.angle for link in links)),
        lambda: -math.degrees(sum(link.speed for link in links)),
    )
