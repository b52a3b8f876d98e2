"""Receiver of a run: sightings, orders, and the Halts that come of either."""

import math

from robot.servoing.linear_algebra import length
from robot.servoing.loss_of_sight import Halt, LossOfSight
from robot.servoing.sightings import SIGHT_TIMEOUT
from shared.messages import STATUS_PERIOD, Stop
from shared.verdicts import BUDGET_SPENT, CONVERGED, LINK_LOST, STOPPED

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Dict, FrozenSet, Iterable, List, Optional, Tuple  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.servoing.decision import AnyServo  # noqa: F401
    from robot.servoing.loop import RunTerms  # noqa: F401
    from robot.servoing.loss_of_sight import SightsClient  # noqa: F401
    from robot.servoing.run_reporter import RunReporter  # noqa: F401
    from robot.servoing.sightings import MarkerFrame, Sightings  # noqa: F401


class RunReceiver(object):
    """Receiver of one run's messages, which reports its progress to the laptop.

    Args:
        client: as for VisualServoing.
        clock: as for VisualServoing.
        servo: as for VisualServoing.
        sightings: Sightings of the run.
        joints: how many the arm has.
        terms: RunTerms.
        reporter: RunReporter.

    Attributes:
        received_at: when messages were received last, s.
        reported_at: when the laptop was reported to last, s.
    """

    def __init__(self, client, clock, servo, sightings, joints, terms, reporter):
        # type: (SightsClient, Timepiece, AnyServo, Sightings, int, RunTerms, RunReporter) -> None
        self._client, self._clock, self._servo = client, clock, servo
        self._sightings = sightings
        self._loss = LossOfSight(client, sightings, joints)
        self._budget, self._follow = terms.budget, terms.follow
        self._reporter = reporter
        self._began = self._seen_at = self._unlinked_at = self.received_at = clock.now()
        self.reported_at = -math.inf
        self._held_for = None  # type: Optional[str]  # the verdict's word that this would come to
        # Cameras: whether what they see determines where the joints go.
        self._enough = {}  # type: Dict[FrozenSet[str], bool]
        self._frames_received = 0  # frames

    def begin(self):
        # type: () -> float
        """Begin the run; return when that is, s."""
        self._began = self._seen_at = self._unlinked_at = self._clock.now()
        return self._began

    def receive(self, timeout, moving=False):
        # type: (float, bool) -> Tuple[List[MarkerFrame], Optional[Halt]]
        """Return (the new MarkerFrames, camera by camera; the Halt that ends the run, or None).

        Args:
            timeout: for messages, s.
            moving: whether the arm moves; no report is sent then.
        """
        new = self._client.poll(timeout)
        now = self.received_at = self._clock.now()
        end = self._end_due(now)
        if not moving and now - self.reported_at >= STATUS_PERIOD:
            self.report()
        frames = []
        for camera in sorted(new):
            frame = self._sightings.frame(
                new[camera], now, moving, self._reporter.frame if self._reporter.logs else None
            )
            if frame is not None:
                frames.append(frame)
                if self._follow:
                    self._sightings.smooth(frame)
        self._frames_received += len(frames)
        if frames and self._sees_enough(now):
            self._report_changes(now)
            if self._held_for is not None:
                self._report_line("{} again".format(self._loss.recovery_text(self._held_for)))
                self._held_for = None
        return frames, end

    def report_end(self, end):
        # type: (Halt) -> None
        """Report to the laptop the Halt that the run has ended with."""
        q = self.where() or ()
        self._client.report(q, verdict=end.word, reason=end.reason, **self._reporter.progress())

    def report(self):
        # type: () -> None
        """Report the progress to the laptop, now and then."""
        self._client.report(
            self.where() or (), reason=self._held_for or "", **self._reporter.progress()
        )
        self.reported_at = self._clock.now()  # after the report, so that its pause is whole

    def where(self):
        # type: () -> Optional[Tuple[float, ...]]
        """Return the joint angles when last known, rad (n); None before."""
        last = self._sightings.history.last
        return last and last[1]

    def _end_due(self, now):
        # type: (float) -> Optional[Halt]
        """Return the Halt that is due whatever is seen; None if none is."""
        for command in self._client.commands():
            if isinstance(command, Stop):
                return self._external_end(STOPPED, command.reason or "by the laptop")
            self._report_line(
                "a start of the laptop is ignored: this run is not over; stop it first"
            )
        if self._client.refused:
            return Halt(LINK_LOST, self._client.why)
        if now - self._began > self._budget:
            rate = (
                self._frames_received / (now - self._began) / max(1, len(self._sightings.seen_by))
            )
            why = "{:g} s{}".format(self._budget, self._loss.too_few(rate))
            return self._external_end(BUDGET_SPENT, why)
        if not self._client.linked:
            self._unlinked_at = now
        return None

    def _sees_enough(self, now):
        # type: (float) -> bool
        """Return whether what was lately seen determines the motion; store when it last did."""
        cameras, seen_by = [], self._sightings.seen_by  # type: List[str], Dict[str, float]
        for camera in sorted(seen_by, key=seen_by.__getitem__, reverse=True):
            cameras.append(camera)
            if self.suffice(cameras):
                self._seen_at = max(self._seen_at, seen_by[camera])
                return now - self._seen_at <= SIGHT_TIMEOUT
        return False

    def suffice(self, cameras):
        # type: (Iterable[str]) -> bool
        """Return Servo.suffices, which between two decisions does not change."""
        key = frozenset(cameras)
        if key not in self._enough:
            self._enough[key] = self._servo.suffices(cameras)
        return self._enough[key]

    def _report_changes(self, now):
        # type: (float) -> None
        """Report cameras that have lost sight of the marker, and those that see it again."""
        lost, found = self._sightings.changes(now)
        seeing = " and ".join(self._sightings.seeing(now)) if lost else ""
        for camera in lost:
            why = self._loss.word_of(camera)
            self._report_line("camera {}: {}; on with {}".format(camera, why, seeing))
        for camera in found:
            self._report_line("camera {}: marker seen again".format(camera))

    def _external_end(self, word, reason):
        # type: (str, str) -> Halt
        """Return the Halt of an end that the servo has not decided.

        A run that follows a goal has converged if it is near it.
        """
        now = self._clock.now()
        behind = self._sightings.behind
        if self._follow and behind and now - self._seen_at <= SIGHT_TIMEOUT:
            lately = {c: behind[c] for c in self._sightings.seeing(now) if c in behind}
            error = self._reporter.error = length(self._servo.rows.values(lately))
            if error < self._follow:
                word = CONVERGED
        return Halt(word, reason)

    def on_decision(self):
        # type: () -> None
        """Forget which cameras suffice: the servo has decided, it may be otherwise now."""
        self._enough = {}

    def still_sees(self):
        # type: () -> bool
        """Return whether the cameras in use see enough."""
        seeing = self._sightings.seeing(self.received_at)
        going_by = [camera for camera in seeing if camera in self._servo.cameras]
        return bool(going_by) and self.suffice(going_by)

    def is_lost(self, now):
        # type: (float) -> bool
        """Return whether too little has been seen for SIGHT_TIMEOUT."""
        return now - self._seen_at > SIGHT_TIMEOUT

    def give_up(self, now):
        # type: (float) -> Optional[Halt]
        """Return the Halt if that has lasted too long, or will; None otherwise."""
        return self._loss.end(now, self._seen_at, self._unlinked_at)

    def refusal(self):
        # type: () -> Optional[Halt]
        """Return LossOfSight.refusal."""
        return self._loss.refusal()

    def report_lost(self):
        # type: () -> None
        """Report that too little is seen, and that the arm is held."""
        why = self._loss.word(self._clock.now())
        if self._held_for != why:
            self._held_for = why
            self._report_line("{}: held".format(why))

    def _report_line(self, text):
        # type: (str) -> None
        """Report a line by the reporter."""
        self._reporter.note(self._clock.now(), text)
