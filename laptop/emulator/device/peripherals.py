"""The peripherals of the brick: buttons, sensors, LEDs, battery, sound, screen.

Rule: everything here is driven by the world's clock and keeps a memory that can be asked
afterwards; no sound is played and no program of the laptop is started.  Every read or write of a
device costs one sysfs access.

Simplifications: a touch sensor is plugged into each input of which nothing is said; an LED's
`delay_on` and `delay_off` files are always there; the LCD console is known by its font size only.
"""

import errno
import os
from typing import Any, Callable, Dict, List, Optional, Union

from laptop.emulator.device.attribute_devices import EmulatedBattery, Led, invalid
from laptop.emulator.device.brick_programs import BrickPrograms
from laptop.emulator.device.buttons import INPUTS, BadPress, ButtonPanel, EventFile
from laptop.emulator.device.ports import InputPort
from laptop.emulator.device.screen import Screen
from laptop.emulator.device.sensor_orders import TOUCH_KINDS, BadSensor, read_sensors

MYPY = False
if MYPY:
    from typing import Collection  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.brick import EmulatedBrick  # noqa: F401
    from laptop.emulator.device.buttons import Press  # noqa: F401
    from laptop.emulator.device.sensor_orders import SensorOrder  # noqa: F401
    from laptop.emulator.device.sensors import Measuring, Sensed, SensedWorld  # noqa: F401
    from laptop.emulator.device.sysfs import Attribute, Sysfs  # noqa: F401


LEDS = ("led0:red:brick-status", "led0:green:brick-status",
        "led1:red:brick-status", "led1:green:brick-status")  # fmt: skip

_EVIOCGKEY_NUMBER = ord("E") << 8 | 0x18


def _no_quantity(word: str, place: Dict[str, float]) -> "Sensed":
    raise BadSensor("sensor: there is no {} for it to see here; write a value".format(word))


class Peripherals(object):
    """All peripherals, plugged into a sysfs.

    Args:
        world: the clock.
        sysfs: where the devices are found and accesses are counted.
        voltage, current: callables giving the battery's V and A.
        sensors: port -> SensorOrder; touch sensors everywhere if None.
        environment: the emulated world as sensors see it, see `sensors.Measuring`.

    Attributes:
        sysfs: as above.
        leds: name -> Led.
        inputs: port -> InputPort.
        buttons: ButtonPanel.
        screen: Screen.
        programs: BrickPrograms.
        on_back: called when the Back button is pushed; None: nothing happens.
    """

    def __init__(
        self,
        world: "DeviceWorld",
        sysfs: "Sysfs",
        voltage: Callable[[], float] = lambda: 8.0,
        current: Callable[[], float] = lambda: 0.2,
        sensors: Optional[Dict[str, "SensorOrder"]] = None,
        environment: "SensedWorld" = _no_quantity,
    ) -> None:
        self._world = world
        self.sysfs = sysfs
        self.buttons = ButtonPanel(world)
        self.screen = Screen()
        self.programs = BrickPrograms(world)
        self.on_back = None  # type: Optional[Callable[[], object]]
        self.inputs = {}  # type: Dict[str, InputPort]
        self.leds = {}  # type: Dict[str, Led]
        orders = read_sensors(()) if sensors is None else sensors
        for index, port in enumerate(INPUTS):
            device = self.inputs[port] = InputPort(world, sysfs, orders[port], environment)
            found = {key: device.constants[key] for key in ("address", "driver_name")}
            sysfs.add("lego-port", "port{}".format(index), found, device)
        for name in LEDS:
            self.leds[name] = Led(world, 255 if "green" in name else 0)
            sysfs.add("leds", name, {"delay_on": "500", "delay_off": "500"}, self.leds[name])
        battery = EmulatedBattery(voltage, current)
        sysfs.add("power_supply", "lego-ev3-battery", {"type": "Battery"}, battery)

    def press(self, press: "Press") -> None:
        """Schedule a Press.

        Raises:
            BadPress: no touch sensor is there.
        """
        if press.button.startswith("touch") and not self._pressed_by(press.button):
            raise BadPress(
                "press '{}': there is no touch sensor; those at the inputs are {}".format(
                    press.button,
                    ", ".join("{} {}".format(port, self.inputs[port].kind) for port in INPUTS),
                )
            )
        self._world.at(press.t, lambda: self._set(press.button, True))
        self._world.at(press.t + press.duration, lambda: self._set(press.button, False))

    def _pressed_by(self, button: str) -> List["Measuring"]:
        """Return the Measurings that a hand on `touch` or `touch:PORT` presses."""
        return [
            device.measuring
            for port, device in self.inputs.items()
            if device.measuring is not None
            and device.kind in TOUCH_KINDS
            and button in ("touch", "touch:" + port)
        ]

    def _set(self, button: str, down: bool) -> None:
        if button.startswith("touch"):
            for measuring in self._pressed_by(button):
                measuring.pressed = down
        else:
            self.buttons.set(button, down)
            if button == "backspace" and down and self.on_back is not None:
                self.on_back()

    def open(self, path: str) -> Union[EventFile, "Attribute", None]:
        """Return the stand-in for a device file of the brick, None for any other file."""
        if path.startswith("/dev/input/"):
            return EventFile(self.buttons)
        if self.sysfs.is_inside(path):
            folder, attribute = os.path.split(path)
            if not self.sysfs.has(folder):
                raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), path)
            return self.sysfs.open(folder, attribute)
        return None

    def ioctl(self, file: Any, request: int, argument: Any, screens: "Collection[int]") -> bool:
        """Answer an ioctl on the buttons or the framebuffer; False when it is neither.

        Args:
            file: descriptor or EventFile.
            request: number of the ioctl.
            argument: buffer or structure, which is filled.
            screens: the descriptors that `screen.open` has handed out.
        """
        if isinstance(file, EventFile):
            if request & 0xFFFF != _EVIOCGKEY_NUMBER:
                raise invalid()
            self.sysfs.touch()
            bits = file.panel.bits()
            argument[: min(len(argument), len(bits))] = bits[: len(argument)]
            return True
        if file not in screens:
            return False
        self.screen.ioctl(request, argument)
        return True


def let_joints_touch(brick: "EmulatedBrick", peripherals: Peripherals) -> None:
    """Connect the joints of the arm, as it was built, to their touch sensors."""
    if brick.arm is None:
        return
    touching = []
    for link, joint in zip(brick.plant.links, brick.arm.joints):
        measuring = peripherals.inputs[joint.touch_port].measuring if joint.touch_port else None
        if measuring is not None and joint.touch_at is not None:
            touching.append((link, joint.touch_at, joint.upper, measuring))

    def sample(t: float) -> None:
        for link, at, upper, sensor in touching:
            sensor.pressed = link.angle >= at if at >= upper else link.angle <= at

    if touching:
        brick.world.bodies.append(sample)
