"""Everything on the brick besides its motors: buttons, sensors, LEDs, battery, sound, screen.

Rule: everything here is driven by the world's clock and keeps a memory that can be asked
afterwards; no sound is played and no program of the laptop is started.  Every read or write of a
device costs one sysfs access.

Simplifications: a touch sensor is plugged into each of the four inputs; an LED's `delay_on` and
`delay_off` files are always there; the LCD console is known by its font size only.
"""

import errno
import os

from laptop.simulator.device.attribute_devices import EmulatedBattery, Led, TouchSensor, invalid
from laptop.simulator.device.brick_programs import BrickPrograms
from laptop.simulator.device.buttons import TOUCH_PORTS, ButtonPanel, EventFile
from laptop.simulator.device.screen import Screen

LEDS = ("led0:red:brick-status", "led0:green:brick-status",
        "led1:red:brick-status", "led1:green:brick-status")  # fmt: skip

_EVIOCGKEY_NUMBER = ord("E") << 8 | 0x18


class Peripherals(object):
    """All of it, plugged into a sysfs.

    Args:
        world: the clock.
        sysfs: where the devices are found and accesses are counted.
        voltage, current: callables giving the battery's V and A.

    Attributes:
        sysfs: as above.
        leds: name -> Led.
        touch: port -> TouchSensor.
        buttons: ButtonPanel.
        screen: Screen.
        programs: BrickPrograms.
        on_back: called when the Back button is pushed; None: nothing happens.
    """

    def __init__(self, world, sysfs, voltage=lambda: 8.0, current=lambda: 0.2):
        self._world = world
        self.sysfs = sysfs
        self.buttons = ButtonPanel(world)
        self.screen = Screen()
        self.programs = BrickPrograms(world)
        self.on_back = None
        self.touch = {}
        self.leds = {}
        for index, port in enumerate(TOUCH_PORTS):
            self.touch[port] = TouchSensor(port)
            found = {key: self.touch[port].constants[key] for key in ("address", "driver_name")}
            sysfs.add("lego-sensor", "sensor{}".format(index), found, self.touch[port])
        for name in LEDS:
            self.leds[name] = Led(world, 255 if "green" in name else 0)
            sysfs.add("leds", name, {"delay_on": "500", "delay_off": "500"}, self.leds[name])
        battery = EmulatedBattery(voltage, current)
        sysfs.add("power_supply", "lego-ev3-battery", {"type": "Battery"}, battery)

    def press(self, press):
        """Schedule a Press."""
        self._world.at(press.t, lambda: self._set(press.button, True))
        self._world.at(press.t + press.duration, lambda: self._set(press.button, False))

    def _set(self, button, down):
        if button.startswith("touch"):
            for port in TOUCH_PORTS:
                if button in ("touch", "touch:" + port):
                    self.touch[port].pressed = down
        else:
            self.buttons.set(button, down)
            if button == "backspace" and down and self.on_back is not None:
                self.on_back()

    def open(self, path):
        """Return what the script gets for a device file of the brick, None for any other file."""
        if path.startswith("/dev/input/"):
            return EventFile(self.buttons)
        if path.startswith("/sys/class/"):
            folder, attribute = os.path.split(path[len("/sys/class/") :])
            if not self.sysfs.has(folder):
                raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), path)
            return self.sysfs.open(folder, attribute)
        return None

    def ioctl(self, file, request, argument, screens):
        """Answer an ioctl on the buttons or the framebuffer; False when it is neither.

        Args:
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
