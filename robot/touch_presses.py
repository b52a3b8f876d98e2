"""Sources of presses that take a point: touch sensors, buttons, keys, another program."""

import os
import sys

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Optional, Protocol, Sequence, Set  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401

    class PressSource(Protocol):
        """A source of presses: TouchSensors, Lines, and the keys and buttons of orders."""

        def pressed(self):
            # type: () -> Sequence[str]
            """Return the presses since the last call."""

        def close(self):
            # type: () -> object
            """Release the source."""


TAKE, END = "enter", "down"
"""Names of the brick's buttons that take a point, and that end it."""

LINE_TAKES, LINE_ENDS = b"", (b"q", b"e", b"end")
"""Lines, of an input that is no terminal, that take a point, and that end it."""


class TouchSensors(object):
    """The touch sensors at inputs where no joint has its own.

    Args:
        arm: shared.arm_description.Arm.

    Attributes:
        ports: inputs of those that are plugged in, such as "in1".
    """

    def __init__(self, arm):
        # type: (Arm) -> None
        from robot.ev3.touch_sensor import NoTouchSensor, touch_sensor  # not above: it is slow

        self._sensors = {}  # type: Dict[str, Callable[[], bool]]
        taken = [joint.touch_port for joint in arm.joints if joint.find_home == "touch"]
        for port in ("in1", "in2", "in3", "in4"):
            if port not in taken:
                try:
                    self._sensors[port] = touch_sensor(port)
                except NoTouchSensor:
                    continue  # there is none, or another kind of sensor
        self.ports = sorted(self._sensors)
        self._before = self._down()

    def _down(self):
        # type: () -> Set[str]
        down = set()  # type: Set[str]
        for port in self.ports:
            try:
                if self._sensors[port]():
                    down.add(port)
            except OSError:  # its cable was pulled: the others are still there
                self.ports = [one for one in self.ports if one != port]
        return down

    def close(self):
        # type: () -> None
        """Do nothing: there is nothing to release."""

    def pressed(self):
        # type: () -> List[str]
        """Return TAKE, once for a press of any of them."""
        down = self._down()
        fresh, self._before = down - self._before, down
        return [TAKE] if fresh else []


class Lines(object):
    """Lines of an input that is no terminal, as of a program that runs this one.

    Raises:
        OSError, ValueError: there is no such input.
    """

    def __init__(self):
        # type: () -> None
        import select

        self._select = select.select
        self._file = sys.stdin.fileno()  # type: Optional[int]
        self._rest = b""
        self._select([self._file], [], [], 0)  # Windows waits for sockets only: raise now

    def close(self):
        # type: () -> None
        """Do nothing: there is nothing to release."""

    def pressed(self):
        # type: () -> List[str]
        """Return TAKE for an empty line, END for one of LINE_ENDS; nothing once it has ended."""
        if self._file is None or not self._select([self._file], [], [], 0)[0]:
            return []
        data = os.read(self._file, 4096)
        if not data:
            self._file = None  # sensor and buttons still take points
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()[-64:]
        typed = [line.strip().lower() for line in lines]
        return [TAKE if line == LINE_TAKES else END for line in typed
                if line == LINE_TAKES or line in LINE_ENDS]  # fmt: skip


def press_sources(arm, say):
    # type: (Arm, Callable[[str], object]) -> List[PressSource]
    """Return the sources of presses for an arm, and report how to press."""
    from robot.asking import Person
    from robot.jobs.orders import KEYS, Buttons, Keys

    class TouchKeys(Keys):
        names = {key: TAKE for key, name in KEYS.items() if name == TAKE}
        names.update({b"q": END, b"e": END, b"\x04": END})

    sensors = TouchSensors(arm)
    found = [sensors]  # type: List[PressSource]
    labels = ["sensor at " + ", ".join(sensors.ports)] if sensors.ports else []
    for kind, label in ((Buttons, "CENTRE"), (TouchKeys, "Enter"), (Lines, "")):
        if kind is Lines and len(labels) > 1 and labels[-1] == "Enter":
            break
        try:
            found.append(kind())
        except (ImportError, OSError, ValueError, AttributeError):
            continue  # not on a brick; no terminal
        if label:
            labels.append(label)
    end = "q" if "Enter" in labels and not Person(None).at_brick else "the button DOWN"
    say(
        "lead the arm by hand;\na press takes a point:\n{}\n{} ends".format(",\n".join(labels), end)
    )
    return found
