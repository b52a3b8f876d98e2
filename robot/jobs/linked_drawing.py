"""Orders, report, log and runner of a job that comes over the link."""

import contextlib

from robot.jobs.logbook import LoggingFeed
from robot.jobs.orders import Buttons, JobOrders, orders_file
from robot.jobs.report import JobReport, status_file
from robot.jobs.runner import JobRunner
from shared.arm_description import ArmError
from shared.job_messages import MAX_LOG_ROWS, JobLog

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional, Protocol, Sequence, Tuple, Union  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.jobs.linked import LinkedJob  # noqa: F401
    from robot.jobs.orders import Presses  # noqa: F401
    from robot.jobs.report import Place  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.trajectory import Trajectory  # noqa: F401
    from shared.arm_description import Joint  # noqa: F401
    from shared.job import Job, Stroke  # noqa: F401
    from shared.job_log import LogRow  # noqa: F401
    from shared.job_messages import Draw, JobPart, Order  # noqa: F401
    from shared.messages import Message, Start, Stop  # noqa: F401

    class JobClient(Protocol):
        """The part of a robot.tracking.TrackingClient that a job uses."""

        @property
        def linked(self):
            # type: () -> bool
            """Whether the tracker receives what is sent."""

        @property
        def refused(self):
            # type: () -> bool
            """Whether it will never serve us."""

        @property
        def why(self):
            # type: () -> str
            """Reason for which it is not linked, for people."""

        def poll(self, timeout=0.0):
            # type: (float) -> object
            """Do what is due, for at most `timeout` seconds."""

        def commands(self):
            # type: () -> Sequence[Union[Start, Stop, Draw]]
            """Return the commands since the last call."""

        def of_job(self):
            # type: () -> Sequence[Union[JobPart, Order]]
            """Return the parts and orders of a job since the last call."""

        @property
        def send(self):
            # type: () -> Callable[..., object]
            """Function of a Message, which is sent if linked."""

        @property
        def report(self):
            # type: () -> Callable[..., object]
            """Function of where the arm is, and of how the last servo run ended."""

    GetPose = Callable[[], Sequence[float]]  # the joints' angles, rad; none where not known

LINK_POLL_PERIOD = 0.08
"""Period of polling the link while it is drawn, s."""


class LinkedOrders(JobOrders):
    """Orders that come over the link, beside those of buttons and the file.

    Args:
        linked: LinkedJob.
        clock: has `now()`.
    """

    def __init__(self, linked, clock):
        # type: (LinkedJob, Clock) -> None
        presses = []  # type: List[Presses]
        with contextlib.suppress(ImportError, OSError, ValueError, AttributeError):
            presses.append(Buttons())  # there are some
        super(LinkedOrders, self).__init__(presses=presses, path=orders_file())
        self._linked, self._clock = linked, clock
        self._poll_at = clock.now()
        self.pose = tuple  # type: GetPose

    def sample(self, now):
        # type: (float) -> float
        """Sample the orders as JobOrders.sample does, and the link."""
        if now >= self._poll_at:
            self._poll_at = now + LINK_POLL_PERIOD
            self._linked.poll(self, self.pose)
        return super(LinkedOrders, self).sample(now)


class LinkedReport(JobReport):
    """The report of a job on file, to people, and over the link.

    Args:
        linked: LinkedJob.
        job: shared.job.Job.
        clock: has `now()`.
        say: called with each line for people.
    """

    def __init__(self, linked, job, clock, say):
        # type: (LinkedJob, Job, Clock, Callable[[str], object]) -> None
        super(LinkedReport, self).__init__(job.header, job.crc, clock, say=say, path=status_file())
        self._linked = linked

    def update(self, state, place, orders, tip=None, moving=False, reason=""):
        # type: (str, Place, JobOrders, Optional[Sequence[float]], bool, str) -> None
        """Report as JobReport.update does, and over the link."""
        super(LinkedReport, self).update(state, place, orders, tip, moving, reason)
        self._linked.update_time_left(self.left(place, orders.share))
        self._linked.update(state, place, reason)


class LinkedLog(object):
    """The log of a job, sent to the laptop.

    Args:
        client: JobClient.
        crc: checksum of the job.
    """

    def __init__(self, client, crc):
        # type: (JobClient, int) -> None
        self._client, self._crc = client, crc

    def add(self, rows):
        # type: (Sequence[LogRow]) -> None
        """Send LogRows."""
        for k in range(0, len(rows), MAX_LOG_ROWS):
            self._client.send(JobLog(self._crc, [list(row) for row in rows[k : k + MAX_LOG_ROWS]]))


class WatchedFeed(LoggingFeed):
    """A LoggingFeed that stores the last reading of the control loop.

    Attributes:
        seen: (the loop's time, s, the motors' angles, rad); None before the first tick.
    """

    seen = None  # type: Optional[Tuple[float, Sequence[float]]]

    def tick(self, t, now, angles):
        # type: (float, float, Sequence[float]) -> Optional[object]
        """Do as LoggingFeed.tick does, and keep its arguments."""
        self.seen = t, angles
        return super(WatchedFeed, self).tick(t, now, angles)


class LinkedRunner(JobRunner):
    """Runner of a job that sends the laptop where links and pen are.

    Args:
        linked: LinkedJob; the others as for JobRunner.
    """

    def __init__(
        self,
        linked,  # type: LinkedJob
        arm,  # type: RobotArm
        clock,  # type: Clock
        job,  # type: Job
        orders,  # type: LinkedOrders
        report,  # type: LinkedReport
        log,  # type: LinkedLog
        dry,  # type: bool
    ):
        # type: (...) -> None
        super(LinkedRunner, self).__init__(arm, clock, job, orders, report, log, dry)
        self._linked = linked
        self._feed = self._watched = WatchedFeed(self._sample, job.header.log)
        orders.pose = self._pose

    def _sample(self, now):
        # type: (float) -> float
        rate = super(LinkedRunner, self)._sample(now)
        if rate:
            place = self._path.place(self._feed.index, self._feed.reached)
            self._linked.update("drawing", place)
        return rate

    def _move_pen(self, down):
        # type: (bool) -> None
        super(LinkedRunner, self)._move_pen(down)
        self._linked.update_pen(down and not self._dry)

    def _chain(self, k, stroke):
        # type: (int, Stroke) -> Tuple[List[Stroke], Optional[Stroke]]
        self._linked.poll(self._orders, self._pose)  # to read a stroke takes the brick a while
        return super(LinkedRunner, self)._chain(k, stroke)

    def _is_ready(self, motion, is_there):
        # type: (Trajectory, bool) -> bool
        self._watched.seen = None  # from here on the arm itself knows
        self._linked.poll(self._orders, self._pose)
        return super(LinkedRunner, self)._is_ready(motion, is_there)

    def _draw_from(self, k):
        # type: (int) -> bool
        try:
            return super(LinkedRunner, self)._draw_from(k)
        finally:
            self._watched.seen = None

    def _pose(self):
        # type: () -> Sequence[float]
        """Return the links' angles, rad; in mid-stroke by where the backlash is at that moment."""
        if self._watched.seen is None:
            try:
                return self._arm.angles()
            except ArmError:
                return ()
        t, angles = self._watched.seen
        joints = self._arm.description.joints
        return [
            angle - side * joint.backlash / 2
            for angle, side, joint in zip(angles, self._feed.sides_at(t), joints)
        ]
