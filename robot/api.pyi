"""Types of what robot.api holds, for editors and type checkers; the brick never reads this file.

A test compares it with the code: names, parameters, defaults, and each docstring's first line.
"""

import select as _select
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias, type_check_only

__all__ = [
    "ArmError",
    "Battery",
    "Clock",
    "Driver",
    "Moving",
    "NotChecked",
    "NotHomed",
    "ReportServo",
    "RobotArm",
    "Rows",
    "STOP",
    "Servo",
    "Stalled",
    "Stream",
    "TooSlow",
    "TrackingClient",
    "Turtle",
    "Unreachable",
    "Verdict",
    "VisualServoing",
    "find_arm",
    "find_tracker",
    "forward",
    "inverse",
    "jacobian",
    "make_servo",
    "read_arm",
]

_Pose: TypeAlias = Sequence[float]  # joint angles, rad, from the base outwards
_Point: TypeAlias = Sequence[float]  # x, y and in space z, cm
_Matrix: TypeAlias = tuple[tuple[float, ...], ...]
_Say: TypeAlias = Callable[[str], object]
_OnTick: TypeAlias = Callable[[float, tuple[float, ...]], object]  # s, rad; may return STOP
_Elbow: TypeAlias = Literal["up", "down"]
_Method: TypeAlias = Literal["smooth", "steps"]

# What is handed out but not imported from here.

@type_check_only
class Joint(NamedTuple):
    name: str
    link: float  # cm
    port: str
    motor: str
    gear: float
    direction: int
    lower: float  # rad
    upper: float
    stop_lower: float | None
    stop_upper: float | None
    backlash: float
    max_speed: float  # rad/s
    home: float
    find_home: str
    touch_port: str | None
    touch_at: float | None  # rad
    seek: str | None
    mass: float  # kg
    centre: float  # cm
    friction: float  # Nm
    park_angle: float | None

@type_check_only
class Pen(NamedTuple):
    port: str
    motor: str
    up: float  # rad
    down: float

@type_check_only
class Arm(NamedTuple):
    name: str
    chain: str
    joints: tuple[Joint, ...]
    pen: Pen | None
    elbow: str
    speed: float  # cm/s
    file: str

@type_check_only
class Found(NamedTuple):
    joint: str
    zero: float  # counts
    backlash: float | None  # rad
    spread: float  # counts

@type_check_only
class ServerAddress(NamedTuple):
    host: str
    port: int
    code: str

@type_check_only
class Observation(NamedTuple):
    seq: int
    camera: str
    t: float  # s on the brick's clock
    markers: Mapping[str, tuple[float, float, float] | None]  # u, v in px and the confidence

@type_check_only
class _Ticking(Protocol):
    def now(self) -> float: ...
    def sleep(self, seconds: float) -> None: ...

class ArmError(Exception):
    """Base of every error that is shown to people as one line."""

class NotChecked(ArmError):
    """Nobody has looked yet which motor is where and which way it turns."""

class NotHomed(ArmError):
    """The zero is unknown, or the encoders contradict it; nothing has moved."""

class Stalled(ArmError):
    """A motor that does not turn as it is driven."""

    motor: Any
    angle: float  # rad
    turning: bool
    fact: str
    def __init__(
        self, motor: Any, missing: str, angle: float = 0.0, turning: bool = False
    ) -> None: ...
    def look_at_battery(self, clock: _Ticking) -> None:
        """Say so if the battery is flat: what turns too slowly does so by that."""

class TooSlow(ArmError):
    """The brick does not keep up with the control loop."""

    def __init__(self, seconds: float, missing: str = "") -> None: ...

class Unreachable(ArmError, ValueError):
    """A point that the arm cannot reach, or an iteration that did not find it."""

class Clock:
    """Monotonic time: the image's wall clock jumps when it finds a time server."""

    def now(self) -> float:
        """Seconds since some moment in the past."""
    def sleep(self, seconds: float) -> None:
        """Wait; returns at once for times that have passed."""

class Battery:
    """What the battery has left."""

    def __init__(self, clock: _Ticking) -> None: ...
    def volts(self) -> float | None:
        """Its voltage a short while ago, V; None if it does not tell, which stops nobody."""

def find_arm(name_or_path: object) -> str:
    """Path of an arm file, given as a path or as the bare name of an arm."""

def read_arm(path: object) -> Arm:
    """The Arm described by the INI file at `path`; raises BadArmFile in one line."""

def forward(arm: Arm, q: _Pose) -> tuple[float, ...]:
    """Position p of the tip, cm, at the joint angles q, rad."""

def jacobian(arm: Arm, q: _Pose) -> _Matrix:
    """J = dp/dq at q, cm/rad, as a tuple of rows."""

def inverse(
    arm: Arm, p: _Point, elbow: _Elbow | None = None, near: _Pose | None = None
) -> tuple[float, ...]:
    """The q within the joint limits that brings the tip to p (cm)."""

STOP: object

class Moving(NamedTuple):
    """An aim that moves at a known speed: rad and rad/s."""

    q: _Pose
    q_dot: _Pose

class RobotArm:
    """The arm on this brick."""

    description: Arm
    clock: _Ticking
    zero: Any
    checked: Any
    motors: Any
    joints: Any
    pen: Any
    backlash_sides: tuple[float, ...]
    def __init__(
        self,
        description: Arm,
        clock: _Ticking,
        zero: Any = None,
        gains: Mapping[str, Any] = ...,
        gravity: Any = None,
        say: _Say = ...,
        motors: Any = None,
        checked: Any = None,
    ) -> None: ...
    @property
    def homed(self) -> bool:
        """Whether its zero is known: nothing moves before; a stall puts it in doubt."""
    def counts(self) -> dict[str, int]:
        """The encoders' readings by port."""
    def confirm_checked(self) -> None:
        """Refuse, by NotChecked, an arm of which nobody has seen which motor turns what."""
    def load_zero(self) -> None:
        """Believe the remembered zero."""
    def angles(self) -> tuple[float, ...]:
        """Joint angles, rad, as the encoders have them, allowing for backlash as far as known."""
    def position(self) -> tuple[float, ...]:
        """The tip, cm, as the encoders have it."""
    def go_to(
        self,
        q: _Pose,
        speed: float = 1.0,
        acceleration: float = ...,
        on_tick: _OnTick | None = None,
    ) -> None:
        """Move all joints together to `q` (rad), each at most at `speed` times its greatest."""
    def pre_approach(self, motion: Any) -> None:
        """Go to the start of `motion` from behind, so that all backlash is taken up its way."""
    def follow(
        self, motions: Sequence[Any], settle: float = 0.2, on_tick: _OnTick | None = None
    ) -> None:
        """Let the links follow Trajectories or JointMoves, one after the other."""
    def follow_fed(self, motions: Sequence[Any], feed: Any, ready: Callable[[], object]) -> None:
        """As `follow`, at the rate of a robot.motion.feed.FeedOverride, which may hold it."""
    def reach(
        self,
        q: _Pose,
        speed: float = 1.0,
        acceleration: float = ...,
        on_tick: _OnTick | None = None,
        within: float = 0.4,
        spare: Callable[[float], object] | None = None,
    ) -> None:
        """Move to `q` (rad), each joint by itself, as fast as a chase and landing as softly."""
    def chase(
        self,
        aim: Callable[[float, tuple[float, ...]], _Pose | Moving | object | None],
        speed: float = 1.0,
        acceleration: float = ...,
        within: float = 0.4,
        spare: Callable[[float], object] | None = None,
    ) -> None:
        """Let the links follow an aim that may move as it likes; end at rest, held."""
    def move_pen(self, angle: float) -> None:
        """Turn the pen's motor to `angle`, rad; raises Stalled if it does not get there."""
    def move_motor(
        self,
        motor: Any,
        move: Any,
        max_error: float = ...,
        on_tick: Callable[[float, float, Sequence[float]], object] | None = None,
    ) -> None:
        """Let a motor follow a JointMove, without limits, `on_tick` as ControlLoop.run; hold it."""
    def lend_motors(self, zero_needed: bool = True) -> AbstractContextManager[None]:
        """For a `with` block somebody else turns the joints, held first; no side is known then."""
    def home(self, here: bool = False, say: _Say = ..., seek: bool = False) -> list[Found]:
        """Find the zero as the arm's file says, which stands about at home; remember it."""
    def step_to(self, q: _Pose) -> None:
        """The report's move: both joints commanded together, then settled to a count for 60 ms."""
    def stop(self) -> None:
        """Stop and hold every motor that still answers; then tell of the first that does not."""
    def go_low(self) -> bool:
        """Go slowly, the base staying, to where the arm is to rest, as its description says."""
    def park(self, low: bool = False) -> None:
        """Stop for good, and put on record where; nothing if nothing was moved."""

class Driver:
    """A drawing arm."""

    arm: RobotArm
    speed: float | None  # cm/s
    elbow: _Elbow | None
    say: _Say
    def __init__(
        self,
        arm: RobotArm,
        speed: float | None = None,
        elbow: _Elbow | None = None,
        say: _Say = ...,
    ) -> None: ...
    def home(self, here: bool = False, seek: bool = False) -> None:
        """Find the zero, see RobotArm.home; if something was sought, then go to the home pose."""
    def position(self) -> tuple[float, ...]:
        """The tip (x, y) or (x, y, z), cm, as the encoders have it."""
    def pen_up(self) -> None:
        """Lift the pen; nothing where the arm has no pen motor."""
    def pen_down(self) -> None:
        """Lower the pen."""
    def move_to(self, p: _Point) -> None:
        """Move to `p` (cm) with the pen up, not necessarily straight."""
    def go_low(self) -> None:
        """Go to where the arm rests, if there is such a place and a way; say what came of it."""
    def draw_line(self, start: _Point, end: _Point, method: _Method = "smooth") -> None:
        """Draw the straight line from `start` to `end`, cm."""
    def draw(self, strokes: Sequence[Sequence[_Point]], method: _Method = "smooth") -> None:
        """Draw strokes, each a sequence of points (x, y) or (x, y, z), cm, of any shape."""
    def draw_planned(
        self,
        pieces: Sequence[Sequence[_Point]],
        plans: Sequence[Any],
        method: _Method = "smooth",
    ) -> None:
        """Draw the pieces of one stroke (robot.motion.paths), planned by trajectory.plan."""

class Turtle:
    """A turtle that holds the arm's pen, down at first; lengths are units, angles degrees."""

    def __init__(
        self,
        driver: Driver | None = None,
        scale: float = ...,
        origin: tuple[float, float] | None = None,
        turn: float = 0.0,
        height: float = 0.0,
    ) -> None: ...
    def forward(self, distance: float) -> None:
        """Go so far ahead."""
    def back(self, distance: float) -> None:
        """Go so far backwards, the heading stays."""
    def right(self, angle: float) -> None:
        """Turn clockwise."""
    def left(self, angle: float) -> None:
        """Turn counter-clockwise."""
    def goto(self, x: float | tuple[float, float] | Turtle, y: float | None = None) -> None:
        """Go straight to a place, given as x, y or as a pair; the heading stays."""
    def setx(self, x: float) -> None:
        """Go to this x."""
    def sety(self, y: float) -> None:
        """Go to this y."""
    def setheading(self, to_angle: float) -> None:
        """Turn to a heading: 0 is east, 90 north."""
    def home(self) -> None:
        """Go to (0, 0), and head east."""
    def circle(self, radius: float, extent: float | None = None, steps: int | None = None) -> None:
        """Draw a circle whose centre is so far to the left, or a part of it."""
    def penup(self) -> None:
        """Lift the pen: the stroke so far is drawn."""
    def pendown(self) -> None:
        """Lower the pen."""
    def isdown(self) -> bool:
        """Whether the pen is down."""
    def flush(self) -> None:
        """Draw now what has been collected."""
    def done(self) -> None:
        """Draw what has been collected: the end of a turtle's program."""
    def position(self) -> tuple[float, float]:
        """(x, y), units."""
    def xcor(self) -> float:
        """Its x."""
    def ycor(self) -> float:
        """Its y."""
    def heading(self) -> float:
        """Where it heads: 0 is east, 90 north."""
    def towards(self, x: float | tuple[float, float] | Turtle, y: float | None = None) -> float:
        """The heading from here to a place."""
    def distance(self, x: float | tuple[float, float] | Turtle, y: float | None = None) -> float:
        """How far a place is from here, units."""
    def speed(self, speed: float | str | None = None) -> int | None:
        """Set the tip's speed, 1 slow to 10 fast; 0, as at first, is the arm's own. Or tell it."""
    def degrees(self, fullcircle: float = 360.0) -> None:
        """Let angles be degrees, or other parts of a full circle."""
    def radians(self) -> None:
        """Let angles be radians."""
    def fd(self, distance: float) -> None:
        """Go so far ahead."""
    def bk(self, distance: float) -> None:
        """Go so far backwards, the heading stays."""
    def backward(self, distance: float) -> None:
        """Go so far backwards, the heading stays."""
    def rt(self, angle: float) -> None:
        """Turn clockwise."""
    def lt(self, angle: float) -> None:
        """Turn counter-clockwise."""
    def setpos(self, x: float | tuple[float, float] | Turtle, y: float | None = None) -> None:
        """Go straight to a place, given as x, y or as a pair; the heading stays."""
    def setposition(self, x: float | tuple[float, float] | Turtle, y: float | None = None) -> None:
        """Go straight to a place, given as x, y or as a pair; the heading stays."""
    def seth(self, to_angle: float) -> None:
        """Turn to a heading: 0 is east, 90 north."""
    def pu(self) -> None:
        """Lift the pen: the stroke so far is drawn."""
    def up(self) -> None:
        """Lift the pen: the stroke so far is drawn."""
    def pd(self) -> None:
        """Lower the pen."""
    def down(self) -> None:
        """Lower the pen."""
    def pos(self) -> tuple[float, float]:
        """(x, y), units."""
    def mainloop(self) -> None:
        """Draw what has been collected: the end of a turtle's program."""
    def update(self) -> None:
        """Draw now what has been collected."""

def find_tracker(
    place: str = "",
    code: str | None = None,
    environ: Mapping[str, str] | None = None,
    memory: Any = None,
    ask: Callable[[str], str] | None = None,
) -> ServerAddress:
    """Which tracker to go to: as said, else where ssh came from, else as remembered."""

class TrackingClient:
    """A link to the tracker that comes back by itself. Call `poll` often."""

    linked: bool
    why: str
    refused: bool
    lost_since: float | None  # s
    def __init__(
        self,
        host: str,
        port: int,
        code: str,
        clock: _Ticking,
        memory: Any = None,
        say: _Say = ...,
        select: Callable[..., Any] = _select.select,
        battery: Callable[[], float | None] = ...,
    ) -> None: ...
    def poll(self, timeout: float = 0.0) -> dict[str, Observation]:
        """Do what is due, and hand over what is new; better wait here than sleep elsewhere."""
    def age(self, camera: str) -> float:
        """How long ago the newest observation of a camera was taken, s; inf if there was none."""
    def commands(self) -> list[Any]:
        """The Start, Stop and Draw messages since the last call; a lost link takes them back."""
    def of_job(self) -> list[Any]:
        """The JobParts and Orders since the last call; a lost link takes them back."""
    def send(self, message: Any) -> bool:
        """Send a Want or JobStatus; whether there is a link."""
    def report(
        self,
        q: _Pose,
        error: float | None,
        verdict: str = "",
        reason: str = "",
        e: Mapping[str, float] | None = None,
        condition: float | None = None,
        moves: int = 0,
        run: int = 1,
    ) -> None:
        """Tell the laptop how it goes; more often than every STATUS_PERIOD, only what is final."""
    @property
    def late(self) -> dict[str, float]:
        """{camera: age, s} of the cameras whose last observation came too late to be used."""
    @property
    def round_trip(self) -> float | None:
        """Of the ping that the clock offset rests on, s; None while there is none."""
    @property
    def counters(self) -> dict[str, int]:
        """What the present link has counted (see Link); {} without one."""
    def close(self, reason: str = "") -> None:
        """Say bye and end; `poll` would connect again."""

class Rows:
    """Which rows of the image count: u and v of every camera, or some of them."""

    BOTH: slice
    NONE: slice
    ONE: dict[str, slice]
    def __init__(self, kind: str, joints: int, third: str | None = None) -> None: ...
    def of(self, camera: str) -> slice:
        """The slice of (u, v) of a camera that counts."""
    def choose(self, J: Mapping[str, Any]) -> None:  # noqa: N803
        """Settle on three rows, once that is possible."""
    def values(self, by_camera: Mapping[str, Any]) -> list[Any]:
        """What counts of {camera: a value for u and one for v}, of all cameras in turn."""
    def names(self, cameras: Any) -> list[str]:
        """As "A.u"."""
    def count(self, cameras: Any) -> int:
        """How many of these cameras' rows count."""
    def suffice(self, cameras: Any) -> bool:
        """Whether there are as many as joints."""

class Servo:
    """Models learn how the image moves; the one that was right lately decides."""

    using: str | None
    J: Any  # px/rad
    rows: Rows
    estimator: Any
    models: Any
    tolerance: float  # px
    def __init__(
        self,
        arm: Arm,
        models: Any,
        tolerance: float,
        seed: int = 0,
        known: bool = False,
        rows: Rows | None = None,
    ) -> None: ...
    @property
    def cameras(self) -> Any:
        """Those that it goes by."""
    @property
    def bound(self) -> tuple[float, ...] | None:
        """The posture that the last move leads to, at first perhaps farther off, rad; or None."""
    def suffices(self, cameras: Any) -> bool:
        """Whether what these cameras see determines where the joints go."""
    def observe_in_motion(self, camera: str, q: _Pose, s: Sequence[float]) -> None:
        """As ImageModels.observe_in_motion, of all models."""
    def prepare(self, q: _Pose, frames: Any) -> Iterator[Any]:
        """Learn ahead of `decide`, while the arm stands at q and is still being looked at."""
    def decide(self, q: _Pose, measurements: Sequence[Any], chase: Sequence[Any] = ()) -> Any:
        """What to do now that the arm stands at q (rad) and [Measurement] is what is seen."""
    def known(self, camera: str) -> Any:
        """Known of a camera; None before the arm has stood before it."""
    def shape(self, camera: str) -> Any:
        """How the image of a camera changes with the joints, as far as known: see models."""
    def learn_shape(self, camera: str, q: _Pose, s: Sequence[float]) -> Iterator[Any]:
        """Learn from a frame taken in motion: an iterator, each step a slice of the work."""
    def together(self, sights: Any, t: float) -> Any:
        """(image model, goal at time t, its velocity), of all that counts."""
    def uncertainty_penalty(self, q: _Pose) -> Any:
        """What is not known of J where the joints stand, at q (rad): a penalty for `nearing`."""
    def nearing(self, image: Any, goal: Any, start: _Pose, q: _Pose, penalty: Any) -> Iterator[Any]:
        """The steps from `start` to where joints that are at `q` should be (rad): see `descent`."""

class ReportServo:
    """The report's algorithm, to the letter."""

    EXPLORE: float
    FAR: float
    NEAR: float
    STEPS: tuple[float, ...]
    using: str
    J: Any
    rows: Rows
    estimator: Any
    cameras: Any
    def __init__(
        self,
        joints: Sequence[Joint],
        tolerance: float,
        rows: Rows | None = None,
        robust: bool = False,
    ) -> None: ...
    def suffices(self, cameras: Any) -> bool:
        """As Servo.suffices."""
    def observe_in_motion(self, camera: str, q: _Pose, s: Sequence[float]) -> None:
        """What is seen in motion is not used."""
    def known(self, camera: str) -> None:
        """As Servo.known: the report asks no camera why a joint stands."""
    def learn_shape(self, camera: str, q: _Pose, s: Sequence[float]) -> Iterator[Any]:
        """As Servo.learn_shape; there is nothing to learn."""
    def prepare(self, q: _Pose, frames: Any) -> Any:
        """As Servo.prepare; there is nothing to prepare."""
    def decide(self, q: _Pose, measurements: Sequence[Any], chase: Sequence[Any] = ()) -> Any:
        """As Servo.decide; the report has no chases."""

class Stream:
    """Steers by what is seen while the arm moves: every frame is of the joints at its own time."""

    FEWEST: int
    MOST: int
    NEAR: float
    REAIM: float
    STILL: float
    ARRIVED: float
    SURE: int
    SLOW_FOR: float
    STALE: float
    def __init__(self, servo: Servo) -> None: ...
    def begin(self, q: _Pose, bound: _Pose | None = None) -> None:
        """Begin with the first aim, rad; if it leads to another posture, that is `bound`."""
    def see(self, frame: Any, goal: Any) -> None:
        """Take in a MarkerFrame; `goal` is its GoalEstimate, None if that is a fixed pixel."""
    def reaim(self) -> Iterator[Any]:
        """Aim by what was seen since the last time: an iterator, each step a slice of the work."""
    def aim(self, t: float, q: _Pose, follow: bool = False) -> Any:
        """Where the joints, at q (rad) at time t, should be, as RobotArm.chase takes it."""

def make_servo(
    arm: Arm,
    method: str,
    mode: str,
    tolerance: float,
    seed: int = 0,
    rows: str = "stereo",
    third: str | None = None,
) -> tuple[Servo | ReportServo, Stream | None]:
    """(servo, stream or None) by the names of the command line."""

class Verdict(NamedTuple):
    """How a run ended."""

    word: str
    reason: str
    error: float | None  # px
    q: tuple[float, ...] | None  # rad
    moves: int
    measurements: int
    frames: int
    seconds: float

class VisualServoing:
    """The loop of one run."""

    def __init__(
        self,
        arm: RobotArm,
        client: TrackingClient,
        clock: _Ticking,
        servo: Servo | ReportServo,
        goals: Mapping[str, tuple[float, float]] | None = None,
        stream: Stream | None = None,
        budget: float = 60.0,
        most_moves: int | None = None,
        follow: float | None = None,
        log: Callable[[dict[str, Any]], object] | None = None,
        say: _Say = ...,
        number: int = 1,
        pictures: Any = None,
    ) -> None: ...
    def run(self) -> Verdict:
        """Servo until a verdict."""
    def progress(self) -> dict[str, Any]:
        """What the laptop is told of the run so far, as TrackingClient.report takes it."""
