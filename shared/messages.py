"""What laptop and brick tell each other: one JSON object per line; bytes in, messages out.

    {"kind":"observation","camera":"A","seq":7,"t":12.5,"markers":{"effector":[u,v,c],"goal":null}}

Rules: every value is checked the same way when it is sent and when it arrives. Keys that are not
known are ignored, so that a later version may add some; kinds that are not known are refused.
"""

import collections
import functools
import json
import re

from shared.arm_description import ArmError
from shared.record import record

VERSION = 2
"""Raised whenever the other side would misunderstand; `hello` keeps its form in every version."""

PORT = 7711
"""Where the laptop listens if nothing else is said."""

MAX_LINE = 2048
"""Bytes of a line, without its newline."""

MAX_MARKERS = 16
MAX_CAMERAS = 8
MAX_JOINTS = 8
MAX_TEXT = 200

STATUS_PERIOD = 0.2
"""Between two Statuses, s, but for one that is final."""

TOLERANCE = 0.5, 200.0, "px"
BUDGET = 1.0, 3600.0, "s"
"""What may be ordered: from, to, unit."""

EFFECTOR, GOAL = "effector", "goal"
"""Names of the markers: on the arm's tip, and where it is to get."""

LEAST_CONFIDENCE = 0.5
"""A sighting with less may be something else: nothing is done by it."""

BRICK = "brick"
"""The role of the side that connects."""
LAPTOP = "laptop"
"""The role of the side that listens."""


class BadMessage(ArmError, ValueError):
    """A line that is no message, or a message that must not be sent."""


Hello = record("Hello", "version role nonce")
Hello.__doc__ = """The first line of the side that connects.

version  VERSION of the sender
role     BRICK
nonce    32 hex digits, new for every connection
"""

Challenge = record("Challenge", "nonce")
Challenge.__doc__ = """The answer to a Hello: 32 hex digits, new for every connection."""

Proof = record("Proof", "proof")
Proof.__doc__ = """That the brick knows the pairing code: 64 hex digits (shared.pairing)."""

Welcome = record("Welcome", "proof")
Welcome.__doc__ = """That the laptop knows it too, and serves the brick from now on."""

Refused = record("Refused", "cause reason wait")
Refused.__doc__ = """The laptop does not serve the sender.

cause   "version" | "code" (trying again is no use) | "busy" | "wait"
reason  one line for people
wait    trying again sooner is no use, s
"""

Ping = record("Ping", "id")
Ping.__doc__ = """Asks for a Pong of the same id."""

Pong = record("Pong", "id received sent")
Pong.__doc__ = """When the Ping came in and when this went out, s on the sender's clock."""

Observation = record("Observation", "seq camera t markers")
Observation.__doc__ = """What one frame of one camera shows.

seq      rises from frame to frame
camera   short name: "A", "B", ...
t        capture time, s on the sender's clock
markers  {name: (u, v, confidence), or None when it is not seen}; u, v in px, confidence 0..1
"""


class Status(record("Status", "t q error verdict reason e condition moves run battery")):
    """How the brick is doing.

    t          when q was read, s on the sender's clock
    q          joint angles, rad
    error      distance of effector and goal in the image, px; None while not known
    verdict    how the run ended; "" while it goes on, READY before the first Start
    reason     of the verdict, or why the arm is held in mid-run, one line for people; "" for none
    e          components of the error by row, {"A.u": px}; {} while not known
    condition  of the image Jacobian; None while not known, and where it is infinite
    moves      that the run has made
    run        its number, from 1 on; a Start that is taken or refused raises it
    battery    of the brick, V; None while not known
    """

    __slots__ = ()

    def __new__(
        cls, t, q, error, verdict, reason="", e=None, condition=None, moves=0, run=0, battery=None
    ):  # fmt: skip
        """A Status of which no more is known than what is said."""
        e = {} if e is None else e
        return super(Status, cls).__new__(
            cls, t, q, error, verdict, reason, e, condition, moves, run, battery
        )


READY = "ready"
"""The verdict of a brick that waits for its first Start."""

REFUSED = "refused"
"""The verdict on a Start whose orders make no sense."""


class Start(record("Start", "method mode rows tolerance budget follow goals")):
    """The laptop asks the brick for a run, and orders how it is to be done.

    method     how the image Jacobian is known
    mode       "look", then move, or "stream"
    rows       of the cameras' u and v: "stereo" | "xyz"
    tolerance  px
    budget     s
    follow     go on after a goal that moves
    goals      {camera: (u, v)}, px; {} for the goal marker
    """

    __slots__ = ()

    def __new__(
        cls, method="chain", mode="look", rows="stereo", tolerance=5.0, budget=60.0, follow=False,
        goals=None
    ):  # fmt: skip
        """The usual run, but for what is said; the brick's command line has the same defaults."""
        goals = {} if goals is None else goals
        return super(Start, cls).__new__(cls, method, mode, rows, tolerance, budget, follow, goals)


Stop = record("Stop", "reason")
Stop.__doc__ = """The laptop asks the brick to stop, and why."""

Bye = record("Bye", "reason")
Bye.__doc__ = """The last line before the sender closes the connection, and why."""


# Checks: each takes a value, on the way out as on the way in, and returns it clean.


class _Wrong(Exception):
    """A value is not what this says."""


def _integer(lowest, highest):
    allowed = "a whole number from {} to {}".format(lowest, highest)

    def check(value):
        if type(value) is not int:
            from numbers import Integral  # not above: only the laptop has others than int

            if isinstance(value, bool) or not isinstance(value, Integral):
                raise _Wrong(allowed)
        if not lowest <= value <= highest:
            raise _Wrong(allowed)
        return int(value)

    return check


def _number(lowest, highest, unit, decimals):
    allowed = "a number from {:g} to {:g} {}".format(lowest, highest, unit).rstrip()

    def check(value):
        if type(value) is not float:
            from numbers import Real

            if isinstance(value, bool) or not isinstance(value, Real):
                raise _Wrong(allowed)
            try:
                value = float(value)
            except OverflowError:
                raise _Wrong(allowed) from None
        if not lowest <= value <= highest:  # NaN is not
            raise _Wrong(allowed)
        return round(value, decimals)

    return check


@functools.lru_cache(maxsize=None)
def _compiled(pattern):
    """The pattern, compiled where it is first needed: it takes the brick a while."""
    return re.compile(pattern)


def _matching(pattern, allowed):
    def check(value):
        if not isinstance(value, str) or not _compiled(pattern).match(value):
            raise _Wrong(allowed)
        return value

    return check


def one_line(text):
    """A text that may be anything, as one that a message takes: printable, and cut to MAX_TEXT."""
    text = "".join(letter if letter.isprintable() else " " for letter in text)
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 3] + "..."


def _text(value):
    # Printable: no line ends, no lone surrogates, nothing that would steer a terminal.
    if not isinstance(value, str) or len(value) > MAX_TEXT or not value.isprintable():
        raise _Wrong("at most {} printable characters".format(MAX_TEXT))
    return value


def _flag(value):
    if not isinstance(value, bool):
        raise _Wrong("true or false")
    return value


def _or_none(check):
    return lambda value: None if value is None else check(value)


_nonce = _matching(r"[0-9a-f]{32}\Z", "32 hex digits")
_proof = _matching(r"[0-9a-f]{64}\Z", "64 hex digits")
_name = _matching(r"[A-Za-z0-9_-]{1,32}\Z", "1 to 32 of A-Z a-z 0-9 _ -")
_camera = _matching(r"[A-Za-z0-9_-]{1,16}\Z", "1 to 16 of A-Z a-z 0-9 _ -")
_row = _matching(r"[A-Za-z0-9_-]{1,16}\.[uv]\Z", "a camera's name and .u or .v")
_word = _matching(r"[a-z-]{1,16}\Z", "1 to 16 of a-z -")
_verdict = _matching(r"[a-z ]{0,32}\Z", "at most 32 of a-z and spaces")
_count = _integer(0, 2**53)
_time = _number(0, 1e9, "s", 6)
_pixel = _number(-1e5, 1e5, "px", 3)
_confidence = _number(0, 1, "", 3)
_angle = _number(-1000, 1000, "rad", 6)
_error = _number(0, 1e6, "px", 3)
_component = _number(-1e6, 1e6, "px", 3)
_condition = _number(0, 1e12, "", 3)
_volts = _number(0, 100, "V", 2)


def prepare():
    """Compile what observations are checked by: later that would make the first of them late."""
    _camera("A")
    _name("A")


def _angles(value):
    if not isinstance(value, (list, tuple)) or len(value) > MAX_JOINTS:
        raise _Wrong("a list of at most {} angles, rad".format(MAX_JOINTS))
    return tuple(_angle(angle) for angle in value)


def _table(most, what, key, check):
    def check_all(value):
        if not isinstance(value, dict) or len(value) > most:
            raise _Wrong("a table of at most {} {}".format(most, what))
        return {key(name): check(item) for name, item in value.items()}

    return check_all


def _pixels(value):
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise _Wrong("u and v for each camera")
    return _pixel(value[0]), _pixel(value[1])


def _sighting(value):
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise _Wrong("u, v and confidence, or null, for each marker")
    return _pixel(value[0]), _pixel(value[1]), _confidence(value[2])


# Each kind's class and fields, in the order of the line: (key, check). An observation's camera
# comes first, so that a reader in a hurry can tell the lines apart without parsing them.
_KINDS = {
    "hello": (Hello, (("version", _integer(0, 10**6)), ("role", _word), ("nonce", _nonce))),
    "challenge": (Challenge, (("nonce", _nonce),)),
    "proof": (Proof, (("proof", _proof),)),
    "welcome": (Welcome, (("proof", _proof),)),
    "refused": (
        Refused,
        (("cause", _word), ("reason", _text), ("wait", _number(0, 3600, "s", 3))),
    ),
    "ping": (Ping, (("id", _count),)),
    "pong": (Pong, (("id", _count), ("received", _time), ("sent", _time))),
    "observation": (
        Observation,
        (
            ("camera", _camera),
            ("seq", _count),
            ("t", _time),
            ("markers", _table(MAX_MARKERS, "markers", _name, _sighting)),
        ),
    ),
    "status": (
        Status,
        (
            ("t", _time),
            ("q", _angles),
            ("error", _or_none(_error)),
            ("verdict", _verdict),
            ("reason", _text),
            ("e", _table(2 * MAX_CAMERAS, "rows", _row, _component)),
            ("condition", _or_none(_condition)),
            ("moves", _count),
            ("run", _count),
            ("battery", _or_none(_volts)),
        ),
    ),
    "start": (
        Start,
        (
            ("method", _word),
            ("mode", _word),
            ("rows", _word),
            ("tolerance", _number(*TOLERANCE, decimals=3)),
            ("budget", _number(*BUDGET, decimals=3)),
            ("follow", _flag),
            ("goals", _table(MAX_CAMERAS, "goals", _camera, _pixels)),
        ),
    ),
    "stop": (Stop, (("reason", _text),)),
    "bye": (Bye, (("reason", _text),)),
}
_LATER = {("status", "battery")}
"""What may be missing in a line: earlier senders of this version do not know it."""
_KIND_OF = {kind_class: kind for kind, (kind_class, _) in _KINDS.items()}


def _refuse_constant(name):
    raise BadMessage("{} is not a number; send null or leave the message out".format(name))


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)
_ENCODER = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def encode(message):
    """The line of a message, with its newline: bytes.

    Raises:
        BadMessage: some value would not be accepted on the other side.
    """
    kind = _KIND_OF[type(message)]
    if kind == "ping" and type(message.id) is int and 0 <= message.id <= 2**53:
        return b'{"kind":"ping","id":%d}\n' % message.id  # so often that it is worth a short way
    line = collections.OrderedDict(kind=kind)
    for key, check in _KINDS[kind][1]:
        line[key] = _checked(kind, key, check, getattr(message, key))
    data = _ENCODER.encode(line).encode("utf-8")
    if len(data) > MAX_LINE:
        raise BadMessage("{}: {} bytes; a line has at most {}".format(kind, len(data), MAX_LINE))
    return data + b"\n"


def decode(line, usual=()):
    """The message in a line of bytes, with or without its newline.

    Args:
        usual: names of cameras and markers that have been found right before.

    Raises:
        BadMessage: saying in one line what is wrong and what is allowed; nothing else is raised,
            whatever the bytes.
    """
    if len(line) > MAX_LINE + 1:
        raise BadMessage("{} bytes; a line has at most {}".format(len(line), MAX_LINE))
    try:
        values = _DECODER.decode(line.decode("utf-8"))
    except BadMessage:
        raise
    except (ValueError, RecursionError):
        raise BadMessage("{} is not JSON in UTF-8".format(_shown(bytes(line)))) from None
    kind = values.get("kind") if isinstance(values, dict) else None
    if kind == "observation":
        seen = _plain_observation(values, usual)
        if seen is not None:
            return seen
    if not isinstance(kind, str) or kind not in _KINDS:
        raise BadMessage(
            "there is no kind of message {}; a line is an object with one of the kinds {}".format(
                _shown(kind), ", ".join(sorted(_KINDS))
            )
        )
    if kind == "hello" and values.get("version") != VERSION:
        # To be refused by its version, whatever else another version says.
        values.update(role=BRICK, nonce="0" * 32)
    fields = {}
    for key, check in _KINDS[kind][1]:
        if key in values:
            fields[key] = _checked(kind, key, check, values[key])
        elif (kind, key) not in _LATER:
            raise BadMessage("{}: {} is missing".format(kind, key))
    return _KINDS[kind][0](**fields)


def _plain_observation(values, usual):
    """The Observation that `values` are if nothing about them is unusual; else None.

    The checks of _KINDS would come to the same, but they take the brick twice as long, which hears
    60 of these a second.
    """
    camera, seq, t = values.get("camera"), values.get("seq"), values.get("t")
    seen = values.get("markers")
    if type(seq) is not int or type(t) is not float or type(camera) is not str:
        return None
    if camera not in usual or len(camera) > 16:
        return None
    if not (0 <= seq <= 2**53 and 0.0 <= t <= 1e9 and type(seen) is dict):
        return None
    if len(seen) > MAX_MARKERS:
        return None
    markers = {}
    for name, sighting in seen.items():
        if name not in usual:
            return None
        if sighting is not None:
            if type(sighting) is not list or len(sighting) != 3:
                return None
            u, v, confidence = sighting
            if not type(u) is type(v) is type(confidence) is float:
                return None
            if not (-1e5 <= u <= 1e5 and -1e5 <= v <= 1e5 and 0.0 <= confidence <= 1.0):
                return None
            sighting = u, v, confidence
        markers[name] = sighting
    return Observation(seq, camera, t, markers)


def _checked(kind, key, check, value):
    try:
        return check(value)
    except _Wrong as allowed:
        raise BadMessage(
            "{}: {} is {}; it must be {}".format(kind, key, _shown(value), allowed)
        ) from None


def _shown(value):
    """A value as one short printable line; never more than a glance at what is nested."""
    if isinstance(value, (list, tuple, dict)):
        return "a {} of {}".format(type(value).__name__, len(value))
    text = ascii(value)
    return text if len(text) <= 40 else text[:37] + "..."


class LineBuffer(object):
    """Cuts a stream of bytes into lines, and never holds more than one unfinished line.

    Attributes:
        overlong: lines that were longer than MAX_LINE, left out.
    """

    def __init__(self):
        self.overlong = 0
        self._rest = b""
        self._skipping = False

    @property
    def pending(self):
        """Bytes of a line that has not come in whole."""
        return len(self._rest)

    def feed(self, data):
        """The lines that `data` completes, without their newlines: a list of bytes."""
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        if self._skipping and lines:
            del lines[0]  # the end of a line that was counted already
            self._skipping = False
        if self._skipping:
            self._rest = b""
        elif len(self._rest) > MAX_LINE:
            self.overlong += 1
            self._rest = b""
            self._skipping = True
        whole = [line for line in lines if len(line) <= MAX_LINE]
        self.overlong += len(lines) - len(whole)
        return whole
