"""A job that the laptop offers over the link: fetched, drawn, given orders, reported all the time.

While it is drawn the link is polled as often as buttons are. A lost link pauses the job, pen up,
unless it was to go on alone: for nobody could stop it then from the page. It stays paused when the
link is back, until it is resumed; without one for LINK_TIMEOUT it is given up, and the arm parked.
"""

import contextlib
import os

from robot.jobs.checking import check_strokes
from robot.jobs.fetching import JobFetching
from robot.jobs.linked_drawing import LinkedLog, LinkedOrders, LinkedReport, LinkedRunner
from robot.jobs.progress import forget_progress, jobs_folder
from robot.tracker_address import Refusal
from shared.arm_description import ArmError
from shared.job import BadJob, Job
from shared.job_messages import (
    ABORTED,
    DONE,
    DRAWING,
    FAILED,
    FETCHING,
    Draw,
    InvalidOrder,
    JobPart,
    JobStatus,
    Order,
    check_order,
)
from shared.message_fields import one_line
from shared.messages import STATUS_PERIOD, Start, Stop

MYPY = False
if MYPY:
    from typing import Any, Callable, Dict, Optional, Sequence  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.jobs.linked_drawing import GetPose, JobClient  # noqa: F401
    from robot.jobs.orders import JobOrders  # noqa: F401
    from robot.jobs.report import Place  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401

JOB_FILE = "from-the-laptop.job"
"""Name, in the folder of jobs, of the last one that the laptop offered."""

LINK_PATIENCE = 3.0
"""Longest break of a link that does not count as a loss, s: it mends by itself within a second."""

LINK_TIMEOUT = 300.0
"""Longest time without a link before a paused job is given up, s."""

FETCH_POLL = 0.02
"""Longest wait for parts at once, s."""

STOPPED = "stopped"
"""The runner's word for aborted by a signal; all its others are the link's, too."""


class LinkedJob(object):
    """One job of the laptop's.

    Args:
        arm: robot.motion.arm.RobotArm.
        client: a JobClient, such as robot.tracking.TrackingClient.
        clock: has `now()` and `sleep(seconds)`.
        draw: the Draw that offers it.
        reported: keyword arguments of TrackingClient.report, of the last servo run: sent on.
        say: called with lines for people.

    Attributes:
        progress: JobStatus that was sent last.
        down: whether the pen is down.
    """

    def __init__(self, arm, client, clock, draw, reported, say):
        # type: (RobotArm, JobClient, Clock, Draw, Dict[str, Any], Callable[[str], object]) -> None
        self._arm, self._client, self._clock = arm, client, clock
        self._draw, self._reported, self._say = draw, reported, say
        self._lost_at = None  # type: Optional[float]
        self._paused_by_link = False
        self._why = ""  # it is paused, or has ended
        self._next = 0.0  # time of the next status, s
        self.down = False
        self.progress = JobStatus(
            clock.now(), draw.crc, draw.name, FETCHING, 0, 0, 0.0, 0.0, None, False, ""
        )

    def run(self):
        # type: () -> None
        """Fetch and draw it; the laptop learns what became of it, and the arm is held.

        Raises:
            Refusal: the tracker will never serve us.
        """
        try:
            path = self._fetch()
            if path is None:
                self._end(ABORTED)
                return
            self._draw_file(path)
        except Refusal:
            raise
        except ArmError as error:
            self._end(FAILED, str(error))
        except BaseException as error:
            self._end(ABORTED, str(error))
            raise

    # Fetching

    def _fetch(self):
        # type: () -> Optional[str]
        """Return the path of the job's file, once it is complete; None if it was aborted."""
        file = os.path.join(jobs_folder(), JOB_FILE)
        fetching = JobFetching(self._draw, file, self._clock.now())
        self._say("fetching '{}': {} parts".format(self._draw.name, self._draw.parts))
        self._send()
        with contextlib.closing(fetching):
            while not fetching.complete:
                want = fetching.due(self._clock.now(), self._client.linked)
                if want:
                    self._client.send(want)
                self._client.poll(FETCH_POLL)
                if self._client.refused:
                    raise Refusal(self._client.why)
                for command in self._client.commands():
                    if isinstance(command, Stop):
                        self._why = command.reason
                        return None
                for message in self._client.of_job():
                    if isinstance(message, JobPart):
                        fetching.handle(message, self._clock.now())
                    elif message.what == "abort":
                        return None
                if self._is_due():
                    share = float(fetching.part) / self._draw.parts
                    self.progress = self.progress._replace(
                        t=self._clock.now(), cm=share, cm_all=1.0
                    )
                    self._send()
                    self._report_pose(self._pose())
        return file

    # Drawing

    def _draw_file(self, path):
        # type: (str) -> None
        description = self._arm.description
        job = Job(path, description)
        self._header = job.header
        if self._draw.first > job.header.strokes:
            raise BadJob(
                "'{}' has {} strokes: there is none to begin with that has number {}".format(
                    self._draw.name, job.header.strokes, self._draw.first
                )
            )
        if not self._arm.homed:
            self._arm.load_zero()
        if self._draw.first == 1:
            forget_progress(job.crc)
        orders = LinkedOrders(self, self._clock)
        try:
            report = LinkedReport(self, job, self._clock, self._say)
            self.poll(orders, self._pose)  # to check a long job takes the brick a while

            def poll_if_due():
                # type: () -> None
                if self._is_due(False):
                    self.poll(orders, self._pose)

            job.between = poll_if_due
            for _ in check_strokes(job, description):
                if orders.aborted:
                    break
            log = LinkedLog(self._client, self._draw.crc)
            runner = LinkedRunner(
                self, self._arm, self._clock, job, orders, report, log, self._draw.dry
            )
            runner.run(self._draw.first)
        finally:
            orders.close()

    # Called while it is drawn, see linked_drawing

    def poll(self, orders, pose):
        # type: (JobOrders, GetPose) -> None
        """Handle what the laptop has sent, and send it where the arm is, if that is due.

        Args:
            orders: JobOrders.
            pose: called for the joints' angles, rad.
        """
        self._client.poll()
        for command in self._client.commands():
            if isinstance(command, Stop):
                orders.aborted, self._why = True, command.reason or "by the laptop"
            elif isinstance(command, Start) or (
                isinstance(command, Draw) and command.crc != self._draw.crc
            ):
                orders.notes.append("a start of the laptop is ignored: a job is on; abort it first")
        for message in self._client.of_job():
            if isinstance(message, Order):
                try:
                    check_order(message)
                except InvalidOrder as problem:
                    orders.notes.append(str(problem))
                    continue
                number = "" if message.value is None else " {:g}".format(message.value)
                orders.handle(message.what + number)
                if message.what == "pause":
                    self._why = ""
        self._watch_link(orders)
        if not orders.paused:
            self._paused_by_link = False
        if self._is_due():
            self._report_pose(pose())
            self._send()

    def _watch_link(self, orders):
        # type: (JobOrders) -> None
        now = self._clock.now()
        if self._client.linked:
            self._lost_at = None
            return
        self._lost_at = now if self._lost_at is None else self._lost_at
        lost = now - self._lost_at
        if self._draw.alone or lost < LINK_PATIENCE:
            return
        if not orders.paused and not self._paused_by_link:
            self._paused_by_link, orders.paused = True, True
            self._why = "the link was lost; resume it when all is well"
            orders.notes.append("paused: the link is lost")
        if self._paused_by_link and lost > LINK_TIMEOUT:
            orders.aborted = True
            self._why = "no link for {:.0f} s".format(lost)

    def update(self, state, place, reason=""):
        # type: (str, Place, str) -> None
        """Update the status, which is sent at once where its state has changed.

        Args:
            state: a state of robot.jobs.report.
            place: Place where the arm is in the job.
            reason: why, for people; "" where there is none.
        """
        now = self._clock.now()
        state = ABORTED if state == STOPPED else state
        changed = state != self.progress.state or self.down != self.progress.down
        header = self._header
        self.progress = JobStatus(
            now, self._draw.crc, self._draw.name, state, place.stroke, header.strokes,
            max(0.0, min(place.cm, header.cm)), header.cm, self.progress.seconds, self.down,
            one_line(reason or (self._why if state not in (DRAWING, DONE) else "")),
        )  # fmt: skip
        if changed:
            self._send()

    def update_time_left(self, seconds):
        # type: (float) -> None
        """Update the time that is left, s."""
        self.progress = self.progress._replace(seconds=max(0.0, min(seconds, 1e6)))

    def update_pen(self, down):
        # type: (bool) -> None
        """Send at once that the pen is down, or up."""
        if down != self.down:
            self.down = down
            self.progress = self.progress._replace(t=self._clock.now(), down=down)
            self._send()

    def _is_due(self, taken=True):
        # type: (bool) -> bool
        now = self._clock.now()
        if now < self._next:
            return False
        if taken:
            self._next = now + STATUS_PERIOD
        return True

    def _send(self):
        # type: () -> None
        self.progress = self.progress._replace(t=self._clock.now())
        self._client.send(self.progress)

    def _report_pose(self, q):
        # type: (Sequence[float]) -> None
        self._client.report(q, **self._reported)

    def _pose(self):
        # type: () -> Sequence[float]
        """Return the joints' angles, rad; none if a motor does not answer: others report that."""
        try:
            return self._arm.angles()
        except ArmError:
            return ()

    def _end(self, state, reason=""):
        # type: (str, str) -> None
        self.down = False
        self.progress = self.progress._replace(
            state=state, down=False, reason=one_line(reason or self._why), seconds=None
        )
        self._say("'{}': {}{}".format(self._draw.name, state, reason and ": " + reason))
        self._send()
