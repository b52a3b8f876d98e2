"""Runs of one arm as the laptop orders them, and their log."""

import contextlib
import json
import os
from collections import OrderedDict

from robot.servoing.camera_memory import CameraMemory
from robot.servoing.image_models import model_kind
from robot.servoing.loop import POLL_TIMEOUT, RunTerms, VisualServoing
from robot.servoing.repeated_pictures import RepeatedPictures
from robot.servoing.rows import Rows
from robot.servoing.run_reporter import RunReporter, verdict_text
from robot.servoing.servo import Servo
from robot.servoing.stream import Stream
from robot.tracker_address import Refusal
from shared.arm_description import ArmError
from shared.job_messages import Draw
from shared.messages import Start
from shared.run_options import check_options, method_named
from shared.verdicts import CONVERGED, READY, REFUSED

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import IO, Any, Dict, Iterator, Mapping, Optional, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.servoing.decision import AnyServo  # noqa: F401
    from robot.servoing.run_reporter import Verdict  # noqa: F401
    from robot.tracking import TrackingClient  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401
    from shared.job_messages import JobStatus  # noqa: F401

    _Kind = Tuple[str, str, str, float]  # method, mode, rows, tolerance (px)
    _Made = Tuple[AnyServo, Optional[Stream]]


class LogLost(ArmError):
    """A log that cannot be written."""


class RunLog(object):
    """Lines of JSON in a file, or nowhere.

    Args:
        path: of the file; None for none.

    Raises:
        LogLost: once; from then on it writes nowhere.
    """

    def __init__(self, path):
        # type: (Optional[str]) -> None
        self._path = path
        self._file = None  # type: Optional[IO[str]]
        with self._raising_log_lost():
            self._file = open(path, "w") if path else None  # noqa: SIM115 - it stays open

    def __call__(self, line):
        # type: (Mapping[str, object]) -> None
        """Write one line, given as a dict."""
        if self._file:
            with self._raising_log_lost():
                self._file.write(json.dumps(line) + "\n")
                # A program that is killed leaves all but the last few sightings.
                if line["kind"] != "seen":
                    self._file.flush()

    def close(self):
        # type: () -> None
        """Write what is left."""
        if self._file:
            with self._raising_log_lost():
                self._file.close()

    @contextlib.contextmanager
    def _raising_log_lost(self):
        # type: () -> Iterator[None]
        """Raise LogLost if the file cannot be written."""
        try:
            yield
        except OSError as error:
            file, self._file = self._file, None
            if file:
                with contextlib.suppress(OSError):  # what waits to be written does not fit either
                    file.close()
            raise LogLost(
                "cannot write {}: {}; give another file with --log".format(
                    self._path, error.strerror
                )
            ) from None


def print_line(line):
    # type: (str) -> None
    """Print a line at once."""
    print(line, flush=True)


def make_servo(arm, method, mode, tolerance, seed=0, rows="stereo", third=None):
    # type: (Arm, str, str, float, int, str, Optional[str]) -> _Made
    """Return (servo, stream or None) by the names of the command line.

    Args:
        arm: shared.arm_description.Arm.
        method: one of shared.run_options.METHODS.
        mode: one of shared.run_options.MODES.
        tolerance: px.
        seed: as for Servo.
        rows: as Rows' kind.
        third: as for Rows.
    """
    kind = method_named(method)
    module, _, name = kind.maker.partition(":")
    make = getattr(__import__(module, fromlist=[name]), name)  # (few runs need all of them)
    servo = make(method, arm, tolerance, Rows(rows, len(arm.joints), third), seed)
    return servo, Stream(servo) if kind.streams and mode == "stream" else None


def model_servo(method, arm, tolerance, rows, seed):
    # type: (str, Arm, float, Rows, int) -> Servo
    """Make the servo of a method that goes by image models alone.

    Args:
        method: see model_kind.
        arm: shared.arm_description.Arm.
        tolerance: px.
        rows: Rows.
        seed: as for Servo.
    """
    return Servo(arm, model_kind(method, arm), tolerance, seed, rows=rows)


class Runs(object):
    """The runs of one arm, each as ordered.

    Args:
        arm: as for VisualServoing.
        client: as for VisualServoing.
        clock: as for VisualServoing.
        log: path of a file for the last run's log; None for none.
        third: as for Rows.
    """

    def __init__(self, arm, client, clock, log=None, third=None):
        # type: (RobotArm, TrackingClient, Clock, Optional[str], Optional[str]) -> None
        self._arm, self._client, self._clock = arm, client, clock
        self._log, self._third = log, third
        self._pictures = RepeatedPictures(arm.description.joints)  # a frozen one stays so
        self._reported = {"error": None, "verdict": READY, "run": 0}  # type: Dict[str, Any]
        # Options and servo of a run that was a success.
        self._learned = None  # type: Optional[Tuple[_Kind, _Made]]
        self._memory = CameraMemory(arm.description, os.path.dirname(arm.zero.file), print_line)

    def run(self, options, number=1):
        # type: (Start, int) -> Verdict
        """Do one run; return its Verdict.

        Args:
            options: Start of the laptop.
            number: of the run.

        Raises:
            ArmError: the log cannot be written; nothing has moved.
            LogLost: the log can be written no more.
        """
        with contextlib.closing(RunLog(self._log)) as log:
            return self._run(options, number, log)

    def _run(self, options, number, log):
        # type: (Start, int, RunLog) -> Verdict
        """Do one run with its log; return its Verdict."""
        description = self._arm.description
        servo, stream = self._servo(options)
        follow = options.tolerance if options.follow else None
        reporter = RunReporter(log, print_line, number)
        loop = VisualServoing(
            self._arm, self._client, self._clock, servo,
            RunTerms(options.goals, options.budget, follow=follow),
            stream, reporter, self._pictures,
        )  # fmt: skip
        log(
            OrderedDict(
                [
                    ("kind", "run"), ("version", 1), ("method", options.method),
                    ("mode", options.mode), ("arm", description.name),
                    ("joints", [joint.name for joint in description.joints]),
                    ("tolerance", options.tolerance), ("budget", options.budget),
                    ("goal", options.goals or "marker"), ("rows", options.rows),
                    ("clock", self._clock.now()),
                ]
            )
        )  # fmt: skip
        verdict = loop.run()
        self._reported = dict(reporter.progress(), verdict=verdict.word, reason=verdict.reason)
        self._learned = None
        if verdict.word == CONVERGED and servo.LEARNS:
            self._learned = _kind(options), (servo, stream)
            views = servo.far_models.views() if servo.far_models else None
            if views:
                self._memory.save(views)
        return verdict

    def _servo(self, options):
        # type: (Start) -> _Made
        """Return what make_servo does; one that has just been a success goes on.

        Others begin with what the last success has seen.
        """
        if self._learned and self._learned[0] == _kind(options):
            return self._learned[1]
        servo, stream = make_servo(
            self._arm.description, options.method, options.mode, options.tolerance,
            rows=options.rows, third=self._third,
        )  # fmt: skip
        if servo.far_models:
            servo.far_models.recall(self._memory.load())
        return servo, stream

    def wait(self):
        # type: () -> None
        """Do a run for every Start of the laptop, and draw for every Draw, one after the other.

        Never returns. Between them the arm is held, and where it is and how the last run ended is
        reported to the laptop.

        Raises:
            Refusal: the tracker will never serve us.
        """
        number = 0
        job, reported = None, False  # JobStatus of the last one, reported to every new link
        print_line("waiting for the laptop to say start")
        while True:
            self._client.poll(POLL_TIMEOUT)
            if self._client.refused:
                raise Refusal(self._client.why)
            options = None
            for command in self._client.commands():
                # A Stop takes it back.
                options = command if isinstance(command, (Start, Draw)) else None
            if isinstance(options, Draw):
                job = self._draw(options)
                reported = True
            elif options is not None:
                number += 1
                self._handle_start(options, number)
            if job and self._client.linked and not reported:
                self._client.send(job._replace(t=self._clock.now()))
            reported = self._client.linked
            self._client.report(self._where(), **self._reported)

    def _draw(self, draw):
        # type: (Draw) -> JobStatus
        """Draw the job that is offered, if that is possible; return its JobStatus."""
        from robot.jobs.linked import LinkedJob  # not above: a servo run needs none of it

        job = LinkedJob(self._arm, self._client, self._clock, draw, self._reported, print_line)
        try:
            try:
                job.run()
            finally:
                self._arm.park()
        except ArmError as error:
            if isinstance(error, Refusal):
                raise
            print_line(str(error))
        return job.progress

    def _handle_start(self, options, number):
        # type: (Start, int) -> None
        """Do the run that is ordered, if that is possible, and hold the arm."""
        try:
            check_options(options, len(self._arm.description.joints))
            if not self._arm.homed:
                self._arm.load_zero()
            try:
                print_line(verdict_text(self.run(options, number)))
            finally:
                self._arm.park()
        except ArmError as error:
            if self._reported["run"] < number:  # it has come to no run
                self._reported = {
                    "error": None, "verdict": REFUSED, "reason": str(error), "run": number,
                }  # fmt: skip
            print_line("{}: {}".format(self._reported["verdict"], error))

    def _where(self):
        # type: () -> Tuple[float, ...]
        """Return the joint angles, rad (n); none if a motor does not answer: a run reports it."""
        try:
            return self._arm.angles()
        except ArmError:
            return ()


def _kind(options):
    # type: (Start) -> _Kind
    """Return the options that a servo is made for."""
    return options.method, options.mode, options.rows, options.tolerance
