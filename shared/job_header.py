"""Header of a job: its first line, about the job as a whole.  Pure.

Lengths are cm, times s.
"""

from shared.config_files import InvalidFile, number
from shared.job_pieces import BadJob
from shared.message_fields import printable
from shared.record import record

MYPY = False
if MYPY:
    from typing import Any, Dict, Iterable, Sequence  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401
    from shared.records import JobHeader, Stroke  # noqa: F401

    __all__ = ["JobHeader"]
else:
    JobHeader = record(
        "JobHeader", "name arm chain links speed strokes cm pen_up_cm seconds log rest pens",
        defaults=(0.0, 0.0, ""),
    )  # fmt: skip

VERSION = 1
"""Version of the format; it rises when something in it changes its meaning."""

MAX_SECONDS = 1e6
"""Greatest time that a job may take, s: 11 days."""

MAX_CM = 1e6
"""Greatest length that a job may have, cm: the ink of a thousand pens."""

MAX_LINKS = 10
"""Greatest number of links."""

MAX_NAME = 60
"""Greatest length of a name, characters."""

LINK_TOLERANCE = 1e-6
"""Tolerance of a link's length, cm, between a job and the arm that draws it."""

PENS = ("", "change", "touch-up")
"""Ways to change pens between layers: none; pause before the next; pause over its first point,
too, where the pen can be nudged."""

LOG_PERIODS, MAX_REST = (0.01, 10.0), 30.0
"""Bounds of a log's period, and greatest rest after a stroke, s."""

JobHeader.__doc__ = """Header of a job.

name        for people
arm         name of the arm that it was planned for
chain       name of its kinematic chain
links       lengths of its links, cm
speed       greatest of the tip, cm/s
strokes     how many there are
cm          length of them all
pen_up_cm   length of the paths between them
seconds     planned for all of it
log         period of the log of the motors' angles, s (shared.job_log); 0: no log
rest        time that the arm stands after each stroke, pen up, logged, s; 0: none
pens        one of PENS
"""


def header_of(arm, name, speed, strokes, pen_up_cm, seconds):
    # type: (Arm, str, float, Sequence[Stroke], float, float) -> JobHeader
    """Return the JobHeader of Strokes for an Arm, without log, rest or change of pens.

    Args:
        arm: Arm.
        name: for people.
        speed: greatest of the tip, cm/s.
        strokes: Strokes.
        pen_up_cm: length of the paths between them, cm.
        seconds: planned for all of it.
    """
    return JobHeader(
        cut(name), arm.name, arm.chain, tuple(joint.link for joint in arm.joints), speed,
        len(strokes), sum(stroke.cm for stroke in strokes), pen_up_cm, seconds,
    )  # fmt: skip


def read_header(value, strokes):
    # type: (Dict[str, Any], int) -> JobHeader
    """Return the JobHeader in a line that was read.

    Args:
        value: the object that the line holds.
        strokes: number of lines of strokes that follow.

    Raises:
        InvalidFile: it is none.
        KeyError, TypeError: a field is missing, or of another type.
    """
    if value["job"] != VERSION:
        raise InvalidFile("has another format than {}, which this program knows".format(VERSION))
    name, arm, chain = [word(value[key]) for key in ("name", "arm", "chain")]
    if len(value["links"]) > MAX_LINKS:
        raise InvalidFile("has {} links, and {} are the most".format(
            len(value["links"]), MAX_LINKS
        ))  # fmt: skip
    links = tuple(number(link) for link in value["links"])
    speed, count, cm, pen_up_cm, seconds = numbers = [
        number(value[key]) for key in ("speed", "strokes", "cm", "pen_up_cm", "seconds")
    ]
    if count != strokes or count < 1 or min(numbers) < 0:
        raise InvalidFile("has another number of strokes than it says")
    if seconds > MAX_SECONDS:
        raise InvalidFile("takes {:.0f} s, and {:.0f} are the most".format(seconds, MAX_SECONDS))
    longest = max(cm, pen_up_cm)
    if longest > MAX_CM:
        raise InvalidFile("has {:.3g} cm to go, and {:g} are the most".format(longest, MAX_CM))
    # (Optional: files of older programs have none of these.)
    log, rest = [number(value.get(key, 0)) for key in ("log", "rest")]
    if log and not LOG_PERIODS[0] <= log <= LOG_PERIODS[1] or not 0 <= rest <= MAX_REST:
        raise InvalidFile("asks for a log or a rest as no brick keeps it")
    pens = value.get("pens", "")
    if pens not in PENS:
        raise InvalidFile("asks for a change of pens as no brick knows it")
    return JobHeader(
        name, arm, chain, links, speed, int(count), cm, pen_up_cm, seconds, log, rest, pens
    )


def check_arm(path, header, arm):
    # type: (str, JobHeader, Arm) -> None
    """Refuse an Arm for which the job at `path` was not planned.

    Args:
        path: of the job's file, for people.
        header: JobHeader.
        arm: Arm.

    Raises:
        BadJob: chain or links differ; it names both.
    """
    links = tuple(joint.link for joint in arm.joints)
    same = (
        header.chain == arm.chain
        and len(links) == len(header.links)
        and all(abs(a - b) <= LINK_TOLERANCE for a, b in zip(links, header.links))
    )
    if not same:
        raise BadJob(
            "{} was planned for {} ({}, links {} cm), and this arm is {} ({}, links {} cm); "
            "plan it for this one".format(
                path, header.arm, header.chain, _listed(header.links),
                arm.name, arm.chain, _listed(links),
            )
        )  # fmt: skip


def word(value):
    # type: (object) -> str
    """Return a name that was read, printable and cut; raise InvalidFile if it is no text."""
    if not isinstance(value, str):
        raise InvalidFile("has a name that is no text")
    return printable(cut(value))


def cut(name):
    # type: (str) -> str
    """Return a name cut to MAX_NAME."""
    return name[:MAX_NAME]


def _listed(values):
    # type: (Iterable[float]) -> str
    return ", ".join("{:g}".format(value) for value in values)
