"""Types of the records, for type checkers alone: the brick's Python cannot read such classes.

Each is made, and described, by the module that is named above it, and is to be had from there.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from shared.job_pieces import Piece

# shared.arm_description

class Pen(NamedTuple):
    port: str
    motor: str
    up: float
    down: float

class Joint(NamedTuple):
    name: str
    link: float
    port: str
    motor: str
    gear: float
    direction: int
    lower: float
    upper: float
    stop_lower: float | None
    stop_upper: float | None
    backlash: float
    max_speed: float
    home: float
    find_home: str
    touch_port: str | None
    touch_at: float | None
    seek: str | None
    mass: float
    centre: float
    friction: float
    park_angle: float | None

class Arm(NamedTuple):
    name: str
    chain: str
    joints: tuple[Joint, ...]
    pen: Pen | None
    elbow: str
    speed: float
    file: str
    marker_offset: tuple[float, float] = ...

# shared.job_header

class JobHeader(NamedTuple):
    name: str
    arm: str
    chain: str
    links: tuple[float, ...]
    speed: float
    strokes: int
    cm: float
    pen_up_cm: float
    seconds: float
    log: float = ...
    rest: float = ...
    pens: str = ...

# shared.job

# Of a piece: lengths of the way from its beginning, cm; per joint by how much it is moved, rad
Offsets = tuple[Sequence[float], Sequence[Sequence[float]]]

class Stroke(NamedTuple):
    layer: str
    cm: float
    start_s: float
    pieces: Sequence[Piece]
    offsets: Sequence[Offsets] = ...

# shared.job_log

class LogRow(NamedTuple):
    stroke: int
    plan: float
    t: float
    rest: bool
    q: tuple[float, ...]

# shared.job_messages

class Draw(NamedTuple):
    name: str
    size: int
    parts: int
    crc: int
    first: int = ...
    alone: bool = ...
    dry: bool = ...

class Want(NamedTuple):
    crc: int
    part: int

class JobPart(NamedTuple):
    crc: int
    part: int
    data: str

class Order(NamedTuple):
    what: str
    value: float | None

class JobStatus(NamedTuple):
    t: float
    crc: int
    name: str
    state: str
    stroke: int
    strokes: int
    cm: float
    cm_all: float
    seconds: float | None
    down: bool
    reason: str

class JobLog(NamedTuple):
    crc: int
    rows: Sequence[Sequence[Any]]

# shared.messages

Sighting = tuple[float, float, float]  # u, v, px; confidence, 0 to 1

class Hello(NamedTuple):
    version: int
    role: str
    nonce: str

class Challenge(NamedTuple):
    nonce: str
    salt: str

class Proof(NamedTuple):
    proof: str

class Welcome(NamedTuple):
    proof: str

class Refused(NamedTuple):
    cause: str
    reason: str
    wait: float

class Ping(NamedTuple):
    id: int

class Pong(NamedTuple):
    id: int
    received: float
    sent: float

class Observation(NamedTuple):
    seq: int
    camera: str
    t: float
    markers: Mapping[str, Sighting | None]

class Status(NamedTuple):
    t: float
    q: tuple[float, ...]
    error: float | None
    verdict: str
    reason: str = ...
    e: Mapping[str, float] = ...
    condition: float | None = ...
    moves: int = ...
    run: int = ...
    battery: float | None = ...

class Start(NamedTuple):
    method: str = ...
    mode: str = ...
    rows: str = ...
    tolerance: float = ...
    budget: float = ...
    follow: bool = ...
    goals: Mapping[str, tuple[float, float]] = ...

class Stop(NamedTuple):
    reason: str

class Bye(NamedTuple):
    reason: str

Message = (
    Hello
    | Challenge
    | Proof
    | Welcome
    | Refused
    | Ping
    | Pong
    | Observation
    | Status
    | Start
    | Stop
    | Bye
    | Draw
    | Want
    | JobPart
    | Order
    | JobStatus
    | JobLog
)
