"""Devices that a script reads and writes as files: LEDs, the battery, and their base class."""

import errno
import os
from typing import Callable, Dict, List, Union

MYPY = False
if MYPY:
    from typing import Any, Protocol  # noqa: F401

    class DeviceWorld(Protocol):
        """Clock and events that devices need of their world; all times are virtual, s."""

        @property
        def exit(self) -> Any:
            """End of the program, an exception or status; None while it runs."""

        @property
        def bodies(self) -> List[Callable[[float], object]]:
            """Callables that advance a body to a time, s."""

        def now(self) -> float:
            """Return the time."""

        def begin(self) -> None:
            """Let the program's computing take its time from now on."""

        def touch(self, cost: float) -> None:
            """Spend time on one access to the outside."""

        def sleep(self, seconds: float) -> None:
            """Wait."""

        def at(self, t: float, action: Callable[[], object]) -> Any:
            """Call `action` when time passes `t`; return a handle for `cancel`."""

        def cancel(self, event: Any) -> None:
            """Cancel an event by the handle that `at` returned."""


def invalid() -> OSError:
    """Return the error of a value that a device does not take."""
    return OSError(errno.EINVAL, os.strerror(errno.EINVAL))


class Device(object):
    """A device whose attributes are mostly constants.

    Args:
        constants: attribute -> text.
    """

    notifications = 0

    def __init__(self, constants: Dict[str, str]) -> None:
        self.constants = constants

    def read(self, attribute: str) -> Union[str, bytes]:
        """Return the attribute's text."""
        if attribute not in self.constants:
            raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), attribute)
        return self.constants[attribute]

    def write(self, attribute: str, value: str) -> None:
        """Set the attribute."""
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), attribute)


class Led(Device):
    """One of the four LEDs.

    Args:
        world: the clock.
        brightness: at the start, 0 to 255.

    Attributes:
        history: (s, brightness), from the start on.
    """

    TRIGGERS = ("none", "default-on", "timer", "heartbeat")

    def __init__(self, world: "DeviceWorld", brightness: int) -> None:
        super(Led, self).__init__({"max_brightness": "255"})
        self._world = world
        self._delays = {"delay_on": 500, "delay_off": 500}
        self.trigger = "none"
        self.history = [(world.now(), brightness)]

    @property
    def brightness(self) -> int:
        """Brightness, 0 to 255."""
        return self.history[-1][1]

    def read(self, attribute: str) -> Union[str, bytes]:
        """Return the attribute's text."""
        if attribute == "brightness":
            return str(self.brightness)
        if attribute == "trigger":
            shown = ("[{}]".format(t) if t == self.trigger else t for t in self.TRIGGERS)
            return " ".join(shown)
        if attribute in self._delays:
            return str(self._delays[attribute])
        return super(Led, self).read(attribute)

    def write(self, attribute: str, value: str) -> None:
        """Set the attribute."""
        if attribute == "trigger":
            if value not in self.TRIGGERS:
                raise invalid()
            self.trigger = value
            return
        if attribute != "brightness" and attribute not in self._delays:
            super(Led, self).write(attribute, value)
        if not value.isdigit():
            raise invalid()
        if attribute in self._delays:
            self._delays[attribute] = int(value)
            return
        self.history.append((self._world.now(), min(255, int(value))))
        if int(value) == 0:
            self.trigger = "none"


class EmulatedBattery(Device):
    """The brick's power supply.

    Args:
        voltage, current: callables, V and A.
    """

    def __init__(self, voltage: Callable[[], float], current: Callable[[], float]) -> None:
        super(EmulatedBattery, self).__init__(
            {
                "technology": "Unknown",
                "type": "Battery",
                "scope": "System",
                "voltage_max_design": "7500000",
                "voltage_min_design": "6200000",
            }
        )
        self._now = {"voltage_now": voltage, "current_now": current}

    def read(self, attribute: str) -> Union[str, bytes]:
        """Return the attribute's text."""
        if attribute in self._now:
            return str(int(round(self._now[attribute]() * 1e6)))
        return super(EmulatedBattery, self).read(attribute)
