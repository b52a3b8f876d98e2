"""Names and numbers of the brick's Linux, which the host's system may lack, or have otherwise."""

import enum
import errno
import os
import types

from laptop import system
from laptop.simulator.device.sysfs import POLLPRI
from laptop.simulator.host.clocks import copy_module


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
"""What `/proc/*/stat` counts in, of a second."""

OS = {
    "sysconf": lambda name: {"SC_CLK_TCK": CLOCK_TICKS}[name],
    "getuid": lambda: 1000,
    "geteuid": lambda: 1000,
}  # fmt: skip
"""What a program finds in `os`, where the host's has it not: it runs as the user `robot`."""

POLL = {
    "POLLIN": 1, "POLLPRI": POLLPRI, "POLLOUT": 4, "POLLERR": 8, "POLLHUP": 16, "POLLNVAL": 32
}  # fmt: skip

_LOCKS = {"LOCK_SH": 1, "LOCK_EX": 2, "LOCK_NB": 4, "LOCK_UN": 8}


def fcntl_module(ioctl):
    """Return a `fcntl` module.

    Args:
        ioctl: (fd, request, arg) -> whether the brick's own devices have taken it.
    """
    shim = types.ModuleType("fcntl") if system.fcntl is None else copy_module(system.fcntl)

    def own_or_host(fd, request, arg=0, mutate_flag=True):
        """ioctl that knows the brick's buttons and screen."""
        if ioctl(fd, request, arg):
            return 0
        if system.fcntl is None:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        return system.fcntl.ioctl(fd, request, arg, mutate_flag)

    def flock(fd, operation):
        """Lock a file of the host where that has no flock of its own."""
        descriptor = fd if isinstance(fd, int) else fd.fileno()
        if operation & _LOCKS["LOCK_UN"]:
            system.unlock_byte(descriptor, 0)
        elif not system.lock(descriptor):
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    shim.ioctl = own_or_host
    if system.fcntl is None:
        vars(shim).update(_LOCKS, flock=flock)
    return shim
