"""The brick's ports as ev3dev shows them: the plugged device, and the driver loaded for it."""

import errno
from typing import Callable, Optional, Sequence, Union

from laptop.emulator.device.attribute_devices import Device, invalid
from laptop.emulator.device.buttons import INPUTS
from laptop.emulator.device.sensor_kinds import GENERIC, KINDS, UNKNOWN, generic
from laptop.emulator.device.sensor_orders import NONE
from laptop.emulator.device.sensors import EmulatedSensor, Measuring, error

MYPY = False
if MYPY:
    from typing import Any, Tuple  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.sensor_kinds import Kind  # noqa: F401
    from laptop.emulator.device.sensor_orders import SensorOrder  # noqa: F401
    from laptop.emulator.device.sensors import SensedWorld  # noqa: F401
    from laptop.emulator.device.sysfs import Sysfs  # noqa: F401


DETECTION_TIME = 0.4
"""Time until the brick has detected a plugged sensor, s."""

AUTO, NXT_ANALOG, TACHO_MOTOR = "auto", "nxt-analog", "tacho-motor"
INPUT_MODES = (
    AUTO, NXT_ANALOG, "nxt-color", "nxt-i2c", "other-i2c", "ev3-analog", "ev3-uart", "other-uart",
    "raw",
)  # fmt: skip
OUTPUT_MODES = (AUTO, TACHO_MOTOR, "dc-motor", "led", "raw")


class _Port(Device):
    """A lego-port: its mode and its status.

    Args:
        address: as ev3dev has it.
        driver: name of the port's own driver.
        modes: that may be chosen.
        mode: that it begins with.
    """

    def __init__(self, address: str, driver: str, modes: Sequence[str], mode: str = AUTO) -> None:
        super(_Port, self).__init__(
            {"address": address, "driver_name": driver, "modes": " ".join(modes)}
        )
        self._modes = modes
        self._mode = mode

    def read(self, attribute: str) -> Union[str, bytes]:
        """Return the attribute's text."""
        if attribute == "mode":
            return self._mode
        if attribute == "status":
            return self._detected() if self._mode == AUTO else self._mode
        return super(_Port, self).read(attribute)

    def write(self, attribute: str, value: str) -> None:
        """Set the attribute."""
        if attribute == "mode":
            if value not in self._modes:
                raise invalid()
            self._mode = value
            self._change()
        elif attribute == "set_device":
            self._set_device(value)
        else:
            super(_Port, self).write(attribute, value)

    def _detected(self) -> str:
        """Return the status in `auto`."""
        raise NotImplementedError

    def _change(self) -> None:
        """Change to the mode."""
        raise NotImplementedError

    def _set_device(self, driver: str) -> None:
        """Load this driver for what is there."""
        raise NotImplementedError


class InputPort(_Port):
    """A lego-port of one input, with the driver that is loaded for its sensor.

    Args:
        world: whose clock the detection takes its time on.
        sysfs: where the sensor is found.
        order: SensorOrder of the plugged sensor.
        environment: see Measuring.

    Attributes:
        kind: a key of KINDS, or "none".
        measuring: Measuring; None where nothing is plugged in.
    """

    def __init__(
        self, world: "DeviceWorld", sysfs: "Sysfs", order: "SensorOrder", environment: "SensedWorld"
    ) -> None:
        # A sensor that the brick cannot detect has its mode set already.
        preset = order.kind != NONE and KINDS[order.kind].driver in UNKNOWN
        super(InputPort, self).__init__(
            "ev3-ports:" + order.port, "ev3-input-port", INPUT_MODES, NXT_ANALOG if preset else AUTO
        )
        self._world = world
        self._sysfs = sysfs
        self._port = order.port
        self.kind = order.kind
        self.measuring = None if self.kind == NONE else Measuring(world, order, environment)
        self._device = None  # type: Optional[Tuple[str, EmulatedSensor]]  # what is loaded
        self._loads = 0
        self._due = None  # type: Any
        self._load(None if self.kind == NONE else KINDS[self.kind])

    @property
    def plugged(self) -> Optional["Kind"]:
        """Kind that is plugged in; None if there is none."""
        return None if self.kind == NONE else KINDS[self.kind]

    def _load(self, kind: Optional["Kind"]) -> None:
        """Load the driver of a Kind, in place of what was loaded; None: none."""
        if self._device is not None:
            name, sensor = self._device
            sensor.unplugged = True
            self._sysfs.remove("lego-sensor", name)
            self._device = None
        if kind is None or self.measuring is None:
            return
        sensor = EmulatedSensor(self._world, self._port, kind, self.measuring)
        found = {key: sensor.constants[key] for key in ("address", "driver_name")}
        # As the system does, a device that comes anew gets a number that none has had.
        number = INPUTS.index(self._port) + len(INPUTS) * self._loads
        self._loads += 1
        name = "sensor{}".format(number)
        self._device = name, sensor
        self._sysfs.add("lego-sensor", name, found, sensor)

    def _detected(self) -> str:
        kind = self.plugged
        return "no-sensor" if kind is None or self._device is None else kind.connection

    def unplug(self) -> None:
        """Pull the cable; pulling it again does nothing."""
        self.kind = NONE
        self._change()

    def _change(self) -> None:
        """Take the sensor away; it comes again where the port's mode is for such ones."""
        self._load(None)
        kind = self.plugged
        if self._due is not None:
            self._world.cancel(self._due)
            self._due = None
        if self._mode == NXT_ANALOG:  # this mode asks nobody
            self._load(generic(kind) if kind is not None and kind.volts else None)
        elif kind is not None and self._mode in (AUTO, kind.connection):
            found = generic(kind) if kind.driver in UNKNOWN else kind
            self._due = self._world.at(
                self._world.now() + DETECTION_TIME, lambda: self._load(found)
            )

    def _set_device(self, driver: str) -> None:
        kind = self.plugged
        if self.read("status") != NXT_ANALOG:
            raise error(errno.EOPNOTSUPP)
        if kind is None or not kind.volts:
            self._load(None)
        elif driver in (kind.driver, GENERIC):
            self._load(kind if driver == kind.driver else generic(kind))
        else:  # a driver of something else, which reads nonsense, or of nothing
            self._load(None)


class OutputPort(_Port):
    """A lego-port of one output; a motor's driver is loaded in `auto` and `tacho-motor`.

    Args:
        port: its letter.
        connect: `connect(port, True or False)` loads or unloads the motor's driver, where there is
            a motor.
        is_there: `is_there(port)`: whether such a driver is loaded.
    """

    def __init__(
        self, port: str, connect: Callable[[str, bool], None], is_there: Callable[[str], bool]
    ) -> None:
        super(OutputPort, self).__init__("ev3-ports:out" + port, "ev3-output-port", OUTPUT_MODES)
        self._port = port
        self._connect = connect
        self._is_there = is_there

    def _detected(self) -> str:
        return TACHO_MOTOR if self._is_there(self._port) else "no-motor"

    def _change(self) -> None:
        self._connect(self._port, self._mode in (AUTO, TACHO_MOTOR))

    def _set_device(self, driver: str) -> None:
        # The name of another device is accepted, but then nothing works.
        if self._mode != TACHO_MOTOR:
            raise error(errno.EOPNOTSUPP)
