"""The one way to an emulated arm: runs one after the other, faults, the truth."""

import os
import re

import pytest
from refusals import refused

from laptop.emulator.faults import Fault, InvalidSimulationOption
from laptop.emulator.rig import Plugs, Rig
from robot.motion import kinematics

LINE = ("driver.py", "line", "10,0", "5,10")
MOVE = ("driver.py", "move")


def test_a_run_leaves_the_arm_where_the_next_one_finds_it(capsys):
    with Rig("planar", plant="cpu=0") as rig:
        assert rig.tip == pytest.approx(kinematics.forward(rig.arm, rig.q))
        first = rig.run(*MOVE, "12,6")
        there, end = rig.tip, rig.world.now()
        second = rig.run("driver.py", "where")
    assert there == pytest.approx((12, 6), abs=0.15)
    assert (first.outcome.status, second.outcome.status) == (0, 0)
    x, y = re.search(r"tip at ([-0-9.]+),([-0-9.]+) cm", capsys.readouterr().out).groups()
    assert (float(x), float(y)) == pytest.approx(there, abs=0.15)
    assert second.record[0].t == pytest.approx(end, abs=0.006)
    assert (first.began, second.began) == (0, end)
    assert len(first.record) + len(second.record) == len(rig.record)


def test_each_run_wanted_its_own_paths(capsys):
    with Rig("planar", plant="cpu=0") as rig:
        first, second = rig.run(*LINE), rig.run("driver.py", "line", "12,0", "9,9")
    assert [path[0] for path in first.wanted] == [(10, 0)]
    assert [path[0] for path in second.wanted] == [(12, 0)]


def test_its_runs_are_a_function_of_its_words():
    def drawn(seed):
        with Rig("geared", plant=f"cpu=0,seed={seed}") as rig:
            return [tuple(sample) for sample in rig.run(*LINE).record]

    assert drawn(4) == drawn(4)
    assert drawn(4) != drawn(5)


def test_faults_presses_and_what_happens_meanwhile_count_from_the_start_of_a_run(capsys):
    with Rig("planar", plant="cpu=0") as rig:
        rig.run(*MOVE, "12,6")
        begun, seen = rig.world.now(), []
        run = rig.run(
            *LINE,
            faults=["unplug:B@1.5"],
            meanwhile=[(1.0, lambda: seen.append(rig.world.now()))],
        )
    assert seen == [pytest.approx(begun + 1.0)]
    assert run.outcome.status == 1
    assert begun + 1.5 < run.outcome.t < begun + 2.5
    assert "port B no longer answers" in capsys.readouterr().err


def test_it_is_built_otherwise_than_the_programs_are_told():
    longer = Rig("planar").arm
    joint = longer.joints[0]
    longer = longer._replace(joints=(joint._replace(link=1.1 * joint.link), *longer.joints[1:]))
    with Rig("planar", built=longer, plant="cpu=0") as rig:
        rig.run(*MOVE, "12,6")
    assert kinematics.distance(kinematics.forward(rig.arm, rig.q), (12, 6)) < 0.15
    assert kinematics.distance(rig.tip, (12, 6)) > 0.5, "it knows of no longer link"


def test_a_brick_without_an_arm(tmp_path):
    script = tmp_path / "turn.py"
    script.write_text(
        "from ev3dev2.motor import LargeMotor\nLargeMotor('outB').on_for_degrees(50, 90)\n"
    )
    with Rig(None, plugs=Plugs({"B": "large"})) as rig:
        run = rig.run(script)
    assert run.motors["B"]["position"] == pytest.approx(90, abs=2)
    assert run.skeleton == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"built": "spatial"}, ["planar", "spatial", "one chain"]),
        ({"arm": None, "built": "planar"}, ["planar is built", "told of no arm"]),
        ({"start": "99"}, ["start '99'", "-90..170"]),
        ({"arm": None, "start": "lost"}, ["there is no arm"]),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(options, message):
    with pytest.raises(InvalidSimulationOption) as error:
        Rig(**options)
    assert refused(error, *message)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda rig: rig.run("drver.py"), ["drver.py", "no such script", "visual_servoing.py"]),
        (lambda rig: rig.run(*MOVE, "9,9", faults="melt@1"), ["'melt@1'", "unplug:PORT"]),
        (lambda rig: rig.run(*MOVE, "9,9", faults=Fault("block", "B", 1)), ["'block'", "stall"]),
        (lambda rig: rig.run(*MOVE, "9,9", faults=["stall:D@1"]), ["no motor at port D"]),
    ],
)
def test_a_run_that_makes_no_sense_is_refused_in_one_line(ask, message):
    with Rig("planar") as rig, pytest.raises(InvalidSimulationOption) as error:
        ask(rig)
    assert refused(error, *message)


@pytest.mark.parametrize(
    "ask", [lambda rig: rig.run(*MOVE, "9,9"), lambda rig: rig.tip, lambda rig: rig.see()]
)
def test_a_rig_that_is_not_open_says_so(ask):
    with pytest.raises(InvalidSimulationOption) as error:
        ask(Rig("planar", cameras=""))
    assert refused(error, "not open", "with Rig")


def test_nobody_watches():
    with Rig("planar") as rig, pytest.raises(InvalidSimulationOption) as error:
        rig.see()
    assert refused(error, "no camera watches", "tilt=20")


def test_nothing_of_it_is_left(tmp_path, monkeypatch):
    with Rig("planar") as rig:
        home = rig.state_folder
    assert not os.path.exists(home)
    folder = tmp_path / "home"
    folder.mkdir()
    with Rig("planar", state_folder=str(folder), plant="cpu=0") as rig:
        rig.run(*MOVE, "12,6")
    assert (folder / "planar.json").exists()
