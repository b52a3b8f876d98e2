"""Orders to a job that is drawn: from the brick's buttons, a terminal's keys, the laptop.

The laptop's are lines appended to a file in the state folder, which costs neither side a
connection: `echo pause >> ~/.brickservo/jobs/orders`.

    pause          the tip slows down on its way, the pen lifts, and all is held
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
        """Buttons, or what stands for them."""

        def pressed(self):
            # type: () -> List[str]
            """Names of the buttons that were pressed since it was last asked, in turn."""


LOOK_PERIOD = 0.06
"""Period of looks at the buttons and at the file, s."""

SPEEDS, PEN_TRIM, MAX_NUDGE = (25.0, 100.0), 30.0, 10.0
"""Bounds: per cent, degrees up and down, mm."""

BUTTON_SPEED, BUTTON_NUDGE = 0.1, 0.05
"""What a press of a button changes: share of the planned speed, and cm."""

NUDGES = {"up": (1, 0), "down": (-1, 0), "left": (0, 1), "right": (0, -1)}
"""Where the arrows shift to, as whoever sits behind the arm sees it: x forward, y to the left."""

MAX_FILE = 4096
"""So much of the file is read at once, bytes."""

WORDS = {"pause": 0, "resume": 0, "abort": 0, "speed": 1, "pen": 1, "nudge": 2}
"""Orders, and how many numbers follow each."""


class BadOrder(ArmError, ValueError):
    """A text that is no order."""


def read_order(text):
    # type: (str) -> Tuple[str, List[float]]
    """(word, numbers) of one order.

    Raises:
        BadOrder: it is none.
    """
    words = text.split()
    if not words or words[0] not in WORDS:
        raise BadOrder(
            "'{}' is no order; write one of {}".format(
                printable(text.strip()[:40]), ", ".join(sorted(WORDS))
            )
        )
    word, texts = words[0], words[1:]
    low, high, unit = {
        "speed": SPEEDS + ("per cent",),
        "pen": (-PEN_TRIM, PEN_TRIM, "degrees"),
        "nudge": (-MAX_NUDGE, MAX_NUDGE, "mm"),
    }.get(word, (0, 0, ""))
    try:
        numbers = [float(x) for x in texts]
    except ValueError:
        numbers = [math.nan]
    if len(texts) != WORDS[word] or not all(low <= x <= high for x in numbers):
        what = ["nothing", "a number", "two numbers"][WORDS[word]]
        bounds = " from {:g} to {:g} {}".format(low, high, unit) if WORDS[word] else ""
        raise BadOrder("'{}': {} takes {}{}".format(printable(text[:40]), word, what, bounds))
    return word, numbers


def orders_file():
    # type: () -> str
    """Path of the file that orders are appended to."""
    return os.path.join(state_folder(), JOB_ORDERS_FILE)


class JobOrders(object):
    """What is wanted of the job that is drawn.

    Args:
        share: of the planned speed, at first.
        paused: whether it is to begin so.
        presses: whose `pressed()` gives the names of buttons pressed since it was last asked.
        path: of the file for the laptop's, which is emptied; None: there is none.

    Attributes:
        paused, aborted: whether it is to be.
        share: of the planned speed.
        pen: how much deeper the pen is to come down, rad of its motor.
        notes: lines for people, to be taken out and said when nothing moves.
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
        """Take no more."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def look(self, now):
        # type: (float) -> float
        """Take what has come; the rate at which the plan is to go: 0 where it is to stand.

        Args:
            now: s; more often than every LOOK_PERIOD nothing is looked at.
        """
        if now >= self._due:
            self._due = now + LOOK_PERIOD
            for source in self._presses:
                for button in source.pressed():
                    self._press(button)
            if self._file is not None:
                self._take_lines(self._file)
        return 0.0 if self.paused or self.aborted else self.share

    def take(self, line):
        # type: (str) -> None
        """Take one order; what is none goes to the notes."""
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

    def taken_nudge(self):
        # type: () -> Optional[Tuple[float, ...]]
        """(x, y) of how far to shift what follows, cm, told once; None: not at all."""
        nudge, self._nudge = self._nudge, [0.0, 0.0]
        return tuple(nudge) if any(nudge) else None

    def _press(self, button):
        # type: (str) -> None
        if button == "enter":
            self.paused = not self.paused
        elif button in NUDGES and self.paused:
            self._nudge = [a + BUTTON_NUDGE * b for a, b in zip(self._nudge, NUDGES[button])]
        elif button in ("up", "down"):
            step = BUTTON_SPEED if button == "up" else -BUTTON_SPEED
            low, high = (x / 100 for x in SPEEDS)
            self.share = min(max(round(self.share + step, 2), low), high)

    def _take_lines(self, file):
        # type: (int) -> None
        os.lseek(file, self._begin, os.SEEK_SET)
        data = os.read(file, MAX_FILE)
        if data == self._read:
            return
        # Who writes by ">" and not by ">>" begins the file anew.
        fresh = data[len(self._read) :] if data.startswith(self._read) else data
        whole = len(data) - len(fresh) + fresh.rfind(b"\n") + 1
        lines = data[len(data) - len(fresh) : whole]
        self._read = data[:whole]
        for line in lines.decode("ascii", "replace").splitlines():
            self.take(line)
        if len(self._read) > MAX_FILE // 2:
            self._begin, self._read = self._begin + len(self._read), b""
        elif len(data) == MAX_FILE and not lines:
            self._begin, self._read = self._begin + MAX_FILE, b""  # one endless line


# ---- who is there

KEY_DOWN = 1, 1
"""Type and value of the event of a key that is pressed, see linux/input-event-codes.h."""

BUTTON_NAMES = {103: "up", 108: "down", 105: "left", 106: "right", 28: "enter"}
"""Names of the brick's buttons by their keys' codes; the one that is left ends the program."""


class Buttons(object):
    """The brick's own; those held down when it begins were meant for something else.

    Their events are read, which the system keeps: while a stroke is read and planned nobody looks
    for seconds, and a press that comes and goes meanwhile would not be seen in what is down.
    """

    def __init__(self):
        # type: () -> None
        from robot.ev3.buttons import brick_buttons  # not above: few draw without a terminal

        self._events = brick_buttons().evdev_device

    def close(self):
        # type: () -> None
        """Hear no more of them."""
        self._events.close()

    def pressed(self):
        # type: () -> List[str]
        """Names of those that were pressed since, in turn."""
        found = []  # type: List[str]
        while True:
            event = self._events.read_one()
            if event is None:
                return found
            if (event.type, event.value) == KEY_DOWN and event.code in BUTTON_NAMES:
                found.append(BUTTON_NAMES[event.code])


def _in_background(terminal):
    # type: (int) -> bool
    """Whether the program would be stopped if it asked this terminal for anything."""
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:  # it is not the terminal of its session
        return False


KEYS = {
    b"\n": "enter", b"\r": "enter", b" ": "enter",
    b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right", b"\x1b[D": "left",
}  # fmt: skip
"""What a terminal sends for the keys that stand for buttons."""


class Keys(object):
    """The keys of the terminal that the program was started in, until `close`.

    Attributes:
        names: what a key is called, by what the terminal sends; others mean nothing.

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
        """Let the terminal treat keys as before."""
        self._termios.tcsetattr(self._terminal, self._termios.TCSADRAIN, self._before)

    def pressed(self):
        # type: () -> List[str]
        """As of Buttons."""
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
