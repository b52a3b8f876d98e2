"""Progress of a job on file, by which an interrupted drawing is resumed.

Ink stays, so a job that goes on must neither draw a line twice nor leave one out, and must meet
what is drawn already. It is written down with the pen up, before each stroke and after the last:
never in motion, where a write to the card could stop a control tick for as long as the card likes.

    stroke, repeat   the stroke is drawn again from its start if it was under way: after a crash
                     nobody knows how far it came, and a line drawn twice in one place harms less
                     than a gap. An ordered pause, on the contrary, goes on in mid-stroke (PenPath).
    crc              names the file: another job, or a job planned anew, never resumes this one
    zeros            counts at joint angle 0. Equal zeros: the arm is where it was to within the
                     encoders. Others: it was homed anew, and the whole drawing is shifted by what
                     homing missed; runner.max_offset tells how far, and a nudge corrects it.
    pen              the pen's trim, which was found by looking at the ink

A file is replaced in one step (write_whole): after a crash there is the old or the new one.
"""

import json
import os

from shared.arm_description import ArmError
from shared.config_files import InvalidFile, number, read_json, write_whole
from shared.record import record
from shared.state import JOBS_FOLDER, state_folder

MYPY = False
if MYPY:
    from typing import Dict, NamedTuple  # noqa: F401

    SavedProgress = NamedTuple(
        "SavedProgress",
        [("stroke", int), ("repeat", int), ("zeros", Dict[str, float]), ("pen", float)],
    )
else:
    SavedProgress = record("SavedProgress", "stroke repeat zeros pen")

SUFFIX = ".job"
"""Ending of the names of files in the folder of jobs."""

SavedProgress.__doc__ = """Place that a job has reached.

stroke  number of the next one to draw, from 1 on; one more than there are: all of this repeat's
        are drawn
repeat  number of the repeat, from 1 on
zeros   counts at joint angle 0, by port, as they were then
pen     depth that was added to the pen's, rad of its motor
"""


class NoJob(ArmError, OSError):
    """There is no such job, or nothing of it was begun."""


def jobs_folder():
    # type: () -> str
    """Return the folder of jobs, and of how far they have come."""
    return os.path.join(state_folder(), JOBS_FOLDER)


def find_job(name):
    # type: (str) -> str
    """Return the path of a job's file.

    Args:
        name: its path, or its name in the folder of jobs, with or without SUFFIX.

    Raises:
        NoJob: there is none.
    """
    stored = os.path.join(jobs_folder(), name if name.endswith(SUFFIX) else name + SUFFIX)
    for path in (name, stored):
        if os.path.isfile(path):
            return path
    if os.path.exists(name):
        return name  # its readers validate it
    raise NoJob("there is no job {}, here or in {}; see driver.py jobs".format(name, jobs_folder()))


def progress_file(crc):
    # type: (int) -> str
    """Return the path of the progress of a job, by the checksum of its contents."""
    return os.path.join(jobs_folder(), "{:08x}.progress".format(crc))


def save_progress(crc, progress):
    # type: (int, SavedProgress) -> None
    """Write a SavedProgress to the file of a job; raises OSError."""
    text = json.dumps(progress._asdict(), sort_keys=True)
    write_whole(progress_file(crc), text, sync=False)


def forget_progress(crc):
    # type: (int) -> None
    """Remove the progress of a job, which is done or begins anew."""
    if os.path.exists(progress_file(crc)):
        os.remove(progress_file(crc))


def load_progress(crc, strokes):
    # type: (int, int) -> SavedProgress
    """Return the SavedProgress on file of a job.

    Args:
        crc: checksum of the job.
        strokes: number of its strokes.

    Raises:
        NoJob: there is none, or it is invalid.
    """
    path = progress_file(crc)
    try:
        value = read_json(path)
        progress = SavedProgress(
            int(number(value["stroke"])),
            int(number(value["repeat"])),
            {str(port): number(zero) for port, zero in value["zeros"].items()},
            number(value["pen"]),
        )
        if not (1 <= progress.stroke <= strokes + 1 and progress.repeat >= 1):
            raise InvalidFile("tells of another job")
    except FileNotFoundError:
        raise NoJob(
            "nothing is known of this job that could be resumed: it was drawn to its end, or never "
            "begun; leave --resume out, or give --from"
        ) from None
    except OSError as error:
        raise NoJob("{}: {}; give --from instead".format(path, error.strerror)) from None
    except (InvalidFile, KeyError, TypeError, AttributeError) as error:
        what = str(error) if isinstance(error, InvalidFile) else "lacks something"
        raise NoJob("{} {}; give --from instead".format(path, what)) from None
    return progress
