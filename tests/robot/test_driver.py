"""The Driver draws what was wanted, judged by the true ink; and its command line."""

import math
import os
import re
import subprocess
import sys

import pytest
from rig import DRIVER, REPORT_LINES, Shell, degrees, described, from_line, switched_on
from waiting import PATIENCE

from laptop.emulator.device.buttons import read_press
from robot.motion.kinematics import Unreachable
from robot.motion.paths import BadPath, arc, circle, polyline, rectangle

ARMS = pytest.mark.parametrize("name", ["planar", "geared"])
THREE = pytest.mark.parametrize("line", REPORT_LINES, ids=["line 1", "line 2", "line 3"])
SLACK = 0.15  # mm


def off_path(p, path):
    """Distance of a point from a polyline with its ends, cm."""
    best = math.inf
    for (ax, ay), (bx, by) in zip(path, path[1:]):
        ux, uy = bx - ax, by - ay
        share = ((p[0] - ax) * ux + (p[1] - ay) * uy) / (ux * ux + uy * uy)
        share = min(max(share, 0.0), 1.0)
        best = min(best, math.hypot(p[0] - ax - share * ux, p[1] - ay - share * uy))
    return best


def greatest(ink, path):
    """Greatest deviation of a stroke from its path, mm."""
    return 10 * max(off_path((sample.x, sample.y), path) for sample in ink)


def distance(sample, p):
    """Distance of a sample from a point, mm."""
    return 10 * math.hypot(sample.x - p[0], sample.y - p[1])


def floor(arm, line, elbow="up"):
    """Half a count at each joint in the worst sign, across the line, at its largest; mm.

    Written down from the geometry: the shoulder moves the tip across its distance from the base,
    the elbow across the forearm.
    """
    (ax, ay), (bx, by) = line
    length = math.hypot(bx - ax, by - ay)
    nx, ny = -(by - ay) / length, (bx - ax) / length
    first, second = (joint.link for joint in arm.joints)
    worst = 0.0
    for k in range(401):
        x, y = ax + k / 400.0 * (bx - ax), ay + k / 400.0 * (by - ay)
        bend = math.acos((x * x + y * y - first**2 - second**2) / (2 * first * second))
        bend = bend if elbow == "up" else -bend
        shoulder = math.atan2(y, x) - math.atan2(
            second * math.sin(bend), first + second * math.cos(bend)
        )
        ex, ey = first * math.cos(shoulder), first * math.sin(shoulder)
        across = [
            abs(-py * nx + px * ny) * math.radians(0.5) / joint.gear
            for (px, py), joint in zip(((x, y), (x - ex, y - ey)), arm.joints)
        ]
        worst = max(worst, sum(across))
    return 10 * worst


def test_the_floor_is_the_one_that_is_known():
    known = [1.39, 1.75, 1.25]
    arm = described("planar")
    assert [floor(arm, line) for line in REPORT_LINES] == pytest.approx(known, abs=0.006)


# Smooth lines


@pytest.mark.short("0-line 2", "2-line 1", "3-line 3", rest="claims")
@THREE
@pytest.mark.parametrize("play", [0, 2, 3])
def test_a_line_is_straight_to_one_and_a_half_floors(tmp_path, line, play):
    with switched_on(tmp_path, described("planar", play)) as rig:
        rig.driver().draw_line(*line)
    (ink,) = rig.ink()
    assert greatest(ink, line) < 1.5 * floor(rig.arm, line) + SLACK
    assert distance(ink[-1], line[1]) < 2.0
    assert distance(ink[0], line[0]) < 3.0
    assert ink[-1].t - ink[0].t < 3.0


@pytest.mark.short("line 2", rest="claims")
@THREE
def test_the_geared_arm_is_straight_to_half_a_millimetre(tmp_path, line):
    with switched_on(tmp_path, "geared") as rig:
        rig.driver().draw_line(*line)
    (ink,) = rig.ink()
    assert greatest(ink, line) < 0.5
    assert distance(ink[-1], line[1]) < 0.5


@pytest.mark.short("planar-down", "geared-up")
@pytest.mark.parametrize("elbow", ["up", "down"])
@ARMS
def test_both_elbows_draw_the_same_line(tmp_path, name, elbow):
    line = ((12, 6), (15, -8))
    with switched_on(tmp_path, name) as rig:
        rig.driver(elbow=elbow).draw_line(*line)
    (ink,) = rig.ink()
    bends = [sample.q[1] for sample in ink]
    assert min(bends) > 0 if elbow == "up" else max(bends) < 0
    assert greatest(ink, line) < (
        0.5 if name == "geared" else 1.5 * floor(rig.arm, line, elbow) + SLACK
    )


@pytest.mark.short("21", rest="claims")
@pytest.mark.parametrize("seed", [21, 22, 23])
def test_on_plants_that_are_not_the_nominal_one(tmp_path, seed):
    line = REPORT_LINES[0]
    with switched_on(tmp_path, "planar", f"seed={seed}") as rig:
        rig.driver().draw_line(*line)
    (ink,) = rig.ink()
    assert greatest(ink, line) < 2.5 * floor(rig.arm, line)
    assert distance(ink[-1], line[1]) < 3.0


def test_a_degree_more_play_than_described_does_not_spoil_it(tmp_path):
    line = REPORT_LINES[0]
    with switched_on(tmp_path, "planar", "backlash=3") as rig:
        rig.driver().draw_line(*line)
    (ink,) = rig.ink()
    assert greatest(ink, line) < 1.5 * floor(rig.arm, line) + 1.5 + SLACK


@pytest.mark.short("6", rest="claims")
@pytest.mark.parametrize("speed", [1.5, 6])
def test_the_speed_asked_for_is_the_speed_of_the_tip(tmp_path, speed):
    line = ((14, 0), (8, 10))
    with switched_on(tmp_path) as rig:
        rig.driver(speed=speed).draw_line(*line)
    (ink,) = rig.ink()
    length = math.hypot(6, 10)
    middle = [s for s in ink if 0.3 < math.hypot(s.x - 14, s.y) / length < 0.7]
    approach = math.hypot(middle[-1].x - middle[0].x, middle[-1].y - middle[0].y)
    assert approach / (middle[-1].t - middle[0].t) == pytest.approx(speed, rel=0.1)


# Other shapes


SHAPES = [
    ("polyline", polyline([(10, 2), (14, 6), (9, 9), (6, 7)])),
    ("rectangle", rectangle((8, 3), (13, 8))),
    ("circle", circle((11, 5), 3)),
    ("arc", arc([(12, -3), (14, 3), (9, 9)])),
]


@pytest.mark.short("polyline-geared-smooth", "rectangle-planar-smooth", "circle-planar-steps")
@pytest.mark.parametrize(
    ("name", "method"), [("planar", "smooth"), ("planar", "steps"), ("geared", "smooth")]
)
@pytest.mark.parametrize("pieces", [s for _, s in SHAPES], ids=[n for n, _ in SHAPES])
def test_shapes_are_drawn_in_one_go(tmp_path, name, pieces, method):
    path = [pieces[0][0]] + [p for piece in pieces for p in piece[1:]]
    with switched_on(tmp_path, name) as rig:
        rig.driver(speed=4).draw(pieces, method)
    (ink,) = rig.ink()
    near, missed = {"smooth": (4.0, 4.0), "steps": (20.0, 25.0)}[method]
    if (name, method) == ("geared", "smooth"):
        near, missed = 1.0, 1.0
    assert greatest(ink, path) < near
    for p in path[:: max(1, len(path) // 40)]:
        assert min(distance(sample, p) for sample in ink) < missed


def test_the_pen_lifts_between_strokes_but_not_where_they_join(tmp_path):
    joined = [(11.0, 2.0), (14.0, 2.0), (14.0, 4.0), (11.0, 4.0)]
    bow = [(8 + k / 20, 6 + (k - 30) ** 2 / 900) for k in range(61)]
    with switched_on(tmp_path) as rig:
        rig.driver().draw([joined[:3], joined[2:], bow])
    first, second = rig.ink()
    assert greatest(first, joined) < 3.0
    assert greatest(second, bow) < 3.0
    for ink, path in ((first, joined), (second, bow)):
        for p in path:
            assert min(distance(sample, p) for sample in ink) < 3.5


@pytest.mark.parametrize("method", ["smooth", "steps"])
def test_no_stroke_is_drawn_where_another_cannot_be(tmp_path, method):
    with switched_on(tmp_path) as rig:
        driver = rig.driver()
        for last, error in (([(10, 0), (30, 0)], Unreachable), ([(1, 1)], BadPath)):
            with pytest.raises(rig.its(error)):
                driver.draw([[(10, 2), (10, 5)], last], method)
        driver.arm.park()
    assert rig.writes == []


# The pen


@pytest.mark.short("smooth-planar", "steps-geared")
@ARMS
@pytest.mark.parametrize("method", ["smooth", "steps"])
def test_the_pen_is_on_the_paper_along_the_line_only(tmp_path, name, method):
    line = ((5, 10), (10, 0))  # the arm comes from the other end of it, stretched
    with switched_on(tmp_path, name) as rig:
        rig.driver().draw_line(*line, method=method)
    (ink,) = rig.ink()
    assert distance(ink[0], line[0]) < 4.0, "down before the start"
    assert greatest(ink, line) < (4.0 if method == "smooth" else 20.0)
    assert not rig.brick.plant.pen_down
    approach = [s for s in rig.brick.record if s.t < ink[0].t]
    travelled = sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in zip(approach, approach[1:]))
    assert travelled > 10, "it was on its way with the pen up"
    assert ink[-1].t - ink[0].t < 20


def test_a_pen_where_it_should_be_is_not_moved_again(tmp_path):
    with switched_on(tmp_path) as rig:
        driver = rig.driver()
        driver.pen_down()
        assert rig.brick.plant.pen_down
        driver.pen_up()
        assert not rig.brick.plant.pen_down
        before = len(rig.writes)
        driver.pen_up()
        assert len(rig.writes) == before


def test_a_pen_left_on_the_paper_is_lifted_before_anything_moves(tmp_path):
    """The program before was stopped in mid-line."""
    line = REPORT_LINES[0]
    with switched_on(tmp_path) as rig:
        first = rig.driver()
        first.pen_down()
        first.arm.park()
        rig.driver().draw_line(*line)
    blot, ink = rig.ink()
    assert max(distance(sample, (20.8, 0)) for sample in blot) < 1.0
    assert greatest(ink, line) < 4.0


def test_an_arm_without_a_pen_motor_draws_all_the_same(tmp_path):
    line = REPORT_LINES[0]
    with switched_on(tmp_path, described("planar")._replace(pen=None)) as rig:
        driver = rig.driver()
        driver.pen_down()
        driver.draw_line(*line)
    assert distance(rig.brick.record[-1], line[1]) < 2.0


# Going somewhere


@pytest.mark.short("p0-planar", "p2-geared")
@ARMS
@pytest.mark.parametrize("p", [(8, 12), (15, -5), (-6, 9), (20.5, 0)])
def test_move_to_goes_there_with_the_pen_up(tmp_path, name, p):
    with switched_on(tmp_path, name) as rig:
        driver = rig.driver()
        driver.move_to(p)
        assert distance(rig.brick.record[-1], p) < (2.0 if name == "geared" else 5.0)
        assert rig.ink() == []
        x, y = driver.position()
        assert math.hypot(x - rig.tip[0], y - rig.tip[1]) < 0.4, "half the play at full reach"


def test_what_cannot_be_had_is_refused_before_anything_moves(tmp_path):
    with switched_on(tmp_path) as rig:
        driver = rig.driver()
        for act in (
            lambda: driver.move_to((0, 30)),
            lambda: driver.draw_line((10, 0), (30, 0)),
            lambda: driver.draw_line((10, 0), (30, 0), method="steps"),
            lambda: driver.draw(circle((18, 0), 4)),
        ):
            with pytest.raises(rig.its(Unreachable)):
                act()
        driver.arm.park()
    assert rig.writes == []


@pytest.mark.long
def test_one_drawing_after_the_other(tmp_path):
    with switched_on(tmp_path) as rig:
        driver = rig.driver()
        for line in REPORT_LINES:
            driver.draw_line(*line)
    inks = rig.ink()
    assert len(inks) == 3
    for ink, line in zip(inks, REPORT_LINES):
        assert greatest(ink, line) < 2 * floor(rig.arm, line) + SLACK


# The report's steps, to the letter


def noted(robot):
    """Where each step will begin, as far as the driver knows, and where it is to end, rad."""
    known, steps = [], []
    angles, step_to = robot.angles, robot.step_to

    def on_plan():
        known.append(angles())
        return known[-1]

    def step(q):
        steps.append((known[-1], tuple(q)))
        step_to(q)

    robot.angles, robot.step_to = on_plan, step
    return steps


@pytest.mark.short("line 1-planar", "line 3-geared")
@ARMS
@THREE
def test_steps_are_the_reports(tmp_path, name, line):
    with switched_on(tmp_path, name) as rig:
        driver = rig.driver()
        steps = noted(driver.arm)
        driver.draw_line(*line, method="steps")
    (ax, ay), (bx, by) = line
    assert len(steps) >= 5
    first, second = (joint.link for joint in rig.arm.joints)
    for here, there in steps:
        dq = [b - a for a, b in zip(here, there)]
        assert math.hypot(*dq) == pytest.approx(math.radians(5), rel=1e-6)
        a, b = here[0], here[0] + here[1]
        dx = -first * math.sin(a) * dq[0] - second * math.sin(b) * (dq[0] + dq[1])
        dy = first * math.cos(a) * dq[0] + second * math.cos(b) * (dq[0] + dq[1])
        # J dq points along y_f - y_i as it was fixed at the start, wherever the tip is now.
        length = math.hypot(dx, dy) * math.hypot(bx - ax, by - ay)
        assert (dx * (bx - ax) + dy * (by - ay)) / length == pytest.approx(1.0, abs=1e-6)
    (ink,) = rig.ink()
    end = ink[-1]
    left = (bx - end.x) * (bx - ax) + (by - end.y) * (by - ay)
    play = 0.3
    assert distance(end, line[1]) < 10 * (1.0 + play) or left < play * math.hypot(bx - ax, by - ay)
    commands = [(t, port) for t, port, _, text in rig.writes if text == "run-to-abs-pos"]
    assert len(commands) == 2 * len(steps)
    for (t, port), (later, other) in zip(commands[::2], commands[1::2]):
        assert (port, other) == ("A", "B")
        assert later - t < 0.02, "both are commanded before anything is waited for"


@pytest.mark.claims
def test_smooth_is_straighter_than_steps(tmp_path):
    line = REPORT_LINES[1]
    worst = {}
    for method in ("smooth", "steps"):
        folder = tmp_path / method
        with switched_on(folder) as rig:
            rig.driver().draw_line(*line, method=method)
        worst[method] = greatest(rig.ink()[0], line)
    assert worst["steps"] > 2 * worst["smooth"]


# The command line


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    return Shell(tmp_path, monkeypatch, capsys)


BAD = [
    ("fly", "fly"),
    ("line", "X,Y"),
    ("line 10,0", "two points"),
    ("line 10,0 5,10 3,3", "two points"),
    ("line 10,0 --angle 30", "--length"),
    ("line 10,0 --length 3", "--angle"),
    ("line 10,0 5,10 --angle 30 --length 3", "two points"),
    ("line 10,0 --angle 30 --length 0", "0.1"),
    ("line 10,0 --angle 30 --length -3", "0.1"),
    ("line 10,0 --angle 30 --length nan", "nan"),
    ("line 10,0 --angle 1000 --length 3", "-360"),
    ("line 10,0 --angle east --length 3", "east"),
    ("line 10 5", "'10' is not a point"),
    ("line 10,0,3 5,10", "10,0,3"),
    ("line 10;0 5,10", "X,Y"),
    ("line ten,0 5,10", "ten,0"),
    ("line nan,0 5,10", "finite"),
    ("line 5,10 inf,0", "finite"),
    ("line 5,10 -inf,0", "finite"),
    ("line 10,0 1e308,0", "farther than 1000 cm"),
    ("arc 10,0 5,10 1e308,0", "farther than 1000 cm"),
    ("arc 10,0 5,10 -1e308,0", "farther than 1000 cm"),
    ("line 10,0 10,0", "twice"),
    ("polyline 10,0", "2 points"),
    ("polyline 10,0 12,3 12,3", "twice"),
    ("arc 10,0 12,3", "3 points"),
    ("arc", "X,Y"),
    ("circle 10,0", "--radius"),
    ("circle --radius 2", "X,Y"),
    ("circle 10,0 --radius 0", "0.1"),
    ("circle 10,0 --radius -2", "0.1"),
    ("circle 10,0 11,0 --radius 2", "11,0"),
    ("rectangle 8,3", "X,Y"),
    ("rectangle 8,3 8,9", "opposite corners"),
    ("rectangle 8,3 9,9 10,10", "10,10"),
    ("move", "X,Y"),
    ("move 8", "'8' is not a point"),
    ("move 8,3 9,4", "9,4"),
    ("home 3,4", "3,4"),
    ("where --here", "--here"),
    ("line 10,0 5,10 --method wobbly", "wobbly"),
    ("line 10,0 5,10 --speed 0", "0.1"),
    ("line 10,0 5,10 --speed fast", "fast"),
    ("line 10,0 5,10 --speed 1e9", "50"),
    ("line 10,0 5,10 --speed nan", "nan"),
    ("line 10,0 5,10 --elbow left", "left"),
    ("line 10,0 5,10 --arm nowhere.ini", "nowhere.ini"),
    ("line 10,0 5,10 --colour red", "--colour"),
    ("--speed 0 line 10,0 5,10", "0.1"),
    ("--method wobbly", "wobbly"),
]


@pytest.mark.short(every=8)
@pytest.mark.parametrize(("args", "says"), BAD, ids=[args for args, _ in BAD])
def test_bad_arguments_are_refused_in_one_line(shell, args, says):
    shown = shell.run(*args.split(), aftermath=0.1)
    assert shown.status in (1, 2)
    assert shown.err.count("\n") == 1
    assert says in shown.err
    assert shown.err.startswith("driver.py")
    assert shown.out == ""
    assert shell.writes == []


def test_help_is_for_people(shell):
    shown = shell.run("--help")
    assert shown.status == 0
    for word in [
        "where",
        "home",
        "move",
        "line",
        "polyline",
        "arc",
        "circle",
        "rectangle",
        "--method",
        "--speed",
        "--elbow",
        "cm",
    ]:
        assert word in shown.out
    assert shown.err == ""
    assert shown.accesses == 0


def tip_told(out):
    return tuple(float(value) for value in re.search(r"tip at (\S+),(\S+) cm", out).groups())


def test_where_tells_the_tip_and_does_not_touch_the_motors(tmp_path, monkeypatch, capsys):
    sh = Shell(tmp_path, monkeypatch, capsys, start=degrees(40, 50))
    before = sh.on_file()
    shown = sh.run("where")
    assert (shown.status, shown.err) == (0, "")
    assert tip_told(shown.out) == pytest.approx(sh.tip, abs=0.3)
    assert sh.writes == []
    assert sh.on_file() == before


GOOD = [
    ("line 10,0 5,10", [(10, 0), (5, 10)]),
    ("line 10,-3 5,-10 --elbow down", [(10, -3), (5, -10)]),
    ("line -5,12 -2,16", [(-5, 12), (-2, 16)]),
    ("line -5,12 -.5,16.5", [(-5, 12), (-0.5, 16.5)]),
    ("line 10,0 --angle 90 --length 5", [(10, 0), (10, 5)]),
    ("line 10,0 --length 5 --angle -30", [(10, 0), (10 + 5 * math.cos(math.pi / 6), -2.5)]),
    ("--speed 6 line 10,0 5,10", [(10, 0), (5, 10)]),
    ("line --speed 6 10,0 5,10", [(10, 0), (5, 10)]),
    ("polyline 10,2 14,6 9,9", [(10, 2), (14, 6), (9, 9)]),
    ("rectangle 8,3 12,-2", [(8, 3), (12, 3), (12, -2), (8, -2), (8, 3)]),
]


@pytest.mark.short("line 10,-3 5,-10 --elbow down", "line 10,0 --length 5 --angle -30")
@pytest.mark.parametrize(("args", "path"), GOOD, ids=[args for args, _ in GOOD])
def test_what_was_ordered_is_drawn(shell, args, path):
    shown = shell.run(*args.split())
    assert (shown.status, shown.err) == (0, "")
    (ink,) = shell.ink()
    assert greatest(ink, path) < 4.0
    for p in path:
        assert min(distance(sample, p) for sample in ink) < 4.0
    assert distance(ink[0], path[0]) < 4.0
    assert math.hypot(*(a - b for a, b in zip(tip_told(shown.out), shell.tip))) < 0.6  # the play
    assert shell.on_file()["parked"] is not None


@pytest.mark.short("circle 11,5 --radius 3-18.84955592153876")
@pytest.mark.parametrize(
    ("args", "n"), [("circle 11,5 --radius 3", 2 * math.pi * 3), ("arc 12,-3 14,3 9,9", 14.5)]
)
def test_round_things_are_drawn(shell, args, n):
    shown = shell.run(*args.split())
    assert (shown.status, shown.err) == (0, "")
    (ink,) = shell.ink()
    length = sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in zip(ink, ink[1:]))
    assert length == pytest.approx(n, rel=0.15)


@pytest.mark.long
def test_options_count_before_and_after_the_command_and_the_later_wins(
    tmp_path, monkeypatch, capsys
):
    seconds = {}
    for args in (
        "--speed 3 line 12,0 9,6",
        "line 12,0 9,6 --speed 3",
        "--speed 9 line 12,0 9,6 --speed 3",
    ):
        sh = Shell(tmp_path, monkeypatch, capsys)
        assert sh.run(*args.split()).status == 0
        seconds[args] = sh.ink()[0][-1].t - sh.ink()[0][0].t
    assert max(seconds.values()) - min(seconds.values()) < 0.05
    assert min(seconds.values()) > math.hypot(3, 6) / 3


def test_steps_by_command(shell):
    assert shell.run("line", "10,0", "5,10", "--method", "steps").status == 0
    assert [text for _, _, _, text in shell.writes].count("run-to-abs-pos") > 10


def test_move_by_command(shell):
    shown = shell.run("move", "-6,9")
    assert shown.status == 0
    assert distance(shell.brick.record[-1], (-6, 9)) < 5
    assert shell.ink() == []


def test_home_here_by_command_takes_the_arm_as_it_stands(tmp_path, monkeypatch, capsys):
    sh = Shell(tmp_path, monkeypatch, capsys, start=degrees(1, -1), homed=False)
    shown = sh.run("home", "--here")
    assert (shown.status, shown.err) == (0, "")
    assert sh.busy == {}
    shown = sh.run("where")
    assert tip_told(shown.out) == pytest.approx((20.8, 0), abs=0.3)


@pytest.mark.long
def test_home_by_command(tmp_path, monkeypatch, capsys):
    sh = Shell(tmp_path, monkeypatch, capsys, start=degrees(60, -50), homed=False)
    shown = sh.run("home", "--seek")
    assert (shown.status, shown.err) == (0, "")
    assert max(abs(math.degrees(angle)) for angle in sh.q) < 2.5
    assert sh.run("line", "10,0", "5,10").status == 0
    assert greatest(sh.ink()[0], [(10, 0), (5, 10)]) < 4


@pytest.mark.short("lost")
@pytest.mark.parametrize("homed", [True, False], ids=["homed", "lost"])
def test_without_arguments_the_three_lines_of_the_report(tmp_path, monkeypatch, capsys, homed):
    """Someone starts it from the brick's menu."""
    start = "home" if homed else degrees(0.5, -0.5)  # as exactly as it was put at home
    sh = Shell(tmp_path, monkeypatch, capsys, start=start, homed=homed)
    shown = sh.run(presses=[] if homed else [read_press("enter@2")])
    assert (shown.status, shown.err) == (0, "")
    assert ("homing" in shown.out) is not homed
    assert ("shoulder 0, elbow 0 deg (stretched" in shown.out) is not homed
    inks = sh.ink()
    assert len(inks) == 3
    for ink, line in zip(inks, REPORT_LINES):
        assert greatest(ink, line) < (2 * floor(sh.arm, line) + SLACK if homed else 7.0)


def test_the_arm_is_found_by_option_and_by_environment(tmp_path, monkeypatch, capsys):
    sh = Shell(tmp_path, monkeypatch, capsys, arm="geared")
    monkeypatch.setenv("BRICKSERVO_ARM", "geared")
    assert sh.run("where").status == 0
    monkeypatch.setenv("BRICKSERVO_ARM", "nowhere")
    assert "nowhere" in sh.run("where").err
    assert sh.run("where", "--arm", "geared").status == 0
    assert sh.run("--arm", "geared", "where").status == 0


def test_it_can_be_started_by_its_file_name():
    with open(DRIVER, newline="") as file:
        assert file.readline() == "#!/usr/bin/env python3\n"
    assert os.access(DRIVER, os.X_OK)


def test_a_line_almost_through_the_base(tmp_path):
    """The elbow bends almost to its limit, and the shoulder turns as fast as it can."""
    line = ((19, 1), (7, 1))
    with switched_on(tmp_path) as rig:
        rig.driver().draw_line(*line)
    (ink,) = rig.ink()
    assert 10 * max(from_line((s.x, s.y), line) for s in ink) < 3.0


def test_two_signals_at_once_do_not_get_past_the_stop():
    """In a real process: emulated signals never arrive between two instructions."""
    code = """
import os, signal
from robot import program
program.raise_on_signals()
both = {signal.SIGINT, signal.SIGTERM}
signal.pthread_sigmask(signal.SIG_BLOCK, both)
for number in both:
    os.kill(os.getpid(), number)
try:
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, both)
        sum(range(100000))
    except BaseException:
        program.ignore_signals()
        os.kill(os.getpid(), signal.SIGHUP)
        print("stopped the motors")
        raise
except program.Stopped as error:
    print(error)
"""
    shown = subprocess.run(
        [sys.executable, "-c", code],
        cwd=os.path.dirname(os.path.dirname(DRIVER)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        universal_newlines=True,  # noqa: UP021 - `text` came with 3.7
        timeout=PATIENCE,
    )
    assert shown.stdout.splitlines()[0] == "stopped the motors"
    assert shown.stdout.splitlines()[1].startswith("stopped by SIG")
    assert shown.returncode == 0


def test_inverse_shows_three_ways_to_the_same_pose(shell):
    shown = shell.run("inverse", "10,0")
    lines = shown.out.splitlines()
    assert shown.status == 0
    assert [line for line in lines if line.startswith("analytic")] == [
        "analytic      -52.545,  123.321 deg",
        "analytic       52.545, -123.321 deg",
    ]
    for name in ("newton", "broyden"):
        trace = [line for line in lines if line.startswith(name)]
        assert "0.000,    0.000 deg, 10.800000 cm off" in trace[0]
        assert "-52.545,  123.321 deg, 0.000000 cm off" in trace[-1]


@pytest.mark.parametrize("args", [("line", "10,0", "10.02,0"), ("rectangle", "8,4", "8.02,9")])
def test_a_line_shorter_than_its_set_points_are_apart(shell, args):
    shown = shell.run(*args)
    assert (shown.status, shown.err) == (0, "")


@pytest.mark.parametrize(
    ("args", "on_plan"),
    [
        (("line", "10,0", "999,0"), "out of reach"),
        (("arc", "10,0", "12,0.000001", "11,0"), "points in order"),
    ],
    ids=["to the moon", "an arc all but straight, the wrong way round"],
)
def test_what_would_not_fit_the_bricks_memory_is_refused_first(shell, args, on_plan):
    shown = shell.run(*args)
    assert shown.status == 1
    assert on_plan in shown.err
    assert "Traceback" not in shown.err
