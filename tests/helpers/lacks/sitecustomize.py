"""With this folder in PYTHONPATH, a Python lacks what $LACKS (windows or macos) has not.

It takes names away, so that whoever uses one without asking fails as there. Of what stays only the
ending of processes and the opening of folders are changed; added is what Windows alone has: locks
of msvcrt, and Ctrl-Break.
"""

import builtins
import fcntl
import os
import select
import signal
import struct
import sys
import termios
import types

NAMES = {
    "windows": {
        select: """poll epoll""",
        signal: """
            SIGALRM SIGBUS SIGCHLD SIGCLD SIGCONT SIGHUP SIGIO SIGKILL SIGPIPE SIGPOLL SIGPROF
            SIGPWR SIGQUIT SIGRTMAX SIGRTMIN SIGSTKFLT SIGSTOP SIGSYS SIGTRAP SIGTSTP SIGTTIN
            SIGTTOU SIGURG SIGUSR1 SIGUSR2 SIGVTALRM SIGWINCH SIGXCPU SIGXFSZ ITIMER_REAL
            ITIMER_VIRTUAL ITIMER_PROF alarm getitimer pause pthread_kill pthread_sigmask
            setitimer siginterrupt sigpending sigtimedwait sigwait sigwaitinfo SIG_BLOCK
            SIG_UNBLOCK SIG_SETMASK
            """,
        os: """
            O_DIRECTORY O_NOFOLLOW O_NONBLOCK chown fchmod fchown fork forkpty getegid geteuid
            getgid getgroups getloadavg getpgid getpgrp getpriority getsid getuid killpg lchown
            major minor mkfifo mknod nice openpty posix_spawn pread preadv pwrite pwritev
            register_at_fork sched_getaffinity sched_setaffinity sched_yield setpgid setpriority
            setsid setuid statvfs wait wait3 wait4
            """,
    },
    "macos": {
        select: """epoll""",
        signal: """SIGCLD SIGPOLL SIGPWR SIGRTMAX SIGRTMIN SIGSTKFLT sigtimedwait sigwaitinfo""",
        os: """
            sched_getaffinity sched_setaffinity posix_fadvise posix_fallocate memfd_create eventfd
            """,
    },
}
"""(os.uname and os.sysconf stay: NumPy and asyncio ask them where sys.platform says linux.)"""
MODULES = {
    "windows": "_curses curses fcntl grp pty pwd readline resource syslog termios tty uvloop",
    "macos": "",
}
FOLDERS = "/proc", "/dev/input", "/dev/v4l", "/sys"
FILES = "/dev/video", "/dev/fb", "/dev/shm/brickservo-"


def lack(system):
    """Take away what a system has not."""
    if system == "windows":
        _windows()
    for module, names in NAMES[system].items():
        for name in names.split():
            vars(module).pop(name, None)
    for name in MODULES[system].split():
        sys.modules[name] = None
    if hasattr(os, "process_cpu_count"):  # which asks for what is no longer there
        os.process_cpu_count = os.cpu_count
    for owner, name in (
        (builtins, "open"), (os, "open"), (os, "listdir"), (os, "scandir"), (os, "mkdir"),
        (os, "stat"), (os, "lstat"), (os, "readlink"),
    ):  # fmt: skip
        setattr(owner, name, _WithoutLinuxFiles(getattr(owner, name)))
    import multiprocessing

    multiprocessing.set_start_method("spawn")
    multiprocessing.get_all_start_methods = lambda: ["spawn"]


class _WithoutLinuxFiles:
    """A function for which Linux's own files are not there; no method where a class keeps it."""

    def __init__(self, call):
        self._call = call

    def __call__(self, path=".", *args, **kwargs):
        text = path if isinstance(path, str) else ""
        if text.startswith(FILES) or any((text + "/").startswith(each + "/") for each in FOLDERS):
            raise FileNotFoundError(2, os.strerror(2), text)
        return self._call(path, *args, **kwargs)


def _windows():
    user, real_kill = signal.SIGUSR1, os.kill
    kill_now = signal.SIGKILL
    signal.SIGBREAK = signal.CTRL_BREAK_EVENT = user  # what the other end gets is the same here

    def kill(pid, number):
        """TerminateProcess, but for Ctrl-Break."""
        real_kill(pid, number if number == user else kill_now)

    os.kill = kill
    real_open, is_folder = os.open, os.path.isdir

    def open_file(path, *args, **kwargs):
        """Nor does it open folders."""
        if is_folder(path):
            raise PermissionError(13, os.strerror(13), path)
        return real_open(path, *args, **kwargs)

    os.open = open_file
    os.supports_dir_fd = set()

    msvcrt = types.ModuleType("msvcrt")
    msvcrt.LK_UNLCK, msvcrt.LK_NBLCK = 0, 2

    def locking(descriptor, mode, count):
        """Lock bytes from the descriptor's place on: for this handle, as Windows does."""
        kind = fcntl.F_UNLCK if mode == msvcrt.LK_UNLCK else fcntl.F_WRLCK
        where = os.lseek(descriptor, 0, os.SEEK_CUR)
        asked = struct.pack("hhqqi4x", kind, os.SEEK_SET, where, count, 0)
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, asked)

    msvcrt.locking = locking
    real_import, of_linux = builtins.__import__, {"fcntl": fcntl, "termios": termios}

    def importing(name, names=None, *args, **kwargs):
        """Give it to us alone: Python's own modules would look for all of Windows then.

        And asyncssh, which asks for sys.platform, has what it finds there on Linux.
        """
        importer = (names or {}).get("__name__") or ""
        if name == "msvcrt" and importer == "laptop.system.platforms":
            return msvcrt
        if name in of_linux and importer.startswith("asyncssh."):
            return of_linux[name]
        return real_import(name, names, *args, **kwargs)

    builtins.__import__ = importing


lack(os.environ["LACKS"])
