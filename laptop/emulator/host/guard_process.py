"""Guard process: ends another one that can no longer end itself.

Who computes inside a library written in C may hold the interpreter: then no thread of that process
gets on, nor does it look at a signal.  Run by `guard`, with nothing imported that it does not need.

Standard input: a 0 as long as the interpreter is free now and then; the number of each signal that
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

LOOK_PERIOD = 0.1
"""Period of the checks, s."""


def spent(pid: int) -> float:
    """Return a time (s) that goes on as the process computes; as the clock does if unknown.

    A computer that is busy with others is no reason to end it.
    """
    try:
        with open("/proc/{}/stat".format(pid), "rb") as file:
            figures = file.read().rpartition(b")")[2].split()
    except OSError:  # not on Linux
        return time.monotonic()
    return (int(figures[11]) + int(figures[12])) / os.sysconf("SC_CLK_TCK")


class Guard(object):
    """Listens to the process `pid`, and says what it has spent since.

    Attributes:
        asked: the signal that it has not looked at yet; None without one.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._since = spent(pid)
        self.asked = None  # type: Optional[int]

    def listen(self, stream: "io.RawIOBase") -> None:
        """Take what comes of a stream of bytes, until its end."""
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
        """Seconds for which the interpreter has been held, or since a signal came then."""
        return spent(self._pid) - self._since


def main(pid: int, name: str, patience: float, hearing: float) -> None:
    """Listen and look until the process ends, or is ended."""
    for number in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, number):  # the terminal tells all of a group
            signal.signal(getattr(signal, number), signal.SIG_IGN)
    guard = Guard(pid)
    pipe = io.FileIO(sys.stdin.fileno(), closefd=False)
    threading.Thread(target=guard.listen, args=(pipe,)).start()
    while True:
        time.sleep(LOOK_PERIOD)
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
