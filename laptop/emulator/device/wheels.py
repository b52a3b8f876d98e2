"""A brick without an arm: motors that turn freely, and a robot that rolls on two of them."""

import math
from typing import List, Optional, Tuple, cast

from laptop.emulator.constants import Constant, ConstantTable, Wording
from laptop.emulator.device.motor_and_link import Drive, between
from laptop.emulator.device.plant_constants import at_port, motor_constants
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Any, Dict, TypedDict  # noqa: F401

    from laptop.emulator.device.motor_and_link import DrivenLink  # noqa: F401
    from laptop.emulator.device.plant_constants import PlantConstants  # noqa: F401

    # Ports of the motors; cm, kg, Nm and deg as in the table.
    Wheels = TypedDict(
        "Wheels",
        {
            "left": str,
            "right": str,
            "diameter": float,
            "track": float,
            "mass": float,
            "friction": float,
            "x": float,
            "y": float,
            "heading": float,
        },
    )


_PORTS = ("A", "B", "C", "D")

CONSTANTS = {
    "left": Constant(None, _PORTS, "", "port of the left wheel's motor, a large one", str),
    "right": Constant(None, _PORTS, "", "port of the right wheel's motor, a large one", str),
    "diameter": Constant(5.6, (1.0, 30.0), "cm", "of the wheels"),
    "track": Constant(12.0, (2.0, 60.0), "cm", "between the wheels"),
    "mass": Constant(0.7, (0.05, 5.0), "kg", "of the robot, which the motors set in motion"),
    "friction": Constant(0.005, (0.0, 0.1), "Nm", "of each wheel as it rolls"),
    "x": Constant(0.0, (-1000.0, 1000.0), "cm", "where the middle between the wheels starts"),
    "y": Constant(0.0, (-1000.0, 1000.0), "cm", "where the middle between the wheels starts"),
    "heading": Constant(90.0, (-360.0, 360.0), "deg", "where it looks then; 0 along x, ccw"),
}


class BadWheels(ArmError, ValueError):
    """A pair of wheels that cannot be understood."""


TABLE = ConstantTable(
    "wheels",
    CONSTANTS,
    BadWheels,
    Wording("no wheels' constant '{key}' in '{item}'; known: {known}"),
)


def read_wheels(text: str) -> "Wheels":
    """Read the constants of a text such as `left=B,right=C,diameter=5.6`.

    Returns:
        dict, name -> float or port.

    Raises:
        BadWheels: naming the key, the value and what is allowed.
    """
    given = TABLE.parse(text)[""]
    wheels = {
        key: given[key][0] if key in given else constant.default
        for key, constant in CONSTANTS.items()
    }  # type: Dict[str, Any]
    if None in (wheels["left"], wheels["right"]) or wheels["left"] == wheels["right"]:
        raise BadWheels(
            "wheels '{}': write left=PORT,right=PORT, two ports from A to D".format(text)
        )
    return cast("Wheels", wheels)


class BarePlant(object):
    """Motors of a brick without an arm, which turn freely or drive a robot on two wheels.

    Wheels roll without slipping; the robot turns about the middle between them.

    Args:
        plant: constants, as `read_plant` returns them.
        wheels: as `read_wheels` returns them, or None.

    Attributes:
        drives: port letter -> Drive.
        heading: where the robot looks, rad, counter-clockwise from x; 0 without wheels.
        pen_down: whether the robot leaves a trail.
        links: those of an arm: none.
    """

    weighs = False
    links = ()  # type: Tuple[DrivenLink, ...]

    def __init__(self, plant: "PlantConstants", wheels: Optional["Wheels"] = None) -> None:
        self.plant = plant
        self.drives = {}  # type: Dict[str, Drive]
        self.wheels = wheels
        self.pen_down = wheels is not None
        self.heading = self._x = self._y = 0.0
        if wheels is not None:
            self._x, self._y = wheels["x"], wheels["y"]
            self.heading = math.radians(wheels["heading"])
        self._rolled = 0.0, 0.0  # angles of the wheels, rad

    def add_bare_motor(
        self, port: str, kind: str, stops: Optional[Tuple[float, float]] = None
    ) -> None:
        """Plug in a motor; at a wheel's port it moves half of the robot.

        Args:
            port: its letter.
            kind: "large" or "medium".
            stops: lower and upper angle that it can turn to, rad; None: it turns freely.
        """
        motor = motor_constants(kind, at_port(self.plant, port))
        wheels = self.wheels
        if wheels is not None and port in (wheels["left"], wheels["right"]):
            radius = 0.005 * wheels["diameter"]  # m
            motor = motor._replace(
                inertia=motor.inertia + 0.5 * wheels["mass"] * radius * radius,
                friction=motor.friction + wheels["friction"],
            )
        self.drives[port] = Drive(motor, self.plant["voltage"], link=stops and between(stops))

    @property
    def names(self) -> List[str]:
        """Names of what `q` holds: the motors' ports in order, and the heading."""
        return sorted(self.drives) + ([] if self.wheels is None else ["heading"])

    @property
    def q(self) -> Tuple[float, ...]:
        """Angles of the motors since the start and, on wheels, the heading, rad."""
        angles = tuple([self.drives[port].angle for port in sorted(self.drives)])
        return angles if self.wheels is None else angles + (self.heading,)

    def tip(self) -> Tuple[float, float, Optional[float]]:
        """Return the robot's place, cm: x, y and None, as it rolls in a plane."""
        return self._x, self._y, None

    @property
    def turning(self) -> float:
        """Rate at which the robot turns, rad/s, counter-clockwise; 0 without wheels."""
        wheels = self.wheels
        if wheels is None:
            return 0.0
        left, right = self.drives[wheels["left"]].speed, self.drives[wheels["right"]].speed
        return (right - left) * wheels["diameter"] / 2 / wheels["track"]

    def step(self, h: float) -> None:
        """Advance everything by `h` seconds."""
        for drive in self.drives.values():
            if drive.duty or drive.speed:
                drive.step(h)
        if self.wheels is not None:
            self._roll(self.wheels)

    def _roll(self, wheels: "Wheels") -> None:
        rolled = self.drives[wheels["left"]].angle, self.drives[wheels["right"]].angle
        if rolled == self._rolled:
            return  # mostly it stands
        left, right = (
            (now - before) * wheels["diameter"] / 2 for now, before in zip(rolled, self._rolled)
        )
        self._rolled = rolled
        turned = (right - left) / wheels["track"]
        # Along an arc one goes where its chord leads.
        towards = self.heading + turned / 2
        self._x += (left + right) / 2 * math.cos(towards)
        self._y += (left + right) / 2 * math.sin(towards)
        self.heading += turned
