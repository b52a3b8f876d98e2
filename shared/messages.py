"""Messages between laptop and brick: one JSON object per line; bytes in, messages out.

    {"kind":"observation","camera":"A","seq":7,"t":12.5,"markers":{"effector":[u,v,c],"goal":null}}

After the handshake a signature follows on the same line; link.py puts it there and takes it off.
Rules: every value is checked the same way when it is sent and when it arrives. Keys that are not
known are ignored, so that a later version may add some; kinds that are not known are refused.
"""

import collections
import json

from shared import job_messages
from shared import message_fields as fields
from shared.arm_description import ArmError
from shared.framing import MAX_LINE
from shared.record import record

MYPY = False
if MYPY:
    from typing import Any, Callable, Container, Dict, NoReturn, Optional  # noqa: F401

    from shared.job_messages import Kind  # noqa: F401
    from shared.records import (
        Bye,
        Challenge,
        Hello,
        Message,
        Observation,
        Ping,
        Pong,
        Proof,
        Refused,
        Sighting,
        Start,
        Status,
        Stop,
        Welcome,
    )

    __all__ = ["Bye", "Challenge", "Hello", "Message", "Observation", "Ping", "Pong", "Proof"]
    __all__ += ["Refused", "Sighting", "Start", "Status", "Stop", "Welcome"]
else:
    Hello = record("Hello", "version role nonce")
    Challenge = record("Challenge", "nonce salt")
    Proof = record("Proof", "proof")
    Welcome = record("Welcome", "proof")
    Refused = record("Refused", "cause reason wait")
    Ping = record("Ping", "id")
    Pong = record("Pong", "id received sent")
    Observation = record("Observation", "seq camera t markers")
    Status = record(
        "Status", "t q error verdict reason e condition moves run battery",
        defaults=("", {}, None, 0, 0, None),
    )  # fmt: skip
    Start = record(
        "Start", "method mode rows tolerance budget follow goals",
        defaults=("chain", "stream", "stereo", 5.0, 60.0, False, {}),
    )  # fmt: skip
    Stop = record("Stop", "reason")
    Bye = record("Bye", "reason")

VERSION = 4
"""Version of the protocol, raised with each incompatible change; `hello` keeps its form."""

PORT = 7711
"""Default TCP port on which the laptop listens."""

MAX_MARKERS = 16
"""Greatest number of markers in an Observation."""

MAX_CAMERAS = 8
"""Greatest number of cameras of a link."""

STATUS_PERIOD = 0.2
"""Period of Statuses, s; a final one is sent at once."""

TOLERANCE = 0.5, 200.0, "px"
BUDGET = 1.0, 3600.0, "s"
"""Bounds and unit of a Start's values."""

EFFECTOR, GOAL = "effector", "goal"
"""Names of the markers: on the arm's tip, and at its goal."""

LEAST_CONFIDENCE = 0.5
"""Least confidence, 0 to 1, of a sighting that is acted on."""

BRICK = "brick"
"""Role of the side that connects."""
LAPTOP = "laptop"
"""Role of the side that listens."""


class BadMessage(ArmError, ValueError):
    """Error for a line that is no message, or a message that must not be sent."""


Hello.__doc__ = """First line of the side that connects.

version  VERSION of the sender
role     BRICK
nonce    32 hex digits, new for every connection
"""

Challenge.__doc__ = """Answer to a Hello.

nonce  32 hex digits, new for every connection
salt   32 hex digits, the laptop's for its pairing code
"""

Proof.__doc__ = """Proof that the brick knows the pairing code: 64 hex digits (shared.pairing)."""

Welcome.__doc__ = """Proof that the laptop knows the code, too; it serves the brick from now on."""

Refused.__doc__ = """Refusal of the laptop to serve the brick.

cause   "version" | "code" (trying again is no use) | "busy" | "wait"
reason  one line for people
wait    least time until the next try, s
"""

Ping.__doc__ = """Request for a Pong of the same id."""

Pong.__doc__ = """Times at which the Ping came in and this went out, s on the sender's clock."""

Observation.__doc__ = """Markers in one frame of one camera.

seq      rises from frame to frame
camera   short name: "A", "B", ...
t        capture time, s on the sender's clock
markers  {name: (u, v, confidence), or None when it is not seen}; u, v in px, confidence 0..1
"""

Status.__doc__ = """State of the brick and its run.

t          time at which q was read, s on the sender's clock
q          joint angles, rad
error      distance of effector and goal in the image, px; None while unknown
verdict    result of the run (shared.verdicts); "" while it goes on, READY before the first Start
reason     of the verdict, or why the arm is held in mid-run, one line for people; "" for none
e          components of the error by row, {"A.u": px}; {} while unknown
condition  number of the image Jacobian; None while unknown, and where it is infinite
moves      number of moves of the run
run        number of the run, from 1 on; a Start that is accepted or refused raises it
battery    voltage of the brick, V; None while unknown
"""

Start.__doc__ = """Order of the laptop for a run.

method     source of the image Jacobian, one of shared.run_options.METHODS
mode       "look", then move, or "stream"
rows       of the cameras' u and v: "stereo" | "xyz"
tolerance  of the error, px
budget     time limit, s
follow     whether to follow a goal that moves
goals      {camera: (u, v)}, px; {} for the goal marker

The defaults are those of the brick's command line.
"""

Stop.__doc__ = """Order of the laptop to stop, and why."""

Bye.__doc__ = """Last line before the sender closes the connection, and why."""


# Each kind's class and fields, in the order of the line: (key, check). An observation's camera
# comes first, so that a fast reader can distinguish the lines without parsing them.
_KINDS = {
    "hello": (
        Hello,
        (
            ("version", fields.whole_number(0, 10**6)),
            ("role", fields.WORD),
            ("nonce", fields.NONCE),
        ),
    ),
    "challenge": (Challenge, (("nonce", fields.NONCE), ("salt", fields.NONCE))),
    "proof": (Proof, (("proof", fields.PROOF),)),
    "welcome": (Welcome, (("proof", fields.PROOF),)),
    "refused": (
        Refused,
        (("cause", fields.WORD), ("reason", fields.text), ("wait", fields.number(0, 3600, "s", 3))),
    ),
    "ping": (Ping, (("id", fields.COUNT),)),
    "pong": (Pong, (("id", fields.COUNT), ("received", fields.TIME), ("sent", fields.TIME))),
    "observation": (
        Observation,
        (
            ("camera", fields.CAMERA_NAME),
            ("seq", fields.COUNT),
            ("t", fields.TIME),
            ("markers", fields.table(MAX_MARKERS, "markers", fields.MARKER_NAME, fields.sighting)),
        ),
    ),
    "status": (
        Status,
        (
            ("t", fields.TIME),
            ("q", fields.angles),
            ("error", fields.or_none(fields.ERROR)),
            ("verdict", fields.VERDICT),
            ("reason", fields.text),
            ("e", fields.table(2 * MAX_CAMERAS, "rows", fields.ROW_NAME, fields.COMPONENT)),
            ("condition", fields.or_none(fields.CONDITION)),
            ("moves", fields.COUNT),
            ("run", fields.COUNT),
            ("battery", fields.or_none(fields.VOLTS)),
        ),
    ),
    "start": (
        Start,
        (
            ("method", fields.WORD),
            ("mode", fields.WORD),
            ("rows", fields.WORD),
            ("tolerance", fields.number(*TOLERANCE, decimals=3)),
            ("budget", fields.number(*BUDGET, decimals=3)),
            ("follow", fields.flag),
            ("goals", fields.table(MAX_CAMERAS, "goals", fields.CAMERA_NAME, fields.pixels)),
        ),
    ),
    "stop": (Stop, (("reason", fields.text),)),
    "bye": (Bye, (("reason", fields.text),)),
}  # type: Dict[str, Kind]
_KINDS.update(job_messages.KINDS)
_LATER = {("status", "battery")}
"""Fields (kind, key) that may be missing: earlier senders of this version do not know them."""
_KIND_OF = {kind_class: kind for kind, (kind_class, _) in _KINDS.items()}


OBSERVATION_BEGINS, _SEQ = b'{"kind":"observation","camera":"', b'","seq":'
"""Bytes at an observation's start and after its camera, so that lines are sorted unparsed."""


def _refuse_constant(name):
    # type: (str) -> NoReturn
    raise BadMessage("{} is not a number; send null or leave the message out".format(name))


_LONGEST = MAX_LINE + 1
_new = tuple.__new__  # of a record: a third of the time that calling its class takes
_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)
_ENCODER = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def encode(message):
    # type: (Message) -> bytes
    """Return the line of a message, with its newline: bytes.

    Raises:
        BadMessage: some value would not be accepted on the other side.
    """
    if type(message) is Ping and type(message.id) is int and 0 <= message.id <= 2**53:
        return b'{"kind":"ping","id":%d}\n' % message.id  # so often that it is worth a short way
    kind = _KIND_OF[type(message)]
    line = collections.OrderedDict(kind=kind)  # type: Dict[str, object]
    for key, check in _KINDS[kind][1]:
        line[key] = _checked(kind, key, check, getattr(message, key))
    data = _ENCODER.encode(line).encode("utf-8")
    if len(data) > MAX_LINE:
        raise BadMessage("{}: {} bytes; a line has at most {}".format(kind, len(data), MAX_LINE))
    return data + b"\n"


def decode(line, known_names=()):
    # type: (bytes, Container[str]) -> Message
    """Return the message in a line of bytes.

    Args:
        line: bytes, with or without the newline.
        known_names: names of cameras and markers that were checked before.

    Raises:
        BadMessage: saying in one line what is wrong and what is allowed; nothing else is raised,
            whatever the bytes.
    """
    if len(line) > _LONGEST:
        raise BadMessage("{} bytes; a line has at most {}".format(len(line), MAX_LINE))
    try:
        text = line.decode("utf-8")
        values, end = _DECODER.raw_decode(text)  # the brick takes a third longer for `decode`
        if end != len(text):
            values = _DECODER.decode(text)
    except BadMessage:
        raise
    except (ValueError, RecursionError):
        raise BadMessage("{} is not JSON in UTF-8".format(_shown(bytes(line)))) from None
    kind = values.get("kind") if isinstance(values, dict) else None
    if kind == "observation":
        seen = _plain_observation(values, known_names)
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
    arguments = {}
    for key, check in _KINDS[kind][1]:
        if key in values:
            arguments[key] = _checked(kind, key, check, values[key])
        elif (kind, key) not in _LATER:
            raise BadMessage("{}: {} is missing".format(kind, key))
    return _KINDS[kind][0](**arguments)


def seq_of(line):
    # type: (bytes) -> int
    """Return the `seq` of an observation's line without parsing it; -1 if it has none."""
    begin = line.find(_SEQ, len(OBSERVATION_BEGINS)) + len(_SEQ)
    number = line[begin : line.find(b",", begin)]
    return int(number) if number.isdigit() and len(number) <= 16 else -1


def _plain_observation(values, known_names, type=type, float=float):
    # type: (Dict[str, Any], Container[str], Any, Any) -> Optional[Observation]
    """Return the Observation in `values` if nothing about them is unusual; else None.

    The checks of _KINDS have the same result, but take the brick twice as long, and 60 of these
    come a second. (For the same reason the two builtins are parameters: a local name is faster.)
    """
    try:
        camera, seq, t = values["camera"], values["seq"], values["t"]
        seen = values["markers"]
    except KeyError:
        return None
    if type(seq) is not int or type(t) is not float or type(camera) is not str:
        return None
    if camera not in known_names or len(camera) > 16:
        return None
    if not (0 <= seq <= 2**53 and 0.0 <= t <= 1e9 and type(seen) is dict):
        return None
    if len(seen) > MAX_MARKERS:
        return None
    markers = {}  # type: Dict[str, Optional[Sighting]]
    for name, sighting in seen.items():
        if name not in known_names:
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
    return _new(Observation, (seq, camera, t, markers))


def _checked(kind, key, check, value):
    # type: (str, str, Callable[[Any], object], object) -> object
    try:
        return check(value)
    except fields.WrongValue as allowed:
        raise BadMessage(
            "{}: {} is {}; it must be {}".format(kind, key, _shown(value), allowed)
        ) from None


def _shown(value):
    # type: (object) -> str
    """Return a value as one short printable line; of nested ones only type and length."""
    if isinstance(value, (list, tuple, dict)):
        return "a {} of {}".format(type(value).__name__, len(value))
    text = ascii(value)
    return text if len(text) <= 40 else text[:37] + "..."
