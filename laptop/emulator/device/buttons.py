"""The brick's six buttons: presses that people order, key states, events, and `evdev`."""

import array
import collections
import re
import types

from shared.arm_description import ArmError
from shared.message_fields import one_line

BUTTONS = {"up": 103, "down": 108, "left": 105, "right": 106, "enter": 28, "backspace": 14}
"""Key codes of the brick's buttons, by the names python-ev3dev2 gives them."""

INPUTS = ("in1", "in2", "in3", "in4")

EV_SYN, EV_KEY = 0, 1

LATEST = 1e6
"""Latest time that may be ordered, s."""


class BadPress(ArmError, ValueError):
    """A button press that cannot be understood."""


Press = collections.namedtuple("Press", ["button", "t", "duration"])
Press.__doc__ = """A button held down from `t` for `duration`, both in s."""


def read_press(text):
    """Read a Press from `BUTTON@SECONDS` or `BUTTON@SECONDS+SECONDS_HELD`, e.g. `enter@2.0`.

    Raises:
        BadPress
    """
    names = sorted(BUTTONS) + ["back", "touch"] + ["touch:" + port for port in INPUTS]
    match = re.match(r"^([\w:]+)@(\d+(?:\.\d*)?|\.\d+)(?:\+(\d+(?:\.\d*)?|\.\d+))?$", text)
    if not match or match.group(1) not in names:
        raise BadPress(
            "press '{}': not BUTTON@SECONDS or BUTTON@SECONDS+SECONDS_HELD; "
            "the buttons are {}".format(one_line(text), ", ".join(names))
        )
    button, t, duration = match.group(1), float(match.group(2)), float(match.group(3) or 0.2)
    if max(t, duration) > LATEST:
        raise BadPress(
            "press '{}': give times up to {:g} s, not {:g} s".format(
                one_line(text), LATEST, max(t, duration)
            )
        )
    return Press("backspace" if button == "back" else button, t, duration)


class InputEvent(collections.namedtuple("InputEvent", "sec usec type code value")):
    """An event of a key, as python-evdev has it."""

    __slots__ = ()

    def timestamp(self):
        """Return its time, s."""
        return self.sec + self.usec / 1e6


class ButtonPanel(object):
    """The six buttons; `listeners` are called with each InputEvent."""

    def __init__(self, world):
        self._world = world
        self.down = set()
        self.listeners = []

    def set(self, button, down):
        """Push or release a button."""
        if (button in self.down) == down:
            return
        (self.down.add if down else self.down.discard)(button)
        sec, usec = divmod(int(round(self._world.now() * 1e6)), 1000000)
        for listener in list(self.listeners):
            listener(InputEvent(sec, usec, EV_KEY, BUTTONS[button], int(down)))
            listener(InputEvent(sec, usec, EV_SYN, 0, 0))

    def bits(self):
        """The key states as the EVIOCGKEY ioctl hands them out."""
        state = array.array("B", [0] * 96)
        for button in self.down:
            state[BUTTONS[button] // 8] |= 1 << BUTTONS[button] % 8
        return state


class EventFile(object):
    """The buttons' device file, opened."""

    name = "/dev/input/by-path/platform-gpio_keys-event"

    def __init__(self, panel):
        self.panel = panel

    def close(self):
        """Nothing to let go of."""


class KeyDevice(object):
    """The brick's buttons as an `evdev.InputDevice`; it sees the events since it was opened.

    Args:
        sysfs: Sysfs, on which accesses are counted.
        panel: ButtonPanel.
        waiting: a `WaitingLine` for threads that wait for a key.
    """

    name = "EV3 Brick Buttons"
    path = fn = "/dev/input/event0"

    def __init__(self, sysfs, panel, waiting):
        self._sysfs = sysfs
        self._panel = panel
        self._waiting = waiting
        self._events = collections.deque()
        panel.listeners.append(self._hear)

    def _hear(self, event):
        self._events.append(event)
        self._waiting.wake()

    def read_one(self):
        """The next event, or None."""
        self._sysfs.touch()
        return self._events.popleft() if self._events else None

    def read(self):
        """All events so far."""
        self._sysfs.touch()
        while self._events:
            yield self._events.popleft()

    def read_loop(self):
        """Events for ever, waiting for each."""
        while True:
            self._sysfs.touch()
            while not self._events:
                self._waiting.wait()
            yield self._events.popleft()

    def active_keys(self):
        """Codes of the buttons held down."""
        self._sysfs.touch()
        return sorted(BUTTONS[button] for button in self._panel.down)

    def close(self):
        """Hear no more."""
        if self._hear in self._panel.listeners:
            self._panel.listeners.remove(self._hear)


def evdev_module(sysfs, panel, waiting_line):
    """Return a module that stands for `evdev`, as far as python-ev3dev2 and key loops need it.

    The package is on the brick, but not on every laptop.

    Args:
        sysfs: Sysfs, on which accesses are counted.
        panel: ButtonPanel.
        waiting_line: makes a `WaitingLine` for threads that wait for a key.
    """

    class InputDevice(KeyDevice):
        """The buttons of this brick, whichever path a script opens them by."""

        def __init__(self, path=KeyDevice.path):
            super(InputDevice, self).__init__(sysfs, panel, waiting_line())

    ecodes = types.ModuleType("evdev.ecodes")
    vars(ecodes).update(EV_SYN=EV_SYN, EV_KEY=EV_KEY)
    vars(ecodes).update(("KEY_" + button.upper(), BUTTONS[button]) for button in BUTTONS)
    module = types.ModuleType("evdev")
    vars(module).update(
        ecodes=ecodes,
        InputDevice=InputDevice,
        InputEvent=InputEvent,
        list_devices=lambda input_device_dir="/dev/input": [InputDevice.path],
    )
    return module
