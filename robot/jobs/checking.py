"""Checks that a job asks of the arm only what that can do, from its first stroke to last.  Pure.

The brick checks before anything moves, and so does the laptop that plans a job.

A job may be longer than the brick's memory, and a fault at its end would spoil the paper. So all of
it is read twice: once here, once while it is drawn. This pass reads one stroke after the other and
keeps two, the one at hand and the one before, whose end must meet the next begin where they join.
Of each stroke it checks, cheapest first:

    continuity    no joint jumps between pieces (shared.job_pieces) or joined strokes (learned)
    joint limits  angle, speed and acceleration, by bounds of each cubic, then roots (check_joints)
    the table     in space, the lowest of elbow and tip at samples along each segment (below)

A segment is q(s) = c0 + c1 s + c2 s^2 + c3 s^3, s in cm along the path. Its joints turn by at most
sum |c_n| s^n, the triangle inequality; only where that is large are there samples in between. The
exact lowest point would take the roots of a polynomial of sines. While a stroke is drawn, the next
ones are read ahead only with the pen up, see runner: to read one takes up to seconds.
"""

from robot.jobs.learned import check_continuity, merged
from robot.motion import kinematics
from shared.job import JOIN_TOLERANCE
from shared.job_pieces import BadJob

MYPY = False
if MYPY:
    from typing import Iterator, Optional, Sequence  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401
    from shared.job import Job, Stroke  # noqa: F401
    from shared.job_pieces import Piece  # noqa: F401

MAX_DEPTH = 0.5
"""Greatest depth of elbow and tip below the table on which the arm stands, cm: it knows no better
how high it stands, and paper may lie lower."""

SAMPLES, SMALL_TURN = 4, 0.05
"""Number of samples of a segment; and the turn of a joint, rad, up to which one is enough: from
there the arm goes no deeper than a centimetre."""


def check_strokes(job, arm):
    # type: (Job, Arm) -> Iterator[int]
    """Yield the number of each stroke, from 1 on, once it is found to be fit for the arm.

    Args:
        job: shared.job.Job for this arm.
        arm: shared.arm_description.Arm.

    Raises:
        BadJob: naming the first unfit stroke, and what it would need.
    """
    before = None  # type: Optional[Stroke]
    pieces = []  # type: Sequence[Piece]
    for k, stroke in enumerate(job.strokes(), 1):
        pieces = pieces if before is not None and joined(before, stroke) else []
        learned = merged(job.path, k, stroke, arm.joints, job.between)
        check_continuity(job.path, k, pieces, learned)
        if kinematics.coordinates(arm) == 3:
            _check_table(job, k, learned, arm)
        before, pieces = stroke, learned
        yield k


def joined(stroke, after):
    # type: (Stroke, Stroke) -> bool
    """Return whether a stroke begins where the one before ended, by the joints' angles."""
    begin = [cubic[0] for cubic in after.pieces[0][1][0][2]]
    return max([abs(a - b) for a, b in zip(stroke.pieces[-1][2], begin)]) <= JOIN_TOLERANCE


def _check_table(job, k, pieces, arm):
    # type: (Job, int, Sequence[Piece], Arm) -> None
    """Refuse pieces on which the elbow or the tip goes into the table."""
    for times, segments, end in pieces:
        job.between()
        poses = [end]
        for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
            s = (t_end - t) * (v + 0.5 * a * (t_end - t))
            turn = max([s * (abs(c1) + s * (abs(c2) + s * abs(c3))) for _, c1, c2, c3 in cubics])
            for n in range(SAMPLES if turn > SMALL_TURN else 1):
                x = s * n / SAMPLES
                poses.append([c0 + x * (c1 + x * (c2 + x * c3)) for c0, c1, c2, c3 in cubics])
        for q in poses:
            lowest = min([p[-1] for p in kinematics.joint_positions(arm, q)[1:]])
            if lowest < -MAX_DEPTH:
                raise BadJob(
                    "{}: stroke {} goes {:.1f} cm into the table; plan it for this arm as it is"
                    "".format(job.path, k, -lowest)
                )
