"""The emulated brick: plant, motor drivers and the sysfs they show, on one world's clock."""

from typing import Dict, List, Optional, Sequence, Tuple, Union

from laptop.emulator.device.buttons import INPUTS
from laptop.emulator.device.hand_guiding import BadHand, HandGuiding
from laptop.emulator.device.motion_record import MotionRecord
from laptop.emulator.device.plant import ArmPlant
from laptop.emulator.device.plant_constants import at_port, read_plant
from laptop.emulator.device.ports import OutputPort
from laptop.emulator.device.stepping import Stepper, time_of_sample
from laptop.emulator.device.sysfs import Sysfs
from laptop.emulator.device.tacho_motor import DRIVER, TachoMotor
from laptop.emulator.device.wheels import BarePlant

MYPY = False
if MYPY:
    from typing import Any, Set  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.hand_guiding import HandPlace  # noqa: F401
    from laptop.emulator.device.motor_and_link import Drive, DrivenLink  # noqa: F401
    from laptop.emulator.device.plant_constants import PlantConstants  # noqa: F401
    from laptop.emulator.device.wheels import Wheels  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401


PORTS = "ABCD"
"""Letters of the output ports."""

FIRST_MOTOR_NUMBER = 9
"""Number of the motor's device at port A: the system counts on from there after replugging."""

ACCESS_TIME = 0.44e-3
"""Time that the kernel takes for an access to an attribute, s."""

MIN_ACCESS_TIME = 0.001
"""Time of an access with its overhead, on a brick that computes in no time, s."""


def _access_time(constants: "PlantConstants") -> float:
    """Return the time of an access, s."""
    if constants["access"] is not None:
        return constants["access"]
    return ACCESS_TIME * constants["cpu"] or MIN_ACCESS_TIME


class EmulatedBrick(object):
    """An arm on a brick, or a brick alone, ready for python-ev3dev2.

    Args:
        world: the clock.
        arm: description of the arm, with its ports; None for a brick without one.
        plant: constants from `read_plant`; the honest LEGO arm if None.
        start: joint angles at the start, rad; the home pose if None.  Encoders read 0 there.
            Where gravity pulls the motors hold, as the last program has left them.
        extra: port -> "large" or "medium", motors beside the arm's.
        wheels: of a brick without an arm, from `read_wheels`; the motors of both are among extra.
        stops: port of such a motor -> lower and upper angle that it can turn to, rad.

    Attributes:
        record: MotionRecord of the true links and tip, one sample per 5 ms.
        names: of the angles in it; None: they are of the arm's joints.
    """

    def __init__(
        self,
        world: "DeviceWorld",
        arm: Optional["Arm"],
        plant: Optional["PlantConstants"] = None,
        start: Optional[Sequence[float]] = None,
        extra: Optional[Dict[str, str]] = None,
        wheels: Optional["Wheels"] = None,
        stops: Optional[Dict[str, Tuple[float, float]]] = None,
    ) -> None:
        self.world = world  # type: Any  # the host's, of which devices need a DeviceWorld
        self.arm = arm
        constants = read_plant() if plant is None else plant
        self.plant = (
            BarePlant(constants, wheels) if arm is None else ArmPlant(arm, constants, start)
        )  # type: Union[ArmPlant, BarePlant]
        self.sysfs = Sysfs(world, _access_time(constants))
        self.slowness = constants["cpu"]
        self.motors = {}  # type: Dict[str, TachoMotor]
        self._names = {}  # type: Dict[str, str]  # of a port's device
        self._loads = {}  # type: Dict[str, int]  # how often it has been loaded
        self._pulled = set()  # type: Set[str]  # ports without their cable
        moved = () if arm is None else arm.joints + ((arm.pen,) if arm.pen else ())
        kinds = {part.port: part.motor for part in moved}
        for port, kind in (extra or {}).items():
            kinds[port] = kind
            self.plant.add_bare_motor(port, kind, (stops or {}).get(port))
        for port in sorted(kinds):
            self._plug(port, kinds[port])
        self.names = self.plant.names if isinstance(self.plant, BarePlant) else None
        for number, port in enumerate(PORTS, len(INPUTS)):
            device = OutputPort(port, self._connect, self._is_loaded)
            found = {key: device.constants[key] for key in ("address", "driver_name")}
            self.sysfs.add("lego-port", "port{}".format(number), found, device)
        if arm is not None and self.plant.weighs:
            for joint in arm.joints:
                self.motors[joint.port].hold()
        self.record = MotionRecord(time_of_sample)
        self._stepper = Stepper(self.plant, self.motors, self.record)
        world.bodies.append(self._stepper.advance)

    def _plug(self, port: str, kind: str) -> None:
        motor = TachoMotor(
            port,
            kind,
            self.plant.drives[port],
            at_port(self.plant.plant, port)["phase"],
            int(self.plant.plant["encoder"]),
        )
        self.motors[port] = motor
        discovery = {"address": "ev3-ports:out" + port, "driver_name": DRIVER[kind]}
        # As the system does, one that comes anew gets a number that none has had.
        number = FIRST_MOTOR_NUMBER + PORTS.index(port) + len(PORTS) * self._loads.get(port, 0)
        self._loads[port] = self._loads.get(port, 0) + 1
        self._names[port] = "motor{}".format(number)
        self.sysfs.add("tacho-motor", self._names[port], discovery, motor)

    def _is_loaded(self, port: str) -> bool:
        return port in self.motors and not self.motors[port].unplugged

    def _connect(self, port: str, wanted: bool) -> None:
        """Load or unload the driver of the motor at `port`; it comes anew."""
        if wanted and port in self.motors and port not in self._pulled:
            self._unload(port)
            self._plug(port, self.motors[port].kind)
            self.motors[port].begin_at(self.world.now())
        elif self._is_loaded(port):
            self._unload(port)

    def _unload(self, port: str) -> None:
        if self._is_loaded(port):
            self.motors[port].unplug()
            self.sysfs.remove("tacho-motor", self._names[port])

    def advance(self, t: float) -> None:
        """Advance physics and drivers to time `t`, s."""
        self._stepper.advance(t)

    def reset_motors(self) -> None:
        """Reset all motors as brickrun does after the Back button: coast, encoders to zero."""
        for motor in self.motors.values():
            if not motor.unplugged:
                motor.write("command", "reset")

    def driven(self) -> List[str]:
        """Return the ports of the motors that a command is turning."""
        return [port for port in sorted(self.motors) if self.motors[port].driven]

    def asked(self) -> List[str]:
        """Return the ports of motors that were given a speed or a duty, or that are gone."""
        return [
            port
            for port, motor in sorted(self.motors.items())
            if motor.unplugged or {motor.read("speed_sp"), motor.read("duty_cycle_sp")} != {"0"}
        ]

    # Faults

    def unplug(self, port: str) -> None:
        """Pull the cable of the motor at `port`; pulling it again does nothing."""
        self._pulled.add(port)
        self._unload(port)

    def jam(self, port: str) -> None:
        """Block what the motor at `port` moves: its link, or the rotor of a bare motor."""
        self._moved(port).jammed = True

    def _moved(self, port: str) -> Union["DrivenLink", "Drive"]:
        drive = self.plant.drives[port]
        return drive.link or drive

    def push(self, port: str) -> None:
        """Turn back what the motor at `port` moves, or lift the pen, as a hand, and keep it so."""
        self.jam(port)
        self._stepper.push(self._moved(port))

    def guide(self, places: Sequence["HandPlace"]) -> None:
        """Let a hand lead the tip through HandPlaces.

        Raises:
            BadHand: it cannot.
        """
        if not isinstance(self.plant, ArmPlant):
            raise BadHand("a hand leads an arm, and there is none; leave --hand out")
        arm = self.plant.arm
        motors = [self.motors[joint.port] for joint in arm.joints]
        coasts, stepper = (lambda k: motors[k].mode == "coast"), self._stepper
        if stepper.hand is not None:
            stepper.hand.release()
        stepper.hand = HandGuiding(arm, self.plant.links, coasts, places, stepper.now)

    def kill_encoder(self, port: str) -> None:
        """Stop the counts of the encoder at `port`."""
        self.motors[port].encoder.dead = True
