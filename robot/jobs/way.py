"""The way of the pen from down to up, and where on it the arm is.  Pure."""

from robot.jobs.learned import check_way, merged
from robot.jobs.report import Place
from robot.motion import kinematics
from robot.motion.feed import rest_of, same_place, slowed
from robot.motion.trajectory import Trajectory

PIECES_PER_SEGMENT = 2
"""Straight parts of the wanted path, told to whoever watches, between two knots."""


class Way(object):
    """What is drawn from pen down to pen up: the pieces of one stroke, or of some that are joined.

    Args:
        job: shared.job.Job.
        k: number of the first stroke.
        chain: Strokes.
        repeat: which time the job is drawn.
        joints: the arm's.

    Attributes:
        pieces: (times, segments, end) of what is not drawn yet, with what was learned of it.

    Raises:
        BadJob: what was learned cannot be merged.
    """

    def __init__(self, job, k, chain, repeat, joints):
        self._repeat = repeat
        self.pieces, self._starts = [], []  # of each piece its stroke's number, and s and cm there
        self._planned = []  # the pieces without what was learned
        for n, stroke in enumerate(chain, k):
            self._planned += stroke.pieces
            learned = merged(job.path, n, stroke, joints, job.between)
            check_way(job.path, n, self.pieces, learned)
            seconds = sum([piece[0][-1] for piece in stroke.pieces])
            planned, cm = stroke.start_s, job.cm_before(n)
            for piece in learned:
                self.pieces.append(piece)
                speed = stroke.cm / seconds
                self._starts.append((n, planned, cm, speed))
                planned, cm = planned + piece[0][-1], cm + piece[0][-1] * speed

    def motions(self, share):
        """Trajectories of what is not drawn yet, at a share of the planned speed."""
        self._drawn = [slowed(p, share) for p in self.pieces] if share < 1.0 else self.pieces
        return [
            Trajectory(*drawn, turning=None if planned is piece else _in_time_of(drawn, planned)[1])
            for drawn, piece, planned in zip(self._drawn, self.pieces, self._planned)
        ]

    def place(self, index, tau):
        """The Place at the time `tau` (s) of a motion."""
        n, planned, cm, speed = self._starts[index]
        tau = max(same_place(self.pieces[index], self._drawn[index], tau), 0.0)
        return Place(self._repeat, n, cm + speed * tau, planned + tau)

    def end(self):
        """The Place where all of it is drawn."""
        return self.place(len(self.pieces) - 1, self._drawn[-1][0][-1])

    def cut(self, index, tau):
        """All before the time `tau` (s) of a motion is drawn."""
        tau = same_place(self.pieces[index], self._drawn[index], tau)
        rest, rest_planned = rest_of(self.pieces[index], tau), None
        if rest:
            same = self.pieces[index] is self._planned[index]
            rest_planned = rest
            if not same:
                rest_planned = _in_time_of(rest, rest_of(self._planned[index], tau))
        n, planned, cm, speed = self._starts[index]
        tau = max(tau, 0.0)
        first = [(n, planned + tau, cm + speed * tau, speed)] if rest else []
        self._starts = first + self._starts[index + 1 :]
        self.pieces = ([rest] if rest else []) + self.pieces[index + 1 :]
        self._planned = ([rest_planned] if rest else []) + self._planned[index + 1 :]

    def points(self, arm):
        """The tip's way, cm, as it is wished."""
        out = []
        for times, segments, _ in self._planned:
            for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
                whole = (t_end - t) * (v + 0.5 * a * (t_end - t))
                for n in range(PIECES_PER_SEGMENT):
                    s = whole * n / PIECES_PER_SEGMENT
                    q = [c0 + s * (c1 + s * (c2 + s * c3)) for c0, c1, c2, c3 in cubics]
                    out.append(kinematics.forward(arm, q))
        return out + [kinematics.forward(arm, self._planned[-1][2])]


def _in_time_of(piece, planned):
    """What a piece was without what was learned, at the speeds at which the piece is drawn."""
    times, segments, _ = piece
    now = [
        (v, a, cubics, across) for (v, a, _, _), (_, _, cubics, across) in zip(segments, planned[1])
    ]
    return times, now, planned[2]
