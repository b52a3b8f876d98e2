"""Platform differences of Linux, macOS and Windows behind one interface.

Rule: whoever on the laptop's side needs what not every system has asks here; but for Linux's way to
its cameras, which is in laptop.see.camera.webcams.
"""

import _thread
import contextlib
import os
import signal
import subprocess
import sys
import time
from types import FrameType
from typing import Any, Callable, Dict, Iterable, Iterator, Optional, Union

MYPY = False
if MYPY:
    from typing import NoReturn  # noqa: F401

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]
    import msvcrt

    _windows = msvcrt  # type: Any  # (elsewhere type checkers see nothing in it)

try:
    import termios
    import tty
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]

ENDING = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)
)
"""The signals by which this system asks a program to end; Ctrl-C's is the first."""

TERMINAL_CHANGES = getattr(signal, "SIGWINCH", None)
"""The signal by which this system tells of a terminal's new size; None where it does not."""

STOPS_PROCESSES = hasattr(signal, "SIGSTOP")
"""Whether a process can be stopped and sent on its way again, as the faults of benches are made."""

OPENS_FOLDERS = hasattr(os, "O_DIRECTORY")
"""Whether a folder can be open, and locked, while it is renamed."""

AnyPath = Union[str, "os.PathLike[str]"]

_LOCK_AT = 1 << 30
"""The first byte that is locked; Windows lets nobody read one, so it is beyond all data."""
_LOCK_POLL_PERIOD = 0.001
"""Period of the attempts to lock a byte where the system cannot wait for one, s."""


# Locks, which the system frees with the process that holds them, however it ends


def lock(descriptor: int) -> bool:
    """Lock an open file for others, through whatever descriptor, if it is free.

    Args:
        descriptor: of the file, which stays locked until this is closed.

    Returns:
        True if it is locked now; False if somebody else has locked it.

    Raises:
        OSError: there it cannot be locked at all.
    """
    if fcntl is None:
        return _try(descriptor, 0)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def is_locked(descriptor: int) -> bool:
    """Return True if another process has locked an open file."""
    if fcntl is None:
        free = _try(descriptor, 0)
        if free:
            unlock_byte(descriptor, 0)
        return not free
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    fcntl.flock(descriptor, fcntl.LOCK_UN)
    return False


def lock_byte(descriptor: int, k: int, wait: bool = False) -> bool:
    """Lock one of a file's bytes for other processes, if it is free.

    Args:
        descriptor: the only one that this process has of the file.
        k: number of the byte.
        wait: whether to wait until it is free.

    Returns:
        True if it is locked now; False if another process has locked it, and `wait` is not given.

    Raises:
        OSError: there it cannot be locked at all.
    """
    if fcntl is not None:
        try:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB), 1, _LOCK_AT + k)
        except (BlockingIOError, PermissionError):  # EAGAIN or EACCES, as the system likes
            return False
        return True
    while not _try(descriptor, k):
        if not wait:
            return False
        time.sleep(_LOCK_POLL_PERIOD)
    return True


def unlock_byte(descriptor: int, k: int) -> None:
    """Free a byte that `lock_byte` has locked."""
    if fcntl is not None:
        fcntl.lockf(descriptor, fcntl.LOCK_UN, 1, _LOCK_AT + k)
    else:
        with _at(descriptor, k):
            _windows.locking(descriptor, _windows.LK_UNLCK, 1)


def _try(descriptor: int, k: int) -> bool:
    with _at(descriptor, k):
        try:
            _windows.locking(descriptor, _windows.LK_NBLCK, 1)
        except OSError:
            return False
        return True


@contextlib.contextmanager
def _at(descriptor: int, k: int) -> Iterator[None]:
    """Be at a byte for a `with` block: Windows locks where the next read would be."""
    where = os.lseek(descriptor, 0, os.SEEK_CUR)
    os.lseek(descriptor, _LOCK_AT + k, os.SEEK_SET)
    try:
        yield
    finally:
        os.lseek(descriptor, where, os.SEEK_SET)


def is_named(descriptor: int, path: AnyPath) -> bool:
    """Return True if this is the open file that has a name now."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False


def remove_open(path: AnyPath, close: Callable[[], object]) -> None:
    """Remove a file that is open here, as far as it can be, and close it.

    Args:
        path: of the file.
        close: closes it; on Windows that comes first.
    """
    try:
        os.remove(path)
    except PermissionError:  # Windows, as long as it is open, be it elsewhere
        close()
        with contextlib.suppress(OSError):
            os.remove(path)
        return
    except OSError:  # it is gone already
        pass
    close()


def is_ours(descriptor: int) -> bool:
    """Return True if an open file is this user's, as far as the system has users."""
    return not hasattr(os, "getuid") or os.fstat(descriptor).st_uid == os.getuid()


def open_to_share(path: AnyPath) -> int:
    """Return a descriptor to read and write bytes by; the file is made if it is not there."""
    return os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o600)


def open_folder(path: AnyPath) -> int:
    """Return a descriptor to lock a folder by, which is no link to one.

    Raises:
        OSError: there is none, or this user may not look into it.
    """
    if not OPENS_FOLDERS:  # a file in it stands for it
        return open_to_share(os.path.join(path, ".lock"))
    return os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)


# Processes


def own_group() -> Dict[str, Any]:
    """Return the arguments by which a subprocess.Popen does not get this terminal's Ctrl-C."""
    if hasattr(os, "killpg"):
        return {"start_new_session": True}
    return {"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)}


def interrupt(process: "subprocess.Popen[Any]") -> None:
    """Ask a subprocess.Popen with `own_group` to end, as Ctrl-C does."""
    process.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))


def kill_group(process: "subprocess.Popen[Any]") -> None:
    """End a subprocess.Popen with `own_group` at once, and all it has started if the system can."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def end_in_order() -> None:
    """Send SIGTERM to the main thread of this process; for its other threads."""
    if hasattr(os, "killpg"):
        os.kill(os.getpid(), signal.SIGTERM)  # it wakes one who waits
    else:  # there os.kill would end it at once
        _thread.interrupt_main(signal.SIGTERM)


def let_ctrl_c_interrupt() -> None:
    """Let Ctrl-C, and `interrupt`, raise KeyboardInterrupt if they would end this process."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGBREAK"):
        signal.signal(signal.SIGBREAK, signal.default_int_handler)


def let_others_end_in_order() -> None:
    """Let whoever ends this process, but by Ctrl-C, raise SystemExit: what it has made goes."""
    for number in ENDING[1:]:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _exit)


def _exit(number: int, frame: Optional[FrameType]) -> "NoReturn":
    raise SystemExit(128 + number)


@contextlib.contextmanager
def signals_blocked() -> Iterator[None]:
    """Block the signals of ENDING in this thread for a `with` block, where the system knows how.

    A process that is started in it has them blocked from its first moment on, and for good.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def raise_signals(numbers: Iterable[int]) -> None:
    """Raise signals in this process that were intercepted for another program, in order.

    Args:
        numbers: of the signals.

    Raises:
        KeyboardInterrupt: for Ctrl-C, unless it is ignored or handled in another way.
    """
    for number in numbers:
        signal.raise_signal(number)


def is_stopped(pid: int) -> bool:
    """Return True if a signal has stopped a process, which does nothing then; False if unknown.

    Args:
        pid: its number.
    """
    try:
        with open("/proc/{}/stat".format(pid), errors="replace") as file:
            text = file.read()
    except OSError:  # not on Linux, or it has ended
        return False
    return text.rpartition(")")[2].split()[0] == "T"  # (its name may hold anything)


def lower_priority(niceness: int, pid: int = 0) -> None:
    """Lower the priority of this process, or of another one, where the system supports it.

    Args:
        niceness: added to its present one, of 20.
        pid: its number; one that has ended is left alone.
    """
    if hasattr(os, "setpriority"):
        with contextlib.suppress(OSError):
            now = os.getpriority(os.PRIO_PROCESS, pid)
            os.setpriority(os.PRIO_PROCESS, pid, now + niceness)


def limit_memory(size: int) -> None:
    """Give this process no more than so many bytes, where the system knows how."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource  # not above: Windows has none

        resource.setrlimit(resource.RLIMIT_AS, (size, size))


# What is typed


@contextlib.contextmanager
def keys_one_by_one() -> Iterator[None]:
    """Let a terminal hand over each key as it is typed, Ctrl-C too, unseen, for a `with` block.

    It is as before then, also where a signal ends this process meanwhile.  Windows does so where it
    is asked for a key; there Ctrl-C stays a signal.  For the main thread.
    """
    if termios is None or sys.stdin is None or not sys.stdin.isatty():
        yield
        return
    before = termios.tcgetattr(sys.stdin)

    def end(number: int, frame: Optional[FrameType]) -> None:
        with contextlib.suppress(termios.error):  # it may be the terminal that has gone
            termios.tcsetattr(sys.stdin, termios.TCSANOW, before)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    deadly = [n for n in ENDING if signal.getsignal(n) is signal.SIG_DFL]
    for number in deadly:
        signal.signal(number, end)
    tty.setraw(sys.stdin)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        for number in deadly:
            signal.signal(number, signal.SIG_DFL)


def read_typed() -> bytes:
    """Return the next bytes of standard input, b"" at its end; they are waited for.

    Raises:
        OSError: there is no standard input.
    """
    if sys.stdin is None:
        raise OSError("no standard input")
    if termios is None and sys.stdin.isatty():
        return msvcrt.getwch().encode()
    return os.read(sys.stdin.fileno(), 4096)


def is_root() -> bool:
    """Return True if this is the user who may do everything, as far as the system has one."""
    return hasattr(os, "geteuid") and os.geteuid() == 0
