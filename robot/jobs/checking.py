"""Whether a job asks of the arm only what that can do, from its first stroke to its last.  Pure.

The brick asks before anything moves, and so does the laptop that plans a job.
"""

from robot.jobs.learned import check_way, merged
from robot.motion import kinematics
from shared.job import JOIN_TOLERANCE
from shared.job_pieces import BadJob

MYPY = False
if MYPY:
    from typing import Iterator, Optional, Sequence  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401
    from shared.job import Job, Stroke  # noqa: F401
    from shared.job_pieces import Piece  # noqa: F401

DEEPEST = 0.5
"""So far below the table on which the arm stands its elbow and tip may come, cm: it knows no better
how high it stands, and paper may lie lower."""

STAGES, SMALL_WAY = 4, 0.05
"""So many places of a segment are looked at, and one only where no joint turns by more, rad: from
there the arm goes no deeper than a centimetre."""


def check_strokes(job, arm):
    # type: (Job, Arm) -> Iterator[int]
    """Yield the number of each stroke, from 1 on, once it is found to be fit for the arm.

    Args:
        job: shared.job.Job for this arm.
        arm: shared.arm_description.Arm.

    Raises:
        BadJob: saying what the first one that is not would need.
    """
    before = None  # type: Optional[Stroke]
    pieces = []  # type: Sequence[Piece]
    for k, stroke in enumerate(job.strokes(), 1):
        pieces = pieces if before is not None and joined(before, stroke) else []
        learned = merged(job.path, k, stroke, arm.joints, job.between)
        check_way(job.path, k, pieces, learned)
        if kinematics.coordinates(arm) == 3:
            _check_table(job, k, learned, arm)
        before, pieces = stroke, learned
        yield k


def joined(stroke, after):
    # type: (Stroke, Stroke) -> bool
    """Whether a stroke begins where the one before ended."""
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
            way = max([s * (abs(c1) + s * (abs(c2) + s * abs(c3))) for _, c1, c2, c3 in cubics])
            for n in range(STAGES if way > SMALL_WAY else 1):
                x = s * n / STAGES
                poses.append([c0 + x * (c1 + x * (c2 + x * c3)) for c0, c1, c2, c3 in cubics])
        for q in poses:
            lowest = min([p[-1] for p in kinematics.joint_positions(arm, q)[1:]])
            if lowest < -DEEPEST:
                raise BadJob(
                    "{}: stroke {} goes {:.1f} cm into the table; plan it for this arm as it is"
                    "".format(job.path, k, -lowest)
                )
