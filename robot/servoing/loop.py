"""The loop of visual servoing: receive what the cameras see, let the servo decide, move the arm.

The path of a stop.  What ends a motion is found by the RunReceiver (run_receiver.py): a stop
or a refusal of the laptop, the end of the time, cameras that see too little.  It comes back as a
Halt to the control tick (`_watch`, `_steer`), which hands STOP to the arm's control loop: that
returns at once, and the arm holds every motor.  `_serve` goes by the Halt: an end becomes the
verdict; a hold is reported, and the arm measures once something is seen again.  Trouble of the arm
itself (a stall, a motor that is gone, a brick that is too slow) and signals come as exceptions from
the arm, which has stopped before.
"""

import math

from robot.motion.online_trajectory import STOP
from robot.servoing.linear_algebra import distance
from robot.servoing.loss_of_sight import Halt
from robot.servoing.motion_learning import LearningInMotion
from robot.servoing.repeated_pictures import RepeatedPictures
from robot.servoing.run_receiver import RunReceiver
from robot.servoing.run_reporter import RunReporter, word_for
from robot.servoing.sightings import SIGHT_TIMEOUT, Sightings, StandingFrames
from robot.servoing.stall_diagnosis import explain_stall
from shared.arm_description import ArmError
from shared.messages import STATUS_PERIOD
from shared.verdicts import BUDGET_SPENT, CONVERGED, STOPPED

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Mapping, Optional, Sequence, Tuple, Union  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.online_trajectory import (  # noqa: F401
        Aim,  # noqa: F401
        Landing,
        Moving,
    )
    from robot.servoing.decision import AnyServo  # noqa: F401
    from robot.servoing.image_model import Pixel, Pose  # noqa: F401
    from robot.servoing.loss_of_sight import SightsClient  # noqa: F401
    from robot.servoing.measurement import Measurement  # noqa: F401
    from robot.servoing.run_reporter import Verdict  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401
    from robot.servoing.stream import Stream  # noqa: F401

    _Measured = Tuple[Optional[Halt], Tuple[float, ...], Sequence[Measurement], int]

MAX_CHASE_FRAMES = 200
"""Frames of a chase that are kept, their greatest number: some may have been seen at rest."""

STANDSTILL_ANGLE = math.radians(0.2)
"""Distance from their last angles within which joints stood already, rad."""

SETTLING_DELAY = 0.03
"""Delay after the end of a motion from which on pictures are of an arm that stands, s."""

CHASE_THRESHOLD = math.radians(5)
"""Distance of a joint beyond which a goal that stands is chased, rad: the last bit is gone by what
was measured at rest, which says more than frames in motion."""

CHASE_TIMEOUT = 6.0
"""Longest chase of a goal that stands, s; then the arm stands, too, and measures."""

POLL_TIMEOUT = 0.1
"""Longest wait for observations while nothing is to be done, s."""

RECEIVE_RATIO, MIN_PAUSE, MAX_PAUSE = 4, 0.03, SIGHT_TIMEOUT / 2
"""Pause between two receptions in motion, as a multiple of the last one's duration, and its
bounds, s: most of the time is for aiming and learning. Where nothing was seen, the pause is the
shortest."""

LANDING_COUNTS = 1.5
"""Tolerance of a motion's end, counts: it is then measured from where it is."""

MAX_JOINT_SPEED, BLIND_SPEED_SHARE = math.radians(60), 0.5
"""Greatest speed of any joint, rad/s; the share of it when a camera has lost sight of the
marker."""

TOO_SLOW_TO_STEER = (
    "the brick, or the camera, is too slow for steering while the arm moves: it looks, then moves"
)
"""Line for people when a stream is given up."""

HOLD = Halt("", "")
"""Halt of a motion while too little is seen."""


class RunTerms(object):
    """The terms of a run: what it is to do, and when it ends at the latest.

    Args:
        goals: {camera: (u, v)}, px; none for the marker.
        budget: s.
        most_moves: None for no limit.
        follow: go on after a goal that moves, until the budget is spent or the laptop stops it; it
            has converged if the smoothed error is then less than so many px. None: end at the goal.
    """

    def __init__(self, goals=None, budget=60.0, most_moves=None, follow=None):
        # type: (Optional[Mapping[str, Pixel]], float, Optional[int], Optional[float]) -> None
        self.goals = goals or {}
        self.budget, self.most_moves, self.follow = budget, most_moves, follow


class VisualServoing(object):
    """The loop of one run.

    Args:
        arm: robot.motion.arm.RobotArm, its zero known.
        client: robot.tracking_client.TrackingClient, or what looks like one.
        clock: has `now()`.
        servo: Servo or ReportServo.
        terms: RunTerms; as they are by themselves if None.
        stream: a Stream to steer by while the arm moves; None: look, then move.
        reporter: RunReporter; None: what it does is printed.
        pictures: RepeatedPictures of earlier runs before the same cameras; None for none.
    """

    def __init__(
        self,
        arm,  # type: RobotArm
        client,  # type: SightsClient
        clock,  # type: Timepiece
        servo,  # type: AnyServo
        terms=None,  # type: Optional[RunTerms]
        stream=None,  # type: Optional[Stream]
        reporter=None,  # type: Optional[RunReporter]
        pictures=None,  # type: Optional[RepeatedPictures]
    ):
        # type: (...) -> None
        self._arm, self._clock, self._servo, self._stream = arm, clock, servo, stream
        terms = terms or RunTerms()
        self._most_moves, self._follow = terms.most_moves, terms.follow
        self._reporter = reporter or RunReporter()
        joints = arm.description.joints
        self._speed = min(1.0, MAX_JOINT_SPEED / max(joint.max_speed for joint in joints))
        self._sightings = Sightings(
            terms.goals, stream is not None, pictures or RepeatedPictures(joints)
        )
        self._receiver = RunReceiver(
            client, clock, servo, self._sightings, len(joints), terms, self._reporter
        )
        self._halt = None  # type: Optional[Halt]  # why the motion is over
        self._chased, self._chase_began = [], 0.0  # type: List[MarkerFrame], float
        self._chasing_now = False
        self._pause = MIN_PAUSE  # between two times of listening, s
        self._learning = LearningInMotion(servo, clock)

    def run(self):
        # type: () -> Verdict
        """Servo until a verdict.

        Returns:
            Verdict; the arm is held.

        Raises:
            whatever is not the arm's trouble (a signal), after the verdict is on record.
        """
        self._reporter.began = self._receiver.begin()
        try:
            try:
                end = self._serve()
            except ArmError as error:
                why = explain_stall(
                    error, self._arm, self._servo, self._sightings, self._clock.now,
                    self._receiver.receive,
                )  # fmt: skip
                end = Halt(word_for(error), why)
        except BaseException as error:
            self._conclude(Halt(STOPPED, str(error)))
            raise
        return self._conclude(end)

    def _serve(self):
        # type: () -> Halt
        """Look, decide and move until a Halt that is an end."""
        seen = []  # type: List[MarkerFrame]
        while True:
            end, q, measurements, frames = self._measure(seen)
            if end:
                return end
            seen = []
            began = self._clock.now()
            decision = self._servo.decide(q, measurements, self._chased)
            self._chased = []
            self._receiver.on_decision()
            measurements = [m for m in measurements if m.camera in self._servo.cameras]
            now = self._clock.now()
            self._reporter.step(
                self._clock.now(), self._servo, q, measurements, decision, frames, now - began
            )
            to = decision.q
            if to is not None and decision.reason:
                self._reporter.note(now, decision.reason)
            if to is None:
                if self._follow and decision.verdict == CONVERGED:
                    continue
                return Halt(decision.verdict, decision.reason)
            if self._reporter.moves == self._most_moves:
                return Halt(BUDGET_SPENT, "{} moves".format(self._most_moves))
            if (
                self._clock.now() - self._receiver.received_at > MAX_PAUSE
            ):  # much has piled up meanwhile
                _, end = self._receiver.receive(0.0)
                if end:
                    return end
            self._reporter.moves += 1
            self._halt = None
            speed = self._speed * (BLIND_SPEED_SHARE if self._sightings.any_blind else 1.0)
            far = self._follow or distance(to, q) > CHASE_THRESHOLD
            explores = decision.action == "explore" and self._servo.explores_in_motion
            steered = explores or decision.action == "move" and far
            stream = self._stream if steered else None
            self._chasing_now = stream is not None
            self._learning.begin(stream)
            if stream is not None:
                stream.begin(to, self._servo.detour_pose, q if explores else None)
                self._chaser, self._chased, self._chase_began = stream, [], self._clock.now()
                self._arm.chase(self._steer, speed, within=LANDING_COUNTS, spare=self._spare)
                seen = self._chased
            else:
                self._arm.reach(
                    to, speed, on_tick=self._watch, within=LANDING_COUNTS, spare=self._spare
                )
            if self._halt is HOLD:
                self._receiver.report_lost()
                seen = []
            elif self._halt:
                return self._halt

    # Seeing

    def _measure(self, seen):
        # type: (List[MarkerFrame]) -> _Measured
        """Stand, and receive frames until they are a measurement; hold as long as nothing is seen.

        Args:
            seen: MarkerFrames that came in before: some may be of the arm as it stands now.

        Returns:
            (Halt that is an end or None, q, [Measurement], frames it took)
        """
        q = self._arm.angles()
        now = self._clock.now()
        self._sightings.history.add(now, q)
        since = self._sightings.history.still_since(STANDSTILL_ANGLE) if seen else now
        since += SETTLING_DELAY
        frames = StandingFrames(since)  # type: StandingFrames
        preparing, done = None, False
        while True:
            if preparing is not None:
                done = done or next(preparing, self) is self
            elif not self._learning.learn() and self._receiver.suffice(frames.seen):
                preparing = self._servo.prepare(q, frames.seen)
            new, end = self._receiver.receive(
                0.0 if not done and (self._learning.waits or preparing) else POLL_TIMEOUT
            )
            if end:
                return end, q, (), frames.count
            frames.add(seen + new, self._receiver.received_at)
            seen = []
            measurements = None
            if self._receiver.suffice(frames.seen):
                measurements = self._servo.estimator.measurements(frames.seen)
            if measurements:
                refusal = None if self._reporter.moves else self._receiver.refusal()
                if refusal:
                    return refusal, q, (), 0
                self._learning.finish()
                self._reporter.note_measured(frames.count)
                return None, q, measurements, frames.count
            now = self._clock.now()
            if self._receiver.is_lost(now):
                self._receiver.report_lost()
                frames = StandingFrames(since)
                end = self._receiver.give_up(now)
                if end:
                    return end, q, (), 0

    # Moving

    def _listen(self):
        # type: () -> Tuple[List[MarkerFrame], Optional[Halt]]
        """Receive what has come in, in motion: (MarkerFrames, Halt or None)."""
        frames, halt = self._receiver.receive(0.0, moving=True)
        self._learning.handle(frames)
        if not halt and not self._receiver.still_sees():
            halt = HOLD
        return frames, halt

    def _watch(self, t, q):
        # type: (float, Pose) -> object
        """Record q (rad) in every control tick of a motion; return None to go on, or STOP."""
        self._sightings.history.add(t, q)
        return STOP if self._halt else None

    def _steer(self, t, q):
        # type: (float, Pose) -> Aim
        """Return, in a chase's control tick, the joints' aim, None to come to rest, or STOP."""
        self._sightings.history.add(t, q)
        if self._halt:
            return STOP
        if self._chaser.is_late(t):
            if self._stream is not None:
                self._reporter.note(t, TOO_SLOW_TO_STEER)
                self._stream.give_up()
            self._stream = None
            return None
        aim = self._chaser.aim(t, q, self._follow)  # it notes since when the joints stand
        late = t - self._chase_began > CHASE_TIMEOUT and not self._sightings.goal_moves(t)
        return None if late else aim

    def _spare(self, until):
        # type: (float) -> None
        """Use the rest of a tick: receive or report if it is time, else learn and aim.

        What takes a slow brick longer than there is has its turn now and then all the same.
        """
        now = self._clock.now()
        if now - self._receiver.received_at >= self._pause:
            frames, self._halt = self._listen()
            elapsed = self._clock.now() - now
            pause = RECEIVE_RATIO * elapsed if frames else 0.0
            self._pause = min(max(MIN_PAUSE, pause), MAX_PAUSE)
            if self._chasing_now:
                self._chased += frames
                del self._chased[:-MAX_CHASE_FRAMES]
                for frame in frames:
                    self._chaser.see(frame, self._sightings.goals.get(frame.camera))
            now = self._clock.now()
            if now >= until:
                return
        if now - self._receiver.reported_at >= STATUS_PERIOD:
            self._receiver.report()
            now = self._receiver.reported_at
        self._learning.work(now, until)

    def _conclude(self, end):
        # type: (Halt) -> Verdict
        """Report the end of the run; return its Verdict."""
        now, q = self._clock.now(), self._receiver.where()
        self._receiver.report_end(end)
        return self._reporter.verdict(now, end, q)
