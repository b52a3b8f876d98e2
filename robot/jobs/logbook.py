"""The log of a job while it is drawn: noted in memory in motion, told while the pen is up."""

import contextlib
import math
import os

from robot.motion.feed import FeedOverride
from shared.job_log import BadLog, LogRow, heading, line_of
from shared.small_files import open_to_write


class LoggingFeed(FeedOverride):
    """A FeedOverride that notes now and then where the motors are.

    Args:
        look: as for FeedOverride.
        period: s; 0: it notes nothing.

    Attributes:
        notes: (index of the plan, its own time in s, clock's time in s, motors' angles in rad).
    """

    def __init__(self, look, period):
        super(LoggingFeed, self).__init__(look)
        self.notes = []
        self._period = period
        self._note_at = -math.inf if period else math.inf

    def tick(self, t, now, angles):
        """As FeedOverride.tick."""
        if now >= self._note_at:
            self._note_at = now + self._period
            self.notes.append((self.index, self._tau(t), now, angles))
        return super(LoggingFeed, self).tick(t, now, angles)

    def rows(self, place):
        """The LogRows of what was noted since the last time.

        Args:
            place: from a plan's index and own time to the robot.jobs.report.Place.
        """
        notes, self.notes = self.notes, []
        found = []
        for index, tau, now, angles in notes:
            where = place(index, tau)
            found.append(LogRow(where.stroke, where.planned, now, False, tuple(angles)))
        return found


class LogFile(object):
    """A log on file.

    Args:
        path: a file of that name is replaced.
        joints: number of the arm's.

    Raises:
        BadLog: it cannot be written.
    """

    def __init__(self, path, joints):
        self._path = path
        self._file = None
        with self._told():
            self._file = os.fdopen(open_to_write(path), "w")
            self._file.write(heading(joints))
            self._file.flush()

    def add(self, rows):
        """Write LogRows; BadLog where there is no room."""
        with self._told():
            for row in rows:
                self._file.write(line_of(row))
            self._file.flush()

    def close(self):
        """Write no more."""
        with self._told():
            self._file.close()

    @contextlib.contextmanager
    def _told(self):
        try:
            yield
        except OSError as error:
            with contextlib.suppress(OSError, AttributeError):
                self._file.close()  # what could not be written is not tried again
            raise BadLog("{}: {}; log to another file".format(self._path, error.strerror)) from None
