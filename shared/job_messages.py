"""Messages about a job, a drawing that the brick draws alone.

The laptop offers a job by a Draw. The brick asks for it part after part, each a message that fits
a line, and draws it when it is complete. So the receiver paces the sender (stop-and-wait), and
observations pass between two parts. A lost link loses one part, which the brick asks for again.
"""

import base64
import binascii

from shared import message_fields as fields
from shared.arm_description import ArmError
from shared.job import MAX_SIZE
from shared.job_header import MAX_NAME
from shared.record import record

MYPY = False
if MYPY:
    from typing import Any, Callable, Dict, List, Sequence, Tuple  # noqa: F401

    from shared.records import Draw, JobLog, JobPart, JobStatus, Message, Order, Want

    __all__ = ["Draw", "JobLog", "JobPart", "JobStatus", "Order", "Want"]
    # A message's class, and its fields in the order of the line: (key, check).
    Kind = Tuple[Callable[..., Message], Tuple[Tuple[str, Callable[[Any], Any]], ...]]
else:
    Draw = record("Draw", "name size parts crc first alone dry", defaults=(1, False, False))
    Want = record("Want", "crc part")
    JobPart = record("JobPart", "crc part data")
    Order = record("Order", "what value")
    JobStatus = record("JobStatus", "t crc name state stroke strokes cm cm_all seconds down reason")
    JobLog = record("JobLog", "crc rows")

PART_SIZE = 1425
"""Size of a JobPart's share of the compressed job, bytes."""

MAX_PARTS = MAX_SIZE // PART_SIZE + 1
"""Greatest number of parts of a job."""

MAX_LOG_ROWS = 16
"""Greatest number of rows of a log in one JobLog."""

PAUSE, RESUME, ABORT, SPEED, PEN = "pause", "resume", "abort", "speed", "pen"
ORDERS = PAUSE, RESUME, ABORT, SPEED, PEN
"""Orders that the laptop may give while a job is drawn."""

RELATIVE_SPEED = 25.0, 100.0, "%"
"""Bounds and unit of the speed relative to the planned one."""

PEN_STEP = -30.0, 30.0, "deg"
"""Bounds and unit of the angle by which the pen's motor goes farther down than planned."""

FETCHING, DRAWING, PAUSED, DONE, ABORTED, FAILED = (
    "fetching", "drawing", "paused", "done", "aborted", "failed",
)  # fmt: skip
STATES = FETCHING, DRAWING, PAUSED, DONE, ABORTED, FAILED
"""States of a job on the brick."""
ENDS = DONE, ABORTED, FAILED
"""Final states of a job."""

Draw.__doc__ = """Offer of a job by the laptop, to be drawn at once.

name   for people
size   of its file, bytes
parts  number of its JobParts
crc    CRC-32 of its file, which names the job from here on
first  stroke to begin with, from 1 on
alone  whether drawing goes on when the link is lost; else it pauses until the link is back
dry    whether the pen stays up all the time
"""

Want.__doc__ = """Request of the brick for a part, from 0 on, of the offered job."""

JobPart.__doc__ = """Part of a job's compressed file (zlib), in base64: see part_of."""

Order.__doc__ = """Order of the laptop while a job is drawn.

what   one of ORDERS
value  for SPEED and PEN: RELATIVE_SPEED, PEN_STEP; else None
"""

JobStatus.__doc__ = """Progress of the brick with a job; sent only while there is one.

t          s on the sender's clock
crc, name  of the job
state      one of STATES
stroke     number of the current stroke, or the last one; 0 before the first
strokes    number of strokes
cm         length drawn so far
cm_all     length of the whole job, cm
seconds    remaining time; None while unknown
down       whether the pen is on the paper
reason     of the state, one line for people; "" for none
"""

JobLog.__doc__ = """Rows of the log of a job that asks for one.

crc   of the job
rows  list of the elements of shared.job_log.LogRow, t on the sender's clock
"""

CRC = fields.whole_number(0, 2**32 - 1)
PART = fields.whole_number(0, MAX_PARTS - 1)
STROKE = fields.whole_number(0, MAX_SIZE)
LENGTH = fields.number(0, 1e6, "cm", 2)
PLANNED = fields.number(0, 1e6, "s", 4)
_base64 = fields.matching(r"[A-Za-z0-9+/]{2,1900}={0,2}\Z", "at most 1900 letters of base64")


def _name(value):
    # type: (object) -> str
    name = fields.text(value)
    if len(name) > MAX_NAME:
        raise fields.WrongValue("at most {} printable characters".format(MAX_NAME))
    return name


def _one_of(choices):
    # type: (Sequence[str]) -> Callable[[object], str]
    def check(value):
        # type: (object) -> str
        if not isinstance(value, str) or value not in choices:
            raise fields.WrongValue("one of {}".format(", ".join(choices)))
        return value

    return check


def _rows(value):
    # type: (object) -> List[List[object]]
    if not isinstance(value, (list, tuple)) or len(value) > MAX_LOG_ROWS:
        raise fields.WrongValue("a list of at most {} rows".format(MAX_LOG_ROWS))
    return [_row(row) for row in value]


def _row(row):
    # type: (object) -> List[object]
    if not isinstance(row, (list, tuple)) or len(row) != 5:
        raise fields.WrongValue("rows of stroke, plan, t, rest and angles")
    stroke, plan, t, rest, q = row
    return [STROKE(stroke), PLANNED(plan), fields.TIME(t), fields.flag(rest), fields.angles(q)]


def _data(value):
    # type: (object) -> str
    data = _base64(value)
    try:
        base64.b64decode(data.encode("ascii"))
    except binascii.Error:
        raise fields.WrongValue("base64") from None
    return data


KINDS = {
    "draw": (
        Draw,
        (
            ("name", _name),
            ("size", fields.whole_number(1, MAX_SIZE)),
            ("parts", fields.whole_number(1, MAX_PARTS)),
            ("crc", CRC),
            ("first", fields.whole_number(1, MAX_SIZE)),
            ("alone", fields.flag),
            ("dry", fields.flag),
        ),
    ),
    "want": (Want, (("crc", CRC), ("part", PART))),
    "part": (JobPart, (("crc", CRC), ("part", PART), ("data", _data))),
    "order": (
        Order,
        (
            ("what", _one_of(ORDERS)),
            ("value", fields.or_none(fields.number(-1000, 1000, "", decimals=3))),
        ),
    ),
    "log": (JobLog, (("crc", CRC), ("rows", _rows))),
    "progress": (
        JobStatus,
        (
            ("t", fields.TIME),
            ("crc", CRC),
            ("name", _name),
            ("state", _one_of(STATES)),
            ("stroke", STROKE),
            ("strokes", STROKE),
            ("cm", LENGTH),
            ("cm_all", LENGTH),
            ("seconds", fields.or_none(fields.number(0, 1e6, "s", 1))),
            ("down", fields.flag),
            ("reason", fields.text),
        ),
    ),
}  # type: Dict[str, Kind]
"""Class and fields of each kind, as in shared.messages."""


class InvalidOrder(ArmError, ValueError):
    """An order that cannot be carried out."""


def check_order(order):
    # type: (Order) -> None
    """Refuse an Order whose value is missing or out of bounds.

    Raises:
        InvalidOrder: it names the value and the bounds.
    """
    limits = {SPEED: RELATIVE_SPEED, PEN: PEN_STEP}.get(order.what)
    if limits is None:
        return
    least, most, unit = limits
    if order.value is None or not least <= order.value <= most:
        raise InvalidOrder(
            "{} {}: give a number from {:g} to {:g} {}".format(
                order.what, order.value, least, most, unit
            ).rstrip()
        )


def part_of(packed, crc, part):
    # type: (bytes, int, int) -> JobPart
    """Cut a JobPart out of a job's compressed file.

    Args:
        packed: the compressed file, bytes.
        crc: CRC-32 of the file, not compressed.
        part: its number, from 0 on.
    """
    data = packed[part * PART_SIZE : (part + 1) * PART_SIZE]
    return JobPart(crc, part, base64.b64encode(data).decode("ascii"))


def bytes_of(part):
    # type: (JobPart) -> bytes
    """Return a JobPart's share of the compressed file."""
    return base64.b64decode(part.data.encode("ascii"))
