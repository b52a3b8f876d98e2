"""States of a job, for browsers."""

from __future__ import annotations

from laptop.page.drawing_snapshots import JobState
from shared.job_messages import ENDS, FAILED, FETCHING, JobStatus


def unreported_state(name: str, is_over: bool) -> JobState:
    """Return the state of a job that was offered, and of which the brick has reported nothing.

    Args:
        name: of the job.
        is_over: whether it is too late for a report.
    """
    if is_over:
        why = "the brick did not begin; does its program run with --wait?"
        return JobState(name, FAILED, 0.0, 0, 0, 0.0, 0.0, None, why, False)
    return JobState(name, FETCHING, 0.0, 0, 0, 0.0, 0.0, None, "", True)


def reported_state(progress: JobStatus, is_lost: bool, alone: bool) -> JobState:
    """Return the state of a job by the brick's last report.

    Args:
        progress: that report.
        is_lost: there is no link now.
        alone: the job goes on without one.
    """
    reason = progress.reason
    is_on = progress.state not in ENDS
    if is_lost and is_on:
        reason = "the link is lost; " + (
            "it goes on by itself" if alone else "it pauses with the pen up until that is back"
        )
    return JobState(
        progress.name,
        progress.state,
        progress.cm / progress.cm_all if progress.cm_all else 0.0,
        progress.stroke,
        progress.strokes,
        progress.cm,
        progress.cm_all,
        progress.seconds,
        reason,
        is_on,
    )
