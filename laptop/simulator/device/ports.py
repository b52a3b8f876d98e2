"""The brick's ports as ev3dev shows them: what is plugged in, and the driver loaded for it."""

import errno

from laptop.simulator.device.attribute_devices import Device, invalid
from laptop.simulator.device.buttons import INPUTS
from laptop.simulator.device.sensor_kinds import GENERIC, KINDS, UNKNOWN, generic
from laptop.simulator.device.sensor_orders import NONE
from laptop.simulator.device.sensors import EmulatedSensor, Measuring, error

DETECTION_TIME = 0.4
"""Time until the brick has found out what is plugged in, s."""

AUTO, NXT_ANALOG, TACHO_MOTOR = "auto", "nxt-analog", "tacho-motor"
INPUT_MODES = (
    AUTO, NXT_ANALOG, "nxt-color", "nxt-i2c", "other-i2c", "ev3-analog", "ev3-uart", "other-uart",
    "raw",
)  # fmt: skip
OUTPUT_MODES = (AUTO, TACHO_MOTOR, "dc-motor", "led", "raw")


class InputPort(Device):
    """A lego-port: what is plugged into one input, and the driver that is loaded for it.

    Args:
        world: whose clock the detection takes its time on.
        sysfs: where the sensor is found.
        order: SensorOrder of what is plugged in.
        scene: see Measuring.

    Attributes:
        kind: a key of KINDS, or "none".
        measuring: Measuring; None where nothing is plugged in.
    """

    def __init__(self, world, sysfs, order, scene):
        super(InputPort, self).__init__(
            {
                "address": "ev3-ports:" + order.port,
                "driver_name": "ev3-input-port",
                "modes": " ".join(INPUT_MODES),
            }
        )
        self._world = world
        self._sysfs = sysfs
        self._port = order.port
        self.kind = order.kind
        self.measuring = None if self.kind == NONE else Measuring(world, order, scene)
        self._device = None  # name and EmulatedSensor of what is loaded
        self._loads = 0
        self._due = None
        self._mode = AUTO
        # What only people can tell the brick they have told it before.
        if self.kind != NONE and KINDS[self.kind].driver in UNKNOWN:
            self._mode = NXT_ANALOG
        self._load(None if self.kind == NONE else KINDS[self.kind])

    @property
    def plugged(self):
        """The Kind that is plugged in; None if there is none."""
        return None if self.kind == NONE else KINDS[self.kind]

    def _load(self, kind):
        """Load the driver of a Kind, in place of what was loaded; None: none."""
        if self._device is not None:
            name, sensor = self._device
            sensor.unplugged = True
            self._sysfs.remove("lego-sensor", name)
            self._device = None
        if kind is None:
            return
        sensor = EmulatedSensor(self._world, self._port, kind, self.measuring)
        found = {key: sensor.constants[key] for key in ("address", "driver_name")}
        # As the system does, a device that comes anew gets a number that none has had.
        number = INPUTS.index(self._port) + len(INPUTS) * self._loads
        self._loads += 1
        self._device = "sensor{}".format(number), sensor
        self._sysfs.add("lego-sensor", self._device[0], found, sensor)

    def read(self, attribute):
        """Return the attribute's text."""
        if attribute == "mode":
            return self._mode
        if attribute == "status":
            if self._mode != AUTO:
                return self._mode
            return self.plugged.connection if self._device else "no-sensor"
        return super(InputPort, self).read(attribute)

    def write(self, attribute, value):
        """Set the attribute."""
        if attribute == "mode":
            if value not in INPUT_MODES:
                raise invalid()
            self._mode = value
            self._detect_later()
        elif attribute == "set_device":
            self._set_device(value)
        else:
            super(InputPort, self).write(attribute, value)

    def unplug(self):
        """Pull the cable; pulling it again does nothing."""
        self.kind = NONE
        self._detect_later()

    def _detect_later(self):
        """Take the sensor away; it comes again where the port's mode is for such ones."""
        self._load(None)
        kind = self.plugged
        if self._due is not None:
            self._world.cancel(self._due)
            self._due = None
        if self._mode == NXT_ANALOG:  # this mode asks nobody
            self._load(kind and kind.volts and generic(kind))
        elif kind is not None and self._mode in (AUTO, kind.connection):
            found = generic(kind) if kind.driver in UNKNOWN else kind
            self._due = self._world.at(
                self._world.now() + DETECTION_TIME, lambda: self._load(found)
            )

    def _set_device(self, driver):
        kind = self.plugged
        if self.read("status") != NXT_ANALOG:
            raise error(errno.EOPNOTSUPP)
        if kind is None or not kind.volts:
            self._load(None)
        elif driver in (kind.driver, GENERIC):
            self._load(kind if driver == kind.driver else generic(kind))
        else:  # a driver of something else, which reads nonsense, or of nothing
            self._load(None)


class OutputPort(Device):
    """A lego-port of one output; a motor's driver is loaded in `auto` and `tacho-motor`.

    Args:
        port: its letter.
        connect: `connect(port, True or False)` loads or unloads the motor's driver, where there is
            a motor.
        is_there: `is_there(port)`: whether such a driver is loaded.
    """

    def __init__(self, port, connect, is_there):
        super(OutputPort, self).__init__(
            {
                "address": "ev3-ports:out" + port,
                "driver_name": "ev3-output-port",
                "modes": " ".join(OUTPUT_MODES),
            }
        )
        self._port = port
        self._connect = connect
        self._is_there = is_there
        self._mode = AUTO

    def read(self, attribute):
        """Return the attribute's text."""
        if attribute == "mode":
            return self._mode
        if attribute == "status":
            if self._mode != AUTO:
                return self._mode
            return TACHO_MOTOR if self._is_there(self._port) else "no-motor"
        return super(OutputPort, self).read(attribute)

    def write(self, attribute, value):
        """Set the attribute."""
        if attribute == "mode":
            if value not in OUTPUT_MODES:
                raise invalid()
            self._mode = value
            self._connect(self._port, value in (AUTO, TACHO_MOTOR))
        elif attribute == "set_device":
            if self._mode != TACHO_MOTOR:
                raise error(errno.EOPNOTSUPP)
            # It says what is there anyway, or what is not, and then nothing works.
        else:
            super(OutputPort, self).write(attribute, value)
