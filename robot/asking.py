"""Questions to people: by keys in a terminal, or by buttons if the program was started there.

A program that Brickman has started is shown on the brick's screen, a Linux console, and has no
keyboard. Any other terminal sends single keys; what is no terminal, lines.
"""

import contextlib
import os
import re
import select
import sys

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Any, Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401

    Choices = Sequence[Tuple[str, str]]  # answers, and the keys for them

BUTTONS = ("left", "right", "up", "down", "enter")
"""Names of the buttons that choose, in the order of the choices; Back ends the program."""

BUTTON_LABELS = {"enter": "CENTRE"}
"""Labels of buttons where that is not their name."""

POLL_PERIOD = 0.05
"""Period of sampling the buttons, s."""

CTRL_D = "\x04"


class NobodyAnswers(ArmError):
    """The terminal was closed, or the input has ended."""


class Person(object):
    """The person at the terminal or at the brick.

    Args:
        clock: has `now()` and `sleep(seconds)`; None where nothing will be asked.

    Attributes:
        at_brick: whether the program was started from the brick's own menu.
    """

    def __init__(self, clock):
        # type: (Optional[Clock]) -> None
        self._clock = clock
        self.at_brick = bool(re.match(r"/dev/tty\d", _terminal()))
        self._buttons = None  # type: Any # python-ev3dev2's, which has no types

    def choose(self, question, choices):
        # type: (str, Choices) -> str
        """Ask a question, and return the answer that is chosen.

        Args:
            question: text.
            choices: at most five pairs of an answer and the key for it.

        Raises:
            NobodyAnswers: nor will anybody.
        """
        with _line_ended():
            return (self._by_button if self.at_brick else self._by_key)(question, choices)

    def confirm(self, request, otherwise=""):
        # type: (str, str) -> None
        """Wait until a person confirms by Enter or the centre button.

        Args:
            request: text of what is to be done.
            otherwise: advice where no person can answer; "" for none.

        Raises:
            NobodyAnswers: nor will anybody.
        """
        with _line_ended():
            if self.at_brick:
                print("{}\nThen press CENTRE.\nBACK ends.".format(request))
                self._pressed(("enter",))
                return
            if not _line("{} Then press Enter. ".format(request)):
                raise _nobody(otherwise)

    def _by_key(self, question, choices):
        # type: (str, Choices) -> str
        hint = ", ".join("{} {}".format(key, answer) for answer, key in choices)
        while True:
            typed = _key("{} [{}] ".format(question, hint))
            if not typed or typed == CTRL_D:
                raise _nobody()
            typed = typed.strip().lower()
            for answer, key in choices:
                if typed in (key, answer):
                    print(answer)
                    return answer
            print("that is none of the keys; type one of {}".format(
                ", ".join(key for _, key in choices)
            ))  # fmt: skip

    def _by_button(self, question, choices):
        # type: (str, Choices) -> str
        print(question)
        for (answer, _), button in zip(choices, BUTTONS):
            print("{:7}{}".format(BUTTON_LABELS.get(button, button.upper()), answer))
        pressed = self._pressed(BUTTONS[: len(choices)])
        answer = choices[BUTTONS.index(pressed)][0]
        print("-> {}".format(answer))
        return answer

    def _pressed(self, wanted):
        # type: (Sequence[str]) -> str
        """Wait for one of these buttons to be pressed and released; return its name."""
        if self._buttons is None:
            from robot.ev3.buttons import brick_buttons  # not above: few are asked by button

            self._buttons = brick_buttons()
        clock = self._clock
        assert clock is not None  # who asks by buttons has one
        before = self._down()  # a button that is down already was meant for something else
        while True:
            clock.sleep(POLL_PERIOD)
            down = self._down()
            for button in down:
                if button in wanted and button not in before:
                    while button in self._down():
                        clock.sleep(POLL_PERIOD)
                    return button
            before = down

    def _down(self):
        # type: () -> List[str]
        return list(self._buttons.buttons_pressed)


@contextlib.contextmanager
def _line_ended():
    # type: () -> Iterator[None]
    """End the line if a `with` block ends by an exception, in the middle of one."""
    try:
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            sys.stdout.write("\n")
        raise


def _nobody(otherwise=""):
    # type: (str) -> NobodyAnswers
    return NobodyAnswers(
        "nobody answers, the input has ended; start it in a terminal (ssh -t), or from the brick's "
        "menu" + otherwise
    )


def _terminal():
    # type: () -> str
    """Return the name of the terminal that the program was started in; "" where there is none."""
    try:
        return os.ttyname(0)
    except (OSError, AttributeError):  # no terminal, or a system without such names
        return ""


def _key(prompt):
    # type: (str) -> str
    """Return the next key in a terminal, else the next line; "" at the end of the input."""
    try:
        descriptor = sys.stdin.fileno()
        if not os.isatty(descriptor):
            return _line(prompt)
        import termios
        import tty
    except (ImportError, OSError, ValueError):  # Windows; a file without a descriptor
        return _line(prompt)
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor, termios.TCSADRAIN)
        _show(prompt)  # only now: a key that comes at once is one of this terminal
        return _letter(descriptor)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _line(prompt):
    # type: (str) -> str
    """Return the next line; "" at the end of the input."""
    _show(prompt)
    try:
        descriptor = sys.stdin.fileno()
    except (OSError, ValueError):
        return sys.stdin.readline()
    line = letter = ""
    while letter != "\n":
        letter = _letter(descriptor)
        if not letter:
            break
        line += letter
    return line


def _show(prompt):
    # type: (str) -> None
    sys.stdout.write(prompt)
    sys.stdout.flush()


def _letter(descriptor):
    # type: (int) -> str
    with contextlib.suppress(OSError, ValueError):  # Windows waits for sockets only
        select.select([descriptor], [], [])
    return os.read(descriptor, 1).decode("ascii", "replace")
