"""The loop of visual servoing: receive what the cameras see, let the servo decide, move the arm.

The way of a stop.  What ends a motion is found out where messages are received (`_receive`): a stop
or a refusal of the laptop, the end of the time, cameras that see too little.  It comes back as a
Halt to the control tick (`_watch`, `_steer`), which hands STOP to the arm's control loop: that
returns at once, and the arm holds every motor.  `_serve` goes by the Halt: an end becomes the
verdict; a hold is told, and it is looked until something is seen again.  Trouble of the arm itself
(a stall, a motor that is gone, a brick that is too slow) and signals come as exceptions from the
arm, which has stopped before anybody hears of it.
"""

import math

from robot.motion.online_trajectory import STOP
from robot.servoing.linear_algebra import apart, length
from robot.servoing.loss_of_sight import Halt, LossOfSight
from robot.servoing.measurement import error_of
from robot.servoing.motion_learning import LearningInMotion
from robot.servoing.repeated_pictures import RepeatedPictures
from robot.servoing.run_reporter import RunReporter, Verdict, word_for
from robot.servoing.sightings import SIGHT_TIMEOUT, Sightings
from robot.servoing.stall_witness import witnessed
from shared.arm_description import ArmError
from shared.messages import STATUS_PERIOD, Stop
from shared.verdicts import BUDGET_SPENT, CONVERGED, LINK_LOST, STOPPED

MAX_CHASE_FRAMES = 200
"""Frames of a chase that are kept: some may have been seen at rest."""

STANDSTILL_ANGLE = math.radians(0.2)
"""Within this of where they stand in the end, joints stood already, rad."""

SETTLING_DELAY = 0.03
"""What is seen so long after the end of a motion is seen of an arm that stands, s."""

CHASE_THRESHOLD = math.radians(5)
"""A goal that stands is chased if a joint is farther off, rad: the last bit is gone by what was
measured at rest, which says more than frames in motion."""

CHASE_TIMEOUT = 6.0
"""After a goal that stands; then the arm stands, too, and is looked at, s."""

POLL_TIMEOUT = 0.1
"""For observations while nothing is to be done, s at a time."""

RECEIVE_RATIO, MIN_PAUSE, MAX_PAUSE = 4, 0.03, SIGHT_TIMEOUT / 2
"""In motion messages are received after so many times what that took last, but no sooner and no
later, s: most of the time is for aiming and learning.  Where nothing was seen: soon."""

LANDING_COUNTS = 1.5
"""A motion may end so many counts off: it is then looked from where it is."""
MAX_JOINT_SPEED, BLIND_SPEED_SHARE = math.radians(60), 0.5
"""Of any joint, rad/s; and the share of it when a camera has lost sight of the marker."""

HOLD = Halt("", "")
"""The Halt of a motion while too little is seen."""


class VisualServoing(object):
    """The loop of one run.

    Args:
        arm: robot.motion.arm.RobotArm, its zero known.
        client: robot.tracking_client.TrackingClient, or what looks like one.
        clock: has `now()` and `sleep(seconds)`.
        servo: Servo or ReportServo.
        goals: {camera: (u, v)}, px; none for the marker.
        stream: a Stream to steer by while the arm moves; None: look, then move.
        budget: s.
        most_moves: None for no limit.
        follow: go on after a goal that moves, until the budget is spent or the laptop stops it; it
            has converged if the smoothed error is then less than so many px. None: end at the goal.
        log: called with a dict per line of the log; None for none.
        say: called with each line of progress.
        number: of the run, for the laptop.
        pictures: RepeatedPictures of earlier runs before the same cameras; None for none.
    """

    def __init__(
        self, arm, client, clock, servo, goals=None, stream=None, budget=60.0,
        most_moves=None, follow=None, log=None, say=print, number=1,
        pictures=None
    ):  # fmt: skip
        self._arm, self._client, self._clock, self._servo = arm, client, clock, servo
        self._stream = stream
        self._budget, self._most_moves, self._follow = budget, most_moves, follow
        self._reporter = RunReporter(log, say)
        self._number = number
        self._speed = min(1.0, MAX_JOINT_SPEED / max(j.max_speed for j in arm.description.joints))
        joints = arm.description.joints
        self._sightings = Sightings(
            goals or {}, stream is not None, pictures or RepeatedPictures(joints)
        )
        self._loss = LossOfSight(client, self._sightings, len(joints))
        self._began = self._seen_at = self._unlinked_at = self._heard_at = clock.now()
        self._held_for = None
        self._halt = None  # why the motion is over
        self._error, self._e, self._condition = None, {}, None
        self._chased, self._chase_began = [], None
        self._chasing_now = False
        self._pause = MIN_PAUSE  # between two times of listening, s
        self._learning = LearningInMotion(servo, clock)
        self._reported_at = -math.inf
        self._enough = {}  # cameras: whether what they see determines where the joints go
        self._moves = self._measurements = self._frames = self._heard = 0

    def run(self):
        """Servo until a verdict.

        Returns:
            Verdict; the arm is held.

        Raises:
            whatever is not the arm's trouble (a signal), after the verdict is on record.
        """
        self._began = self._seen_at = self._unlinked_at = self._clock.now()
        self._reporter.began = self._began
        try:
            try:
                end = self._serve()
            except ArmError as error:
                looking = self._arm, self._servo, self._sightings, self._clock.now, self._receive
                end = Halt(word_for(error), witnessed(error, *looking))
        except BaseException as error:
            self._conclude(Halt(STOPPED, str(error)))
            raise
        return self._conclude(end)

    def progress(self):
        """What the laptop is told of the run so far, as TrackingClient.report takes it."""
        return {
            "error": self._error, "e": self._e, "condition": self._condition,
            "moves": self._moves, "run": self._number,
        }  # fmt: skip

    def _serve(self):
        """Look, decide and move until a Halt that is an end."""
        seen = ()
        while True:
            end, q, measurements, frames = self._measure(seen)
            if end:
                return end
            seen = ()
            began = self._clock.now()
            decision = self._servo.decide(q, measurements, self._chased)
            self._chased = []
            self._enough = {}
            measurements = [m for m in measurements if m.camera in self._servo.cameras]
            self._error = length(error_of(measurements, self._servo.rows))
            self._record_step(q, measurements, frames, decision, self._clock.now() - began)
            if decision.action == "end":
                if self._follow and decision.verdict == CONVERGED:
                    continue
                return Halt(decision.verdict, decision.reason)
            if self._moves == self._most_moves:
                return Halt(BUDGET_SPENT, "{} moves".format(self._moves))
            if self._clock.now() - self._heard_at > MAX_PAUSE:  # much has piled up meanwhile
                _, end = self._receive(0.0)
                if end:
                    return end
            self._moves += 1
            self._halt = None
            speed = self._speed * (BLIND_SPEED_SHARE if self._sightings.any_blind else 1.0)
            far = self._follow or apart(decision.q, q) > CHASE_THRESHOLD
            self._chasing_now = self._stream is not None and decision.action == "move" and far
            self._learning.begin(self._stream if self._chasing_now else None)
            if self._chasing_now:
                self._stream.begin(decision.q, self._servo.bound)
                self._chased, self._chase_began = [], self._clock.now()
                self._arm.chase(self._steer, speed, within=LANDING_COUNTS, spare=self._spare)
                seen = self._chased
            else:
                self._arm.reach(
                    decision.q, speed, on_tick=self._watch, within=LANDING_COUNTS, spare=self._spare
                )
            if self._halt is HOLD:
                self._note_lost()
                seen = ()
            elif self._halt:
                return self._halt

    # Seeing

    def _receive(self, timeout, moving=False):
        """(the new MarkerFrames, camera by camera; a Halt that is an end, or None)."""
        new = self._client.poll(timeout)
        now = self._heard_at = self._clock.now()
        end = self._end_due(now)
        if not moving and now - self._reported_at >= STATUS_PERIOD:
            self._report()
        frames = []
        for camera in sorted(new):
            frame = self._sightings.frame(
                new[camera], now, moving, self._reporter.frame if self._reporter.logs else None
            )
            if frame is not None:
                frames.append(frame)
                if self._follow:
                    self._sightings.smooth(frame)
        self._heard += len(frames)
        if frames and self._sees_enough(now):
            self._note_changes(now)
            if self._held_for is not None:
                self._note("{} again".format(self._loss.what_came_back(self._held_for)))
                self._held_for = None
        return frames, end

    def _report(self):
        """Tell the laptop how it goes, now and then."""
        self._client.report(self._where() or (), reason=self._held_for or "", **self.progress())
        self._reported_at = self._clock.now()  # after it, that it is due there when it is here

    def _end_due(self, now):
        """The Halt that is due whatever is seen; None."""
        for command in self._client.commands():
            if isinstance(command, Stop):
                return self._end_from_outside(STOPPED, command.reason or "by the laptop")
            self._note("a start of the laptop is ignored: this run is not over; stop it first")
        if self._client.refused:
            return Halt(LINK_LOST, self._client.why)
        if now - self._began > self._budget:
            rate = self._heard / (now - self._began) / max(1, len(self._sightings.seen_by))
            why = "{:g} s{}".format(self._budget, self._loss.too_few(rate))
            return self._end_from_outside(BUDGET_SPENT, why)
        if not self._client.linked:
            self._unlinked_at = now
        return None

    def _sees_enough(self, now):
        """Whether what was lately seen determines the motion; keeps in mind when it last was."""
        cameras, seen_by = [], self._sightings.seen_by
        for camera in sorted(seen_by, key=seen_by.__getitem__, reverse=True):
            cameras.append(camera)
            if self._suffice(cameras):
                self._seen_at = max(self._seen_at, seen_by[camera])
                return now - self._seen_at <= SIGHT_TIMEOUT
        return False

    def _suffice(self, cameras):
        """Servo.suffices, which between two decisions does not change."""
        key = frozenset(cameras)
        if key not in self._enough:
            self._enough[key] = self._servo.suffices(cameras)
        return self._enough[key]

    def _note_changes(self, now):
        """Tell of cameras that have lost sight of the marker, and see it again."""
        lost, found = self._sightings.changes(now)
        seeing = " and ".join(self._sightings.seeing(now)) if lost else ""
        for camera in lost:
            why = self._loss.word_of(camera)
            self._note("camera {}: {}; on with {}".format(camera, why, seeing))
        for camera in found:
            self._note("camera {}: marker seen again".format(camera))

    def _end_from_outside(self, word, reason):
        """End, though the servo has not decided so; who follows a goal has converged if near it."""
        now = self._clock.now()
        behind = self._sightings.behind
        if behind and now - self._seen_at <= SIGHT_TIMEOUT:
            lately = {c: behind[c] for c in self._sightings.seeing(now) if c in behind}
            self._error = length(self._servo.rows.values(lately))
            if self._error < self._follow:
                word = CONVERGED
        return Halt(word, reason)

    def _where(self):
        """The joints' angles when last seen, rad; None before."""
        last = self._sightings.history.last
        return last and last[1]

    def _measure(self, seen=()):
        """Stand, and look until it is enough; holds as long as nothing is seen.

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
        frames, heard, count = {}, {}, 0
        preparing, done = None, False
        while True:
            if preparing is not None:
                done = done or next(preparing, self) is self
            elif not self._learning.learn() and self._suffice(frames):
                preparing = self._servo.prepare(q, frames)
            new, end = self._receive(
                0.0 if not done and (self._learning.waits or preparing) else POLL_TIMEOUT
            )
            if end:
                return end, q, None, count
            for frame in list(seen) + new:
                heard[frame.camera] = self._heard_at
                if frame.t >= since:
                    of_camera = frames.setdefault(frame.camera, [])
                    of_camera.append((frame.t, frame.s, frame.goal))
                    count += 1
            seen = ()
            for camera in list(frames):
                if self._heard_at - heard[camera] > SIGHT_TIMEOUT:  # the others do not wait for it
                    del frames[camera]
            measurements = None
            if self._suffice(frames):
                measurements = self._servo.estimator.measurements(frames)
            refusal = not self._moves and measurements and self._loss.refusal()
            if refusal:
                return refusal, q, None, 0
            if measurements:
                self._learning.finish()
                self._measurements += 1
                self._frames += count
                return None, q, measurements, count
            now = self._clock.now()
            if now - self._seen_at > SIGHT_TIMEOUT:
                self._note_lost()
                frames, count = {}, 0
                end = self._loss.end(now, self._seen_at, self._unlinked_at)
                if end:
                    return end, q, None, 0

    def _note_lost(self):
        why = self._loss.word(self._clock.now())
        if self._held_for != why:
            self._held_for = why
            self._note("{}: held".format(why))

    # Moving

    def _listen(self):
        """Take in what has come in, in motion: (MarkerFrames, Halt or None)."""
        frames, halt = self._receive(0.0, moving=True)
        self._learning.take(frames)
        seeing = self._sightings.seeing(self._heard_at)
        going_by = [camera for camera in seeing if camera in self._servo.cameras]
        if not halt and not (going_by and self._suffice(going_by)):
            halt = HOLD
        return frames, halt

    def _watch(self, t, q):
        """What is done in every control tick of a motion: None to go on, or STOP."""
        self._sightings.history.add(t, q)
        return STOP if self._halt else None

    def _steer(self, t, q):
        """The same of a chase: where the joints should be, None to come to rest, or STOP."""
        self._sightings.history.add(t, q)
        if self._halt:
            return STOP
        aim = self._stream.aim(t, q, self._follow)  # it notes since when the joints stand
        late = t - self._chase_began > CHASE_TIMEOUT and not self._sightings.goal_moves(t)
        return None if late else aim

    def _spare(self, until):
        """What is done in the rest of a tick: listen or report if it is time, else learn and aim.

        What takes a slow brick longer than there is has its turn now and then all the same.
        """
        now = self._clock.now()
        if now - self._heard_at >= self._pause:
            frames, self._halt = self._listen()
            took = self._clock.now() - now
            pause = RECEIVE_RATIO * took if frames else 0.0
            self._pause = min(max(MIN_PAUSE, pause), MAX_PAUSE)
            if self._chasing_now:
                self._chased += frames
                del self._chased[:-MAX_CHASE_FRAMES]
                for frame in frames:
                    self._stream.see(frame, self._sightings.goals.get(frame.camera))
            return
        if now - self._reported_at >= STATUS_PERIOD:
            self._report()
            now = self._reported_at
        self._learning.work(now, until)

    # Telling

    def _record_step(self, q, measurements, frames, decision, computing):
        self._condition, self._e = self._reporter.step(
            self._clock.now(), self._servo, q, measurements, decision,
            error=self._error, frames=frames, computing=computing, number=self._moves + 1,
        )  # fmt: skip

    def _note(self, text):
        self._reporter.note(self._clock.now(), text)

    def _conclude(self, end):
        now, q = self._clock.now(), self._where()
        verdict = Verdict(
            end.word, end.reason, self._error, q, self._moves, self._measurements, self._frames,
            now - self._began,
        )  # fmt: skip
        self._client.report(q or (), verdict=end.word, reason=end.reason, **self.progress())
        self._reporter.verdict(now, verdict)
        return verdict
