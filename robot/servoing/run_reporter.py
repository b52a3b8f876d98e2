"""Reports of a run: lines for people, and a log of dicts."""

import math
from collections import OrderedDict

from robot.servoing.linear_algebra import condition, length
from robot.servoing.measurement import error_of
from shared.record import record
from shared.verdicts import STALLED, STOPPED, TOO_SLOW

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Callable,
        Dict,
        Iterable,
        List,
        Mapping,
        NamedTuple,
        Optional,
        Sequence,
        Tuple,
        TypedDict,
    )

    from robot.servoing.decision import AnyServo, Decision  # noqa: F401
    from robot.servoing.image_model import Pixel, Pose  # noqa: F401
    from robot.servoing.loss_of_sight import Halt  # noqa: F401
    from robot.servoing.measurement import Measurement  # noqa: F401
    from shared.arm_description import ArmError  # noqa: F401

    Angles = Tuple[float, ...]  # rad
    Log = Callable[[Dict[str, object]], object]
    RunProgress = TypedDict(
        "RunProgress",
        {
            "error": Optional[float],
            "e": Dict[str, float],
            "condition": Optional[float],
            "moves": int,
            "run": int,
        },
    )

if MYPY:
    Verdict = NamedTuple(
        "Verdict",
        [
            ("word", str),
            ("reason", str),
            ("error", Optional[float]),
            ("q", Optional[Tuple[float, ...]]),
            ("moves", int),
            ("measurements", int),
            ("frames", int),
            ("seconds", float),
        ],
    )
else:
    Verdict = record("Verdict", "word reason error q moves measurements frames seconds")
Verdict.__doc__ = """End of a run.

Attributes:
    word: "converged", or why not.
    reason: in words for people; "" where the word says it all.
    error: distance of tip and goal in the image when last measured, px, or None.
    q: joint angles, rad, or None.
    moves: number of moves.
    measurements: number of measurements.
    frames: number of pictures received.
    seconds: duration, s.
"""


class RunReporter(object):
    """Reporter of one run, which counts its moves and measurements.

    Args:
        log: called with a dict per line of the log; None for none.
        say: called with each line of progress.
        number: of the run, for the laptop.

    Attributes:
        began: when the run began, s: times of the log are since then.
        logs: whether there is a log.
        moves: that the run has made.
        error: when last measured, px; None before.
    """

    def __init__(self, log=None, say=print, number=1):
        # type: (Optional[Log], Callable[[str], object], int) -> None
        self._log, self._say, self._number = log, say, number
        self.began = 0.0
        self.logs = log is not None
        self.moves = self._measurements = self._frames = 0
        self.error = None  # type: Optional[float]
        self._condition, self._e = None, {}  # type: Optional[float], Dict[str, float]

    def progress(self):
        # type: () -> RunProgress
        """Return the run's progress so far, as TrackingClient.report takes it."""
        return {
            "error": self.error, "e": self._e, "condition": self._condition,
            "moves": self.moves, "run": self._number,
        }  # fmt: skip

    def note_measured(self, frames):
        # type: (int) -> None
        """Count a measurement, and the frames that it took."""
        self._measurements += 1
        self._frames += frames

    def line(self, kind, t, **values):
        # type: (str, float, **object) -> None
        """Write a line of the log: what happened at t (s)."""
        if self._log is not None:
            line = OrderedDict(kind=kind)  # type: OrderedDict[str, object]
            line["t"] = round(t - self.began, 4)
            line.update(sorted(values.items()))
            self._log(line)

    def step(self, t, servo, q, measurements, decision, frames, computing):
        # type: (float, AnyServo, Pose, Sequence[Measurement], Decision, int, float) -> None
        """Log what was measured and decided, and print what the next move is.

        Args:
            t: when it was decided, s.
            servo: that decided.
            q: joint angles, rad (n).
            measurements: of the cameras in use.
            decision: Decision.
            frames: how many the measurement took.
            computing: how long the decision took, s.
        """
        self.error = length(error_of(measurements, servo.rows))
        unequal = condition(servo.J) if servo.J else None
        unequal = None if unequal == math.inf else unequal  # JSON knows no infinity
        names = servo.rows.names(m.camera for m in measurements)
        s = servo.rows.values({m.camera: m.s for m in measurements})
        goal = servo.rows.values({m.camera: m.goal for m in measurements})
        self._condition, self._e = unequal, {name: a - b for name, a, b in zip(names, s, goal)}
        self.line(
            "step", t, q=q, rows=names, s=s, goal=goal,
            error=self.error, sigma=servo.estimator.sigma, frames=frames,
            J=servo.J, condition=unequal, model=servo.using,
            action="hold" if decision.action == "end" else decision.action,
            q_wanted=decision.q, computing=computing,
        )  # fmt: skip
        if decision.q is not None:
            how = servo.using if decision.action == "move" else decision.action
            step = [b - a for a, b in zip(q, decision.q)]
            angles = " ".join("{:+.1f}".format(math.degrees(a)) for a in step)
            self._say(
                "move {}: {:.1f} px off, {}, {} deg".format(self.moves + 1, self.error, how, angles)
            )

    def note(self, t, text):
        # type: (float, str) -> None
        """Print a line, and log it with its time t (s)."""
        self._say(text)
        self.line("note", t, text=text)

    def frame(self, camera, t, q, s, goal):
        # type: (str, float, Optional[Angles], Optional[Pixel], Optional[Pixel]) -> None
        """Log a MarkerFrame's fields, s, rad and px; None is what is not known."""
        self.line("seen", t, camera=camera, q=q, s=s, goal=goal)

    def verdict(self, t, end, q):
        # type: (float, Halt, Optional[Angles]) -> Verdict
        """Return the Verdict of a run, and log it.

        Args:
            t: when the run ended, s.
            end: Halt that ended it.
            q: joint angles, rad (n), or None.
        """
        verdict = Verdict(
            end.word, end.reason, self.error, q, self.moves, self._measurements, self._frames,
            t - self.began,
        )  # fmt: skip
        self.line(
            "verdict", t, verdict=verdict.word, reason=verdict.reason, error=verdict.error,
            q=verdict.q, moves=verdict.moves, measurements=verdict.measurements,
            frames=verdict.frames,
        )  # fmt: skip
        return verdict


def verdict_text(verdict):
    # type: (Verdict) -> str
    """Return a Verdict as one line."""
    text = verdict.word
    if verdict.error is not None:
        text += ": {:.1f} px off".format(verdict.error)
    text += " after {} move{}, {:.1f} s".format(
        verdict.moves, "" if verdict.moves == 1 else "s", verdict.seconds
    )
    return text + (" ({})".format(verdict.reason) if verdict.reason else "")


def word_for(error):
    # type: (ArmError) -> str
    """Return the verdict's word that an ArmError comes to."""
    # Not above: the laptop, which has no motors, must report that in one line.
    from robot.ev3.motors import MotorNotFound
    from robot.motion.control_loop import Stalled, TooSlow

    if isinstance(error, TooSlow):
        return TOO_SLOW
    return STALLED if isinstance(error, (Stalled, MotorNotFound)) else STOPPED
