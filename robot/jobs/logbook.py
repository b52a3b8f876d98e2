"""The log of a job while it is drawn: in memory in motion, written while the pen is up."""

import contextlib
import math
import os

from robot.motion.feed import FeedOverride
from shared.config_files import open_to_write
from shared.job_log import BadLog, LogRow, heading, line_of

MYPY = False
if MYPY:
    from typing import Callable, Iterable, Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.jobs.report import Place  # noqa: F401

    # The plan's index and own time, s; the clock's time, s; the motors' angles, rad.
    Note = Tuple[int, float, float, Sequence[float]]


class LoggingFeed(FeedOverride):
    """A FeedOverride that notes periodically where the motors are.

    Args:
        sample: as FeedOverride's first argument: from the clock's time (s) to the wanted rate.
        period: period of the notes, s; 0: there are none.

    Attributes:
        notes: (index of the plan, its own time in s, clock's time in s, motors' angles in rad).
    """

    def __init__(self, sample, period):
        # type: (Callable[[float], float], float) -> None
        super(LoggingFeed, self).__init__(sample)
        self.notes = []  # type: List[Note]
        self._period = period
        self._note_at = -math.inf if period else math.inf

    def tick(self, t, now, angles):
        # type: (float, float, Sequence[float]) -> Optional[object]
        """Do as FeedOverride.tick does, and note the motors' angles where that is due."""
        if now >= self._note_at:
            self._note_at = now + self._period
            self.notes.append((self.index, self._tau(t), now, angles))
        return super(LoggingFeed, self).tick(t, now, angles)

    def rows(self, place):
        # type: (Callable[[int, float], Place]) -> List[LogRow]
        """Return the LogRows of what was noted since the last call.

        Args:
            place: from a plan's index and own time to the robot.jobs.report.Place.
        """
        notes, self.notes = self.notes, []
        found = []
        for index, tau, now, angles in notes:
            at = place(index, tau)
            found.append(LogRow(at.stroke, at.planned, now, False, tuple(angles)))
        return found


class LogFile(object):
    """A log on file.

    Args:
        path: of the file; one of that name is replaced.
        joints: number of the arm's joints.

    Raises:
        BadLog: it cannot be written.
    """

    def __init__(self, path, joints):
        # type: (str, int) -> None
        self._path = path
        try:
            self._file = os.fdopen(open_to_write(path), "w")
        except OSError as error:
            raise self._bad(error) from None
        with self._as_bad_log():
            self._file.write(heading(joints))
            self._file.flush()

    def add(self, rows):
        # type: (Iterable[LogRow]) -> None
        """Write LogRows; BadLog where there is no room."""
        with self._as_bad_log():
            for row in rows:
                self._file.write(line_of(row))
            self._file.flush()

    def close(self):
        # type: () -> None
        """Close the file."""
        with self._as_bad_log():
            self._file.close()

    @contextlib.contextmanager
    def _as_bad_log(self):
        # type: () -> Iterator[None]
        """Raise BadLog for an OSError in a `with` block."""
        try:
            yield
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.close()  # what could not be written is not tried again
            raise self._bad(error) from None

    def _bad(self, error):
        # type: (OSError) -> BadLog
        return BadLog("{}: {}; log to another file".format(self._path, error.strerror))
