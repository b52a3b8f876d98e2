"""Names and numbers of the brick's Linux, where the host's system has none or others."""

import enum
import errno
import os
import random
import types
from typing import Any, Callable, Dict, NamedTuple, Sequence

from laptop.emulator.device.sysfs import POLLPRI
from laptop.emulator.host.clocks import copy_module
from laptop.system import platforms

MYPY = False
if MYPY:
    from typing import Protocol, Union

    from laptop.emulator.host.clocks import ProgramClock

    class HasFileno(Protocol):
        """A file, socket, or other object with a descriptor."""

        def fileno(self) -> int:
            """Return its descriptor."""

    FileDescriptorLike = Union[int, HasFileno]


class Signals(enum.IntEnum):
    """linux/arch/arm/include/uapi/asm/signal.h, as Python's `signal` has it."""

    SIGHUP, SIGINT, SIGQUIT, SIGILL, SIGTRAP, SIGABRT = 1, 2, 3, 4, 5, 6
    SIGBUS, SIGFPE, SIGKILL, SIGUSR1, SIGSEGV, SIGUSR2 = 7, 8, 9, 10, 11, 12
    SIGPIPE, SIGALRM, SIGTERM, SIGSTKFLT, SIGCHLD, SIGCONT = 13, 14, 15, 16, 17, 18
    SIGSTOP, SIGTSTP, SIGTTIN, SIGTTOU, SIGURG, SIGXCPU = 19, 20, 21, 22, 23, 24
    SIGXFSZ, SIGVTALRM, SIGPROF, SIGWINCH, SIGIO, SIGPWR = 25, 26, 27, 28, 29, 30
    SIGSYS = 31
    SIGIOT, SIGCLD, SIGPOLL = SIGABRT, SIGCHLD, SIGIO
    SIGRTMIN, SIGRTMAX = 34, 64


TIMERS = {"ITIMER_REAL": 0, "ITIMER_VIRTUAL": 1, "ITIMER_PROF": 2}

CLOCK_TICKS = 100
"""Frequency of the ticks in `/proc/*/stat`, Hz."""

HOST, USER, HOME = "ev3dev", "robot", "/home/robot"
"""Names of the brick and of its user, and that user's home."""

ENVIRONMENT = {
    "HOME": HOME, "LOGNAME": USER, "USER": USER, "SHELL": "/bin/bash", "LANG": "C.UTF-8",
    "PATH": "/usr/local/bin:/usr/bin:/bin:/usr/local/games:/usr/games", "TERM": "linux",
    "TZ": "UTC",
}  # fmt: skip
"""Environment variables that a program finds, beside this project's."""
NEEDED = ("SYSTEMROOT", "TEMP", "TMP") if os.name == "nt" else ()
"""Variables without which Python does not work on this host."""

PID, PARENT = 812, 640
"""Numbers of the program's process, and of the shell that has started it."""
USER_ID = 1000

FIRST_THREAD, STACK = 0xB6F6D000, 0x800000
"""Number of the main thread in Python on the brick, and its distance to the next one's, bytes."""

EXECUTABLE = "/usr/bin/python3"
RELEASE, MACHINE = "4.14.117-ev3dev-2.3.5-ev3", "armv5tejl"
VERSION = "#1 PREEMPT Sat Mar 7 12:54:39 CST 2020"

LOAD = 0.9
"""Load average, processes, while a program runs."""
MEMORY = {"MemTotal": 57472, "MemFree": 9340, "MemAvailable": 27680, "SwapTotal": 98300}
"""Rows of /proc/meminfo, kB."""
CARD = (4096, 4096, 1865000, 1390000, 1290000, 472000, 401000, 401000, 4096, 255)
"""Result of `os.statvfs` for the brick's card: 5.3 GB of 7.6 are free."""
TERMINAL = (80, 24)
"""Size of a terminal over ssh, characters."""


def system_files(argv: Sequence[str], started: float) -> Dict[str, str]:
    """Return the files on the system and its processes: path -> text.

    Args:
        argv: the program's command line.
        started: time of its start since that of the system, s.
    """
    own = {
        "cmdline": "\0".join(argv) + "\0",
        "comm": "python3\n",
        "stat": stat_of(PID, started),
        "status": "Name:\tpython3\nPid:\t{}\nPPid:\t{}\nUid:\t{}\n".format(
            PID, PARENT, "\t".join([str(USER_ID)] * 4)
        ),
    }
    files = {
        "/proc/{}/{}".format(process, name): text
        for process in (PID, "self")
        for name, text in own.items()
    }
    files.update({
        "/etc/hostname": HOST + "\n",
        "/etc/os-release": 'PRETTY_NAME="Debian GNU/Linux 9 (stretch)"\nNAME="Debian GNU/Linux"\n'
        'VERSION_ID="9"\nVERSION="9 (stretch)"\nID=debian\n',
        "/etc/passwd": "".join(":".join(map(str, one)) + "\n" for one in USERS),
        "/etc/timezone": "Etc/UTC\n",
        "/proc/cpuinfo": "processor\t: 0\nmodel name\t: ARM926EJ-S rev 5 (v5l)\n"
        "BogoMIPS\t: 148.88\nHardware\t: LEGO MINDSTORMS EV3\n",
        "/proc/loadavg": "{0:.2f} {0:.2f} {0:.2f} 1/70 {1}\n".format(LOAD, PID),
        "/proc/locks": "",
        "/proc/meminfo": "".join("{}: {:8} kB\n".format(*one) for one in sorted(MEMORY.items())),
        "/proc/uptime": "{0:.2f} 0.00\n".format(started),
        "/proc/version": "Linux version {} {}\n".format(RELEASE, VERSION),
    })  # fmt: skip
    # This computer's, as the arm's zero was written with it: of one length everywhere on Linux.
    try:
        with open(BOOT_ID) as file:
            files[BOOT_ID] = file.read()
    except OSError:  # not Linux
        pass
    return files


def stat_of(pid: int, started: float) -> str:
    """Return /proc/PID/stat: of 52 figures, the number of the process and when it was started."""
    figures = ["0"] * 49
    figures[18] = str(int(started * CLOCK_TICKS))
    return "{} (python3) R {}\n".format(pid, " ".join(figures))


BOOT_ID = "/proc/sys/kernel/random/boot_id"

USERS = (
    ("root", "x", 0, 0, "root", "/root", "/bin/bash"),
    (USER, "x", USER_ID, USER_ID, "", HOME, "/bin/bash"),
)
"""Rows of /etc/passwd."""


def os_functions(clock: "ProgramClock") -> Dict[str, Callable[..., object]]:
    """Return substitutes for functions of `os` on processes: the brick has one.

    Args:
        clock: clocks.ProgramClock.
    """
    chance = random.Random(0)
    own = {  # type: Dict[str, Callable[..., object]]
        "getpid": lambda: PID,
        "getppid": lambda: PARENT,
        "getlogin": lambda: USER,
        "cpu_count": lambda: 1,
        "process_cpu_count": lambda: 1,
        "sched_getaffinity": lambda pid: {0},
        "getloadavg": lambda: (LOAD, LOAD, LOAD),
        "get_terminal_size": lambda fd=1: os.terminal_size(TERMINAL),
        "urandom": lambda size: bytes(bytearray(chance.getrandbits(8) for _ in range(size))),
        "times": lambda: os.times_result((clock.busy(), 0.0, 0.0, 0.0, clock.monotonic())),
    }
    own.update(dict.fromkeys(("getuid", "geteuid", "getgid", "getegid"), lambda: USER_ID))
    if hasattr(os, "uname"):
        release = os.uname_result(("Linux", HOST, RELEASE, VERSION, MACHINE))
        own["uname"] = lambda: release
    if hasattr(os, "statvfs"):
        real = os.statvfs

        def statvfs(path: Any) -> os.statvfs_result:
            real(path)  # which may not be there
            return os.statvfs_result(CARD)

        own["statvfs"] = statvfs
    return own


OS = {
    "sysconf": lambda name: {"SC_CLK_TCK": CLOCK_TICKS}[name],
    "getuid": lambda: USER_ID,
    "geteuid": lambda: USER_ID,
}  # fmt: skip
"""Functions of `os` that the host may lack; a program runs as the user `robot`."""


def users_module() -> types.ModuleType:
    """Return a `pwd` module."""
    shim = types.ModuleType("pwd")
    users = [Passwd(*one) for one in USERS]

    def getpwnam(name: str) -> Passwd:
        """Return the user of that name."""
        for one in users:
            if one.pw_name == name:
                return one
        raise KeyError("getpwnam(): name not found: {!r}".format(name))

    def getpwuid(uid: int) -> Passwd:
        """Return the user of that number."""
        for one in users:
            if one.pw_uid == uid:
                return one
        raise KeyError("getpwuid(): uid not found: {!r}".format(uid))

    vars(shim).update(
        struct_passwd=Passwd,
        getpwall=lambda: list(users),
        getpwnam=getpwnam,
        getpwuid=getpwuid,
    )
    return shim


Passwd = NamedTuple(
    "Passwd",
    [
        ("pw_name", str),
        ("pw_passwd", str),
        ("pw_uid", int),
        ("pw_gid", int),
        ("pw_gecos", str),
        ("pw_dir", str),
        ("pw_shell", str),
    ],
)
Passwd.__doc__ = """A row of /etc/passwd."""

POLL = {
    "POLLIN": 1, "POLLPRI": POLLPRI, "POLLOUT": 4, "POLLERR": 8, "POLLHUP": 16, "POLLNVAL": 32
}  # fmt: skip

_LOCKS = {"LOCK_SH": 1, "LOCK_EX": 2, "LOCK_NB": 4, "LOCK_UN": 8}


def fcntl_module(ioctl: Callable[[Any, int, Any], bool]) -> types.ModuleType:
    """Return a `fcntl` module.

    Args:
        ioctl: (fd, request, arg) -> whether a device of the brick has handled it.
    """
    real = vars(platforms)["fcntl"]  # type: Any  # None where the host has none

    def own_or_host(fd: Any, request: int, arg: Any = 0, mutate_flag: bool = True) -> Any:
        """Do an ioctl, also of the brick's buttons and screen."""
        if ioctl(fd, request, arg):
            return 0
        if real is None:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        return real.ioctl(fd, request, arg, mutate_flag)

    def flock(fd: "FileDescriptorLike", operation: int) -> None:
        """Lock a file of the host where that has no flock of its own."""
        descriptor = fd if isinstance(fd, int) else fd.fileno()
        if operation & _LOCKS["LOCK_UN"]:
            platforms.unlock_byte(descriptor, 0)
        elif not platforms.lock(descriptor):
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    if real is None:
        return copy_module(types.ModuleType("fcntl"), ioctl=own_or_host, flock=flock, **_LOCKS)
    return copy_module(real, ioctl=own_or_host)
