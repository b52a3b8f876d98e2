"""What a run tells: lines for people, and a log of dicts."""

import math
from collections import OrderedDict

from shared.record import record

Verdict = record("Verdict", "word reason error q moves measurements frames seconds")
Verdict.__doc__ = """How a run ended.

word          "converged", or why not
reason        in words for people; "" where the word says it all
error         distance of tip and goal in the image when last measured, px, or None
q             joint angles, rad, or None
moves, measurements, frames, seconds   what it took
"""


class Teller(object):
    """Tells of one run.

    Args:
        log: called with a dict per line of the log; None for none.
        say: called with each line of progress.

    Attributes:
        began: when the run began, s: times of the log are since then.
        logs: whether there is a log.
    """

    def __init__(self, log, say):
        self._log, self._say = log, say
        self.began = 0.0
        self.logs = log is not None

    def line(self, kind, t, **values):
        """Write a line of the log: what happened at t (s)."""
        if self.logs:
            line = OrderedDict([("kind", kind), ("t", round(t - self.began, 4))])
            line.update(sorted(values.items()))
            self._log(line)

    def note(self, t, text):
        """Say a line, and log it."""
        self._say(text)
        self.line("note", t, text=text)

    def frame(self, frame):
        """Log a MarkerFrame."""
        self.line("seen", frame.t, camera=frame.camera, q=frame.q, s=frame.s, goal=frame.goal)

    def move(self, number, error, how, step):
        """Say what the next move is: px, the model or why, rad."""
        angles = " ".join("{:+.1f}".format(math.degrees(a)) for a in step)
        self._say("move {}: {:.1f} px off, {}, {} deg".format(number, error, how, angles))

    def verdict(self, t, verdict):
        """Log how it ended."""
        self.line(
            "verdict", t, verdict=verdict.word, reason=verdict.reason, error=verdict.error,
            q=verdict.q, moves=verdict.moves, measurements=verdict.measurements,
            frames=verdict.frames,
        )  # fmt: skip


def in_words(verdict):
    """A Verdict as one line."""
    text = verdict.word
    if verdict.error is not None:
        text += ": {:.1f} px off".format(verdict.error)
    text += " after {} move{}, {:.1f} s".format(
        verdict.moves, "" if verdict.moves == 1 else "s", verdict.seconds
    )
    return text + (" ({})".format(verdict.reason) if verdict.reason else "")
