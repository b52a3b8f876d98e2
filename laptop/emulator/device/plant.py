"""The arm behind the encoders: a drive per joint, gravity, the pen and the paper's drag.

Gravity pulls an arm in space down by what it weighs (see `masses`); the paper drags at the pen of
one in the plane.  Units are SI: rad, s, Nm, kg m2, V, N.
"""

import math
from typing import Optional, Sequence, Tuple

from laptop.emulator.device.masses import inertias, weighed
from laptop.emulator.device.motor_and_link import Drive, DrivenLink, between
from laptop.emulator.device.plant_constants import at_port, motor_constants
from robot.motion import kinematics
from robot.motion.gravity import Gravity

MYPY = False
if MYPY:
    from typing import Dict, List  # noqa: F401

    from laptop.emulator.device.plant_constants import PlantConstants  # noqa: F401
    from robot.motion.chains import FixedPoint  # noqa: F401
    from shared.arm_description import Arm, Pen  # noqa: F401


PEN_TOUCH_SHARE, PEN_LIFT_SHARE = 0.8, 0.7
"""Shares of the turn from `up` to `down` at which the pen meets the paper and leaves it.

`down` presses the pen a little, so it stays on the paper for a part of the turn back."""


class ArmPlant(object):
    """The arm that the emulated brick moves.

    Args:
        arm: its description; the true backlash differs from it where the plant says so.
        plant: constants, as `read_plant` returns them.
        start: joint angles at the start, rad; the home pose if None.

    Attributes:
        drives: port letter -> Drive.
        joints: the joints' Drives, from the base outwards.
        links: their DrivenLinks.
        pen_down: whether the pen is on the paper.
    """

    def __init__(
        self, arm: "Arm", plant: "PlantConstants", start: Optional[Sequence[float]] = None
    ) -> None:
        self.arm = arm
        self.plant = plant
        self.drives = {}  # type: Dict[str, Drive]
        self.joints = []  # type: List[Drive]
        self.links = []  # type: List[DrivenLink]
        start = [joint.home for joint in arm.joints] if start is None else start
        self._gravity = Gravity(weighed(arm, plant), plant["gravity"])
        self._pen_drag = 0.0 if self.weighs else plant["pen_drag"]  # no paper in space
        for joint, angle, inertia in zip(arm.joints, start, inertias(arm, plant)):
            own = at_port(plant, joint.port)
            error = math.radians(own["zero_error"])
            backlash = own["backlash"]
            link = DrivenLink(
                angle + error,
                inertia,
                own["link_friction"],
                joint.backlash if backlash is None else math.radians(backlash),
                -math.inf if joint.stop_lower is None else joint.stop_lower,
                math.inf if joint.stop_upper is None else joint.stop_upper,
            )
            drive = self._drive(
                joint.port, joint.motor, joint.gear * joint.direction, link, angle + error
            )
            self.drives[joint.port] = drive
            self.joints.append(drive)
            self.links.append(link)
        self._positions = kinematics.chain_of(arm).positions
        # Joint angles, rad, and where the joints and the tip are there, cm.
        self._placed_at = None  # type: Optional[Tuple[float, ...]]
        self._places = ()  # type: Sequence[FixedPoint]
        self._heavy = self.weighs
        # Joint angles, rad, and the torques of gravity there, Nm.
        self._pulled_at, self._torques = None, ()  # type: Optional[List[float]], Sequence[float]
        self.pen_down = not arm.pen  # one without a motor always is
        self._pen = None  # type: Optional[Drive]  # its motor
        self._pen_at = None  # type: Optional[float]  # its angle at the last step, rad
        if arm.pen:
            self._pen = self._drive(arm.pen.port, arm.pen.motor, 1.0, None, arm.pen.up)
            self.drives[arm.pen.port] = self._pen

    def _drive(
        self, port: str, kind: str, ratio: float, link: Optional[DrivenLink], angle: float
    ) -> Drive:
        motor = motor_constants(kind, at_port(self.plant, port))
        return Drive(motor, self.plant["voltage"], ratio, link, angle)

    def add_bare_motor(
        self, port: str, kind: str, stops: Optional[Tuple[float, float]] = None
    ) -> None:
        """Plug in a motor that moves nothing, between its stops (rad) if there are any."""
        self.drives[port] = self._drive(port, kind, 1.0, stops and between(stops), 0.0)

    @property
    def weighs(self) -> bool:
        """Whether gravity pulls at the joints."""
        return self._gravity.loaded

    @property
    def q(self) -> Tuple[float, ...]:
        """True joint angles (of the links), rad."""
        return tuple([link.angle for link in self.links])

    def tip(self) -> Tuple[float, float, Optional[float]]:
        """Return the true tip, cm: x, y and z, which is None in the plane."""
        x, y, *z = self._placed()[-1]
        return x, y, z[0] if z else None

    def _placed(self) -> "Sequence[FixedPoint]":
        """Return where the joints and the tip truly are, cm."""
        q = self.q
        if q != self._placed_at:
            self._placed_at, self._places = q, self._positions(self.arm, q)
        return self._places

    def step(self, h: float) -> None:
        """Advance everything by `h` seconds."""
        pen = self._pen
        if pen is not None and pen.angle != self._pen_at and self.arm.pen:
            self._pen_at = pen.angle
            self.pen_down = self._pen_touches(self.arm.pen, pen.angle)
        self._load_links()
        for drive in self.drives.values():
            if drive.duty or drive.speed or drive.link is not None:
                drive.step(h)

    def _pen_touches(self, pen: "Pen", angle: float) -> bool:
        share = (angle - pen.up) / (pen.down - pen.up)
        return share > (PEN_LIFT_SHARE if self.pen_down else PEN_TOUCH_SHARE)

    def _load_links(self) -> None:
        """Set the links' torques: constant load, gravity, and the paper's drag at the pen."""
        links, load = self.links, self.plant["load"]
        if self._heavy:
            q = [link.angle for link in links]
            if q != self._pulled_at:  # mostly it stands
                self._pulled_at, self._torques = q, self._gravity.torques(q)
            for link, torque in zip(links, self._torques):
                link.load = load + torque
            return
        moving = False
        for link in links:
            link.load = load
            moving = moving or link.speed != 0.0
        if moving and self.pen_down and self._pen_drag:
            self._drag_pen()

    def _drag_pen(self) -> None:
        *axes, (x, y) = self._placed()
        levers = []  # m: each joint moves the tip across its own
        v_x = v_y = 0.0
        for link, (axis_x, axis_y) in zip(self.links, axes):
            speed, across, along = link.speed, 0.01 * (axis_y - y), 0.01 * (x - axis_x)
            v_x += across * speed
            v_y += along * speed
            levers.append((link, across, along))
        # Below 5 mm/s the drag fades with speed: a stiff sign change would ring at this step.
        force = -self._pen_drag / max(math.sqrt(v_x * v_x + v_y * v_y), 0.005)
        for link, across, along in levers:
            link.load = link.load + across * force * v_x + along * force * v_y
