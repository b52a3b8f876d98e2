"""Jobs: drawings on file, written by the laptop, which the brick reads stroke by stroke.

Lines of JSON. The first is the JobHeader, then comes a line per Stroke, from pen down to pen up;
the last ends the file and holds the checksum of all before it:

    {"job": 1, "name": "rose", "arm": "planar", "chain": "planar", "links": [11.3, 9.5],
     "speed": 12, "strokes": 37, "cm": 412.3, "pen_up_cm": 80.1, "seconds": 312.5}
    {"cm": 12.3, "layer": "", "pieces": [[times, segments, end], ...], "start_s": 3.1, "stroke": 1}
    {"end": 37, "crc": 305419896}

A stroke may also have "offsets", corrections learned by camera: see robot.jobs.learned.
There is no space between the parts of a line, and its keys are sorted. Planning costs the brick
more time than drawing; so a piece, a smooth part of a stroke, is planned already: what
robot.motion.trajectory.Trajectory is made of. Where a piece ends the tip stands. Lengths are cm,
angles rad, times s.
"""

import json
import os
import zlib
from array import array

from shared.config_files import InvalidFile, check_replaceable, number, open_file, open_to_write
from shared.job_header import (
    MAX_CM,
    MAX_SECONDS,
    VERSION,
    JobHeader,
    check_arm,
    cut,
    header_of,  # noqa: F401 (for who writes a job)
    read_header,
    word,
)
from shared.job_pieces import BadJob, check_joined, check_joints, go_on, read_piece
from shared.record import record

MYPY = False
if MYPY:
    from typing import Any, Dict, Iterable, Iterator, List, NoReturn, Optional, Tuple  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401
    from shared.job_pieces import Between, Piece  # noqa: F401
    from shared.records import Offsets, Stroke

    __all__ = ["BadJob", "JobHeader", "Offsets", "Stroke", "header_of"]
else:
    Stroke = record("Stroke", "layer cm start_s pieces offsets", defaults=((),))

CM_PREFIX = b'{"cm":'
"""First bytes of a stroke's line, so that its length is found without parsing JSON."""

MAX_SIZE, MAX_LINE = 16000000, 600000
"""Greatest size of a file and of a line, bytes: of one stroke the brick has room for some MB."""

MAX_STROKES = 100000
"""Greatest number of strokes: a file of MAX_SIZE has no room for more that are drawn."""

MAX_DIGITS = 15
"""Greatest length of a whole number, digits: one as long as a line would take the brick minutes."""

MIN_PIECE_SECONDS = 0.05
"""Least time of a piece, s: the arm stands still before the next."""

MAX_TIME_RATIO, MAX_EXTRA_SECONDS = 1.1, 10.0
"""Greatest planned time of all strokes: the header's time, s, times a ratio, plus a constant, s."""

JOIN_TOLERANCE = 0.02
"""Greatest difference of a joint between two strokes that are drawn as one, rad: an encoder's
resolution."""

Stroke.__doc__ = """One stroke, from pen down to pen up.

layer       name of its layer, "" where it has none
cm          its length
start_s     when the pen is to come down on it, from the job's start
pieces      [(times, segments, end)], see robot.motion.trajectory.Trajectory
offsets     of each piece (lengths, joints): arc lengths from its beginning, cm, and per joint the
            corrections of its angle there, rad; () where nothing was learned
"""


def write_job(path, header, strokes):
    # type: (str, JobHeader, Iterable[Stroke]) -> None
    """Write a job, whole or not at all.

    Args:
        path: of the file.
        header: JobHeader.
        strokes: as many as the header says.

    Raises:
        BadJob: a stroke is too long for the brick, or a device or the like is there.
        OSError: there is no room.
    """
    try:
        check_replaceable(path)
    except InvalidFile as error:
        raise BadJob("{}: {}; choose another name".format(path, error)) from None
    draft = path + ".part"
    crc = size = 0
    try:
        with open(open_to_write(draft), "wb") as file:
            for line in _lines(header, strokes):
                size += len(line)
                if size > MAX_SIZE:
                    raise BadJob(
                        "it takes more than {:g} MB, which the brick has no room for; draw a part "
                        "of it, or simplify it".format(MAX_SIZE / 1e6)
                    )
                file.write(line)
                crc = zlib.crc32(line, crc)
            file.write(_line({"end": header.strokes, "crc": crc & 0xFFFFFFFF}))
        os.replace(draft, path)
    except BaseException:
        if os.path.exists(draft):
            os.remove(draft)
        raise


def _lines(header, strokes):
    # type: (JobHeader, Iterable[Stroke]) -> Iterator[bytes]
    values = dict(header._asdict(), job=VERSION)
    for key in ("log", "rest", "pens"):
        if not values[key]:
            del values[key]
    yield _line(values)
    for k, stroke in enumerate(strokes, 1):
        values = dict(stroke._asdict(), stroke=k, layer=cut(stroke.layer))
        line = _line({key: part for key, part in values.items() if key != "offsets" or part})
        if len(line) > MAX_LINE:
            raise BadJob(
                "stroke {} takes {} bytes, more than the brick's {}; lift the pen somewhere, or "
                "simplify it".format(k, len(line), MAX_LINE)
            )
        yield line


def _line(value):
    # type: (Dict[str, Any]) -> bytes
    return (json.dumps(value, sort_keys=True, separators=(",", ":")) + "\n").encode("ascii")


class Job(object):
    """Job on file, checked as a whole; its strokes are read and checked one by one.

    Args:
        path: of the file.
        arm: shared.arm_description.Arm that is to draw it; None: it is only read.

    Attributes:
        path: as given.
        header: JobHeader.
        crc: CRC-32 of its contents, which names the drawing.
        between: called repeatedly while a stroke is read: a long one takes the brick seconds.

    Raises:
        BadJob: it cannot be read, is damaged, or is for another arm.
    """

    def __init__(self, path, arm=None):
        # type: (str, Optional[Arm]) -> None
        self.path = path
        self._arm = arm
        self.between = go_on  # type: Between
        try:
            self._offsets, self._lengths, self.crc = self._scan()
            self.header = read_header(_object(self.line(0)), len(self._offsets) - 2)
            # CRC-32 of the line of each stroke that was found fit for the arm; 0: not yet
            self._fit = array("L", [0]) * len(self._offsets)
        except OSError as error:
            raise BadJob("{}: {}; give a job's file".format(path, error.strerror)) from None
        except (InvalidFile, ValueError, KeyError, TypeError, RecursionError) as error:
            raise self._bad(error) from None
        if arm:
            check_arm(path, self.header, arm)

    def stroke(self, k):
        # type: (int) -> Stroke
        """Read the k-th Stroke, from 1 on; check it, unless it was found fit as it is.

        Raises:
            BadJob: it was damaged or taken away meanwhile, or asks of the arm what that cannot do.
        """
        try:
            line = self.line(k)
            crc = zlib.crc32(line) & 0xFFFFFFFF
            value = _object(line)
            self.between()
            known = crc == self._fit[k]
            if known:
                pieces, offsets = value["pieces"], value.get("offsets", ())
            else:
                pieces, offsets = self._checked(k, value)
            stroke = Stroke(
                word(value["layer"]), number(value["cm"]), number(value["start_s"]), pieces, offsets
            )
        except OSError as error:
            raise BadJob("{}: {}; send it again".format(self.path, error.strerror)) from None
        except (InvalidFile, ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
            raise self._bad(error) from None
        if self._arm and not known:
            check_joints(self.path, k, pieces, self._arm.joints, self.between)
            self._fit[k] = crc
        return stroke

    def _checked(self, k, value):
        # type: (int, Dict[str, Any]) -> Tuple[List[Piece], List[Offsets]]
        """Return the pieces and offsets of a stroke that was read; raise if it is none."""
        if value["stroke"] != k:
            raise InvalidFile("has another stroke where {} should be".format(k))
        pieces = []
        for piece in value["pieces"]:
            pieces.append(read_piece(piece, len(self.header.links)))
            self.between()
        if not pieces:
            raise InvalidFile("has a stroke without a piece")
        if not 0 <= number(value["start_s"]) <= MAX_SECONDS:
            raise InvalidFile("has a stroke that begins after {:g} s".format(value["start_s"]))
        check_joined(pieces, self.between)
        return pieces, [_offsets(one, len(pieces[0][2])) for one in value.get("offsets", ())]

    def strokes(self):
        # type: () -> Iterator[Stroke]
        """Yield all Strokes in turn, each read and checked as by `stroke`.

        Raises:
            BadJob: as `stroke`; or they take longer than the header says of all.
        """
        planned = 0.0
        for k in range(1, self.header.strokes + 1):
            stroke = self.stroke(k)
            planned += sum([max(times[-1], MIN_PIECE_SECONDS) for times, _, _ in stroke.pieces])
            if planned > MAX_TIME_RATIO * self.header.seconds + MAX_EXTRA_SECONDS:
                raise self._bad(InvalidFile(
                    "says that it takes {:.0f} s, and by the end of stroke {} it takes {:.0f}"
                    "".format(self.header.seconds, k, planned)
                ))  # fmt: skip
            yield stroke

    def cm_before(self, k):
        # type: (int) -> float
        """Return the length of all strokes before the k-th, cm; k may be one past the last."""
        return sum(self._lengths[: k - 1])

    def stroke_at(self, share):
        # type: (float) -> int
        """Return the number of the stroke at this share, 0 to 1, of the total length."""
        target, k = share * self.cm_before(self.header.strokes + 1), 1
        while k < self.header.strokes and self.cm_before(k + 1) <= target:
            k += 1
        return k

    def size(self, k):
        # type: (int) -> int
        """Return the size of the k-th stroke's line, bytes."""
        return self._offsets[k + 1] - self._offsets[k]

    def _bad(self, error):
        # type: (Exception) -> BadJob
        what = str(error) if isinstance(error, InvalidFile) else "does not hold what a job holds"
        return BadJob("{} is no job, or is damaged: it {}; make it again".format(self.path, what))

    def _scan(self):
        # type: () -> Tuple[array[int], array[float], int]
        """Return (offset of each line; length of each stroke, cm; CRC-32 but for the end)."""
        # (As lists they would take the brick more memory than it has.)
        offsets, lengths = array("L"), array("d")
        crc, size, last = 0, 0, b""
        with open(open_file(self.path), "rb") as file:
            while True:
                line = file.readline(MAX_LINE + 1)
                if not line:
                    break
                if len(line) > MAX_LINE or size > MAX_SIZE or len(lengths) > MAX_STROKES:
                    raise InvalidFile("is longer than a job may be")
                if len(offsets) > 1:  # the one before is followed by another, so it is a stroke
                    lengths.append(_length(last))
                offsets.append(size)
                size += len(line)
                crc, last = zlib.crc32(last, crc), line
        end = _object(last)
        if "end" not in end or end["end"] != len(offsets) - 2:
            raise InvalidFile("is cut off")
        if end["crc"] != crc & 0xFFFFFFFF or not isinstance(end["crc"], int):
            raise InvalidFile("was changed on its way")
        if sum(lengths) > MAX_CM:
            raise InvalidFile("has {:.3g} cm of strokes, and {:g} are the most".format(
                sum(lengths), MAX_CM
            ))  # fmt: skip
        return offsets, lengths, end["crc"]

    def line(self, k):
        # type: (int) -> bytes
        """Return the line of the k-th stroke, from 1 on, as it stands in the file."""
        with open(open_file(self.path), "rb") as file:
            file.seek(self._offsets[k])
            return file.readline(MAX_LINE)


def _length(line):
    # type: (bytes) -> float
    """Return the length, cm, with which the line of a stroke begins."""
    length = (
        number(float(line[len(CM_PREFIX) : line.index(b",")]))
        if line.startswith(CM_PREFIX)
        else -1.0
    )
    if length < 0:
        raise InvalidFile("has a stroke that does not begin with its length")
    return length


def _object(line):
    # type: (bytes) -> Dict[str, Any]
    value = json.loads(line.decode("ascii"), parse_constant=_refuse, parse_int=_integer)
    if not isinstance(value, dict):
        raise InvalidFile("holds something else")
    return value


def _refuse(word):
    # type: (str) -> NoReturn
    raise InvalidFile("holds " + word)


def _integer(digits):
    # type: (str) -> int
    if len(digits) > MAX_DIGITS:
        raise InvalidFile("has a number beyond all bounds")
    return int(digits)


def _offsets(value, joints):
    # type: (Any, int) -> Offsets
    """Read the offsets of a piece: (arc lengths, cm; per joint corrections, rad)."""
    lengths, *by_joint = [[number(x) for x in own] for own in (value[0], *value[1])]
    if len(by_joint) != joints or any(len(own) != len(lengths) for own in by_joint):
        raise InvalidFile("has offsets of another arm")
    return lengths, by_joint
