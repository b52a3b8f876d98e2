"""The examples do what they say, by the emulator's truth, and say how they are run."""

import ast
import itertools
import math
import os
import re
import subprocess
import sys

import pytest
from places import ROOT
from shapely import LineString, MultiLineString, Point

from laptop.emulator.rig import Rig
from laptop.emulator.scene.camera_rig import CameraRig
from robot import api

FOLDER = ROOT / "laptop" / "examples"
EXAMPLES = {file.stem: file for file in sorted(FOLDER.glob("[!_]*.py"))}
LAPTOP_SIDE = {name for name, file in EXAMPLES.items() if "import brickservo" in file.read_text()}

NEAR = 0.25
"""Greatest distance of ink from where it should be: 2 degrees of backlash make 1.8 mm, cm."""
GOAL = (400, 200)
"""Where the examples that servo bring the tip, px."""


def turtle_path(start, sides):
    """The path of a turtle that goes so far, cm, and then turns left so much, degrees."""
    path, heading = [start], 0.0
    for length, turn in sides:
        x, y = path[-1]
        path.append((x + length * math.cos(heading), y + length * math.sin(heading)))
        heading += math.radians(turn)
    return path


def star(start):
    return [turtle_path(start, 5 * [(3, 144)])]


def rosette(start):
    below = start[0], start[1] - 3
    return [turtle_path(start, 18 * [(2, 100)]), Point(below[0], below[1] + 1.5).buffer(1.5, 64)]


def bow(start):
    parabola = [(8 + k / 20, 3 + (k - 60) ** 2 / 900) for k in range(121)]
    return [parabola, [(8, 9), (12, 9), (12, 10)]]


DRAWN = {"line": lambda start: [[(10, 0), (5, 10)]], "bow": bow, "rosette": rosette, "star": star}
"""What each that draws should draw, of where its first stroke begins."""


@pytest.mark.parametrize("name", DRAWN)
def test_the_ink_is_where_the_example_wants_it(name, capsys):
    with Rig("planar") as rig:
        run = rig.run(EXAMPLES[name])
    assert run.outcome.status == 0, capsys.readouterr().err
    shapes = DRAWN[name](run.wanted[0][0])
    lines = [s.exterior if hasattr(s, "exterior") else LineString(s) for s in shapes]
    strokes = [
        [(sample.x, sample.y) for sample in samples]
        for pen, samples in itertools.groupby(run.record, lambda sample: sample.pen)
        if pen
    ]
    assert len(strokes) == len(lines)
    for stroke, line in zip(strokes, lines, strict=True):
        assert max(line.distance(Point(place)) for place in stroke) < NEAR
    ink = MultiLineString(strokes)
    wanted = [place for line in lines for place in line.segmentize(0.1).coords]
    assert max(ink.distance(Point(place)) for place in wanted) < NEAR


@pytest.mark.long
def test_the_tip_truly_comes_to_the_goal(capsys):
    with Rig("planar", cameras="") as rig:
        run = rig.run(EXAMPLES["servo"])
        u, v = CameraRig(rig.arm, "").truth(rig.q)
    assert run.outcome.status == 0
    word, error, moves = capsys.readouterr().out.splitlines()[-1].split()
    assert word == "converged"
    assert float(error) < 5
    assert int(moves) > 2
    assert math.dist((u, v), GOAL) < 5 + 1


def test_what_is_seen_is_where_the_tip_truly_is(capsys):
    with Rig("planar", cameras="") as rig:
        run = rig.run(EXAMPLES["see"], faults="int@2")
        truth = CameraRig(rig.arm, "").truth(rig.q)
    assert run.outcome.status == 130
    shown = re.findall(r"^A [\d.]+ \((.+), (.+), (.+)\)$", capsys.readouterr().out, re.MULTILINE)
    assert len(shown) > 20
    for u, v, confidence in shown:
        assert math.dist((float(u), float(v)), truth) < 1
        assert 0.5 < float(confidence) <= 1


def output(name):
    """What an example on the laptop prints, run by this checkout's own package."""
    paths = [str(ROOT / "laptop" / "cli" / "package"), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, str(EXAMPLES[name])],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
def test_the_line_is_measured_by_the_true_ink():
    shown = dict(re.findall(r"^(\d) degrees: (\S+) mm", output("straightness"), re.MULTILINE))
    assert list(shown) == ["1", "2", "3"]
    assert float(shown["3"]) > float(shown["2"])  # which the file knows of
    with Rig("planar", plant="backlash=3") as rig:
        run = rig.run("driver.py", "line", "10,0", "5,10")
    line = LineString([(20, -20), (-5, 30)])
    true = max(10 * line.distance(Point(s.x, s.y)) for s in run.record if s.pen)
    assert float(shown["3"]) == pytest.approx(true, abs=0.006)


@pytest.mark.long
def test_all_laws_come_to_the_goal_before_the_same_camera():
    told = output("compare_laws")
    shown = re.findall(r"^(\w+): (\S+) s, tip at (\S+), (\S+) cm$", told, re.MULTILINE)
    assert len(re.findall("^converged", told, re.MULTILINE)) == 3
    seconds = {law: float(s) for law, s, _, _ in shown}
    assert sorted(seconds, key=seconds.get) == ["chain", "bold", "report"]
    x, y, _ = CameraRig(Rig("planar").arm, "tilt=20").place_at(GOAL, "effector")
    for *_, u, v in shown:
        assert math.dist((float(u), float(v)), (x, y)) < 0.5  # 5 px are 4 mm


def imports(source):
    """The modules and names that a program imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module, one.name) for one in node.names)
        elif isinstance(node, ast.Import):
            yield from ((one.name, "") for one in node.names)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short_says_how_it_is_run_and_imports_what_it_may(name):
    source = EXAMPLES[name].read_text("utf-8")
    told = ast.get_docstring(ast.parse(source))
    assert len(source.splitlines()) <= 40
    if name in LAPTOP_SIDE:
        assert f"`.uv/bin/uv run python laptop/examples/{name}.py`" in told
        others = {module for module, _ in imports(source)} - {"brickservo"}
        assert others <= sys.stdlib_module_names
    else:
        assert re.search(rf"`brickservo simulate (--scene \"\" )?{name}\.py`", told)
        assert f"`brickservo brick run {name}.py`" in told
        assert set(imports(source)) <= {("robot.api", one) for one in api.__all__}


def test_each_example_is_run_above():
    assert set(EXAMPLES) == {*DRAWN, "see", "servo", "bold_servo", "straightness", "compare_laws"}
