"""The emulated brick: plant, motor drivers and the sysfs they show, on one world's clock."""

import math
from collections import namedtuple

from laptop.simulator.device.plant import ArmPlant
from laptop.simulator.device.plant_constants import at_port, read_plant
from laptop.simulator.device.sysfs import Sysfs
from laptop.simulator.device.tacho_motor import DRIVER, TICK, TachoMotor
from laptop.simulator.host.processor import ACCESS_TIME

STEP = 0.001
"""Step of the physics, s."""
TICK_STEPS = round(TICK / STEP)
"""Steps between two ticks of the motor drivers."""
SAMPLE_STEPS = 5
"""Steps between two samples of the record."""
PORTS = "ABCD"

FIRST_DEVICE = 9
"""Number of the device at port A: after some plugging the system counts on from there."""

PUSH_ANGLE, PUSH_SPEED = math.radians(20), math.radians(200)
"""By how much a hand turns what a motor moves, rad, and how fast, rad/s."""

MIN_ACCESS_TIME = 0.001
"""Time of an access, with what goes with it, on a brick that computes in no time, s."""

MotionSample = namedtuple("MotionSample", "t q x y z pen")
"""One row of the record: s, true link angles (rad), true tip (cm; z None in the plane), 0 or 1."""


def _name(port):
    return "motor{}".format(FIRST_DEVICE + PORTS.index(port))


def _access_of(constants):
    """Time of an access, s."""
    if constants["access"] is not None:
        return constants["access"]
    return ACCESS_TIME * constants["cpu"] or MIN_ACCESS_TIME


class EmulatedBrick(object):
    """An arm on a brick, ready for python-ev3dev2.

    Args:
        world: the clock.
        arm: Arm, what is plugged in where.
        plant: constants from `read_plant`; the honest LEGO arm if None.
        start: joint angles at the start, rad; the home pose if None.  Encoders read 0 there.
            Where gravity pulls the motors hold, as the last program has left them.
        extra: port -> "large" or "medium", motors that move nothing; none at a joint's port.

    Attributes:
        record: MotionSamples, one per 5 ms.
    """

    def __init__(self, world, arm, plant=None, start=None, extra=None):
        self.world = world
        self.arm = arm
        constants = read_plant() if plant is None else plant
        self.plant = ArmPlant(arm, constants, start)
        self.sysfs = Sysfs(world, _access_of(constants))
        self.slowness = constants["cpu"]
        self.motors = {}
        kinds = {joint.port: joint.motor for joint in arm.joints}
        if arm.pen:
            kinds[arm.pen.port] = arm.pen.motor
        for port, kind in (extra or {}).items():
            kinds[port] = kind
            self.plant.add_bare_motor(port, kind)
        for port in sorted(kinds):
            self._plug(port, kinds[port])
        if self.plant.weighs:
            for joint in arm.joints:
                self.motors[joint.port].hold()
        self.record = []
        self._steps = 0
        self._pushed = []  # links and bare rotors in a hand, and where that takes them, rad
        self._tip = self._tip_at = None  # the true tip, and the joint angles of it
        self._sample()
        world.bodies.append(self.advance)

    def _plug(self, port, kind):
        motor = TachoMotor(
            port, kind, self.plant.drives[port], at_port(self.plant.plant, port)["phase"]
        )
        self.motors[port] = motor
        discovery = {"address": "ev3-ports:out" + port, "driver_name": DRIVER[kind]}
        self.sysfs.add("tacho-motor", _name(port), discovery, motor)

    def advance(self, t):
        """Bring physics and drivers up to time `t`, s."""
        step, motors = self.plant.step, self.motors.values()
        while (self._steps + 1) * STEP <= t + 1e-9:
            step(STEP)
            for moved, end in self._pushed:
                moved.angle = max(end, moved.angle - PUSH_SPEED * STEP)
            self._steps += 1
            now = self._steps * STEP
            regulate = self._steps % TICK_STEPS == 0
            for motor in motors:
                motor.sense(now)
                if regulate:
                    motor.tick(now)
            if self._steps % SAMPLE_STEPS == 0:
                self._sample()

    def _sample(self):
        q = self.plant.q
        if q != self._tip_at:  # mostly it stands
            self._tip_at, self._tip = q, self.plant.tip()
        x, y, z = self._tip
        self.record.append(MotionSample(self._steps * STEP, q, x, y, z, int(self.plant.pen_down)))

    def reset_motors(self):
        """Do as brickrun after the Back button: coast, encoders to zero."""
        for motor in self.motors.values():
            if not motor.unplugged:
                motor.write("command", "reset")

    def driven(self):
        """Ports of the motors that a command is turning."""
        return [port for port in sorted(self.motors) if self.motors[port].driven]

    # Faults

    def unplug(self, port):
        """Pull the cable of the motor at `port`; pulling it again does nothing."""
        if self.motors[port].unplugged:
            return
        self.motors[port].unplug()
        self.sysfs.remove("tacho-motor", _name(port))

    def jam(self, port):
        """Block what the motor at `port` moves: its link, or the rotor of a bare motor."""
        self._moved(port).jammed = True

    def _moved(self, port):
        drive = self.plant.drives[port]
        return drive.link or drive

    def push(self, port):
        """A hand turns back what the motor at `port` moves (it lifts a pen), and keeps it there."""
        self.jam(port)
        moved = self._moved(port)
        self._pushed.append((moved, moved.angle - PUSH_ANGLE))

    def kill_encoder(self, port):
        """The encoder at `port` counts no more."""
        self.motors[port].encoder.dead = True
