#!/usr/bin/env python3
"""Bring the tip where the camera sees the goal: nothing between image and joints is calibrated.

    visual_servoing.py --code ABCD-EFGH      to the goal marker that the laptop's tracker sees
    visual_servoing.py                       the same later: host and code are remembered
    visual_servoing.py --goal 400,200        to a pixel
    visual_servoing.py --arm spatial --goal A:400,200 --goal B:310,150     in space, by two cameras
    visual_servoing.py --mode stream --follow --budget 30    after a goal marker that moves
    visual_servoing.py --wait                a run whenever the laptop says so, and as it orders

The joints' zero must be known (driver.py home), because of their limits.
"""

import argparse
import contextlib
import json
import math
import os
import re
import sys
from collections import OrderedDict, deque, namedtuple

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

from robot import program  # noqa: E402

if __name__ == "__main__":
    program.let_signals_end()

from robot import servo as servoing  # noqa: E402
from robot.battery import Battery  # noqa: E402
from robot.clock import Clock  # noqa: E402
from robot.servo import Goal, JointHistory, apart, length  # noqa: E402
from robot.tracking_client import Refusal, TrackingClient, find_tracker  # noqa: E402
from shared.arm_description import ArmError, find_arm, read_arm  # noqa: E402
from shared.messages import BUDGET, READY, REFUSED, TOLERANCE, Start, Stop  # noqa: E402
from shared.orders import METHODS, MODES, ROWS, BadOrders, check  # noqa: E402

EFFECTOR, GOAL = "effector", "goal"
"""Names of the markers."""

BELIEVED = 0.5
"""A sighting with less confidence may be something else."""

LOST = 0.3
"""Without a sighting for so long the arm holds, s: nothing moves on old data."""

MARKER_PATIENCE, LINK_PATIENCE = 10.0, 20.0
"""The run is given up when marker or link have not come back for so long, s."""

GLIMPSED = math.radians(0.5)
"""Frames in motion are learned from if a joint has moved by so much in between, rad."""

SETTLED = 0.03
"""What is seen so long after the end of a motion is seen of an arm that stands, s."""

LONGEST_CHASE = 6.0
"""After a goal that stands; then the arm stands, too, and is looked at, s."""

MOST_CHASED = 200
"""Frames of a chase that are kept: those since it stands are measured."""

SMOOTHED = 0.5
"""Over so long the error is smoothed when a moving goal is followed, s."""

WAIT = 0.1
"""For observations while nothing is to be done, s at a time."""

FASTEST = math.radians(60)
"""Of any joint, rad/s."""

CAMERA = "A"
"""A goal that is given as a pixel, and no more, is one of this camera."""

FEWER = 0.5
"""The share of its speed at which it goes on when a camera has lost sight of the marker."""

USUAL = Start()
"""What is done unless something else is ordered."""

Verdict = namedtuple("Verdict", "word reason error q moves measurements frames seconds")
Verdict.__doc__ = """How a run ended.

word          "converged", or why not
reason        in words for people; "" where the word says it all
error         distance of tip and goal in the image when last measured, px, or None
q             joint angles, rad, or None
moves, measurements, frames, seconds   what it took
"""

Frame = namedtuple("Frame", "camera t q s goal")
Frame.__doc__ = "One picture of one camera: when it was taken (s), where the joints were, px."


class NotReached(ArmError):
    """The run has ended with another verdict than `converged`."""


class LogLost(ArmError):
    """The log cannot be written."""


class _Over(Exception):
    """The run is over: verdict and reason."""

    def __init__(self, word, reason=""):
        super(_Over, self).__init__(word)
        self.word, self.reason = word, reason


class _Unseen(Exception):
    """The marker or the link is lost in mid-motion."""


class VisualServoing(object):
    """The loop: hears what the camera sees, lets the servo decide, moves the arm.

    Args:
        arm: robot.motion.arm.RobotArm, its zero known.
        eyes: robot.tracking_client.TrackingClient, or what looks like one.
        clock: has `now()` and `sleep(seconds)`.
        servo: robot.servo.Servo or ReportServo.
        goals: {camera: (u, v)}, px; none for the marker.
        stream: a robot.servo.Stream to steer by while the arm moves; None: look, then move.
        budget: s.
        most_moves: None for no limit.
        follow: go on after a goal that moves, until the budget is spent or the laptop stops it; it
            has converged if the smoothed error is then less than so many px. None: end at the goal.
        log: called with a dict per line of the log; None for none.
        say: called with each line of progress.
        number: of the run, for the laptop.
    """

    def __init__(
        self, arm, eyes, clock, servo, goals=None, stream=None, budget=USUAL.budget,
        most_moves=None, follow=None, log=None, say=print, number=1
    ):  # fmt: skip
        self._arm, self._eyes, self._clock, self._servo = arm, eyes, clock, servo
        self._fixed_goals, self._stream = goals or {}, stream
        self._budget, self._most_moves, self._follow = budget, most_moves, follow
        self._log = log
        self._say = say
        self._number = number
        self._speed = min(1.0, FASTEST / max(j.max_speed for j in arm.description.joints))
        self._history = JointHistory()
        self._goals = {}
        self._began = self._seen_at = clock.now()
        self._unlinked_at = self._began
        self._seen_by = {}  # camera: when both tip and goal were last heard of
        self._blind = set()  # those that were told of as blind
        self._heard_of = set()  # those that send, whatever they see
        self._held_for = None
        self._error, self._e, self._condition = None, {}, None
        self._chased, self._chase_began = [], None
        self._glimpses = deque(maxlen=MOST_CHASED)  # seen in motion, to be learned from at rest
        self._glimpsed = {}  # camera: where the joints were in the last of these
        self._refitting = None
        self._turn = 0  # what is done in this tick of a motion: listen if 0, aim if 1, else learn
        self._enough = {}  # cameras: whether what they see determines where the joints go
        self._behind = {}  # camera: (t, error) smoothed
        self._moves = self._measurements = self._frames = self._heard = 0

    def run(self):
        """Servo until a verdict.

        Returns:
            Verdict; the arm is held.

        Raises:
            whatever is not the arm's trouble (a signal), after the verdict is on record.
        """
        self._began = self._seen_at = self._unlinked_at = self._clock.now()
        try:
            self._serve()
        except _Over as over:
            return self._conclude(over.word, over.reason)
        except ArmError as error:
            return self._conclude(_word_for(error), str(error))
        except BaseException as error:
            self._conclude("stopped", str(error))
            raise

    def progress(self):
        """What the laptop is told of the run so far, as TrackingClient.report takes it."""
        return {
            "error": self._error, "e": self._e, "condition": self._condition,
            "moves": self._moves, "run": self._number,
        }  # fmt: skip

    def _serve(self):
        seen = ()
        while True:
            q, views, frames = self._measure(*seen)
            seen = ()
            began = self._clock.now()
            decision = self._servo.decide(q, views)
            self._enough = {}
            views = [view for view in views if view.camera in self._servo.cameras]
            self._error = length(servoing.error_of(views, self._servo.rows))
            self._record_step(q, views, frames, decision, self._clock.now() - began)
            if decision.action == "end":
                if self._follow and decision.verdict == servoing.CONVERGED:
                    continue
                raise _Over(decision.verdict, decision.reason)
            if self._moves == self._most_moves:
                raise _Over("budget spent", "{} moves".format(self._moves))
            self._moves += 1
            try:
                if self._stream is not None and decision.action == "move":
                    self._stream.begin(decision.q)
                    self._chased, self._chase_began = [], self._clock.now()
                    self._arm.chase(self._steer, self._pace())
                    seen = self._stream.still_since, self._chased
                else:
                    self._arm.reach(decision.q, self._pace(), watch=self._watch)
            except _Unseen:
                self._note_lost()

    # Seeing

    def _hear(self, timeout, moving=False):
        """The new Frames, camera by camera; says what is due, ends the run where it must."""
        new = self._eyes.look(timeout)
        now = self._clock.now()
        for command in self._eyes.commands():
            if isinstance(command, Stop):
                self._end_from_outside("stopped", command.reason or "by the laptop")
            self._note("a start of the laptop is ignored: this run is not over; stop it first")
        if self._eyes.refused:
            raise _Over("link lost", self._eyes.why)
        if now - self._began > self._budget:
            self._end_from_outside("budget spent", self._why_so_long(now))
        if not self._eyes.linked:
            self._unlinked_at = now
        self._eyes.report(self._where() or (), reason=self._held_for or "", **self.progress())
        frames = []
        for camera in sorted(new):
            frame = self._frame(new[camera], moving)
            if frame is not None:
                frames.append(frame)
                self._heard += 1
                self._seen_by[camera] = now
        if frames and self._sees_enough(now):
            if self._blind or len(self._seeing(now)) < len(self._seen_by):
                self._note_blind(now)
            if self._held_for is not None:
                self._note(
                    "{} again".format("seen" if self._held_for == "marker lost" else "linked")
                )
                self._held_for = None
        return frames

    def _sees_enough(self, now):
        """Whether what was lately seen determines the motion; keeps in mind when it last was."""
        cameras = []
        for camera in sorted(self._seen_by, key=self._seen_by.get, reverse=True):
            cameras.append(camera)
            if self._suffice(cameras):
                self._seen_at = max(self._seen_at, self._seen_by[camera])
                return now - self._seen_at <= LOST
        return False

    def _suffice(self, cameras):
        """Servo.suffices, which between two decisions does not change."""
        key = frozenset(cameras)
        if key not in self._enough:
            self._enough[key] = self._servo.suffices(cameras)
        return self._enough[key]

    def _seeing(self, now):
        """The cameras that have lately seen what is to be seen."""
        return [camera for camera in sorted(self._seen_by) if now - self._seen_by[camera] <= LOST]

    def _note_blind(self, now):
        """Tell of cameras that have lost sight of the marker, and see it again."""
        seeing = self._seeing(now)
        blind = set(self._seen_by) - set(seeing)
        for camera in sorted(blind - self._blind):
            self._note("camera {}: marker lost; on with {}".format(camera, " and ".join(seeing)))
        for camera in sorted(self._blind - blind):
            self._note("camera {}: marker seen again".format(camera))
        self._blind = blind

    def _pace(self):
        """Share of the joints' greatest speeds."""
        return self._speed * (FEWER if self._blind else 1.0)

    def _end_from_outside(self, word, reason):
        """End, though the servo has not decided so; who follows a goal has converged if near it."""
        now = self._clock.now()
        if self._behind and now - self._seen_at <= LOST:
            behind = {c: self._behind[c][1] for c in self._seeing(now) if c in self._behind}
            self._error = length(self._servo.rows.values(behind))
            if self._error < self._follow:
                word = servoing.CONVERGED
        raise _Over(word, reason)

    def _why_so_long(self, now):
        rate = self._heard / (now - self._began) / max(1, len(self._seen_by))
        reason = "{:g} s".format(self._budget)
        if rate < 2 / LOST:
            reason += "; {:.1f} pictures a second with the marker in them, {:g} are needed".format(
                rate, math.ceil(2 / LOST)
            )
        return reason

    def _where(self):
        """The joints' angles when last seen, rad; None before."""
        last = self._history.last
        return last and last[1]

    def _frame(self, seen, moving):
        """The Frame of an Observation; None unless the tip is seen and the goal known."""
        self._heard_of.add(seen.camera)
        tip, goal = (seen.markers.get(name) for name in (EFFECTOR, GOAL))
        tip = tip if tip and tip[2] >= BELIEVED else None
        if tip and goal and goal[2] >= BELIEVED and not self._fixed_goals:
            self._goals.setdefault(seen.camera, Goal()).add(seen.t, goal[:2], goal[2], tip[:2])
        where = self._fixed_goals.get(seen.camera)
        if seen.camera in self._goals:
            goal = self._goals[seen.camera]
            # In motion nothing is made of where it is, unless it is steered for.
            where = goal.latest if moving and not self._stream else goal.at(seen.t)
        q = self._history.at(seen.t)
        self._log_line("seen", seen.t, camera=seen.camera, q=q, s=tip and tip[:2], goal=where)
        if tip is None or where is None:
            return None
        if self._follow:
            self._smooth(seen.camera, seen.t, tuple(a - b for a, b in zip(tip, where)))
        return Frame(seen.camera, seen.t, q, tip[:2], where)

    def _smooth(self, camera, t, e):
        before, behind = self._behind.get(camera, (t, e))
        share = min((t - before) / SMOOTHED, 1.0)
        self._behind[camera] = t, tuple(b + share * (x - b) for b, x in zip(behind, e))

    def _measure(self, since=None, seen=()):
        """Stand, and look until it is enough: (q, [View], frames it took).

        Holds as long as nothing is seen; gives up after a while.

        Args:
            since: the arm stands since then, s; now if None.
            seen: Frames that have come in meanwhile.
        """
        q = self._standing_angles()
        since = (self._clock.now() if since is None else since) + SETTLED
        frames, heard, count = {}, {}, 0
        while True:
            self._learn()
            for frame in list(seen) + self._hear(0.0 if self._glimpses else WAIT):
                heard[frame.camera] = self._clock.now()
                if frame.t >= since:
                    of_camera = frames.setdefault(frame.camera, [])
                    of_camera.append((frame.t, frame.s, frame.goal))
                    count += 1
            seen = ()
            for camera in list(frames):
                if self._clock.now() - heard[camera] > LOST:  # the others do not wait for it
                    del frames[camera]
            views = None
            if self._servo.suffices(sorted(frames)):
                views = self._servo.measure.views(frames)
            if views:
                while self._glimpses:
                    self._learn()
                self._measurements += 1
                self._frames += count
                return q, views, count
            if self._clock.now() - self._seen_at > LOST:
                self._note_lost()
                frames, count = {}, 0
                self._give_up_in_time()

    def _learn(self, only=None):
        """Learn from a frame that was seen in motion; the arm stands now, and there is time."""
        if self._glimpses:
            frame = self._glimpses.popleft()
            self._servo.glimpse(frame.camera, frame.q, frame.s, only)

    def _learn_on(self):
        """Learn, and do a slice of making use of it; for the stream."""
        if self._refitting is None:
            self._learn(self._servo.using)
            self._refitting = self._stream.refit()
        if next(self._refitting, self) is self:
            self._refitting = None

    def _standing_angles(self):
        """The joints' angles, rad, as the encoders have them."""
        q = self._arm.angles()
        self._history.add(self._clock.now(), q)
        return q

    def _note_lost(self):
        why = "marker lost" if self._eyes.linked else "link lost"
        if self._held_for != why:
            self._held_for = why
            self._note("{}: held".format(why))

    def _give_up_in_time(self):
        now = self._clock.now()
        if now - max(self._seen_at, self._unlinked_at) > MARKER_PATIENCE:
            raise _Over("marker lost", self._what_is_missing())
        if not self._eyes.linked and now - self._seen_at > LINK_PATIENCE:
            raise _Over("link lost", self._eyes.why)

    def _what_is_missing(self):
        if not self._fixed_goals and not self._goals:
            return (
                "effector and goal have not been seen together for {:g} s; let the camera see "
                "both, or give a pixel as the goal".format(MARKER_PATIENCE)
            )
        seeing = self._seeing(self._clock.now())
        missing = sorted((set(self._seen_by) | set(self._fixed_goals)) - set(seeing))
        unheard = [camera for camera in missing if camera not in self._heard_of]
        if unheard and self._fixed_goals:
            return "no camera {}, of which a pixel is the goal; those that send are {}".format(
                " and ".join(unheard), " and ".join(sorted(self._heard_of)) or "none"
            )
        if seeing:
            return (
                "what {} sees is not enough to move {} joints; let {} see effector and goal".format(
                    " and ".join(seeing),
                    len(self._arm.description.joints),
                    " and ".join(missing) or "another camera",
                )
            )
        return "{} has not been seen for {:g} s; look at what the tracker says of it".format(
            "the effector, or the goal, which moves," if self._goal_moves() else "the effector",
            MARKER_PATIENCE,
        )

    # Moving

    def _listen(self):
        """What has come in, in motion.

        Raises:
            _Unseen: too few cameras see the marker.
        """
        frames = self._hear(0.0, moving=True)
        for frame in frames:
            before = self._glimpsed.get(frame.camera)
            if frame.q is not None and (before is None or apart(frame.q, before) > GLIMPSED):
                self._glimpsed[frame.camera] = frame.q
                self._glimpses.append(frame)
        going_by = [c for c in self._seeing(self._clock.now()) if c in self._servo.cameras]
        if not going_by or not self._suffice(going_by):
            raise _Unseen
        return frames

    def _watch(self, t, q):
        """In every control tick of a motion: listen, or learn, which takes a tick of its own."""
        self._history.add(t, q)
        self._turn = (self._turn + 1) % 2
        if self._turn:
            self._learn()
        else:
            self._listen()

    def _steer(self, t, q):
        """In every control tick of a chase: where the joints should be, or None."""
        self._history.add(t, q)
        self._turn = (self._turn + 1) % 3
        if self._turn == 0:
            frames = self._listen()
            self._chased += frames
            del self._chased[:-MOST_CHASED]
            for frame in frames:
                self._stream.see(frame, self._goals.get(frame.camera))
        elif self._turn == 1:
            self._stream.reaim()
        else:
            self._learn_on()
        if t - self._chase_began > LONGEST_CHASE and not self._goal_moves():
            self._stream.aim(t, q)  # it notes since when the joints stand
            return None
        return self._stream.aim(t, q)

    def _goal_moves(self):
        seeing = self._seeing(self._clock.now()) or self._goals
        return any(goal.moving for camera, goal in self._goals.items() if camera in seeing)

    # Telling

    def _record_step(self, q, views, frames, decision, computing):
        using = self._servo.using
        condition = self._servo.J and servoing.condition(self._servo.J)
        self._condition = None if condition == math.inf else condition  # JSON knows no infinity
        rows = self._servo.rows
        names = rows.names(view.camera for view in views)
        s = rows.values({view.camera: view.s for view in views})
        goal = rows.values({view.camera: view.goal for view in views})
        self._e = {name: a - b for name, a, b in zip(names, s, goal)}
        self._log_line(
            "step", self._clock.now(), q=q, rows=names, s=s, goal=goal,
            error=self._error, sigma=self._servo.measure.sigma, frames=frames,
            J=self._servo.J, condition=self._condition, model=using,
            action="hold" if decision.action == "end" else decision.action,
            q_wanted=decision.q, computing=computing,
        )  # fmt: skip
        if decision.q is not None:
            step = " ".join("{:+.1f}".format(math.degrees(b - a)) for a, b in zip(q, decision.q))
            self._say(
                "move {}: {:.1f} px off, {}, {} deg".format(
                    self._moves + 1,
                    self._error,
                    using if decision.action == "move" else decision.action,
                    step,
                )
            )

    def _note(self, text):
        self._say(text)
        self._log_line("note", self._clock.now(), text=text)

    def _log_line(self, kind, t, **values):
        if not self._log:
            return
        line = OrderedDict([("kind", kind), ("t", round(t - self._began, 4))])
        line.update(sorted(values.items()))
        self._log(line)

    def _conclude(self, word, reason):
        now, q = self._clock.now(), self._where()
        verdict = Verdict(
            word, reason, self._error, q, self._moves, self._measurements, self._frames,
            now - self._began,
        )  # fmt: skip
        self._eyes.report(q or (), verdict=word, reason=reason, **self.progress())
        self._log_line(
            "verdict", now, verdict=word, reason=reason, error=self._error, q=q,
            moves=self._moves, measurements=self._measurements, frames=self._frames,
        )  # fmt: skip
        return verdict


def _word_for(error):
    """The verdict that an ArmError comes to."""
    # Not above: the laptop, which has no motors, is to be told so in one line.
    from robot.motion.control_loop import Stalled
    from robot.motion.motors import MotorNotFound

    return "stalled" if isinstance(error, (Stalled, MotorNotFound)) else "stopped"


def in_words(verdict):
    """A Verdict as one line."""
    text = verdict.word
    if verdict.error is not None:
        text += ": {:.1f} px off".format(verdict.error)
    text += " after {} move{}, {:.1f} s".format(
        verdict.moves, "" if verdict.moves == 1 else "s", verdict.seconds
    )
    return text + (" ({})".format(verdict.reason) if verdict.reason else "")


# The command line


def _goal(text):
    """(camera, (u, v)); None for the marker."""
    if text == "marker":
        return None
    number = r"(-?\d+(?:\.\d*)?)"
    match = re.match(r"\s*(?:([A-Z]):)?{0},{0}\s*\Z".format(number), text)
    if not match or not all(abs(float(x)) <= 1e5 for x in match.groups()[1:]):
        raise argparse.ArgumentTypeError(
            "'{}' is no goal; write marker, or a pixel U,V like 400,200, or B:U,V if it is one of"
            " camera B".format(text.strip()[:40])
        )
    return match.group(1) or CAMERA, tuple(float(x) for x in match.groups()[1:])


def _fixed_goals(goals):
    """{camera: (u, v)} of what was given with --goal.

    Raises:
        ArmError: that is no one goal.
    """
    fixed = dict(goal for goal in goals if goal is not None)
    if len(fixed) != len(goals) and len(goals) > 1:
        raise ArmError("--goal twice for one camera, or for a marker and a pixel; give one of them")
    return fixed


def _parser():
    parser = program.Parser(
        prog="visual_servoing.py", description="Bring the tip where the camera sees the goal."
    )
    parser.add_argument(
        "place", nargs="?", default="", metavar="HOST[:PORT]",
        help="the laptop (default: where ssh came from, else as remembered)",
    )  # fmt: skip
    parser.add_argument("--code", help="as the tracker prints it (default: as remembered)")
    parser.add_argument(
        "--goal", type=_goal, action="append", default=[], metavar="marker|U,V|CAMERA:U,V",
        help="once, or a pixel of each camera (default: marker)",
    )  # fmt: skip
    parser.add_argument(
        "--rows", choices=ROWS, default=USUAL.rows,
        help="of the cameras' u and v, all, weighed by their noise, or as the report has it, those"
        " of the first and one of the second (default: stereo)",
    )  # fmt: skip
    parser.add_argument(
        "--third", choices=sorted(servoing.Rows.ONE),
        help="the second camera's row with --rows xyz (default: as exploring shows)",
    )  # fmt: skip
    parser.add_argument("--method", choices=METHODS, default=USUAL.method)
    parser.add_argument("--mode", choices=MODES, default=USUAL.mode)
    parser.add_argument(
        "--follow", action="store_true",
        help="after a goal that moves, until the budget is spent; needs --mode stream",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=program.number_in(*TOLERANCE), default=USUAL.tolerance, metavar="PX"
    )
    parser.add_argument(
        "--budget", type=program.number_in(*BUDGET), default=USUAL.budget, metavar="S"
    )
    parser.add_argument(
        "--wait", action="store_true",
        help="until ended by a signal, do a run whenever the laptop says so, as it orders, and hold"
        " the arm between them",
    )  # fmt: skip
    parser.add_argument(
        "--arm", default=os.environ.get("BRICKSERVO_ARM", "planar"), metavar="FILE",
        help="arm file (default: $BRICKSERVO_ARM, else planar)",
    )  # fmt: skip
    parser.add_argument(
        "--low", action="store_true",
        help="once at the goal, go low before parking, if the arm's file says where it rests",
    )  # fmt: skip
    parser.add_argument(
        "--log", metavar="FILE",
        help="what happened, as lines of JSON; with --wait, in the last run",
    )  # fmt: skip
    return parser


class _Log(object):
    """Lines of JSON in a file, or nowhere.

    Raises:
        LogLost: once; from then on it writes nowhere.
    """

    def __init__(self, path):
        self._path, self._file = path, None
        with self._telling():
            self._file = path and open(path, "w")  # noqa: SIM115 - it stays open

    def __call__(self, line):
        if self._file:
            with self._telling():
                self._file.write(json.dumps(line) + "\n")
                # A program that is killed leaves all but the last few sightings.
                if line["kind"] != "seen":
                    self._file.flush()

    def close(self):
        if self._file:
            with self._telling():
                self._file.close()

    @contextlib.contextmanager
    def _telling(self):
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


def _say(line):
    print(line, flush=True)


def make_servo(arm, method, mode, tolerance, seed=0, rows="stereo", third=None):
    """(servo, stream or None) by the names of the command line."""
    rows = servoing.Rows(rows, len(arm.joints), third)
    if method == "report":
        return servoing.ReportServo(arm.joints, tolerance, rows), None
    servo = servoing.Servo(arm, servoing.models_of(method, arm), tolerance, seed, rows=rows)
    return servo, servoing.Stream(servo) if mode == "stream" else None


class _Runs(object):
    """Runs of one arm, each as ordered.

    Args:
        args: of the command line: what is the same in every run.
        arm, eyes, clock: as for VisualServoing.
    """

    def __init__(self, args, arm, eyes, clock):
        self._args, self._arm, self._eyes, self._clock = args, arm, eyes, clock
        self._told = {"error": None, "verdict": READY, "run": 0}
        self._learned = None  # orders and servo of a run that was a success

    def run(self, orders, number=1):
        """Do one run; its Verdict.

        Raises:
            ArmError: the log cannot be written; nothing has moved.
            LogLost, and what VisualServoing.run raises.
        """
        with contextlib.closing(_Log(self._args.log)) as log:
            return self._run(orders, number, log)

    def _run(self, orders, number, log):
        description = self._arm.description
        servo, stream = self._servo(orders)
        loop = VisualServoing(
            self._arm, self._eyes, self._clock, servo, orders.goals, stream, orders.budget,
            follow=orders.tolerance if orders.follow else None, log=log, say=_say,
            number=number,
        )  # fmt: skip
        log(
            OrderedDict(
                [
                    ("kind", "run"), ("version", 1), ("method", orders.method),
                    ("mode", orders.mode), ("arm", description.name),
                    ("joints", [joint.name for joint in description.joints]),
                    ("tolerance", orders.tolerance), ("budget", orders.budget),
                    ("goal", orders.goals or "marker"), ("rows", orders.rows),
                    ("clock", self._clock.now()),
                ]
            )
        )  # fmt: skip
        verdict = loop.run()
        self._told = dict(loop.progress(), verdict=verdict.word, reason=verdict.reason)
        success = verdict.word == servoing.CONVERGED and orders.method != "report"
        self._learned = (_kind(orders), (servo, stream)) if success else None
        return verdict

    def _servo(self, orders):
        """As make_servo; the one that has just been a success knows the way, and goes on."""
        if self._learned and self._learned[0] == _kind(orders):
            return self._learned[1]
        return make_servo(
            self._arm.description, orders.method, orders.mode, orders.tolerance,
            rows=orders.rows, third=self._args.third,
        )  # fmt: skip

    def wait(self):
        """Do a run for every Start of the laptop, one after the other; never returns.

        Between them the arm is held, and the laptop is told where it is and how the last run ended.

        Raises:
            Refusal: the tracker will never serve us.
        """
        number = 0
        _say("waiting for the laptop to say start")
        while True:
            self._eyes.look(WAIT)
            if self._eyes.refused:
                raise Refusal(self._eyes.why)
            orders = None
            for command in self._eyes.commands():
                orders = command if isinstance(command, Start) else None  # a Stop takes it back
            if orders is not None:
                number += 1
                self._obey(orders, number)
            self._eyes.report(self._where(), **self._told)

    def _obey(self, orders, number):
        """Do the run that is ordered, if that is possible; the arm is held."""
        try:
            check(orders, len(self._arm.description.joints))
            if not self._arm.homed:
                self._arm.wake()
            try:
                _say(in_words(self.run(orders, number)))
            finally:
                self._arm.park()
        except ArmError as error:
            if self._told["run"] < number:  # it has come to no run
                self._told = {
                    "error": None, "verdict": REFUSED, "reason": str(error), "run": number,
                }  # fmt: skip
            _say("{}: {}".format(self._told["verdict"], error))

    def _where(self):
        """The joints' angles, rad; none if a motor does not answer, of which a run would tell."""
        try:
            return self._arm.angles()
        except ArmError:
            return ()


def _kind(orders):
    """What a servo is made for."""
    return orders.method, orders.mode, orders.rows, orders.tolerance


def _run(parser, args):
    description = read_arm(find_arm(args.arm))
    goals = _fixed_goals(args.goal)
    if args.third and args.rows != "xyz":
        parser.error(
            "--third is the second camera's row with --rows xyz; add that, or leave it out"
        )
    orders = Start(
        args.method, args.mode, args.rows, args.tolerance, args.budget, args.follow,
        goals,
    )  # fmt: skip
    if args.wait and (orders != USUAL or args.low):
        parser.error(
            "with --wait the laptop orders each run, and the arm is held at its goal; leave all but"
            " HOST, --code, --arm, --third and --log out"
        )
    if args.low and all(joint.rest is None for joint in description.joints):
        parser.error("--low: {} does not say where it rests; leave it out".format(description.name))
    try:
        check(orders, len(description.joints))
    except BadOrders as error:
        parser.error(str(error))
    tracker = find_tracker(args.place, args.code)
    clock = Clock()
    arm = program.connect(description, clock)
    arm.wake()
    eyes = TrackingClient(*tracker, clock=clock, say=_say, battery=Battery(clock).volts)
    runs = _Runs(args, arm, eyes, clock)
    reached = False
    try:
        if args.wait:
            runs.wait()
        verdict = runs.run(orders)
        reached = verdict.word == servoing.CONVERGED
        if reached and args.low:
            arm.go_low()
    finally:
        program.ignore_signals()
        with contextlib.ExitStack() as last:
            last.callback(eyes.close, "the program has ended" if args.wait else "the run has ended")
            if not reached:
                last.enter_context(contextlib.suppress(ArmError))  # the first trouble is told
            arm.park()
    if not reached:
        raise NotReached(in_words(verdict))
    _say(in_words(verdict))


def main(argv=None):
    """Run one servo run; the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    argv = [" " + word if re.match(r"-\d", word) else word for word in argv]
    parser = _parser()
    args = parser.parse_args(argv)
    return program.run(parser.prog, lambda: _run(parser, args))


if __name__ == "__main__":
    sys.exit(main())
