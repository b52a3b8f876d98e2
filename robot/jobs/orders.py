"""Orders to a job that is drawn: from the brick's buttons, a terminal's keys, the laptop.

The laptop's are lines appended to a file in the state folder, which costs neither side a
connection: `echo pause >> ~/.brickservo/jobs/orders`.

    pause          the tip slows down on its path, the pen lifts, and all is held
    resume         the pen comes down where it was, and goes on
    abort          the pen lifts, and the job ends
    speed 60       in per cent of what is planned, from 25 to 100
    pen -5         the pen comes down so much deeper (or less deep), degrees of its motor
    nudge 0.5 0    while it is paused: the pen is to come down so much farther in x and y, mm; the
                   joints' zero is corrected by that, as after a homing that was a little off
"""

import math
import os

from shared.arm_description import ArmError
from shared.message_fields import printable
from shared.state import JOB_ORDERS_FILE, state_folder

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Protocol, Sequence, Tuple  # noqa: F401

    class Presses(Protocol):
        """Buttons, or a substitute."""

        def pressed(self):
            # type: () -> List[str]
            """Return the names of the buttons that were pressed since the last call, in turn."""


POLL_PERIOD = 0.06
"""Period of sampling the buttons and the file, s."""

SPEED_BOUNDS, MAX_PEN_TRIM, MAX_NUDGE = (25.0, 100.0), 30.0, 10.0
"""Bounds of orders: least and greatest speed, per cent; the pen's trim up and down, degrees of its
motor; a nudge in x or y, mm."""

SPEED_STEP, NUDGE_STEP = 0.1, 0.05
"""Steps of one press of a button: share of the planned speed, and cm of a nudge."""

NUDGES = {"up": (1, 0), "down": (-1, 0), "left": (0, 1), "right": (0, -1)}
"""Directions (x, y) of the arrows as seen from behind the arm: x forward, y to the left."""

MAX_READ = 4096
"""Greatest size of what is read of the file at once, bytes."""

ORDER_NUMBERS = {"pause": 0, "resume": 0, "abort": 0, "speed": 1, "pen": 1, "nudge": 2}
"""Orders, and the number of numbers that follow each."""


class BadOrder(ArmError, ValueError):
    """A text that is no order."""


def read_order(text):
    # type: (str) -> Tuple[str, List[float]]
    """Return (word, numbers) of one order, the numbers in the units of its text.

    Raises:
        BadOrder: it is none.
    """
    parts = text.split()
    if not parts or parts[0] not in ORDER_NUMBERS:
        raise BadOrder(
            "'{}' is no order; write one of {}".format(
                printable(text.strip()[:40]), ", ".join(sorted(ORDER_NUMBERS))
            )
        )
    word, texts = parts[0], parts[1:]
    low, high, unit = {
        "speed": SPEED_BOUNDS + ("per cent",),
        "pen": (-MAX_PEN_TRIM, MAX_PEN_TRIM, "degrees"),
        "nudge": (-MAX_NUDGE, MAX_NUDGE, "mm"),
    }.get(word, (0, 0, ""))
    try:
        numbers = [float(x) for x in texts]
    except ValueError:
        numbers = [math.nan]
    if len(texts) != ORDER_NUMBERS[word] or not all(low <= x <= high for x in numbers):
        what = ["nothing", "a number", "two numbers"][ORDER_NUMBERS[word]]
        bounds = " from {:g} to {:g} {}".format(low, high, unit) if ORDER_NUMBERS[word] else ""
        raise BadOrder("'{}': {} takes {}{}".format(printable(text[:40]), word, what, bounds))
    return word, numbers


def orders_file():
    # type: () -> str
    """Return the path of the file that orders are appended to."""
    return os.path.join(state_folder(), JOB_ORDERS_FILE)


class JobOrders(object):
    """The state that is wanted of the job that is drawn.

    Args:
        share: share of the planned speed, at first, 0.25 to 1.
        paused: whether it is to begin paused.
        presses: sources whose `pressed()` gives the buttons pressed since it was last called.
        path: of the file for the laptop's orders, which is emptied; None: there is none.

    Attributes:
        paused: whether it is to be paused.
        aborted: whether it is to be aborted.
        share: share of the planned speed, 0.25 to 1.
        pen: depth that is added to the pen's, rad of its motor.
        notes: lines for people, to be taken out and printed when nothing moves.
    """

    def __init__(self, share=1.0, paused=False, presses=(), path=None):
        # type: (float, bool, Sequence[Presses], Optional[str]) -> None
        self.share, self.paused, self.aborted = share, paused, False
        self.pen = 0.0
        self.notes = []  # type: List[str]
        self._presses = presses
        self._nudge = [0.0, 0.0]
        self._due = -math.inf
        self._file = None  # type: Optional[int]
        self._begin, self._read = 0, b""
        if path is not None:
            os.makedirs(os.path.dirname(path), exist_ok=True)
            flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0)
            self._file = os.open(path, flags, 0o666)

    def close(self):
        # type: () -> None
        """Close the file of orders."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def sample(self, now):
        # type: (float) -> float
        """Handle the orders that have come; return the wanted rate, 0 where it is to stand.

        Args:
            now: the clock's time, s; nothing is read more often than every POLL_PERIOD.
        """
        if now >= self._due:
            self._due = now + POLL_PERIOD
            for source in self._presses:
                for button in source.pressed():
                    self._press(button)
            if self._file is not None:
                self._handle_lines(self._file)
        return 0.0 if self.paused or self.aborted else self.share

    def handle(self, line):
        # type: (str) -> None
        """Handle one order; an invalid one is noted."""
        try:
            word, numbers = read_order(line)
        except BadOrder as problem:
            self.notes.append(str(problem))
            return
        if word in ("pause", "resume"):
            self.paused = word == "pause"
        elif word == "abort":
            self.aborted = True
        elif word == "speed":
            self.share = numbers[0] / 100
        elif word == "pen":
            self.pen = math.radians(numbers[0])
        elif self.paused:
            self._nudge = [a + b / 10 for a, b in zip(self._nudge, numbers)]
        else:
            self.notes.append("nudge: the job is not paused; pause it first")

    def pop_nudge(self):
        # type: () -> Optional[Tuple[float, ...]]
        """Return (x, y) by which to shift what follows, cm, and forget it; None: not at all."""
        nudge, self._nudge = self._nudge, [0.0, 0.0]
        return tuple(nudge) if any(nudge) else None

    def _press(self, button):
        # type: (str) -> None
        if button == "enter":
            self.paused = not self.paused
        elif button in NUDGES and self.paused:
            self._nudge = [a + NUDGE_STEP * b for a, b in zip(self._nudge, NUDGES[button])]
        elif button in ("up", "down"):
            step = SPEED_STEP if button == "up" else -SPEED_STEP
            low, high = (x / 100 for x in SPEED_BOUNDS)
            self.share = min(max(round(self.share + step, 2), low), high)

    def _handle_lines(self, file):
        # type: (int) -> None
        os.lseek(file, self._begin, os.SEEK_SET)
        data = os.read(file, MAX_READ)
        if data == self._read:
            return
        # A writer that uses ">" and not ">>" truncates the file.
        fresh = data[len(self._read) :] if data.startswith(self._read) else data
        end = len(data) - len(fresh) + fresh.rfind(b"\n") + 1
        lines = data[len(data) - len(fresh) : end]
        self._read = data[:end]
        for line in lines.decode("ascii", "replace").splitlines():
            self.handle(line)
        if len(self._read) > MAX_READ // 2:
            self._begin, self._read = self._begin + len(self._read), b""
        elif len(data) == MAX_READ and not lines:
            self._begin, self._read = self._begin + MAX_READ, b""  # one endless line


# ---- who is there

KEY_DOWN = 1, 1
"""Type and value of the event of a key that is pressed, see linux/input-event-codes.h."""

BUTTON_NAMES = {103: "up", 108: "down", 105: "left", 106: "right", 28: "enter"}
"""Names of the brick's buttons by their keys' codes; the one that is left ends the program."""


class Buttons(object):
    """The brick's own buttons; those held down when it begins were meant for something else.

    Their events are read, which the system queues: while a stroke is read and planned nobody
    samples for seconds, and a press that comes and goes meanwhile would be missed by the state.
    """

    def __init__(self):
        # type: () -> None
        from robot.ev3.buttons import brick_buttons  # not above: few draw without a terminal

        self._events = brick_buttons().evdev_device

    def close(self):
        # type: () -> None
        """Close their events."""
        self._events.close()

    def pressed(self):
        # type: () -> List[str]
        """Return the names of those that were pressed since the last call, in turn."""
        found = []  # type: List[str]
        while True:
            event = self._events.read_one()
            if event is None:
                return found
            if (event.type, event.value) == KEY_DOWN and event.code in BUTTON_NAMES:
                found.append(BUTTON_NAMES[event.code])


def _in_background(terminal):
    # type: (int) -> bool
    """Return whether the system would stop the program if it read from this terminal."""
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:  # it is not the terminal of its session
        return False


KEYS = {
    b"\n": "enter", b"\r": "enter", b" ": "enter",
    b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right", b"\x1b[D": "left",
}  # fmt: skip
"""Names of buttons by what a terminal sends for the keys that stand for them."""


class Keys(object):
    """The keys of the terminal that the program was started in, until `close`.

    Attributes:
        names: names of keys by what the terminal sends; others mean nothing.

    Raises:
        OSError, ImportError: there is none.
    """

    names = KEYS  # type: Dict[bytes, str]

    def __init__(self):
        # type: () -> None
        import select
        import sys
        import termios
        import tty

        self._select, self._termios = select.select, termios
        self._terminal = sys.stdin.fileno()
        if not os.isatty(self._terminal) or _in_background(self._terminal):
            raise OSError("no terminal to read from")
        self._before = termios.tcgetattr(self._terminal)
        tty.setcbreak(self._terminal, termios.TCSADRAIN)

    def close(self):
        # type: () -> None
        """Restore how the terminal treats keys."""
        self._termios.tcsetattr(self._terminal, self._termios.TCSADRAIN, self._before)

    def pressed(self):
        # type: () -> List[str]
        """Return the names of the keys that were pressed since the last call, in turn."""
        if not self._select([self._terminal], [], [], 0)[0]:
            return []
        typed = os.read(self._terminal, 64)
        found = []
        while typed:
            size = 3 if typed.startswith(b"\x1b[") else 1
            if typed[:size] in self.names:
                found.append(self.names[typed[:size]])
            typed = typed[size:]
        return found
