"""Emulated sensors, as their drivers show them.

Rule: a mode gives its own values only.  The state of the world at a sensor belongs to the plug,
whatever driver the port has loaded for it.
"""

import errno
import os
import random
import struct
from typing import Callable, Dict, List, Union

from laptop.emulator.device.attribute_devices import Device, invalid
from laptop.emulator.device.sensor_kinds import BY_CHANNEL, CHANNELS, KINDS
from laptop.emulator.device.sensor_values import constant

MYPY = False
if MYPY:
    from typing import Any, Optional, Protocol  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.sensor_kinds import Kind, Mode  # noqa: F401
    from laptop.emulator.device.sensor_orders import SensorOrder  # noqa: F401
    from laptop.emulator.device.sensor_values import Value  # noqa: F401

    class Sensed(Protocol):
        """A quantity of the emulated world, with the interface of a Signal."""

        def value(self, t: float) -> Value:
            """Return its value at `t`, s."""

        def slope(self, t: float) -> float:
            """Return its rate of change at `t`, 1/s."""

    SensedWorld = Callable[[str, Dict[str, float]], Sensed]  # of a word and the sensor's place, cm


SWITCH_TIME = {"ev3-uart": 0.02}
"""Time of a change of mode, s, by a sensor's connection; 0 for those not listed."""

NOISE_PERIOD = 0.01
"""Period in which noise stays the same, s."""

RESET_GYRO = "\x11"
"""Byte to a gyro's `direct` that sets its angle to 0."""

STRUCT_CODES = {"s8": "b", "u8": "B", "s16": "h", "u16": "H", "s32": "i"}
"""Codes of `struct` by the format of `bin_data`."""


def error(number: int) -> OSError:
    """Return the system's error of that number."""
    return OSError(number, os.strerror(number))


class Measuring(object):
    """All that one plugged sensor could measure, whatever driver reads it.

    Args:
        world: whose clock it goes by.
        order: SensorOrder.
        environment: `environment(word, place)` gives a quantity of the emulated world
            there, with `value(t)` and `slope(t)`; place: key -> cm.

    Attributes:
        pressed: whether a hand presses it.
    """

    def __init__(
        self, world: "DeviceWorld", order: "SensorOrder", environment: "SensedWorld"
    ) -> None:
        self._world = world
        self._name = order.port
        self.pressed = False
        signals = dict(order.quantities)  # type: Dict[str, Any]
        quantities = KINDS[order.kind].quantities
        place = {
            key: signals[key].value(0.0) if key in signals else quantities[key].default
            for key in "xyz"
            if key in quantities
        }
        for key, signal in signals.items():
            if isinstance(signal, str):
                signals[key] = environment(signal, place)
        self._given = set(signals)
        for key, quantity in quantities.items():
            by_channel = [channel + "." + key for channel in CHANNELS]
            for each in by_channel if key in BY_CHANNEL else [key]:
                signals.setdefault(each, constant(quantity.default))
        self._signals = signals
        self._sign = -1 if "flipped" in signals and signals["flipped"].value(0.0) else 1
        self._origins = {}  # type: Dict[str, float]

    def given(self, key: str) -> bool:
        """Return whether the order gives this quantity."""
        return key in self._given

    def __call__(self, key: str) -> "Value":
        """Return a quantity now."""
        if key == "pressed" and self.pressed:
            return 1
        return self._signals[key].value(self._world.now())

    def rate(self, key: str) -> float:
        """Return the rate of change of an angle now, deg/s."""
        rate = self._signals[key].slope(self._world.now())  # type: float
        if key != "angle":
            return rate
        drift = self("rate")  # type: float
        return self._sign * rate + drift

    def turned(self, key: str) -> float:
        """Return the angle since the origin was set, deg."""
        return self._turned(key) - self._origins.get(key, 0.0)

    def _turned(self, key: str) -> float:
        t = self._world.now()
        angle = self._signals[key].value(t)  # type: float
        if key != "angle":
            return angle
        drifted = self._signals["rate"].integral(t)  # type: float
        return self._sign * angle + drifted

    def set_origin(self) -> None:
        """Set the origin of all angles here."""
        for key in {"angle", "tilt"} & set(self._signals):
            self._origins[key] = self._turned(key)

    def noise(self) -> float:
        """Return the noise of a value now, the same in every call at the same time."""
        sigma = self("noise") if "noise" in self._signals else 0.0
        if not sigma:
            return 0.0
        period = int(self._world.now() / NOISE_PERIOD)
        return random.Random("{}/{}".format(self._name, period)).gauss(0.0, sigma)


class EmulatedSensor(Device):
    """A lego-sensor.

    Args:
        world: whose clock a change of mode takes its time on.
        port: name of the input.
        kind: Kind.
        measuring: Measuring.
    """

    def __init__(self, world: "DeviceWorld", port: str, kind: "Kind", measuring: Measuring) -> None:
        address = "ev3-ports:" + port + (":i2c1" if kind.connection == "nxt-i2c" else "")
        super(EmulatedSensor, self).__init__(
            {
                "address": address,
                "driver_name": kind.driver,
                "modes": " ".join(mode.name for mode in kind.modes),
                "fw_version": "V1.0" if kind.connection == "nxt-i2c" else "",
            }
        )
        self._world = world
        self._kind = kind
        self._measuring = measuring
        self._poll_ms = 100 if kind.connection == "nxt-i2c" else None
        self.unplugged = False
        self._enter(kind.modes[0])

    def _enter(self, mode: "Mode") -> None:
        self._mode = mode
        self._measuring.set_origin()
        self._single_values = None  # type: Optional[List[int]]
        self._single_values = self._raw() if mode.single else None

    def _raw(self) -> List[int]:
        """Return the values as whole numbers, in units of their last decimal."""
        if self._single_values is not None:
            return self._single_values
        mode = self._mode
        assert mode.measure is not None, "`_switch` enters none that does not come back"
        values = [min(mode.highest, max(mode.lowest, v)) for v in mode.measure(self._measuring)]
        return [int(round(value * 10**mode.decimals)) for value in values]

    def read(self, attribute: str) -> Union[str, bytes]:
        """Return the attribute's text, or bytes."""
        self._check_plugged()
        mode = self._mode
        if attribute.startswith("value") and attribute[5:].isdigit():
            number = int(attribute[5:])
            if number >= mode.count:
                raise error(errno.ENXIO)
            return str(self._raw()[number])
        if attribute == "bin_data":
            return struct.pack("<{}{}".format(mode.count, STRUCT_CODES[mode.format]), *self._raw())
        now = {
            "mode": mode.name,
            "decimals": mode.decimals,
            "num_values": mode.count,
            "units": mode.units,
            "bin_data_format": mode.format,
        }
        if attribute in now:
            return str(now[attribute])
        if attribute == "poll_ms" and self._poll_ms is not None:
            return str(self._poll_ms)
        if attribute == "commands":  # none of LEGO's has any
            return ""
        if attribute in ("poll_ms", "text_value", "direct"):
            raise error(errno.EOPNOTSUPP)
        return super(EmulatedSensor, self).read(attribute)

    def write(self, attribute: str, value: str) -> None:
        """Set the attribute."""
        self._check_plugged()
        if attribute == "mode":
            self._switch(value)
        elif attribute == "poll_ms" and self._poll_ms is not None:
            if not value.isdigit():
                raise invalid()
            self._poll_ms = int(value)
        elif attribute == "direct" and self._kind.connection == "ev3-uart":
            # This is the only direct message that is known here.
            if self._kind is KINDS["gyro"] and value == RESET_GYRO:
                self._measuring.set_origin()
        elif attribute == "command":
            raise invalid()
        elif attribute in ("poll_ms", "direct"):
            raise error(errno.EOPNOTSUPP)
        else:
            super(EmulatedSensor, self).write(attribute, value)

    def _switch(self, name: str) -> None:
        modes = {mode.name: mode for mode in self._kind.modes}
        if name not in modes:
            raise invalid()
        if modes[name].measure is None:  # it resets itself in the end, and never answers
            raise error(errno.ETIMEDOUT)
        self._world.sleep(SWITCH_TIME.get(self._kind.connection, 0.0))
        self._check_plugged()
        # A sensor that is in the mode already goes on in it: a gyro keeps its angle.
        if name != self._mode.name or self._mode.single:
            self._enter(modes[name])

    def _check_plugged(self) -> None:
        if self.unplugged:
            raise error(errno.ENODEV)
