"""The path of the pen from down to up, and where on it the arm is.  Pure.

A pause holds the plan at its own time tau (robot.motion.feed), pen up. To go on, the path is cut
there: the piece under way is replaced by its rest, begun at speed 0, on the same cubics. So the tip
comes down on the very point that it left, and speeds up from there. To plan the rest anew would
move it off its path by rounding, and take the brick seconds.

Offsets that a camera has taught are part of the pieces; `planned` holds the pieces without, for the
joints' turning points, where backlash is crossed. Both are cut together, so that they stay in step.
"""

from robot.jobs.learned import check_continuity, merged
from robot.jobs.report import Place
from robot.motion.feed import remaining, time_at_same_place, with_speed_limit
from robot.motion.trajectory import Trajectory

MYPY = False
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from shared.arm_description import Arm, Joint  # noqa: F401
    from shared.job import Job, Stroke  # noqa: F401
    from shared.job_pieces import Piece  # noqa: F401


class PenPath(object):
    """The path from pen down to pen up: the pieces of one stroke, or of some that are joined.

    Args:
        job: shared.job.Job.
        k: number of the first stroke, from 1 on.
        chain: shared.job.Strokes that are joined.
        repeat: number of the repeat, from 1 on.
        joints: the arm's shared.arm_description.Joints.

    Attributes:
        pieces: (times, segments, end) of what is not drawn yet, with what was learned of it.

    Raises:
        BadJob: what was learned cannot be merged.
    """

    def __init__(self, job, k, chain, repeat, joints):
        # type: (Job, int, Sequence[Stroke], int, Sequence[Joint]) -> None
        self._repeat = repeat
        self.pieces = []  # type: List[Piece]
        # of each piece its stroke's number, s and cm there, and its speed, cm/s
        self._starts = []  # type: List[Tuple[int, float, float, float]]
        self._planned = []  # type: List[Piece]  # the pieces without what was learned
        for n, stroke in enumerate(chain, k):
            self._planned += stroke.pieces
            learned = merged(job.path, n, stroke, joints, job.between)
            check_continuity(job.path, n, self.pieces, learned)
            seconds = sum([piece[0][-1] for piece in stroke.pieces])
            planned, cm = stroke.start_s, job.cm_before(n)
            for piece in learned:
                self.pieces.append(piece)
                speed = stroke.cm / seconds
                self._starts.append((n, planned, cm, speed))
                planned, cm = planned + piece[0][-1], cm + piece[0][-1] * speed

    def motions(self, share):
        # type: (float) -> List[Trajectory]
        """Return Trajectories of what is not drawn yet, at a share of the planned speed."""
        drawn = [with_speed_limit(p, share) for p in self.pieces] if share < 1.0 else self.pieces
        self._drawn = drawn  # type: List[Piece]
        return [
            Trajectory(*drawn, turning=None if planned is piece else _in_time_of(drawn, planned)[1])
            for drawn, piece, planned in zip(self._drawn, self.pieces, self._planned)
        ]

    def place(self, index, tau):
        # type: (int, float) -> Place
        """Return the Place at the time `tau` (s) of the motion of that index."""
        n, planned, cm, speed = self._starts[index]
        tau = max(time_at_same_place(self.pieces[index], self._drawn[index], tau), 0.0)
        return Place(self._repeat, n, cm + speed * tau, planned + tau)

    def end(self):
        # type: () -> Place
        """Return the Place where all of it is drawn."""
        return self.place(len(self.pieces) - 1, self._drawn[-1][0][-1])

    def cut(self, index, tau):
        # type: (int, float) -> None
        """Cut off what is drawn: all before the time `tau` (s) of the motion of that index."""
        tau = time_at_same_place(self.pieces[index], self._drawn[index], tau)
        piece, planned = self.pieces[index], self._planned[index]
        rest = remaining(piece, tau)  # type: Optional[Piece]
        n, seconds, cm, speed = self._starts[index]
        self._starts = self._starts[index + 1 :]
        self.pieces = self.pieces[index + 1 :]
        self._planned = self._planned[index + 1 :]
        if rest is None:
            return
        planned_rest = None if planned is piece else remaining(planned, tau)  # type: Optional[Piece]
        tau = max(tau, 0.0)
        self._starts.insert(0, (n, seconds + tau, cm + speed * tau, speed))
        self.pieces.insert(0, rest)
        self._planned.insert(0, rest if planned_rest is None else _in_time_of(rest, planned_rest))


def _in_time_of(piece, planned):
    # type: (Piece, Piece) -> Piece
    """Return a piece without what was learned, at the speeds at which `piece` is drawn."""
    times, segments, _ = piece
    now = [
        (v, a, cubics, across) for (v, a, _, _), (_, _, cubics, across) in zip(segments, planned[1])
    ]
    return times, now, planned[2]
