"""What lies behind the encoders: rotors, gears, gaps, links, friction, stops and the pen.

Per joint two masses, the rotor (seen through the gear) and the link, are separated by a real gap,
the backlash; where the gap is closed they move as one (contact is rigid, impacts are inelastic).
All friction is Coulomb's, solved as an impulse per step, so that things at rest stay at rest.  The
links' inertias are constants: the torques that one joint's acceleration puts on the other are left
out.  An arm in space is pulled down by what it weighs, and its inertias are those of the same
masses with the arm stretched out level.

Constants of the EV3 motors: derived from the loaded and no-load points of published measurements,
with the rotor inertia set so that the stopping distances of real motors come out (see the README).
Units here are SI: rad, s, Nm, kg m2, V, N.
"""

import math
import random
from collections import namedtuple

from robot.motion import kinematics
from robot.motion.gravity import Gravity
from shared.arm_description import PULLED_DOWN, ArmError

MotorConstants = namedtuple(
    "MotorConstants", "torque_constant emf_constant resistance friction inertia"
)
"""Nm/A, V s/rad, ohm, Nm and kg m2 at the motor's output shaft."""

MOTORS = {
    "large": MotorConstants(0.275, 0.473, 5.50, 0.0165, 0.0014),
    "medium": MotorConstants(0.246, 0.291, 10.7, 0.0246, 0.0005),
}

TOUCHES_AT, LEAVES_AT = 0.8, 0.7
"""Shares of the way from `up` to `down` at which the pen meets the paper and leaves it.

`down` presses the tip a little, which follows for as long."""

Constant = namedtuple("Constant", "default lower upper unit scatter meaning")
"""`scatter`: whether a random plant draws this constant around its value: once ("plant"), for every
motor by itself ("port"), or not (None)."""

CONSTANTS = {
    "voltage": Constant(8.0, 4.5, 10.0, "V", "plant", "battery voltage at the motors"),
    "torque_constant": Constant(
        1.0, 0.5, 2.0, "x", "port", "motor torque per ampere, times nominal"
    ),
    "emf_constant": Constant(1.0, 0.5, 2.0, "x", "port", "back-EMF per speed, times nominal"),
    "resistance": Constant(1.0, 0.5, 2.0, "x", "port", "winding resistance, times nominal"),
    "rotor_inertia": Constant(1.0, 0.2, 5.0, "x", "port", "rotor inertia, times nominal"),
    "rotor_friction": Constant(1.0, 0.0, 5.0, "x", "port", "friction in the motor, times nominal"),
    "link_friction": Constant(
        0.01, 0.0, 0.2, "Nm", "port", "friction of the bearing behind the gap"
    ),
    "shoulder_inertia": Constant(
        0.003, 1e-5, 0.1, "kg m2", "plant", "first link and all it carries"
    ),
    "elbow_inertia": Constant(0.0006, 1e-5, 0.1, "kg m2", "plant", "second link with the pen"),
    "pen_drag": Constant(
        0.04, 0.0, 2.0, "N", "plant", "pen on paper, in the plane; a pen of 10 g resting on it"
    ),
    "load": Constant(0.0, -0.4, 0.4, "Nm", None, "constant torque on every joint"),
    "backlash": Constant(
        None, 0.0, 20.0, "deg", None, "play at every joint; as described if not given"
    ),
    "zero_error": Constant(
        0.0, -5.0, 5.0, "deg", None, "true joint angles where the zero is believed"
    ),
    "phase": Constant(
        None,
        0.0,
        0.5,
        "deg",
        "port",
        "where between two encoder edges a shaft starts; 0.25 if not given, anywhere with a seed",
    ),
    "access": Constant(
        None,
        0.0,
        0.1,
        "s",
        None,
        "time of one sysfs access; if not given cpu x 0.00044, 0.001 where that is 0",
    ),
    "cpu": Constant(
        1.0,
        0.0,
        20.0,
        "x",
        None,
        "how slowly the brick computes: 1 as it truly does, 2 half as fast, 0 in no time",
    ),
    "spread": Constant(0.2, 0.0, 0.5, "", None, "half-width of the random draw, as a fraction"),
    "seed": Constant(None, 0, 2**31, "", None, "draw the scattered constants with this seed"),
}

CPU = CONSTANTS["cpu"].default
"""How slowly every emulated brick computes if nothing is said."""

IN_SPACE = {
    "gravity": Constant(9.81, 0.0, 25.0, "m/s2", None, "gravity; 0 lets nothing weigh"),
    "upper_arm_mass": Constant(30.0, 1.0, 500.0, "g", "plant", "beams of the upper arm"),
    "forearm_mass": Constant(15.0, 1.0, 500.0, "g", "plant", "beams of the forearm"),
    "motor_mass": Constant(1.0, 0.2, 3.0, "x", "plant", "motors that are carried, times nominal"),
    "tip_mass": Constant(5.0, 0.0, 500.0, "g", "plant", "the tip: a ball, or what it holds"),
    "base_inertia": Constant(
        0.001, 1e-5, 0.1, "kg m2", "plant", "the turntable with the shoulder's motor, without links"
    ),
}
"""Of arms in space only."""

CONSTANTS.update(IN_SPACE)

_DRAWN = sorted(CONSTANTS, key=lambda key: (key == "cpu", key in IN_SPACE, key))
"""In this order; what came later is drawn later, so that a seed's plants stay what they were."""

MOTOR_MASS = {"large": 76.0, "medium": 36.0}
"""g, as weighed by LEGO's builders."""

ELBOW_MOTOR_AT, TIP_MOTOR_AT = 5.5, 5.0
"""Where the carried motors balance, cm from the axis of shoulder and elbow: each lies along its
link, its shaft at the far end."""


class BadPlant(ArmError, ValueError):
    """A plant constant that is unknown or out of range."""


def read_plant(text="", measured=None):
    """The plant constants of a text such as `backlash=3,voltage=7.2,load=-0.1..0.1,seed=4`.

    `KEY=LOW..HIGH` draws uniformly; `seed` scatters the frictions, inertias and the voltage by up
    to `spread` around their values, and (see `at_port`) every motor's own constants.  The same text
    draws the same plant.

    Args:
        measured: name -> float, in place of the defaults; and "ports": port -> such a dict of what
            is only so there.  What the text gives holds at all ports.

    Returns:
        dict, name -> float or None (not given and without a default); and "ports" as measured.

    Raises:
        BadPlant: naming the key, the value and its range.
    """
    given = {}
    measured = measured or {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        key, equals, value = item.partition("=")
        key = key.strip()
        if key in CONSTANTS and not equals:
            raise BadPlant("plant '{}': write {}=NUMBER".format(item, key))
        if key not in CONSTANTS:
            raise BadPlant(
                "no plant constant '{}' in '{}'; known: {}".format(key, item, ", ".join(CONSTANTS))
            )
        bounds = [check(key, part) for part in value.split("..")]
        if len(bounds) > (1 if key in ("seed", "spread") else 2):
            raise BadPlant(
                "plant {}: '{}' is not a single value{}".format(
                    key, value, "" if key in ("seed", "spread") else " or LOW..HIGH"
                )
            )
        given[key] = bounds
    seed = given.get("seed", [None])[0]
    draw = random.Random(int(seed or 0))
    spread = given.get("spread", [CONSTANTS["spread"].default])[0]
    plant = {}
    for key in _DRAWN:
        constant = CONSTANTS[key]
        bounds = given.get(key, [measured.get(key, constant.default)])
        luck = draw.uniform(-1, 1)
        if len(bounds) == 2:
            plant[key] = (bounds[0] + bounds[1]) / 2 + luck * (bounds[1] - bounds[0]) / 2
        elif seed is not None and constant.scatter == "plant":
            plant[key] = bounds[0] * (1 + spread * luck)
        else:
            plant[key] = bounds[0]
    if "ports" in measured:
        plant["ports"] = {
            port: {key: value for key, value in own.items() if key not in given}
            for port, own in measured["ports"].items()
        }
    return plant


def at_port(plant, port):
    """The plant's constants as they are at one port: no two motors are alike where it is random."""
    own = dict(plant, **plant.get("ports", {}).get(port, {}))
    draw = random.Random("{}/{}".format(plant["seed"], port))
    for key in _DRAWN:
        luck = draw.uniform(-1, 1)
        if plant["seed"] is not None and CONSTANTS[key].scatter == "port" and key != "phase":
            own[key] *= 1 + plant["spread"] * luck
        elif key == "phase" and plant[key] is None:
            own[key] = 0.25 if plant["seed"] is None else 0.25 * (1 + luck)
    return own


def check(key, text):
    """The value of a constant.

    Raises:
        BadPlant: it is no number within the constant's limits.
    """
    constant = CONSTANTS[key]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not constant.lower <= value <= constant.upper:
        raise BadPlant(
            "plant {} = {}: must be a number from {} to {} {} ({})".format(
                key, text, constant.lower, constant.upper, constant.unit, constant.meaning
            ).replace("  ", " ")
        )
    return value


def motor_constants(kind, plant):
    """The constants of one motor of this plant."""
    nominal = MOTORS[kind]
    return MotorConstants(
        nominal.torque_constant * plant["torque_constant"],
        nominal.emf_constant * plant["emf_constant"],
        nominal.resistance * plant["resistance"],
        nominal.friction * plant["rotor_friction"],
        nominal.inertia * plant["rotor_inertia"],
    )


def _slowed(speed, by):
    """Coulomb friction: `speed` after an impulse that can take away at most `by`."""
    if speed > by:
        return speed - by
    if speed < -by:
        return speed + by
    return 0.0


class Drive(object):
    """One motor's rotor and, behind gear and gap, the link it moves.

    Args:
        motor: MotorConstants.
        voltage: battery, V.
        ratio: motor turns per joint turn, negative where the gear train reverses.
        link: None for a bare motor, else Link.
        angle: where rotor and link start, rad at the joint; the encoder reads 0 there.
    """

    def __init__(self, motor, voltage, ratio=1.0, link=None, angle=0.0):
        self.motor = motor
        self.voltage = voltage
        self.ratio = ratio
        self.link = link
        self.angle = angle
        self.speed = 0.0
        self._start = angle
        self.duty = None
        """-1 .. 1; 0 shorts the motor (brake), None leaves it open (coast)."""
        self.jammed = False
        """Of a bare motor; behind a gear it is the link that jams, and the gap stays."""
        self._step = None  # s, what these are for
        self._electric = self._per_step = ()

    def _prepare(self, h):
        """What of a step of `h` seconds never changes, worked out once: there are thousands."""
        motor, ratio, link = self.motor, self.ratio, self.link
        inertia = motor.inertia * ratio * ratio
        drag = h * abs(ratio) * motor.friction / inertia
        link_inertia = link_drag = both = both_drag = 0.0
        if link is not None:
            link_inertia = link.inertia
            link_drag = h * link.friction / link_inertia
            both = inertia + link_inertia
            both_drag = (inertia * drag + link_inertia * link_drag) / both
        self._step = h
        self._electric = motor.torque_constant, motor.emf_constant, motor.resistance, ratio
        self._per_step = h * ratio, inertia, drag, link_inertia, link_drag, both, both_drag

    @property
    def shaft(self):
        """Angle of the motor's shaft since the start, rad."""
        return (self.angle - self._start) * self.ratio

    def step(self, h):
        """Advance by `h` seconds."""
        duty, speed, link = self.duty, self.speed, self.link
        if not (duty or speed) and (
            link is None
            or not (link.speed or link.load)
            and abs(self.angle - link.angle) <= link.play
            and link.lower <= link.angle <= link.upper
        ):
            return  # what stands goes on standing
        if h != self._step:
            self._prepare(h)
        push, inertia, drag, link_inertia, link_drag, both, both_drag = self._per_step
        pushed = speed
        if duty is not None:
            torque_constant, emf_constant, resistance, ratio = self._electric
            current = duty * self.voltage - emf_constant * speed * ratio
            pushed += push * (torque_constant * current / resistance) / inertia
        speed = _slowed(pushed, drag)
        if link is None:
            self.speed = speed = 0.0 if self.jammed else speed
            self.angle += h * speed
            return
        play, jammed = link.play, link.jammed
        link_pushed = link.speed + h * link.load / link_inertia
        link_speed = 0.0 if jammed else _slowed(link_pushed, link_drag)
        gap = self.angle - link.angle
        closing = speed - link_speed
        after = gap + h * closing
        if -play <= after <= play:
            link_angle = link.angle + h * link_speed
            angle = self.angle + h * speed
        else:
            # Apart until they meet (at once where they touched already), from there on together.
            touching = play if after > 0.0 else -play
            alone = (touching - gap) / closing if closing else 0.0
            alone = 0.0 if alone <= 0.0 else h if alone > h else alone
            link_angle = link.angle + alone * link_speed
            together = (inertia * pushed + link_inertia * link_pushed) / both
            speed = link_speed = 0.0 if jammed else _slowed(together, both_drag)
            link_angle += (h - alone) * speed
            angle = link_angle + touching
        if not link.lower <= link_angle <= link.upper:
            stop = link.lower if link_angle < link.lower else link.upper
            side = math.copysign(1.0, link_angle - stop)
            link_angle = stop
            link_speed = 0.0
            if side * (angle - stop) >= link.play:
                angle = stop + side * link.play
                speed = 0.0
        link.angle = link_angle
        link.speed = link_speed
        self.angle = angle
        self.speed = speed


class Link(object):
    """What turns behind the gap: inertia, friction, stops and the torque on it."""

    def __init__(self, angle, inertia, friction, backlash, lower, upper):
        self.angle = angle
        self.speed = 0.0
        self.inertia = inertia
        self.friction = friction
        self.play = backlash / 2.0
        self.lower = lower
        self.upper = upper
        self.load = 0.0
        self.jammed = False


def _carried(arm, plant):
    """What hangs on each joint of an arm in space.

    Returns:
        Per joint, the pairs (mass g, cm from its axis) of what its link carries.
    """
    _, upper, fore = arm.joints
    motors = plant["motor_mass"]
    on_upper = [
        (plant["upper_arm_mass"], upper.link / 2),
        (motors * MOTOR_MASS[fore.motor], ELBOW_MOTOR_AT),
    ]
    on_fore = [(plant["forearm_mass"], fore.link / 2), (plant["tip_mass"], fore.link)]
    if arm.pen:
        on_fore.append((motors * MOTOR_MASS[arm.pen.motor], TIP_MOTOR_AT))
    return [], on_upper, on_fore


def weighed(arm, plant):
    """The Arm as one who weighs this plant, and how its joints rub, describes it.

    One in the plane is left as it is.
    """
    if arm.chain not in PULLED_DOWN:
        return arm
    joints = []
    for joint, parts in zip(arm.joints, _carried(arm, plant)):
        mass = sum(grams for grams, _ in parts)
        centre = sum(grams * at for grams, at in parts) / mass if mass else 0.0
        rubs = at_port(plant, joint.port)["link_friction"]
        joints.append(joint._replace(mass=0.001 * mass, centre=centre, friction=rubs))
    return arm._replace(joints=tuple(joints))


def inertias(arm, plant):
    """The inertia of what each joint moves, kg m2; of an arm in space, stretched out level."""
    if arm.chain not in PULLED_DOWN:
        return [plant["shoulder_inertia"], plant["elbow_inertia"]]
    _, on_upper, on_fore = _carried(arm, plant)
    reach = arm.joints[1].link
    elbow, shoulder = (
        1e-7 * sum(grams * at * at for grams, at in parts)
        for parts in (on_fore, on_upper + [(grams, reach + at) for grams, at in on_fore])
    )
    return [plant["base_inertia"] + shoulder, shoulder, elbow]


class ArmPlant(object):
    """The arm that the emulated brick moves.

    Args:
        arm: its description; the true backlash differs from it where the plant says so.
        plant: constants, as `read_plant` returns them.
        start: joint angles at the start, rad; the home pose if None.

    Attributes:
        drives: port letter -> Drive.
        pen_down: whether the pen is on the paper.
    """

    def __init__(self, arm, plant, start=None):
        self.arm = arm
        self.plant = plant
        self.drives = {}
        self.joints = []
        start = [joint.home for joint in arm.joints] if start is None else start
        error = math.radians(plant["zero_error"])
        self._gravity = Gravity(weighed(arm, plant), plant["gravity"])
        self._pen_drag = 0.0 if self.weighs else plant["pen_drag"]  # there is no paper in the air
        for joint, angle, inertia in zip(arm.joints, start, inertias(arm, plant)):
            own = at_port(plant, joint.port)
            play = own["backlash"]
            link = Link(
                angle + error,
                inertia,
                own["link_friction"],
                joint.backlash if play is None else math.radians(play),
                -math.inf if joint.stop_lower is None else joint.stop_lower,
                math.inf if joint.stop_upper is None else joint.stop_upper,
            )
            drive = self._drive(
                joint.port, joint.motor, joint.gear * joint.direction, link, angle + error
            )
            self.drives[joint.port] = drive
            self.joints.append(drive)
        self._links = [drive.link for drive in self.joints]
        self._heavy = self.weighs
        self._pulled_at = self._torques = None  # joint angles, and what gravity does there
        self.pen_down = not arm.pen  # one without a motor always is
        self._pen = self._pen_at = None  # what lowers it, and where that was at the last step
        if arm.pen:
            self._pen = self._drive(arm.pen.port, arm.pen.motor, 1.0, None, arm.pen.up)
            self.drives[arm.pen.port] = self._pen

    def _drive(self, port, kind, ratio, link, angle):
        motor = motor_constants(kind, at_port(self.plant, port))
        return Drive(motor, self.plant["voltage"], ratio, link, angle)

    def add_bare_motor(self, port, kind):
        """Plug in a motor that moves nothing; at the pen's port it leaves the pen lifted."""
        self.drives[port] = self._drive(port, kind, 1.0, None, 0.0)
        if self.arm.pen and port == self.arm.pen.port:
            self._pen = None

    @property
    def weighs(self):
        """Whether gravity pulls at the joints."""
        return self._gravity.loaded

    @property
    def q(self):
        """The TRUE joint angles (of the links), rad."""
        return tuple([link.angle for link in self._links])

    def step(self, h):
        """Advance everything by `h` seconds."""
        pen = self._pen
        if pen is not None and pen.angle != self._pen_at:
            self._pen_at = pen.angle
            self.pen_down = self._pen_touches()
        self._load_links()
        for drive in self.drives.values():
            if drive.duty or drive.speed or drive.link is not None:
                drive.step(h)

    def _pen_touches(self):
        pen = self.arm.pen
        way = (self._pen_at - pen.up) / (pen.down - pen.up)
        return way > (LEAVES_AT if self.pen_down else TOUCHES_AT)

    def _load_links(self):
        """Constant load, gravity, and the paper dragging at the pen against its motion."""
        links, load = self._links, self.plant["load"]
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
            moving = moving or link.speed
        if moving and self.pen_down and self._pen_drag:
            self._drag_pen()

    def _drag_pen(self):
        *axes, (x, y) = kinematics.joint_positions(self.arm, self.q)
        levers = []  # m: each joint moves the tip across its own
        v_x = v_y = 0.0
        for link, (axis_x, axis_y) in zip(self._links, axes):
            speed, across, along = link.speed, 0.01 * (axis_y - y), 0.01 * (x - axis_x)
            v_x += across * speed
            v_y += along * speed
            levers.append((link, across, along))
        # Below 5 mm/s the drag fades with speed: a stiff sign change would ring at this step.
        force = -self._pen_drag / max(math.sqrt(v_x * v_x + v_y * v_y), 0.005)
        for link, across, along in levers:
            link.load = link.load + across * force * v_x + along * force * v_y
