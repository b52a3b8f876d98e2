"""The arm in space: points of three numbers, lines at any slope, shapes at one height."""

import math
import re

import numpy as np
import pytest
from click.testing import CliRunner
from places import ROOT

from laptop.bench.draw import DrawCase, draw
from laptop.cli.main import laptop
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from robot.driver import LINES, main
from robot.motion import paths
from robot.motion.kinematics import branches, forward, joint_positions
from robot.servoing.chain_model import ChainModel
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("spatial"))


@pytest.mark.short("slanting", rest="claims")
@pytest.mark.parametrize("line", LINES[3], ids=["upright", "level", "slanting"])
def test_lines_in_space_are_as_straight_as_the_encoders_can_tell(line):
    assert math.dist(*line) == pytest.approx(12, abs=0.1)
    found = draw(DrawCase("spatial", "smooth", "no play", "backlash=0", 0.0, line, "line"))
    assert found.error == ""
    assert found.greatest <= 1.5 * found.floor
    assert found.end <= 1.5 * found.floor


def test_the_preferred_elbow_is_above_or_below_whichever_way_the_arm_faces():
    wide = tuple(joint._replace(lower=-3.5, upper=3.5) for joint in ARM.joints)
    point = (12.0, 3.0, 8.0)
    for preferred, sign in (("up", 1), ("down", -1)):
        poses = branches(ARM._replace(joints=wide, elbow=preferred), point)
        facing = {math.cos(q[0]) > 0 for q in poses[: len(poses) // 2]}
        assert facing == {True, False}
        for number, q in enumerate(poses):
            assert forward(ARM, q) == pytest.approx(point)
            *_, shoulder, elbow, tip = np.array(joint_positions(ARM, q))
            out = np.hypot(*(tip - shoulder)[:2])
            level = (elbow - shoulder) @ [*point[:2], 0] / np.hypot(*point[:2])
            above = (elbow - shoulder)[2] - (tip - shoulder)[2] * level / out
            wanted = sign if number < len(poses) // 2 else -sign
            assert above * wanted > 0


@pytest.mark.parametrize(
    ("args", "says"),
    [
        ("--arm spatial inverse 14,0 --height 4", "analytic        0.000,    5.548,  -78.703 deg"),
        ("--arm spatial inverse 14,0,4", "analytic        0.000,    5.548,  -78.703 deg"),
    ],
)
def test_a_height_completes_a_point(args, says, capsys):
    assert main(args.split()) == 0
    assert says in capsys.readouterr().out


@pytest.mark.parametrize("args", ["inverse 10,0,3", "inverse 10,0 --height 3"])
def test_an_arm_in_the_plane_has_no_height(args, capsys):
    assert main(args.split()) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "is no point for planar" in err


def test_shapes_lie_at_one_height():
    (circle,) = paths.circle((12, 0, 5), 3)
    assert {p[2] for p in circle} == {5}
    (arc,) = paths.arc([(10, 0, 5), (12, 5, 5), (5, 10, 5)])
    assert {p[2] for p in arc} == {5}
    assert len(paths.rectangle((8, 4, 5), (12, 8, 5))) == 4
    level = paths.line_from((10, 0, 5), math.pi / 2, 4)[0]
    assert level[1] == pytest.approx((10, 4, 5))
    with pytest.raises(paths.BadPath, match="an arc lies at one height, not at 5 and 5 and 6"):
        paths.arc([(10, 0, 5), (12, 5, 5), (5, 10, 6)])
    with pytest.raises(paths.BadPath, match="a rectangle lies at one height, not at 5 and 6"):
        paths.rectangle((8, 4, 5), (12, 8, 6))


def test_the_image_of_an_arm_in_space_is_learned_from_a_few_looks():
    rng = np.random.default_rng(4)
    camera = np.array([[20, 3, 1], [2, -18, 4.0]])

    def see(q):
        return (camera @ forward(ARM, q) / (1 + 0.004 * forward(ARM, q)[0])).tolist()

    low, high = (0.6 * np.array([getattr(j, s) for j in ARM.joints]) for s in ("lower", "upper"))
    model = ChainModel("spatial", [joint.link for joint in ARM.joints])
    for q in rng.uniform(low, high, (16, 3)).tolist():
        model.observe(q, see(q), 0.1)
    off = []
    for q in rng.uniform(low, high, (20, 3)):
        there = q + rng.uniform(-0.3, 0.3, 3)
        picture = model.seen_from(q.tolist(), see(q))
        off.append(math.dist(picture.predict(there.tolist()), see(there)))
        J = np.array(picture.jacobian(there.tolist()))
        for k, e in enumerate(1e-6 * np.eye(3)):
            ahead, behind = (picture.predict((there + sign * e).tolist()) for sign in (1, -1))
            slope = np.subtract(ahead, behind) / 2e-6
            assert np.allclose(J[:, k], slope, atol=1e-3)
    assert np.median(off) < 5
    assert max(off) < 25


SEES = """import sys
sys.path.insert(0, {root!r})
from robot.clock import Clock
from robot.tracking_client import TrackingClient, find_tracker

clock = Clock()
client = TrackingClient(*find_tracker(), clock=clock)
seen = {{}}
while len(seen) < {count}:
    seen.update(client.poll(0.1))
for name in sorted(seen):
    u, v, confidence = seen[name].markers["effector"]
    print("camera {{}}: {{:.2f}} {{:.2f}} {{:.2f}}".format(name, u, v, confidence))
client.close()
"""


@pytest.mark.long
def test_scripts_in_virtual_time_are_served_by_all_cameras(tmp_path, monkeypatch):
    scene, names = "C.tilt=45,B.azimuth=20,clutter=0,jpeg=0,exposure=0.004", "ABC"
    monkeypatch.setenv("SSH_CLIENT", "192.0.2.1 1 22")
    script = tmp_path / "sees.py"
    script.write_text(SEES.format(root=str(ROOT), count=len(names)))
    args = ["simulate", "--arm", "spatial", "--scene", scene, "--start", "30,45,-60"]
    args += ["--plant", "gravity=0"]  # or the arm would sink within its play
    result = CliRunner().invoke(laptop, [*args, "--out", str(tmp_path / "out"), str(script)])
    assert result.exit_code == 0, result.output
    found = dict(re.findall(r"camera (\w): (.*)", result.output))
    q = tuple(map(math.radians, (30, 45, -60)))
    for name in names:
        *place, confidence = map(float, found[name].split())
        truth = Scene(ARM, read_scene(scene, name)).truth(q)["effector"]
        assert place == pytest.approx(truth, abs=1.0)
        assert confidence > 0.5


def test_cameras_in_virtual_time_share_their_rate(tmp_path):
    args = ["simulate", "--arm", "spatial", "--scene", "B.fps=20", "--out", str(tmp_path)]
    shown = CliRunner().invoke(laptop, [*args, str(ROOT / "robot" / "driver.py")])
    assert shown.exit_code == 1
    assert shown.output.count("\n") == 1
    assert "B.fps" in shown.output


@pytest.mark.long
def test_a_run_in_space_is_shown_from_above_and_from_the_side(tmp_path):
    args = f"simulate --arm spatial --out {tmp_path} {ROOT / 'robot' / 'driver.py'}"
    shown = CliRunner().invoke(laptop, [*args.split(), "line", "14,0,6", "14,0,9"])
    assert shown.exit_code == 0, shown.output
    assert "path 1: 3.0 cm" in shown.output
    assert (tmp_path / "picture.png").stat().st_size > 20_000
    assert (tmp_path / "picture-side.png").stat().st_size > 20_000
    header, *rows = (tmp_path / "trace.csv").read_text().splitlines()
    assert header == "t,q1,q2,q3,x,y,z,pen"
    heights = [float(row.split(",")[6]) for row in rows if row.endswith(",1")]
    assert min(heights) == pytest.approx(6, abs=0.1)
    assert max(heights) == pytest.approx(9, abs=0.1)
