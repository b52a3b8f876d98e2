"""Report of a job that is drawn: lines for people, and a status file for observers.

The file holds one JSON object, replaced in one step:

    {"state": "drawing", "job": "rose", "crc": 305419896, "pid": 812, "reason": "",
     "stroke": 12, "strokes": 40, "cm": 152.5, "cm_all": 412.3, "left_s": 130, "repeat": 1,
     "repeats": 1, "tip": [10.1, 4.2], "volts": 7.6, "speed": 100, "pen": 0}

state    drawing, paused; and in the end done, aborted, stopped (by a signal), failed
cm       drawn of this time
left_s   by the job's own estimate and the pace so far, s, all repeats; not counting pauses
tip      cm, as planned; null between strokes
speed    per cent; pen: degrees deeper
"""

import json
import math
import os

from robot.ev3.battery import Battery
from shared.config_files import write_whole
from shared.record import record
from shared.state import JOB_STATUS_FILE, state_folder

MYPY = False
if MYPY:
    from typing import Callable, NamedTuple, Optional, Sequence  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.jobs.orders import JobOrders  # noqa: F401
    from shared.job import JobHeader  # noqa: F401

    Place = NamedTuple(
        "Place", [("repeat", int), ("stroke", int), ("cm", float), ("planned", float)]
    )
else:
    Place = record("Place", "repeat stroke cm planned")

SAY_PERIOD, WRITE_PERIOD = 5.0, 2.0
"""Least times between two lines for people, and between two writes in motion, s."""

MIN_TRUSTED_TIME, PACE_BOUNDS = 10.0, (0.5, 5.0)
"""Least planned time that is drawn before the pace so far counts, s; and bounds of the pace, real
time over planned time."""

STATUS_FORMAT = (
    '{"state": "%s", %s, "stroke": %d, "cm": %.1f, "left_s": %.0f, "repeat": %d, "tip": %s, '
    '"volts": %s, "speed": %.0f, "pen": %.1f, "reason": %s}'
)
"""Format of the status file."""

Place.__doc__ = """Place of the arm in its job.

repeat   number of the repeat, from 1 on
stroke   number of the stroke, from 1 on
cm       length drawn so far of this repeat
planned  time from the job's start to there, as planned, s
"""


def status_file():
    # type: () -> str
    """Return the path of the status file of the job that is drawn, or was last."""
    return os.path.join(state_folder(), JOB_STATUS_FILE)


class JobReport(object):
    """The report of one job.

    Args:
        header: shared.job.JobHeader.
        crc: checksum of the job.
        clock: has `now()`.
        repeats: number of times it is drawn.
        say: called with each line for people.
        path: of the status file; None: no file.

    Attributes:
        say: as given.
        state: the last that was reported.
    """

    def __init__(self, header, crc, clock, repeats=1, say=print, path=None):
        # type: (JobHeader, int, Clock, int, Callable[[str], object], Optional[str]) -> None
        self._header, self._clock, self._repeats = header, clock, repeats
        self._fixed = json.dumps(
            {
                "job": header.name, "crc": crc, "pid": os.getpid(), "strokes": header.strokes,
                "cm_all": round(header.cm, 1), "repeats": repeats,
            },
            sort_keys=True,
        )[1:-1]  # fmt: skip
        self.say = say
        self._path = path
        self._battery = Battery(clock)
        self._volts = self._battery.volts()
        self.state = ""
        self._place = None  # type: Optional[Place]
        self._tip = None  # type: Optional[Sequence[float]]
        self._said_at = self._wrote_at = -math.inf
        self._worked = self._planned = 0.0
        self._at = 0.0  # time of the last update, s

    def due(self, now):
        # type: (float) -> bool
        """Return whether an update in motion is due at the time `now`, s."""
        return now - self._wrote_at >= WRITE_PERIOD

    def update(self, state, place, orders, tip=None, moving=False, reason=""):
        # type: (str, Place, JobOrders, Optional[Sequence[float]], bool, str) -> None
        """Write the status file, and print lines for people where the tip stands.

        Args:
            state: see above.
            place: Place.
            orders: robot.jobs.orders.JobOrders, whose notes are printed and removed.
            tip: (x, y) or (x, y, z), cm; None between strokes.
            moving: whether the tip moves, so that nothing may take long: nothing is printed then.
            reason: why it is in that state, for people; "" where there is none.
        """
        now = self._clock.now()
        self._keep_time(now, place, orders)
        changed = state != self.state
        self.state, self._place, self._tip, self._wrote_at = state, place, tip, now
        if not moving:
            self._volts = self._battery.volts()
        if self._path is not None:
            try:
                write_whole(self._path, self._text(place, orders, reason), sync=False)
            except OSError as error:
                self._path = None
                orders.notes.append(
                    "the job's status cannot be written ({}); make room".format(error.strerror)
                )
        if not moving:
            notes, orders.notes[:] = list(orders.notes), []
            for note in notes:
                self.say(note)
            if changed or now - self._said_at >= SAY_PERIOD:
                self._said_at = now
                self.say(self._line(place, orders, reason))

    def _keep_time(self, now, place, orders):
        # type: (float, Place, JobOrders) -> None
        """Sum up the time since the last update, as if at the planned speed, s."""
        before = self._place
        if before and self.state == "drawing" and before.repeat == place.repeat:
            self._worked += (now - self._at) * orders.share
            self._planned += max(0.0, place.planned - before.planned)
        self._at = now

    def left(self, place, share):
        # type: (Place, float) -> float
        """Return the time that is left, s, all repeats.

        Args:
            place: Place of the arm.
            share: share of the planned speed.
        """
        pace = 1.0
        if self._planned > MIN_TRUSTED_TIME:
            pace = min(max(self._worked / self._planned, PACE_BOUNDS[0]), PACE_BOUNDS[1])
        seconds = self._header.seconds
        planned = max(0.0, seconds - place.planned) + seconds * (self._repeats - place.repeat)
        return planned * pace / share

    def _line(self, place, orders, reason):
        # type: (Place, JobOrders, str) -> str
        header = self._header
        progress = "{:.0f} %, stroke {} of {}".format(
            100 * place.cm / header.cm if header.cm else 100, place.stroke, header.strokes
        )
        if self._repeats > 1:
            progress += ", time {} of {}".format(place.repeat, self._repeats)
        if self.state == "drawing":
            left = int(round(self.left(place, orders.share)))
            return "{}, {}:{:02d} left".format(progress, left // 60, left % 60)
        return "{} at {}{}".format(self.state, progress, ": " + reason if reason else "")

    def _text(self, place, orders, reason):
        # type: (Place, JobOrders, str) -> str
        # (By hand: the brick takes 3 ms longer for a dictionary, and this is done in motion.)
        tip = self._tip
        return STATUS_FORMAT % (
            self.state, self._fixed, place.stroke, place.cm, self.left(place, orders.share),
            place.repeat, "[%s]" % ", ".join(["%.2f" % x for x in tip]) if tip else "null",
            "null" if self._volts is None else "%.2f" % self._volts, 100 * orders.share,
            math.degrees(orders.pen), json.dumps(reason) if reason else '""',
        )  # fmt: skip
