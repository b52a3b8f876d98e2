"""A turtle that draws with the arm: the names and meanings of Python's own turtle module.

    from robot.api import Turtle

    turtle = Turtle()
    for _ in range(4):
        turtle.forward(100)
        turtle.left(90)
    turtle.done()

Its steps are collected. A stroke is drawn in one go when the pen lifts, at `done`, and at the end
of the program; so many short steps are one smooth path.
"""

import atexit
import math
import os
import sys

from robot.motion import kinematics, paths, trajectory
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from types import FrameType, ModuleType, TracebackType  # noqa: F401
    from typing import Any, List, Optional, Sequence, Tuple, Type, Union  # noqa: F401

    from robot.drawing import Driver  # noqa: F401
    from robot.motion.chains import FixedPoint  # noqa: F401

    Place = Tuple[float, float]  # units
    Commands = Sequence[Tuple[str, str]]  # each, and where it stands in a program

CM_PER_UNIT = 0.05
"""Length of a turtle's unit, cm: 100 units are 5 cm."""

ORIGIN_SHARES = {2: 0.6, 3: 0.45}
"""Places where the turtle begins, of an arm in the plane and in space: on the x axis, at this share
between the least and the greatest distance that the links reach; there they have most room."""

CIRCLE_STEP = 0.1
"""Greatest distance of a circle's points, cm."""

MAX_LENGTH, MAX_POINTS = 300.0, 5000
"""Greatest length, cm, and number of points of a stroke; a longer one is drawn up to there."""

SPEEDS = {"fastest": 0, "fast": 10, "normal": 6, "slow": 3, "slowest": 1}
"""Speeds of a turtle by Python's words."""

IGNORED = (
    "hideturtle", "ht", "showturtle", "st", "shape", "shapesize", "turtlesize", "resizemode",
    "tracer", "delay", "title", "bgcolor", "setup", "colormode", "exitonclick", "screensize",
)  # fmt: skip
"""Names of commands that mean a screen, and do nothing here."""

ONE_PEN = "a pen has one colour and width: leave it out, and change the pen while it is lifted"

ADVICE = {
    "color": ONE_PEN, "pencolor": ONE_PEN, "fillcolor": ONE_PEN,
    "pensize": ONE_PEN, "width": ONE_PEN,
    "begin_fill": "nothing is filled: draw lines close together",
    "end_fill": "nothing is filled: draw lines close together",
    "dot": "use circle(radius)",
    "stamp": "draw the shape by forward and left",
    "write": "a laptop draws text",
    "undo": "ink stays: take a new sheet", "clear": "ink stays: take a new sheet",
    "reset": "ink stays: take a new sheet, and use home()",
    "onclick": "nobody clicks on paper", "onkey": "ask for keys by input()",
    "clone": "make another Turtle(): they share the pen",
    "Screen": "there is none: leave it out",
}  # fmt: skip
"""Advice by the names of commands that Python's turtle has and this one has not."""


class BadTurtle(ArmError, ValueError):
    """A command that no turtle could obey, or this one does not."""


class NoTurtleCommand(ArmError, AttributeError):
    """A name that this turtle does not have."""


class Turtle(object):
    """A turtle that holds the arm's pen, down at first; lengths are units, angles degrees.

    Args:
        driver: robot.drawing.Driver of an arm whose zero is known; None: the arm that
            $BRICKSERVO_ARM names, which is parked when the program ends.
        scale: length of a unit, cm.
        origin: its place (0, 0) as the arm has it, (x, y), cm; None: in front of the arm.
        turn: angle of its east from the arm's x, degrees counter-clockwise.
        height: z of all that it draws with an arm in space, cm.

    Raises:
        NotHomed: the zero is unknown.
        BadTurtle: a scale or place that is none.
    """

    def __init__(self, driver=None, scale=CM_PER_UNIT, origin=None, turn=0.0, height=0.0):
        # type: (Optional[Driver], float, Optional[Place], float, float) -> None
        self._driver = driver or _own_driver()
        self._arm = self._driver.arm.description
        self._scale = _number("scale", scale)
        if not self._scale > 0:
            raise BadTurtle("a scale of {:g} cm per unit is none; give more than 0".format(scale))
        if origin is None:
            least, greatest = kinematics.reach(self._arm)
            share = ORIGIN_SHARES[kinematics.coordinates(self._arm)]
            origin = least + share * (greatest - least), 0.0
        self._origin = tuple(_number("origin", x) for x in origin)
        if len(self._origin) != 2:
            raise BadTurtle("origin takes (x, y) in cm")
        turn = math.radians(_number("turn", turn))
        self._east = math.cos(turn), math.sin(turn)
        self._height = (
            (_number("height", height),) if kinematics.coordinates(self._arm) == 3 else ()
        )
        self._full = 360.0
        self._x = self._y = self._heading = 0.0  # units, and turns of a whole one
        self._is_down = True
        self._speed = 0
        self._own_speed = self._driver.speed
        self._points = []  # type: List[FixedPoint]
        self._places = []  # type: List[Tuple[str, str]]
        self._length = 0.0
        _turtles.append(self)

    # Motion

    def forward(self, distance):
        # type: (float) -> None
        """Go ahead by a distance, units."""
        self._ahead("forward", distance)

    def back(self, distance):
        # type: (float) -> None
        """Go backwards by a distance, units; the heading stays."""
        self._ahead("back", -_number("back", distance))

    def right(self, angle):
        # type: (float) -> None
        """Turn clockwise."""
        self._heading -= _number("right", angle) / self._full

    def left(self, angle):
        # type: (float) -> None
        """Turn counter-clockwise."""
        self._heading += _number("left", angle) / self._full

    def goto(self, x, y=None):
        # type: (Union[float, Place, Turtle], Optional[float]) -> None
        """Go straight to a place, given as x, y or as a pair; the heading stays."""
        x, y = _pair("goto", x, y)
        self._go(x, y, "goto({:g}, {:g})".format(x, y))

    def setx(self, x):
        # type: (float) -> None
        """Go to this x."""
        self._go(_number("setx", x), self._y, "setx({})".format(x))

    def sety(self, y):
        # type: (float) -> None
        """Go to this y."""
        self._go(self._x, _number("sety", y), "sety({})".format(y))

    def setheading(self, to_angle):
        # type: (float) -> None
        """Turn to a heading: 0 is east, 90 north."""
        self._heading = _number("setheading", to_angle) / self._full

    def home(self):
        # type: () -> None
        """Go to (0, 0), and head east."""
        self._go(0.0, 0.0, "home()")
        self._heading = 0.0

    def circle(self, radius, extent=None, steps=None):
        # type: (float, Optional[float], Optional[int]) -> None
        """Draw a circle whose centre is to the left, or a part of it.

        Args:
            radius: in units; negative: the centre is to the right.
            extent: angle of the part; None: all of it.
            steps: number of sides of a polygon that is drawn instead; None: a round one.
        """
        radius = _number("circle", radius)
        extent = self._full if extent is None else _number("circle", extent)
        turn = extent / self._full * (1 if radius >= 0 else -1)
        if steps is None:
            length = 2 * math.pi * abs(radius * turn) * self._scale
            steps = max(8, int(math.ceil(length / CIRCLE_STEP)))
        steps = int(_number("circle", steps))
        if not 1 <= steps <= MAX_POINTS:
            raise BadTurtle("circle takes 1 to {} steps, not {}".format(MAX_POINTS, steps))
        text = "circle({:g})".format(radius)
        begin, heading = (self._x, self._y), self._heading
        side = 2 * radius * math.sin(math.pi * turn / steps)
        side = abs(side) if extent >= 0 else -abs(side)
        for k in range(steps):
            angle = 2 * math.pi * (heading + turn * (k + 0.5) / steps)
            x, y = self._x + side * math.cos(angle), self._y + side * math.sin(angle)
            if k == steps - 1 and abs(turn) == 1.0:
                x, y = begin  # rounding leaves no gap
            self._go(x, y, text)
        self._heading = heading + turn

    # The pen

    def penup(self):
        # type: () -> None
        """Lift the pen: the stroke so far is drawn."""
        self.flush()
        self._is_down = False

    def pendown(self):
        # type: () -> None
        """Lower the pen."""
        self._is_down = True

    def isdown(self):
        # type: () -> bool
        """Return whether the pen is down."""
        return self._is_down

    def flush(self):
        # type: () -> None
        """Draw now what has been collected.

        Raises:
            kinematics.Unreachable: naming the command; nothing of the stroke is drawn.
        """
        points, places = self._points, self._places
        self._points, self._places, self._length = [], [], 0.0
        if len(points) < 2:
            return
        try:
            pieces = paths.pieces_of(points)
        except paths.BadPath:
            return  # it stayed where it was
        driver = self._driver
        try:
            plans = trajectory.plan(self._arm, pieces, driver.speed, driver.elbow)
        except kinematics.Unreachable as problem:
            raise kinematics.Unreachable(
                "{}: {}".format(self._unreachable_command(points, places), problem)
            ) from None
        driver.draw_planned(pieces, plans)

    def done(self):
        # type: () -> None
        """Draw what has been collected: the end of a turtle's program."""
        self.flush()

    # Its state

    def position(self):
        # type: () -> Place
        """Return its place (x, y), units."""
        return self._x, self._y

    def xcor(self):
        # type: () -> float
        """Return its x, units."""
        return self._x

    def ycor(self):
        # type: () -> float
        """Return its y, units."""
        return self._y

    def heading(self):
        # type: () -> float
        """Return its heading: 0 is east, 90 north."""
        return self._heading % 1.0 * self._full

    def towards(self, x, y=None):
        # type: (Union[float, Place, Turtle], Optional[float]) -> float
        """Return the heading from here to a place."""
        x, y = _pair("towards", x, y)
        turns = math.atan2(y - self._y, x - self._x) / (2 * math.pi)
        return turns % 1.0 * self._full

    def distance(self, x, y=None):
        # type: (Union[float, Place, Turtle], Optional[float]) -> float
        """Return the distance of a place from here, units."""
        x, y = _pair("distance", x, y)
        return math.hypot(x - self._x, y - self._y)

    def speed(self, speed=None):
        # type: (Union[float, str, None]) -> Optional[int]
        """Set the tip's speed, 1 slow to 10 fast, 0 the arm's own; or return it."""
        if speed is None:
            return self._speed
        number = SPEEDS.get(speed, speed) if isinstance(speed, str) else speed
        number = _number("speed", number)
        self.flush()
        self._speed = int(round(number)) if 0.5 < number < 10.5 else 0
        share = self._speed / 10.0 if self._speed else 1.0
        self._driver.speed = share * (self._own_speed or self._arm.speed)
        return None

    def degrees(self, fullcircle=360.0):
        # type: (float) -> None
        """Let angles be degrees, or other parts of a full circle."""
        full = _number("degrees", fullcircle)
        if not full > 0:
            raise BadTurtle("degrees takes how many a full circle has, more than 0")
        self._full = full

    def radians(self):
        # type: () -> None
        """Let angles be radians."""
        self._full = 2 * math.pi

    fd, bk, backward, rt, lt = forward, back, back, right, left
    setpos = setposition = goto
    seth = setheading
    pu = up = penup
    pd = down = pendown
    pos = position
    mainloop = done
    update = flush

    def __getattr__(self, name):
        # type: (str) -> Any
        if name in IGNORED:
            return _do_nothing
        if name.startswith("_"):
            raise AttributeError(name)
        advice = ADVICE.get(name, "it has {}".format(", ".join(COMMANDS)))
        raise NoTurtleCommand("{}the arm's turtle has no {}: {}".format(_caller(), name, advice))

    # Inside

    def _ahead(self, word, distance):
        # type: (str, float) -> None
        distance = _number(word, distance)
        angle = 2 * math.pi * self._heading
        x, y = self._x + distance * math.cos(angle), self._y + distance * math.sin(angle)
        self._go(x, y, "{}({:g})".format(word, abs(distance)))

    def _go(self, x, y, text):
        # type: (float, float, str) -> None
        start = self._place(self._x, self._y)
        self._x, self._y = x, y
        if not self._is_down:
            return
        end = self._place(x, y)
        if max(map(abs, end)) > paths.MAX_COORDINATE:
            raise BadTurtle("{}{} goes farther than any arm".format(_caller(), text))
        if not self._points:
            self._points.append(start)
        self._points.append(end)
        self._places.append((text, _caller()))
        self._length += kinematics.distance(start, end)
        if self._length > MAX_LENGTH or len(self._points) > MAX_POINTS:
            self.flush()

    def _place(self, x, y):
        # type: (float, float) -> FixedPoint
        """Return a place of the turtle's (units) as the arm has it, cm."""
        (cos, sin), scale = self._east, self._scale
        return (
            self._origin[0] + scale * (x * cos - y * sin),
            self._origin[1] + scale * (x * sin + y * cos),
        ) + self._height

    def _unreachable_command(self, points, places):
        # type: (Sequence[FixedPoint], Commands) -> str
        """Return the first command of a stroke that cannot be drawn, for people."""
        for a, b, (text, caller) in zip(points, points[1:], places):
            try:
                trajectory.plan(self._arm, [(a, b)], elbow=self._driver.elbow)
            except kinematics.Unreachable:
                return caller + text
            except ZeroDivisionError:
                continue  # it stayed there
        text, caller = places[0]
        return "{}the stroke that begins with {}".format(caller, text)


COMMANDS = tuple(sorted(name for name in vars(Turtle) if not name.startswith("_")))
"""Names of the commands that a turtle obeys."""


def _do_nothing(*args, **options):
    # type: (*object, **object) -> None
    """Do nothing: for commands that mean a screen."""


def _number(word, value):
    # type: (str, Any) -> float
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise BadTurtle("{}{} takes a number, not {!r:.40}".format(_caller(), word, value))
    return number


def _pair(word, x, y):
    # type: (str, Any, Optional[float]) -> Place
    if y is None:
        try:
            x, y = x.position() if isinstance(x, Turtle) else x
        except (TypeError, ValueError):
            raise BadTurtle("{}{} takes x, y, or a pair".format(_caller(), word)) from None
    return _number(word, x), _number(word, y)


def _caller():
    # type: () -> str
    """Return the line that is being obeyed, as 'my_turtle.py, line 12: '; "" if not known."""
    frame = sys._getframe(1)  # type: Optional[FrameType]
    while frame is not None and frame.f_code.co_filename == __file__:
        frame = frame.f_back
    if frame is None:
        return ""
    return "{}, line {}: ".format(os.path.basename(frame.f_code.co_filename), frame.f_lineno)


# ---- a program of its own

_turtles = []  # type: List[Turtle] # all that were made
_own = []  # type: List[Driver] # the Driver of a program that made none, once it has one


def _own_driver():
    # type: () -> Driver
    """Return the Driver of $BRICKSERVO_ARM; from now on errors and signals park the arm."""
    if _own:
        return _own[0]
    from robot import program
    from robot.clock import Clock
    from robot.drawing import Driver
    from shared.arm_description import find_arm, read_arm
    from shared.state import default_arm

    _end_well(program)
    arm = program.connect(read_arm(find_arm(default_arm())), Clock())
    arm.load_zero()
    _own.append(Driver(arm))
    return _own[0]


def _end_well(program):
    # type: (ModuleType) -> None
    """Let errors be one line, and let no end of the program leave a motor on or a stroke out."""
    from shared.message_fields import printable

    failed = []  # type: List[BaseException]

    def report(kind, error, trace):
        # type: (Type[BaseException], BaseException, Optional[TracebackType]) -> None
        failed.append(error)
        if isinstance(error, (ArmError, program.Stopped)):
            sys.stderr.write("{}\n".format(printable(str(error))))
        else:
            before(kind, error, trace)

    def end():
        # type: () -> None
        status = 0
        try:
            if not failed:
                for turtle in _turtles:
                    turtle.flush()
        except (ArmError, program.Stopped) as error:
            report(type(error), error, None)
            status = getattr(error, "status", 1)
        program.ignore_signals()
        for driver in _own:
            driver.arm.park(low=not failed)
        if status:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)

    before, sys.excepthook = sys.excepthook, report
    atexit.register(end)
    program.raise_on_signals()
