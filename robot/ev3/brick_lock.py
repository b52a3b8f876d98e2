"""One program at a time may move a brick's motors: a lock that the system keeps for the motors.

It lies on the very folder in which the system shows the motors, so that there is one for a brick,
whoever runs the programs and wherever they keep their state. Nothing is written: the kernel knows
who holds it, and frees it when that program ends, however it ends. So an emulated brick has its own
by having motors of its own; only in real time, where several programs may want the arm that all
cameras see, a file in the state folder stands for it ($BRICKSERVO_LOCK).

Of one program's arms, too, only one moves the motors: another would not know where that left them.

The lock is flock(2), and not a file with a process number in it: such a file outlives a killed
program, and its number may be another's by then. Nor fcntl locks: closing any descriptor of the
file would free those. Who holds it is read from /proc/locks, by inode; as that names a device that
some file systems report differently, the holder's open files are compared, too.

A system without such locks (no `fcntl`) shows no motors either; there everybody may move.
"""

import os

from shared.arm_description import ArmError
from shared.record import record
from shared.state import LOCK

MYPY = False
if MYPY:
    from typing import Callable, Dict, NamedTuple, Optional, Sequence  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401

    Holder = NamedTuple("Holder", [("name", str), ("pid", int), ("age", float), ("begun", int)])
else:
    Holder = record("Holder", "name pid age begun")

TAKE_TIMEOUT = 15.0
"""Longest wait for a program that is asked to stop, s: it stops the arm, saves its state, and ends
Python on a busy brick."""

POLL_PERIOD = 0.05
"""Period of checking whether it has ended, s."""

_held = {}  # type: Dict[str, int]  # path -> descriptor, which keeps the lock until this program ends
_movers = {}  # type: Dict[str, BrickLock]  # path -> lock of this program's arm that moves


class BrickInUse(ArmError):
    """Another program may be moving the motors, or another arm of it; nothing of ours has moved."""


Holder.__doc__ = """The program that may move the motors.

name   of its script
pid    number of the process
age    time for which it has been running, s
begun  time of its start, clock ticks: it differs from a later process's of the same number
"""


class BrickLock(object):
    """The right to move the motors, for all of this program, until it ends.

    Args:
        path: the folder in which the system shows the motors, see motors.motors_folder.
    """

    def __init__(self, path):
        # type: (str) -> None
        stand_in = os.environ.get(LOCK)
        self._path = stand_in or path
        self._flags = os.O_RDWR | os.O_CREAT if stand_in else os.O_RDONLY

    def acquire(self, advice=""):
        # type: (str) -> None
        """Take it, unless this program has it.

        Args:
            advice: what else may be done if it is not free, for people.

        Raises:
            BrickInUse: another program has it; the message says which.
        """
        if self._path in _held or self._taken():
            return
        raise BrickInUse(_in_use(self.holder()) + advice)

    def begin(self):
        # type: () -> None
        """Take it for the one arm whose this is, until `end`.

        Raises:
            BrickInUse: another program has it, or another arm of this one moves the motors.
        """
        self.acquire()
        self._check_mover()
        _movers[self._path] = self

    def begin_anew(self):
        # type: () -> None
        """Take it; what another arm of this program knows of the motors is worth nothing now.

        Raises:
            BrickInUse: another program has it.
        """
        self.acquire()
        if _movers.get(self._path) is not self:
            _movers.pop(self._path, None)

    def end(self):
        # type: () -> None
        """Let another arm of this program move the motors: this one is parked."""
        if _movers.get(self._path) is self:
            del _movers[self._path]

    def _check_mover(self):
        # type: () -> None
        if _movers.get(self._path, self) is not self:
            raise BrickInUse(
                "another RobotArm of this program has moved the motors and is not parked; move "
                "that one, or first call its park()"
            )

    def check_free(self):
        # type: () -> None
        """Raise BrickInUse if it is known that another program has it, or another arm."""
        self._check_mover()
        holder = self.holder()
        if holder:
            raise BrickInUse(_in_use(holder))

    def take_over(self, clock, say=print):
        # type: (Timepiece, Callable[[str], object]) -> None
        """Take it; if another program has it, ask that to stop, as `kill PID` does, and wait.

        Args:
            clock: has `now()` and `sleep(seconds)`.
            say: called with a line for people while it waits.

        Raises:
            BrickInUse: that program cannot be asked, or has not ended in TAKE_TIMEOUT.
        """
        asked = None  # type: Optional[Holder]
        end = clock.now() + TAKE_TIMEOUT
        while self._path not in _held and not self._taken():
            holder = self.holder()  # None: it has just ended, or it is not known
            if holder is not None:
                if asked is None:
                    asked = holder
                    self._ask(holder, say)
                elif holder.pid != asked.pid:
                    self.check_free()  # another one was faster
            if clock.now() >= end:
                if asked is None:
                    raise BrickInUse(_in_use(None))
                raise BrickInUse(
                    "{} was asked to stop and has not in {:.0f} s; "
                    "hold the arm, and end it: kill -9 {}".format(
                        _described(asked), TAKE_TIMEOUT, asked.pid
                    )
                )
            clock.sleep(POLL_PERIOD)

    def _ask(self, holder, say):
        # type: (Holder, Callable[[str], object]) -> None
        """Ask a program to stop that still holds it."""
        say("asking {} to stop".format(_described(holder)))
        number = _orderly_signal(holder.pid)
        still = self.holder()
        if still is None or (still.pid, still.begun) != (holder.pid, holder.begun):
            return  # it has ended by itself
        try:
            os.kill(holder.pid, number)
        except ProcessLookupError:
            pass  # likewise
        except PermissionError:
            raise BrickInUse(
                "{} is another user's: end it as that user, or as root: kill {}".format(
                    _described(holder), holder.pid
                )
            ) from None

    def holder(self):
        # type: () -> Optional[Holder]
        """Return the Holder that is another program; None if there is none, or it is not known."""
        if self._path in _held:
            return None
        try:
            lock = os.stat(self._path)
            with open("/proc/locks") as locks:
                lines = locks.read().split("\n")
        except OSError:
            return None
        for line in lines:
            # "1: FLOCK  ADVISORY  WRITE 812 00:0f:1234 0 EOF"; one that waits has "->" before it.
            fields = line.split()
            if fields[1:2] == ["FLOCK"] and fields[3] == "WRITE":
                pid, device = int(fields[4]), fields[5].rsplit(":", 1)
                if device[1] == str(lock.st_ino) and _holds(pid, lock, device[0]):
                    return _holder(pid)
        return None

    def _taken(self):
        # type: () -> bool
        """Take it if it is free; return whether it is ours now."""
        try:
            import fcntl  # not above: not every system has it
        except ImportError:
            return True
        descriptor = os.open(self._path, self._flags, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            return False
        _held[self._path] = descriptor
        return True


def release():
    # type: () -> None
    """Release it, as the end of the program does: for programs that are run inside another."""
    _movers.clear()
    while _held:
        os.close(_held.popitem()[1])


def _in_use(holder):
    # type: (Optional[Holder]) -> str
    """Return text for people about its holder."""
    if holder is None:
        return (
            "another program may be moving the motors, and the system does not tell which; "
            "wait until it has ended, or end it"
        )
    return "{} may be moving the motors; wait until it has ended, or end it: kill {}".format(
        _described(holder), holder.pid
    )


def _described(holder):
    # type: (Holder) -> str
    """Return words for people; a brick's date may be wrong, but the duration is right."""
    return "{} (process {}, running for {})".format(holder.name, holder.pid, _span(holder.age))


def _span(seconds):
    # type: (float) -> str
    for unit, size in (("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return "{:.0f} {}".format(seconds // size, unit)
    return "{:.0f} s".format(seconds)


# Facts of a process, from /proc


def _holds(pid, lock, device):
    # type: (int, os.stat_result, str) -> bool
    """Return whether a process has the file open; of another user's, whether the device is its."""
    folder = "/proc/{}/fd".format(pid)
    try:
        descriptors = os.listdir(folder)
    except PermissionError:
        # Not so on all file systems, hence the files above; but where the motors are shown.
        return device == "{:02x}:{:02x}".format(os.major(lock.st_dev), os.minor(lock.st_dev))
    except OSError:
        return False
    for name in descriptors:
        try:
            if os.path.samestat(os.stat(os.path.join(folder, name)), lock):
                return True
        except OSError:
            continue  # closed meanwhile
    return False


def _holder(pid):
    # type: (int) -> Optional[Holder]
    """Return the Holder of that process number; None if it has just ended."""
    try:
        with open("/proc/{}/cmdline".format(pid)) as file:
            args = file.read().split("\0")
        with open("/proc/{}/stat".format(pid)) as file:
            begun = int(file.read().rsplit(")", 1)[1].split()[19])  # starttime, see proc(5)
        with open("/proc/uptime") as file:
            uptime = float(file.read().split()[0])
    except (OSError, IndexError):
        return None
    age = max(0.0, uptime - begun / float(os.sysconf("SC_CLK_TCK")))
    return Holder(_script(args), pid, age, begun)


def _script(args):
    # type: (Sequence[str]) -> str
    """Return the name of a command line's script; of a module that is run, or of the program."""
    for arg in args:
        if arg.endswith(".py"):
            return os.path.basename(arg)
    if "-m" in args[:-1]:
        return args[args.index("-m") + 1]
    return os.path.basename(args[0])


def _orderly_signal(pid):
    # type: (int) -> int
    """Return the signal at which a process ends in its own way: SIGTERM, or else SIGINT.

    Python ends at SIGTERM without a `finally` unless a script sees to it, but not at Ctrl-C.
    """
    import _signal as signal  # type: ignore[import-not-found] # not above, see robot.program

    end, interrupt = signal.SIGTERM, signal.SIGINT  # type: int, int
    try:
        with open("/proc/{}/status".format(pid)) as file:
            caught = [line.split()[1] for line in file if line.startswith("SigCgt:")]
        mask = int(caught[0], 16)
    except (OSError, IndexError, ValueError):
        return end
    catches = [bool(mask >> (number - 1) & 1) for number in (end, interrupt)]
    return interrupt if catches == [False, True] else end
