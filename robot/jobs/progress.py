"""What a job leaves on file: how far it has come, so that it goes on after a crash."""

import errno
import json
import os

from shared.arm_description import ArmError
from shared.record import record
from shared.small_files import InvalidFile, number, open_to_write, read_json
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
"""Of the files in the folder of jobs."""

SavedProgress.__doc__ = """How far a job has come.

stroke  the next one to draw, from 1 on; one more than there are: all of this time's are drawn
repeat  which time it is drawn, from 1 on
zeros   counts at joint angle 0, by port, as they were then
pen     how much deeper the pen came down, rad
"""


class NoJob(ArmError, OSError):
    """There is no such job, or nothing of it was begun."""


def jobs_folder():
    # type: () -> str
    """Where jobs are kept, and how far they have come."""
    return os.path.join(state_folder(), JOBS_FOLDER)


def find_job(name):
    # type: (str) -> str
    """Path of a job's file, given so, or by its name in the folder of jobs.

    Raises:
        NoJob: there is none.
    """
    kept = os.path.join(jobs_folder(), name if name.endswith(SUFFIX) else name + SUFFIX)
    for path in (name, kept):
        if os.path.isfile(path):
            return path
    if os.path.exists(name):
        return name  # whoever reads it says what it is
    raise NoJob("there is no job {}, here or in {}; see driver.py jobs".format(name, jobs_folder()))


def progress_file(crc):
    # type: (int) -> str
    """Path of the file of a job, by the checksum of its contents."""
    return os.path.join(jobs_folder(), "{:08x}.progress".format(crc))


def write_whole(path, text):
    # type: (str, str) -> None
    """Write a small file, whole or not at all; OSError where there is no room."""
    draft, data = path + ".part", text.encode("utf-8")
    file = open_to_write(draft)
    try:
        if os.write(file, data) < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        os.close(file)
    os.replace(draft, path)


def save_progress(crc, progress):
    # type: (int, SavedProgress) -> None
    """Put it on file; raises OSError."""
    path = progress_file(crc)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    write_whole(path, json.dumps(progress._asdict(), sort_keys=True))


def forget_progress(crc):
    # type: (int) -> None
    """The job is done, or begins anew."""
    if os.path.exists(progress_file(crc)):
        os.remove(progress_file(crc))


def load_progress(crc, strokes):
    # type: (int, int) -> SavedProgress
    """The SavedProgress on file of a job of so many strokes.

    Raises:
        NoJob: there is none, or it is spoilt.
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
