"""The brick's six buttons: presses that people order, key states, events, and `evdev`."""

import array
import collections
import re
import types
from typing import Callable, Iterator, List, NamedTuple, Optional

from shared.arm_description import ArmError
from shared.message_fields import one_line

MYPY = False
if MYPY:
    from typing import Deque, Protocol, Set  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.sysfs import Sysfs  # noqa: F401

    class KeyWaiting(Protocol):
        """A place where threads wait for a key."""

        def wait(self) -> object:
            """Wait until `wake` is called."""

        def wake(self) -> object:
            """Wake the threads."""


BUTTONS = {"up": 103, "down": 108, "left": 105, "right": 106, "enter": 28, "backspace": 14}
"""Key codes of the brick's buttons, by the names python-ev3dev2 gives them."""

INPUTS = ("in1", "in2", "in3", "in4")
"""Names of the input ports."""

EV_SYN, EV_KEY = 0, 1
"""Types of events, as linux/input-event-codes.h has them."""

MAX_ORDER_TIME = 1e6
"""Latest time that may be ordered, s."""


class BadPress(ArmError, ValueError):
    """A button press that cannot be understood."""


Press = NamedTuple("Press", [("button", str), ("t", float), ("duration", float)])
Press.__doc__ = """A button that is held down for a time.

Attributes:
    button: its name, such as "enter", "back", or "touch:in2" for the touch sensor there.
    t: when it is pressed, s.
    duration: for how long, s.
"""


def read_press(text: str) -> Press:
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
    if max(t, duration) > MAX_ORDER_TIME:
        raise BadPress(
            "press '{}': give times up to {:g} s, not {:g} s".format(
                one_line(text), MAX_ORDER_TIME, max(t, duration)
            )
        )
    return Press("backspace" if button == "back" else button, t, duration)


class InputEvent(
    NamedTuple(
        "InputEvent",
        [("sec", int), ("usec", int), ("type", int), ("code", int), ("value", int)],
    )
):
    """An event of a key, as python-evdev has it."""

    __slots__ = ()

    def timestamp(self) -> float:
        """Return its time, s."""
        return self.sec + self.usec / 1e6


class ButtonPanel(object):
    """The six buttons.

    Args:
        world: the clock.

    Attributes:
        down: names of the buttons held down.
        listeners: called with each InputEvent.
    """

    def __init__(self, world: "DeviceWorld") -> None:
        self._world = world
        self.down = set()  # type: Set[str]
        self.listeners = []  # type: List[Callable[[InputEvent], None]]

    def set(self, button: str, down: bool) -> None:
        """Push or release a button."""
        if (button in self.down) == down:
            return
        (self.down.add if down else self.down.discard)(button)
        sec, usec = divmod(int(round(self._world.now() * 1e6)), 1000000)
        for listener in list(self.listeners):
            listener(InputEvent(sec, usec, EV_KEY, BUTTONS[button], int(down)))
            listener(InputEvent(sec, usec, EV_SYN, 0, 0))

    def bits(self) -> "array.array[int]":
        """Return the key states as the EVIOCGKEY ioctl hands them out."""
        state = array.array("B", [0] * 96)
        for button in self.down:
            state[BUTTONS[button] // 8] |= 1 << BUTTONS[button] % 8
        return state


class EventFile(object):
    """The buttons' device file, opened.

    Args:
        panel: ButtonPanel.
    """

    name = "/dev/input/by-path/platform-gpio_keys-event"

    def __init__(self, panel: ButtonPanel) -> None:
        self.panel = panel

    def close(self) -> None:
        """Close the file, which holds nothing."""


class KeyDevice(object):
    """The brick's buttons as an `evdev.InputDevice`; it sees the events since it was opened.

    Args:
        sysfs: Sysfs, on which accesses are counted.
        panel: ButtonPanel.
        waiting: a `WaitQueue` for threads that wait for a key.
    """

    name = "EV3 Brick Buttons"
    path = fn = "/dev/input/event0"

    def __init__(self, sysfs: "Sysfs", panel: ButtonPanel, waiting: "KeyWaiting") -> None:
        self._sysfs = sysfs
        self._panel = panel
        self._waiting = waiting
        self._events = collections.deque()  # type: Deque[InputEvent]
        panel.listeners.append(self._on_event)

    def _on_event(self, event: InputEvent) -> None:
        self._events.append(event)
        self._waiting.wake()

    def read_one(self) -> Optional[InputEvent]:
        """Return the next event, or None."""
        self._sysfs.touch()
        return self._events.popleft() if self._events else None

    def read(self) -> Iterator[InputEvent]:
        """Iterate over all events so far."""
        self._sysfs.touch()
        while self._events:
            yield self._events.popleft()

    def read_loop(self) -> Iterator[InputEvent]:
        """Iterate over events for ever, waiting for each."""
        while True:
            self._sysfs.touch()
            while not self._events:
                self._waiting.wait()
            yield self._events.popleft()

    def active_keys(self) -> List[int]:
        """Return the codes of the buttons held down."""
        self._sysfs.touch()
        return sorted(BUTTONS[button] for button in self._panel.down)

    def close(self) -> None:
        """Stop receiving events."""
        if self._on_event in self._panel.listeners:
            self._panel.listeners.remove(self._on_event)


def evdev_module(
    sysfs: "Sysfs", panel: ButtonPanel, wait_queue: Callable[[], "KeyWaiting"]
) -> types.ModuleType:
    """Return a module that stands for `evdev`, as far as python-ev3dev2 and key loops need it.

    The package is on the brick, but not on every laptop.

    Args:
        sysfs: Sysfs, on which accesses are counted.
        panel: ButtonPanel.
        wait_queue: makes a `WaitQueue` for threads that wait for a key.
    """

    class InputDevice(KeyDevice):
        """The buttons of this brick, whichever path a script opens them by.

        Args:
            path: of the device file; there is only one device.
        """

        def __init__(self, path: str = KeyDevice.path) -> None:
            super(InputDevice, self).__init__(sysfs, panel, wait_queue())

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
