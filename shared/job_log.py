"""Log of a job: the joints' angles by the motors' encoders, over time.

Lines of comma-separated values, written while the pen is up; the first names them:

    stroke,plan,t,rest,q1,q2
    1,0.05,103.21,0,0.52360,0.69813
"""

from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_text
from shared.record import record

MYPY = False
if MYPY:
    from typing import List  # noqa: F401

    from shared.config_files import AnyPath  # noqa: F401
    from shared.records import LogRow

    __all__ = ["LogRow"]
else:
    LogRow = record("LogRow", "stroke plan t rest q")

LogRow.__doc__ = """One row of a log.

stroke  of the job, from 1 on
plan    planned time from the job's start, s: the stroke's start_s and the time within the stroke
t       s on the sender's clock
rest    whether the arm stood still there, after the stroke
q       the joints' angles by their motors' encoders, rad, not corrected for backlash
"""

MAX_LOG_SIZE = 4000000
"""Greatest size of a log, bytes."""


class BadLog(ArmError, ValueError):
    """A file that is no log of a job."""


def heading(joints):
    # type: (int) -> str
    """Return the first line, with its newline; `joints` is the number of joints."""
    names = ["q{}".format(k) for k in range(1, joints + 1)]
    return ",".join(["stroke", "plan", "t", "rest"] + names) + "\n"


def line_of(row):
    # type: (LogRow) -> str
    """Return the line of a LogRow, with its newline."""
    values = ["{:.6f}".format(angle) for angle in row.q]
    text = "{:d},{:.4f},{:.4f},{:d},".format(row.stroke, row.plan, row.t, bool(row.rest))
    return text + ",".join(values) + "\n"


def read_log(path):
    # type: (AnyPath) -> List[LogRow]
    """Read the LogRows of a file.

    Raises:
        BadLog: it cannot be read, or is no log.
    """
    try:
        lines = read_text(path, MAX_LOG_SIZE).split("\n")
        joints = lines[0].count(",") - 3
        if joints < 1 or lines[0] + "\n" != heading(joints):
            raise InvalidFile("does not begin as a log does")
        # (A last line that a crash cut off has no newline, and is left out.)
        return [_row(line, joints) for line in lines[1:-1]]
    except OSError as error:
        raise BadLog("{}: {}; give a job's log".format(path, error.strerror)) from None
    except InvalidFile as problem:
        raise BadLog("{}: it {}; log the job anew".format(path, problem)) from None


def _row(line, joints):
    # type: (str, int) -> LogRow
    values = line.split(",")
    try:
        stroke, rest = int(values[0]), int(values[3])
        numbers = [float(value) for value in values[1:3] + values[4:]]
    except (ValueError, IndexError):
        stroke, rest, numbers = 0, 0, []
    if stroke < 1 or rest not in (0, 1) or len(numbers) != 2 + joints:
        raise InvalidFile("holds the line '{}'".format(line[:40]))
    if not all(abs(value) < 1e9 for value in numbers):
        raise InvalidFile("holds a number that is none")
    return LogRow(stroke, numbers[0], numbers[1], bool(rest), tuple(numbers[2:]))
