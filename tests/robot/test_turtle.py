"""The arm's turtle goes where Python's own goes; what it draws is judged by the true ink."""

import importlib
import math
import random
import sys

import pytest
from rig import Terminal, described, switched_on

from robot.motion import kinematics
from robot.turtle_graphics import BadTurtle, NoTurtleCommand, Turtle
from shared.arm_description import find_arm, read_arm

ARMS = [read_arm(find_arm(name)) for name in ("planar", "geared", "spatial")]


class Drawn:
    """A Driver that draws nothing but remembers what it was to draw."""

    class arm:  # noqa: N801
        description = ARMS[0]

    def __init__(self, arm=ARMS[0]):
        self.arm = type("Arm", (), {"description": arm})
        self.speed, self.elbow = None, None
        self.strokes = []

    def draw_planned(self, pieces, plans):
        points = [pieces[0][0]] + [p for piece in pieces for p in piece[1:]]
        self.strokes.append(points)


@pytest.fixture
def drawn():
    return Drawn()


@pytest.fixture
def turtle(drawn):
    return Turtle(drawn)


# As Python's own


def oracle():
    """Python's own turtle, as far as it is no picture."""
    try:
        return importlib.import_module("turtle").TNavigator()
    except ImportError:  # without tkinter
        pytest.skip("this Python has no turtle of its own")


COMMANDS = (
    [("forward", (30,)), ("fd", (11.5,)), ("back", (20,)), ("bk", (3,)), ("backward", (7,))]
    + [("left", (33,)), ("lt", (90,)), ("right", (45,)), ("rt", (200,)), ("setheading", (123,))]
    + [("seth", (-10,)), ("goto", (3, -4)), ("goto", ((5, 6),)), ("setpos", (1, 2)), ("home", ())]
    + [("setposition", (-3, 8)), ("setx", (4,)), ("sety", (-9,)), ("circle", (10,))]
    + [("circle", (12, 90)), ("circle", (-8, 200)), ("circle", (9, -120)), ("circle", (-7, -60))]
    + [("circle", (10, 180, 3)), ("circle", (5, None, 5)), ("circle", (-6, 120, 2))]
)


@pytest.mark.parametrize("seed", range(4))
def test_it_goes_where_pythons_own_goes(turtle, seed):
    theirs, draw = oracle(), random.Random(seed)
    turtle.penup()
    for k in range(120):
        name, args = draw.choice(COMMANDS)
        if k == 60:
            turtle.radians()
            theirs.radians()
        if k > 60 and name in ("circle", "left", "lt", "right", "rt", "setheading", "seth"):
            args = tuple(a and (a / 60 if n or name != "circle" else a) for n, a in enumerate(args))
            args = args[:2]
        getattr(turtle, name)(*args)
        getattr(theirs, name)(*args)
        assert turtle.position() == pytest.approx(tuple(theirs.pos()), abs=1e-6), (k, name, args)
        full = 360 if k < 60 else 2 * math.pi
        off = (turtle.heading() - theirs.heading()) / full
        assert off - round(off) == pytest.approx(0, abs=1e-9), (k, name, args)
        place = draw.uniform(-50, 50), draw.uniform(-50, 50)
        assert turtle.distance(*place) == pytest.approx(theirs.distance(*place))
        off = (turtle.towards(place) - theirs.towards(place)) / full
        assert off - round(off) == pytest.approx(0, abs=1e-9)
    assert (turtle.xcor(), turtle.ycor()) == turtle.pos()


# Strokes


def test_many_short_steps_are_one_stroke_drawn_when_the_pen_lifts(turtle, drawn):
    for _ in range(90):
        turtle.forward(1)
        turtle.left(1)
    assert drawn.strokes == []
    turtle.penup()
    assert len(drawn.strokes) == 1
    assert len(drawn.strokes[0]) == 91
    turtle.goto(500, 500)  # nobody goes there with the pen up
    turtle.goto(0, 0)
    turtle.pendown()
    assert turtle.isdown()
    turtle.done()
    assert len(drawn.strokes) == 1, "nothing was drawn since"


def test_a_hundred_units_are_five_centimetres_in_front_of_the_arm(turtle, drawn):
    turtle.goto(100, 0)
    turtle.goto(100, 50)
    turtle.done()
    (begin, corner, end) = drawn.strokes[0]
    assert begin == pytest.approx((13.2, 0.0))
    assert corner == pytest.approx((18.2, 0.0))
    assert end == pytest.approx((18.2, 2.5))


def test_scale_origin_turn_and_height_are_as_told():
    drawn = Drawn(ARMS[2])
    turtle = Turtle(drawn, scale=0.1, origin=(10, 2), turn=90, height=5)
    turtle.goto(20, -10)
    turtle.done()
    assert drawn.strokes[0][-1] == pytest.approx((11.0, 4.0, 5.0))


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_where_it_begins_there_is_room_for_a_circle_of_90_units(arm):
    turtle = Turtle(Drawn(arm))
    turtle.penup()
    turtle.goto(0, -90)
    turtle.pendown()
    turtle.circle(90)
    turtle.done()


def test_a_circle_closes_and_is_round(turtle, drawn):
    turtle.circle(40)
    turtle.done()
    (points,) = drawn.strokes
    assert points[0] == points[-1]
    assert len(points) > 100
    for x, y in points:
        assert math.hypot(x - 13.2, y - 2.0) == pytest.approx(2.0, abs=1e-6)


def test_a_stroke_without_end_is_drawn_piece_by_piece(turtle, drawn):
    for _ in range(200):
        turtle.forward(80)
        turtle.right(144)
    turtle.done()
    assert len(drawn.strokes) == 3
    assert drawn.strokes[0][-1] == pytest.approx(drawn.strokes[1][0])
    assert sum(len(points) - 1 for points in drawn.strokes) == 200


def test_its_speed_is_a_share_of_the_arms(turtle, drawn):
    assert turtle.speed() == 0
    for speed, share in ((10, 1.0), ("slow", 0.3), (1, 0.1), (0, 1.0), ("fastest", 1.0), (99, 1.0)):
        turtle.speed(speed)
        assert drawn.speed == pytest.approx(12 * share)


# What it refuses


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda t: t.forward("x"), "forward takes a number, not 'x'"),
        (lambda t: t.left(math.nan), "left takes a number"),
        (lambda t: t.goto(1e9, 0), "goes farther than any arm"),
        (lambda t: t.goto("home"), "goto takes"),
        (lambda t: t.circle(10, 90, 0), "1 to 5000 steps"),
        (lambda t: t.degrees(0), "more than 0"),
        (lambda t: t.color("red"), "has no color: a pen has one colour"),
        (lambda t: t.begin_fill(), "draw lines close together"),
        (lambda t: t.write("x"), "a laptop draws text"),
        (lambda t: t.forwards(1), "has no forwards: it has .*forward, "),
        (lambda t: Turtle(Drawn(), scale=0), "more than 0"),
        (lambda t: Turtle(Drawn(), origin=(1, 2, 3)), "origin takes"),
    ],
)
def test_what_it_cannot_do_is_refused_with_the_line(turtle, act, message):
    with pytest.raises((BadTurtle, NoTurtleCommand), match=message) as error:
        act(turtle)
    assert "\n" not in str(error.value)


def test_what_is_on_a_screen_only_does_nothing(turtle, drawn):
    turtle.hideturtle()
    turtle.ht()
    turtle.tracer(0, 0)
    turtle.shape("turtle")
    turtle.mainloop()
    assert drawn.strokes == []
    assert not hasattr(turtle, "__len__")


def test_what_cannot_be_reached_is_told_with_its_command_and_nothing_is_drawn(turtle, drawn):
    turtle.forward(50)
    turtle.left(90)
    turtle.forward(1000); line = sys._getframe().f_lineno  # fmt: skip # noqa: E702
    turtle.forward(10)
    with pytest.raises(kinematics.Unreachable) as error:
        turtle.penup()
    printed = str(error.value)
    assert printed.startswith(f"test_turtle.py, line {line}: forward(1000): ")
    assert "out of reach" in printed
    assert drawn.strokes == []
    turtle.penup()  # it is not told twice


# On the brick


@pytest.mark.long
def test_it_draws_with_the_arm(tmp_path):
    with switched_on(tmp_path, described("geared")) as rig:
        driver = rig.driver()
        turtle = rig.its(Turtle)(driver)
        for _ in range(4):
            turtle.forward(60)
            turtle.left(90)
        turtle.penup()
        turtle.goto(0, -60)
        turtle.pendown()
        turtle.circle(30)
        turtle.done()
        driver.arm.park()
    square, circle = rig.ink()
    x0, y0 = 13.2, 0.0
    for sample in square:
        x, y = abs(sample.x - x0 - 1.5), abs(sample.y - y0 - 1.5)
        assert max(x, y) == pytest.approx(1.5, abs=0.06)
    for sample in circle:
        assert math.hypot(sample.x - x0, sample.y + 1.5) == pytest.approx(1.5, abs=0.07)


SCRIPT = """
from robot.api import Turtle
turtle = Turtle()
{}
"""


@pytest.mark.parametrize(
    ("body", "status", "strokes", "printed"),
    [
        ("turtle.forward(40)", 0, 1, ""),
        ("turtle.forward(900)", 1, 0, "script.py, line 4: forward(900): "),
        ("turtle.fd(40); turtle.pu(); turtle.dot()", 1, 1, "script.py, line 4: the arm's turtle"),
        ("turtle.fd(40); 1 / 0", 1, 0, "ZeroDivisionError"),
    ],
)
def test_a_program_ends_well(tmp_path, monkeypatch, capsys, body, status, strokes, printed):
    rig = Terminal(tmp_path, monkeypatch, capsys)
    (tmp_path / "script.py").write_text(SCRIPT.format(body))
    outcome, _, err = rig.type(str(tmp_path / "script.py"))
    assert (outcome.status, outcome.reason) == (status, "ended")
    assert printed in err
    assert len(err.splitlines()) <= 1 or "Traceback" in err
    assert len(rig.ink()) == strokes
    assert not rig.brick.driven()
    assert rig.on_file()["parked"]


def test_a_signal_stops_it_and_parks(tmp_path, monkeypatch, capsys):
    for k, t in enumerate((2.0, 4.0)):
        rig = Terminal(tmp_path / str(k), monkeypatch, capsys)
        (tmp_path / "script.py").write_text(SCRIPT.format("turtle.forward(100)"))
        outcome, _, err = rig.type(str(tmp_path / "script.py"), signals=[(t, 15)])
        assert outcome.status != 0
        assert outcome.t < t + 0.6
        assert "stopped by SIGTERM" in err
        assert rig.on_file()["parked"]
