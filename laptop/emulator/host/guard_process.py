"""Guard process: ends another one that can no longer end itself.

Code inside a C library may hold the interpreter lock: then no thread of that process runs, and no
signal is handled.  Run by `guard`, with as few imports as possible.

Standard input: a 0 at each heartbeat, which needs the interpreter; the number of each signal that
comes.  Arguments: number of the process, name of the script, seconds that it may hold the
interpreter, and seconds after a signal.
"""

import io
import os
import signal
import sys
import threading
import time

MYPY = False
if MYPY:
    import io
    from typing import Optional  # noqa: F401

POLL_PERIOD = 0.1
"""Period of the checks, s."""


def spent(pid: int) -> float:
    """Return the CPU time of the process, s; the wall time where that is unknown.

    A computer that is busy with other processes is no reason to end it.
    """
    try:
        with open("/proc/{}/stat".format(pid), "rb") as file:
            figures = file.read().rpartition(b")")[2].split()
    except OSError:  # not on Linux
        return time.monotonic()
    return (int(figures[11]) + int(figures[12])) / os.sysconf("SC_CLK_TCK")


class Guard(object):
    """Monitor of the process `pid` and of the time that it has spent since its last message.

    Attributes:
        asked: the signal that it has not handled yet; None without one.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._since = spent(pid)
        self.asked = None  # type: Optional[int]

    def listen(self, stream: "io.RawIOBase") -> None:
        """Read a stream of bytes until its end."""
        while True:
            received = stream.read(1)
            if not received:
                os._exit(0)
            if received == b"\0":
                self.asked = None
            elif self.asked is None:
                self.asked = received[0]
            else:
                continue  # it has held the interpreter since the first one
            self._since = spent(self._pid)

    def held(self) -> float:
        """Time for which the interpreter has been held, or since a signal came then, s."""
        return spent(self._pid) - self._since


def main(pid: int, name: str, patience: float, hearing: float) -> None:
    """Monitor the process until it ends, or is ended."""
    for number in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, number):  # the terminal signals a whole group
            signal.signal(getattr(signal, number), signal.SIG_IGN)
    guard = Guard(pid)
    pipe = io.FileIO(sys.stdin.fileno(), closefd=False)
    threading.Thread(target=guard.listen, args=(pipe,)).start()
    while True:
        time.sleep(POLL_PERIOD)
        asked, held = guard.asked, guard.held()
        if asked is not None and held > hearing:
            why = "it did not hear {}".format(signal.Signals(asked).name)
        elif held > patience:
            why = "it computed for {:.0f} s".format(held)
        else:
            continue
        sys.stderr.write(
            "simulate: {}: {} inside one call of a library written in C, and was killed; "
            "no files were written\n".format(name, why)
        )
        sys.stderr.flush()
        os.kill(pid, getattr(signal, "SIGKILL", 137))  # Windows takes the exit status
        os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
