"""A drawing that the brick draws alone: its file, written by the laptop, read stroke by stroke.

Lines of JSON. The first is the JobHeader, then comes a line per Stroke, from pen down to pen up;
the last ends the file and holds the checksum of all before it:

    {"job": 1, "name": "rose", "arm": "planar", "chain": "planar", "links": [11.3, 9.5],
     "speed": 12, "strokes": 37, "cm": 412.3, "pen_up_cm": 80.1, "seconds": 312.5}
    {"cm": 12.3, "layer": "", "pieces": [[times, segments, end], ...], "start_s": 3.1, "stroke": 1}
    {"end": 37, "crc": 305419896}

A stroke may have "offsets" beside: what a camera has taught of it, see robot.jobs.learned.
There is no space between the parts of a line, and its keys are sorted. Planning costs the brick
more time than drawing; so a piece, a smooth part of a stroke, is planned already: what
robot.motion.trajectory.Trajectory is made of. Where a piece ends the tip stands. Lengths are cm,
angles rad, times s.
"""

import json
import os
import zlib
from array import array

from shared.job_pieces import BadJob, check_joined, check_joints, go_on, read_piece
from shared.message_fields import printable
from shared.record import record
from shared.small_files import SpoiltFile, check_replaceable, number, open_file, open_to_write

VERSION = 1
"""Of the format; it rises when something in it changes its meaning."""

CM = b'{"cm":'
"""So the line of a stroke begins, which then need not be read for its length."""

MAX_SIZE, MAX_LINE = 16000000, 600000
"""Greatest size of a file and of a line, bytes: of one stroke the brick has room for some MB."""

MAX_STROKES = 100000
"""Greatest number of strokes: a file of MAX_SIZE has no room for more that are drawn."""

MAX_DIGITS = 15
"""Greatest length of a whole number: to read one of a whole line would take the brick minutes."""

MAX_SECONDS = 1e6
"""Greatest time that a job may take, s: 11 days."""

MAX_CM = 1e6
"""Greatest length that a job may have, cm: the ink of a thousand pens."""

MAX_LINKS = 10
"""No arm has more."""

PIECE_SECONDS = 0.05
"""A piece takes at the least so long, s: the arm stands before the next."""

MORE, MORE_SECONDS = 1.1, 10.0
"""All strokes together are planned to take at the most so many times, and s, what the header says
of the whole job."""

MAX_NAME = 60
"""Greatest length of a name, characters."""

JOINED = 0.02
"""A stroke begins where the last one ended, and the pen stays down, if no joint differs by more,
rad: it is no more than an encoder shows."""

LINK_TOLERANCE = 1e-6
"""Links differ where they differ by more, cm."""

PENS = ("", "change", "touch-up")
"""How a job of several pens, one for each layer, has them changed: not; it waits before the next;
and waits over its first point, too, where it can be nudged."""

LOG_PERIODS, MAX_REST = (0.01, 10.0), 30.0
"""Bounds of a log's period, and greatest rest after a stroke, s."""

JobHeader = record(
    "JobHeader", "name arm chain links speed strokes cm pen_up_cm seconds log rest pens",
    defaults=(0.0, 0.0, ""),
)  # fmt: skip
JobHeader.__doc__ = """What a job is.

name        for people
arm         name of the arm that it was planned for
chain       name of its kinematic chain
links       lengths of its links, cm
speed       greatest of the tip, cm/s
strokes     how many there are
cm          length of them all
pen_up_cm   length of the ways between them
seconds     that the brick is to take for all of it
log         the brick logs so often where its motors are, s (shared.job_log); 0: never
rest        after each stroke the arm stands so long, pen up, and that is logged, s; 0: it does not
pens        one of PENS
"""

Stroke = record("Stroke", "layer cm start_s pieces offsets", defaults=((),))
Stroke.__doc__ = """From pen down to pen up.

layer       name of its layer, "" where it has none
cm          its length
start_s     when the pen is to come down on it, from the job's start
pieces      [(times, segments, end)], see robot.motion.trajectory.Trajectory
offsets     of each piece (ways, joints): lengths of the way from its beginning, cm, and per joint
            by how much its angle is moved at these, rad; of a stroke without, there are none
"""


def header_of(arm, name, speed, strokes, pen_up_cm, seconds, log=0.0, rest=0.0, pens=""):
    """The JobHeader of Strokes for an Arm."""
    return JobHeader(
        _cut(name), arm.name, arm.chain, tuple(joint.link for joint in arm.joints), speed,
        len(strokes), sum(stroke.cm for stroke in strokes), pen_up_cm, seconds, log, rest, pens,
    )  # fmt: skip


def write_job(path, header, strokes):
    """Write a job, whole or not at all.

    Raises:
        BadJob: a stroke is too long for the brick, or a device or the like is there.
        OSError: there is no room.
    """
    try:
        check_replaceable(path)
    except SpoiltFile as error:
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
    told = dict(header._asdict(), job=VERSION)
    for key in ("log", "rest", "pens"):
        if not told[key]:
            del told[key]
    yield _line(told)
    for k, stroke in enumerate(strokes, 1):
        told = dict(stroke._asdict(), stroke=k, layer=_cut(stroke.layer))
        line = _line({key: part for key, part in told.items() if key != "offsets" or part})
        if len(line) > MAX_LINE:
            raise BadJob(
                "stroke {} takes {} bytes, more than the brick's {}; lift the pen somewhere, or "
                "simplify it".format(k, len(line), MAX_LINE)
            )
        yield line


def _line(value):
    return (json.dumps(value, sort_keys=True, separators=(",", ":")) + "\n").encode("ascii")


class Job(object):
    """A job on file, checked as a whole; its strokes are read and checked one by one.

    Args:
        path: of the file.
        arm: shared.arm_description.Arm that is to draw it; None: whoever asks draws nothing.

    Attributes:
        path: as given.
        header: JobHeader.
        crc: of its contents; another drawing has another one.
        between: called now and then while a stroke is read: a long one takes the brick seconds.

    Raises:
        BadJob: it cannot be read, is damaged, or is for another arm.
    """

    def __init__(self, path, arm=None):
        self.path = path
        self._arm = arm
        self.between = go_on
        try:
            self._offsets, self._lengths, self.crc = self._scan()
            self.header = self._read_header()
        except OSError as error:
            raise BadJob("{}: {}; give a job's file".format(path, error.strerror)) from None
        except (SpoiltFile, ValueError, KeyError, TypeError, RecursionError) as error:
            raise self._bad(error) from None
        if arm:
            self._check_arm(arm)

    def stroke(self, k):
        """The k-th Stroke, from 1 on.

        Raises:
            BadJob: it was damaged or taken away meanwhile, or asks of the arm what that cannot do.
        """
        try:
            value = self._parsed(k)
            self.between()
            if value["stroke"] != k:
                raise SpoiltFile("has another stroke where {} should be".format(k))
            pieces = []
            for piece in value["pieces"]:
                pieces.append(read_piece(piece, len(self.header.links)))
                self.between()
            if not pieces:
                raise SpoiltFile("has a stroke without a piece")
            offsets = [_offsets(one, len(pieces[0][2])) for one in value.get("offsets", ())]
            cm, start_s = number(value["cm"]), number(value["start_s"])
            if not 0 <= start_s <= MAX_SECONDS:
                raise SpoiltFile("has a stroke that begins after {:g} s".format(start_s))
            stroke = Stroke(_word(value["layer"]), cm, start_s, pieces, offsets)
            check_joined(pieces, self.between)
        except OSError as error:
            raise BadJob("{}: {}; send it again".format(self.path, error.strerror)) from None
        except (SpoiltFile, ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
            raise self._bad(error) from None
        if self._arm:
            check_joints(self.path, k, pieces, self._arm.joints, self.between)
        return stroke

    def strokes(self):
        """Yield all Strokes in turn, each read and checked as by `stroke`.

        Raises:
            BadJob: as `stroke`; or they take longer than the header says of all.
        """
        planned = 0.0
        for k in range(1, self.header.strokes + 1):
            stroke = self.stroke(k)
            planned += sum([max(times[-1], PIECE_SECONDS) for times, _, _ in stroke.pieces])
            if planned > MORE * self.header.seconds + MORE_SECONDS:
                raise self._bad(SpoiltFile(
                    "says that it takes {:.0f} s, and by the end of stroke {} it takes {:.0f}"
                    "".format(self.header.seconds, k, planned)
                ))  # fmt: skip
            yield stroke

    def cm_before(self, k):
        """Length of all strokes before the k-th, cm; k from 1 on, also one past the last."""
        return sum(self._lengths[: k - 1])

    def stroke_at(self, share):
        """Number of the stroke that lies at this share, 0 to 1, of the length of all."""
        sought, k = share * self.cm_before(self.header.strokes + 1), 1
        while k < self.header.strokes and self.cm_before(k + 1) <= sought:
            k += 1
        return k

    def size(self, k):
        """What the k-th stroke takes of the file, bytes."""
        return self._offsets[k + 1] - self._offsets[k]

    def _bad(self, error):
        what = str(error) if isinstance(error, SpoiltFile) else "does not hold what a job holds"
        return BadJob("{} is no job, or is damaged: it {}; make it again".format(self.path, what))

    def _scan(self):
        """(offset of each line, lengths of the strokes, checksum of all but the last line)."""
        # (As lists they would take the brick more memory than it has.)
        offsets, lengths = array("L"), array("d")
        crc, size, last = 0, 0, b""
        with open(open_file(self.path), "rb") as file:
            while True:
                line = file.readline(MAX_LINE + 1)
                if not line:
                    break
                if len(line) > MAX_LINE or size > MAX_SIZE or len(lengths) > MAX_STROKES:
                    raise SpoiltFile("is longer than a job may be")
                if len(offsets) > 1:  # the one before is followed by another, so it is a stroke
                    lengths.append(_length(last))
                offsets.append(size)
                size += len(line)
                crc, last = zlib.crc32(last, crc), line
        end = _object(last)
        if "end" not in end or end["end"] != len(offsets) - 2:
            raise SpoiltFile("is cut off")
        if end["crc"] != crc & 0xFFFFFFFF or not isinstance(end["crc"], int):
            raise SpoiltFile("was changed on its way")
        if sum(lengths) > MAX_CM:
            raise SpoiltFile("has {:.3g} cm of strokes, and {:g} are the most".format(
                sum(lengths), MAX_CM
            ))  # fmt: skip
        return offsets, lengths, end["crc"]

    def _parsed(self, k):
        with open(open_file(self.path), "rb") as file:
            file.seek(self._offsets[k])
            return _object(file.readline(MAX_LINE))

    def _read_header(self):
        value = self._parsed(0)
        if value["job"] != VERSION:
            raise SpoiltFile("has another format than {}, which this program knows".format(VERSION))
        words = [_word(value[key]) for key in ("name", "arm", "chain")]
        if len(value["links"]) > MAX_LINKS:
            raise SpoiltFile("has {} links, and {} are the most".format(
                len(value["links"]), MAX_LINKS
            ))  # fmt: skip
        links = tuple(number(link) for link in value["links"])
        numbers = [number(value[key]) for key in ("speed", "strokes", "cm", "pen_up_cm", "seconds")]
        if numbers[1] != len(self._offsets) - 2 or numbers[1] < 1 or min(numbers) < 0:
            raise SpoiltFile("has another number of strokes than it says")
        if numbers[4] > MAX_SECONDS:
            raise SpoiltFile("takes {:.0f} s, and {:.0f} are the most".format(
                numbers[4], MAX_SECONDS
            ))  # fmt: skip
        if max(numbers[2:4]) > MAX_CM:
            raise SpoiltFile("has {:.3g} cm to go, and {:g} are the most".format(
                max(numbers[2:4]), MAX_CM
            ))  # fmt: skip
        numbers[1] = int(numbers[1])
        # (Programs that know none of these leave them out, and all others where there is none.)
        log, rest = [number(value.get(key, 0)) for key in ("log", "rest")]
        if log and not LOG_PERIODS[0] <= log <= LOG_PERIODS[1] or not 0 <= rest <= MAX_REST:
            raise SpoiltFile("asks for a log or a rest as no brick keeps it")
        pens = value.get("pens", "")
        if pens not in PENS:
            raise SpoiltFile("asks for a change of pens as no brick knows it")
        return JobHeader(*(words + [links] + numbers + [log, rest, pens]))

    def _check_arm(self, arm):
        links = tuple(joint.link for joint in arm.joints)
        header = self.header
        same = (
            header.chain == arm.chain
            and len(links) == len(header.links)
            and all(abs(a - b) <= LINK_TOLERANCE for a, b in zip(links, header.links))
        )
        if not same:
            raise BadJob(
                "{} was planned for {} ({}, links {} cm), and this arm is {} ({}, links {} cm); "
                "plan it for this one".format(
                    self.path, header.arm, header.chain, _listed(header.links),
                    arm.name, arm.chain, _listed(links),
                )
            )  # fmt: skip


def _length(line):
    """The length, cm, with which the line of a stroke begins."""
    length = number(float(line[len(CM) : line.index(b",")])) if line.startswith(CM) else -1.0
    if length < 0:
        raise SpoiltFile("has a stroke that does not begin with its length")
    return length


def _word(value):
    """A name, for people."""
    if not isinstance(value, str):
        raise SpoiltFile("has a name that is no text")
    return printable(_cut(value))


def _cut(name):
    return name[:MAX_NAME]


def _listed(values):
    return ", ".join("{:g}".format(value) for value in values)


def _object(line):
    value = json.loads(line.decode("ascii"), parse_constant=_refuse, parse_int=_whole)
    if not isinstance(value, dict):
        raise SpoiltFile("holds something else")
    return value


def _refuse(word):
    raise SpoiltFile("holds " + word)


def _whole(digits):
    if len(digits) > MAX_DIGITS:
        raise SpoiltFile("has a number beyond all bounds")
    return int(digits)


def _offsets(value, joints):
    """(ways, joints) as a Stroke has them, of numbers only."""
    ways, *by_joint = [[number(x) for x in own] for own in (value[0], *value[1])]
    if len(by_joint) != joints or any(len(own) != len(ways) for own in by_joint):
        raise SpoiltFile("has offsets of another arm")
    return ways, by_joint
