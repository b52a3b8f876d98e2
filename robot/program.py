"""Beginning and end of every script on the brick.

    if __name__ == "__main__":
        program.use_default_signals()   # before the imports that take seconds
    ...
    status = program.run("name.py", command)

Whatever moves or must say farewell does so in `except BaseException` or `finally`, and calls
`ignore_signals` first.
"""

# All of `signal` but its enums of the numbers, which take the brick 8 M instructions to make.
import _signal as signal  # type: ignore[import-not-found]
import contextlib
import os
import sys

MYPY = False
if MYPY:
    from typing import Callable, Iterator, NoReturn, Optional  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.command_line import Parser  # noqa: F401
    from robot.ev3.brick_lock import BrickLock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

SIGNALS = {
    signal.SIGINT: "SIGINT", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"
}  # fmt: skip


class Stopped(BaseException):
    """A signal asked the program to end; no `except Exception` of a library may swallow that."""

    def __init__(self, number):
        # type: (int) -> None
        super(Stopped, self).__init__("stopped by {}".format(SIGNALS[number]))
        self.status = 128 + number


def use_default_signals():
    # type: () -> None
    """Let signals just end the program: imports take the brick seconds, and nothing turns yet."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)


def raise_on_signals():
    # type: () -> None
    """Let the first signal from here on raise Stopped, and ignore the others."""
    for number in SIGNALS:
        signal.signal(number, _raise_stopped)


def ignore_signals():
    # type: () -> None
    """Ignore signals: nothing may spoil the end of the program."""
    # Not SIG_IGN: Python 3.5 would try to call that for a signal that has just come in.
    for number in SIGNALS:
        signal.signal(number, _do_nothing)


def _do_nothing(number, frame):
    # type: (int, object) -> None
    pass


def _raise_stopped(number, frame):
    # type: (int, object) -> NoReturn
    ignore_signals()  # a second one must not keep the first from being obeyed
    raise Stopped(number)


TAKE = "--take"
"""Option of every script that may move motors: it takes over from another program."""


def add_take(parser):
    # type: (Parser) -> None
    """Give a command line that option."""
    parser.add_argument(
        TAKE, action="store_true",
        help="ask another program that may be moving the motors to stop, and go on when it has",
    )  # fmt: skip


def connect(description, clock, take_over=None, unchecked=False):
    # type: (Arm, Clock, Optional[bool], bool) -> RobotArm
    """Return the RobotArm of a description; only here python-ev3dev2 is needed, slow to import.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        take_over: None for a program that moves nothing; else see `claim`.
        unchecked: whether it may move though the mounting of the motors is unchecked.

    Raises:
        ImportError: this is not the brick, nor an emulated one; `run` tells it.
        MotorNotFound: see RobotArm.
        NotChecked: it moves something, and the mounting of the motors is unchecked.
        BrickInUse: see `claim`.
    """
    from robot.motion.arm import RobotArm

    arm = RobotArm(description, clock)
    arm.checked.needed = not unchecked
    if take_over is not None:
        arm.confirm_checked()
        claim(arm.motors.lock, clock, take_over)
    return arm


def claim(lock, clock, take_over):
    # type: (BrickLock, Clock, bool) -> None
    """Make sure that no other program moves the motors until this one has ended.

    Args:
        lock: robot.ev3.brick_lock.BrickLock.
        clock: has `now()` and `sleep(seconds)`.
        take_over: whether one that may is asked to stop.

    Raises:
        BrickInUse: another one may, and has not been asked or does not stop.
    """
    if take_over:
        lock.take_over(clock)
    else:
        lock.acquire("; or take over with " + TAKE)


@contextlib.contextmanager
def parking(arm):
    # type: (RobotArm) -> Iterator[None]
    """Park the arm after a `with` block, whatever happens, and let no signal spoil that.

    Raises:
        ArmError: of parking, unless something else came first.
    """
    from shared.arm_description import ArmError  # not above, see run

    try:
        yield
    except BaseException:
        ignore_signals()
        with contextlib.suppress(ArmError):  # the first error is the one to report
            arm.park()
        raise
    ignore_signals()
    arm.park()


def run(name, command):
    # type: (str, Callable[[], object]) -> int
    """Call `command()`; return the exit status, after one line if it failed or was stopped."""
    from shared.arm_description import ArmError  # not above: it is no part of a quick start

    raise_on_signals()
    try:
        command()
    except BrokenPipeError:
        # Nobody reads on: and nothing is to be written at the end of Python either.
        with contextlib.suppress(OSError):  # an emulated output has no number
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print("{}: the reader of the output has gone".format(name), file=sys.stderr)
        return 1
    except ImportError as error:
        from robot.ev3.library import what_is_missing

        missing = what_is_missing(error)
        if missing is None:
            raise
        print("{}: {} ...".format(name, missing), file=sys.stderr)
        return 1
    except (ArmError, OSError, Stopped) as error:
        from shared.message_fields import printable  # it may quote names and contents of files

        with contextlib.suppress(OSError):  # its terminal may be closed
            print("{}: {}".format(name, printable(str(error))), file=sys.stderr)
        return getattr(error, "status", 1)
    return 0
