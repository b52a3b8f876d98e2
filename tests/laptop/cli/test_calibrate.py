"""`calibrate`, end to end: what it finds, what it says where something is wrong, what it writes."""

import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import spoilt_rigs
from click import ClickException, UsageError
from click.testing import CliRunner
from csv_rows import rows_in
from run_json import run_in

from laptop.cli import calibrate
from laptop.cli.main import laptop
from laptop.emulator.scene.optics import to_srgb
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.arm import arm_result, emulated_setups
from laptop.measure.arm.arm_fit import BadIdentification
from laptop.measure.run_data import Sights
from laptop.record.run_folder import run_folder
from laptop.see.table.camera_file import write_camera
from shared.arm_description import find_arm, read_arm

PLANAR = find_arm("planar")


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))

    def calibrate(*args, status=0):
        result = CliRunner().invoke(laptop, ["measure", "arm", "--out", "out", *args])
        assert result.exit_code == status, result.output
        return result

    return calibrate


def refused(result, tmp_path):
    """Return what it said in the end; nothing has come of it."""
    assert isinstance(result.exception, SystemExit), result.exception
    assert list((tmp_path / "out").glob("*")) == []
    assert not (tmp_path / "state").exists()
    *_, last = result.output.strip().splitlines()
    assert last.endswith("nothing was written")
    return last


# What is typed


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        ((), "--camera 0"),
        (("--camera", "0", "--simulate"), "leave --camera out"),
        (("--camera", "0", "--seed", "3"), "--seed is of"),
        (("--camera", "0", "--scene", ""), "--scene is of"),
        (("--simulate", "--effector", "red"), "leave --effector out"),
        (("--simulate", "--brick"), "leave --brick out"),
        (("--simulate", "--crosses", "1,2"), "3 different crosses are the least, 6 are better"),
        (("--simulate", "--crosses", "1,2,3,01"), "touch each cross once, others tell more"),
        (
            ("--simulate", "--crosses", "1,2,12"),
            "the crosses have numbers from 1 to 9, like 1,3,7,9",
        ),
        (("--simulate", "--crosses", "1,2,3", "--arm", "spatial"), "is for an arm in the plane"),
        (("--simulate", "--bar", "nan"), "50<=x<=200"),
        (("--simulate", "--timeout", "5"), "60<=x<=900"),
    ],
)
def test_words_that_do_not_go_together_are_refused(run, tmp_path, args, reported):
    result = run(*args, status=2)
    assert reported in result.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        (("--scene", "board=none"), "the scene has no board: --scene board=a4,board_x=12"),
        (("--scene", "tilt=200"), "tilt = 200"),
        (("--plant", "backlash=99"), "backlash = 99"),
        (("--built", "nowhere.ini"), "nowhere.ini"),
        (("--arm", "nowhere.ini"), "nowhere.ini"),
    ],
)
def test_a_text_that_cannot_be_is_refused_before_anything_moves(run, args, reported):
    result = run("--simulate", *args, status=1)
    assert reported in result.output
    assert isinstance(result.exception, SystemExit)


def test_two_do_not_write_into_one_folder(run, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    with run_folder("measure-arm", out):
        result = run("--simulate", status=1)
    assert "for out; " in result.output
    assert list(out.iterdir()) == []


# What comes of it


@pytest.mark.long
def test_an_emulated_arm_is_measured_and_drawn_with_and_reported(run, tmp_path):
    built = tmp_path / "built.ini"
    text = Path(find_arm("planar")).read_text()
    built.write_text(text.replace("link = 11.3", "link = 11.6").replace("= 9.5", "= 9.2"))
    args = ("--seed", "3", "--built", str(built), "--plant", "cpu=0,backlash=3,spread=0")
    result = run(
        "--simulate", *args, "--bar", "100", "--crosses", "1,3,4,6,7,9", "--board-square", "0"
    )
    found = read_arm(tmp_path / "out" / "planar.ini")
    for joint, link in zip(found.joints, (11.6, 9.2), strict=True):
        assert joint.link == pytest.approx(link, abs=0.07)
        assert math.degrees(joint.backlash) == pytest.approx(3.0, abs=0.5)
    assert not (tmp_path / "state" / "arms").exists(), "an emulated arm leaves the real one alone"
    assert "home --here" not in result.output
    # The arm's file is one to draw with.
    drawn = CliRunner().invoke(
        laptop,
        ["simulate", "--arm", "out/planar.ini", "--built", str(built), "--out", "drawn",
         "--plant", "cpu=0,backlash=3", "driver.py", "line", "10,2", "12,5"],
    )  # fmt: skip
    assert drawn.exit_code == 0, drawn.output
    # And what was measured is there for a report.
    reported = run_in(tmp_path / "out")
    assert (reported["reason"], reported["brick"]) == ("calibrated", "emulated")
    assert reported["files"] == ["planar.ini", "rests.csv"]
    assert ("shoulder: link", "cm") in [(row["number"], row["unit"]) for row in reported["numbers"]]
    poses = next(row["value"] for row in reported["values"] if row["what"] == "poses")
    rests = rows_in(tmp_path / "out" / "rests.csv")
    assert len(rests) == poses
    off = [float(row["off_u_px"]) for row in rests if row["off_u_px"]]
    assert math.sqrt(sum(x * x for x in off) / len(off)) < 1.0


@pytest.mark.claims
def test_rendered_pictures_tell_the_same(run, tmp_path):
    mine = Path(shutil.copyfile(find_arm("planar"), tmp_path / "mine.ini"))
    run(
        "--simulate", "--arm", str(mine), "--scene", "marker_stray=0.4,seed=3,fps=8", "--seed", "2",
        "--plant", "cpu=0,backlash=1,spread=0", "--marker-height", "25", "--bar", "100",
        "--crosses", "1,3,4,6,7,9",
    )  # fmt: skip
    found = read_arm(tmp_path / "out" / "mine.ini")
    assert [joint.link for joint in found.joints] == pytest.approx([11.3, 9.5], abs=0.07)
    assert [math.degrees(joint.backlash) for joint in found.joints] == pytest.approx(
        [1.0, 1.0], abs=0.5
    )
    assert math.hypot(*found.marker_offset) == pytest.approx(0.4, abs=0.08)
    assert mine.read_text() == Path(find_arm("planar")).read_text()


@pytest.mark.long
def test_an_arm_in_space_is_measured_too(run, tmp_path):
    built = tmp_path / "built.ini"
    text = Path(find_arm("spatial")).read_text()
    built.write_text(text.replace("link = 11.3", "link = 11.6"))
    result = run(
        "--simulate", "--arm", "spatial", "--built", str(built), "--bar", "100",
        "--marker-height", "120", "--board-square", "0", "--plant", "cpu=0,backlash=1.2,spread=0",
    )  # fmt: skip
    base, shoulder, elbow = read_arm(tmp_path / "out" / "spatial.ini").joints
    assert base.link == pytest.approx(12.0, abs=0.1)
    assert shoulder.link == pytest.approx(11.6, abs=0.08)
    assert elbow.link == 9.5, "unknown"
    assert math.degrees(shoulder.home) == pytest.approx(45, abs=0.4)
    for joint in (base, shoulder, elbow):
        assert math.degrees(joint.backlash) == pytest.approx(1.2, abs=0.5)
    assert "base: tilt about x             0.000     " in result.output


@pytest.mark.long
def test_where_the_arms_file_is_refused_no_summary_says_calibrated(run, tmp_path, monkeypatch):
    def refuse(*_):
        raise BadIdentification("home lies outside its limits")

    monkeypatch.setattr(arm_result, "write_measured", refuse)
    done = run("--simulate", "--timeout", "60", status=1)
    assert "outside its limits" in done.output
    assert list((tmp_path / "out").glob("*")) == []


@pytest.mark.long
def test_a_dry_run_tells_and_changes_no_arm(run, tmp_path):
    result = run("--simulate", "--plant", "cpu=0", "--preview", "--timeout", "60")
    assert "the arm's file was left as it is, as wished" in result.output
    assert sorted(one.name for one in (tmp_path / "out").iterdir()) == ["rests.csv", "run.json"]


@pytest.mark.long
def test_what_sight_alone_does_not_tell_stays_as_it_was(run, tmp_path):
    """The disc sits 4 mm beside the pen: taken for the elbow's zero that is 1.5 degrees."""
    args = (
        "--scene",
        "marker_stray=0.4",
        "--bar",
        "100",
        "--marker-height",
        "25",
        "--timeout",
        "90",
    )
    result = run("--simulate", "--plant", "cpu=0", *args)
    assert re.search(r"elbow: home \(its zero\) +0\.000 +unknown", result.output)
    found, before = (read_arm(p).joints[1] for p in (str(tmp_path / "out/planar.ini"), PLANAR))
    assert (found.home, found.link) == (before.home, before.link)


# What is said where something is wrong


def test_a_board_half_covered_is_told_before_the_arm_moves(run, tmp_path, monkeypatch):
    spoilt_rigs.spoil_pictures(monkeypatch, spoilt_rigs.half_covered)
    said = refused(run("--simulate", "--scene", "", status=1), tmp_path)
    assert "10 of the board's 26" in said
    assert "uncover it" in said


def test_a_picture_smeared_over_200_px_is_told_before_the_arm_moves(run, tmp_path, monkeypatch):
    spoilt_rigs.spoil_pictures(monkeypatch, spoilt_rigs.smeared)
    said = refused(run("--simulate", "--scene", "", status=1), tmp_path)
    assert "blurred" in said


@pytest.mark.long
@pytest.mark.parametrize(
    ("spoil", "first", "reported"),
    [
        (spoilt_rigs.smeared, 1, "blurred"),
        (spoilt_rigs.without_red, 1, "0 of 12 poses"),
        (spoilt_rigs.pushed, 90, "board was moved after pose"),
    ],
    ids=["smeared", "out of sight", "pushed"],
)
def test_what_happens_to_pictures_in_mid_run_is_told(
    run, tmp_path, monkeypatch, spoil, first, reported
):
    spoilt_rigs.spoil_pictures(monkeypatch, spoil, first)
    assert reported in refused(
        run("--simulate", "--scene", "fps=8", "--plant", "cpu=0", status=1), tmp_path
    )


@pytest.mark.long
def test_a_print_of_a_wrong_size_is_told_and_its_bar_measured_mends_it(run, tmp_path):
    args = (
        "--simulate",
        "--scene",
        "board_scale=0.97,fps=6",
        "--plant",
        "cpu=0",
        "--marker-height",
        "25",
    )
    said = refused(run(*args, status=1), tmp_path)
    assert "link of the shoulder is 3." in said  # the other one nobody knows
    assert "--bar" in said
    run(*args, "--bar", "97")


@pytest.mark.long
def test_too_few_pictures_are_not_taken_for_a_marker_out_of_sight(run, tmp_path):
    said = refused(run("--simulate", "--scene", "fps=3", "--plant", "cpu=0", status=1), tmp_path)
    assert "fewer than 3 pictures" in said


@pytest.mark.long
@pytest.mark.parametrize(
    ("wrong", "reported"),
    [
        ({"links": spoilt_rigs.slipped(1, math.radians(4), 90)}, "elbow slipped"),
        ({"links": spoilt_rigs.slipped(0, math.radians(9), 30)}, "shoulder slipped"),
        ({"links": spoilt_rigs.loose(1, math.radians(3), 2)}, "elbow stands now here"),
        ({"sight": spoilt_rigs.moved((30, 10), 90)}, "board was moved after pose"),
        ({"sight": spoilt_rigs.hidden(200)}, " of 12 poses"),
        ({"links": lambda q, t: q * (1, -1)}, "elbow turns the other way"),
    ],
    ids=["elbow slips", "shoulder slips", "loose", "pushed", "hidden", "turned"],
)
def test_an_arm_that_does_not_fit_is_told_and_no_file_is_touched(
    run, tmp_path, monkeypatch, wrong, reported
):
    monkeypatch.setattr(emulated_setups, "EmulatedRig", spoilt_rigs.spoilt_rig(**wrong))
    mine = Path(shutil.copyfile(find_arm("planar"), tmp_path / "mine.ini"))
    before = mine.read_bytes()
    said = refused(run("--simulate", "--arm", str(mine), "--plant", "cpu=0", status=1), tmp_path)
    assert reported in said
    assert mine.read_bytes() == before
    assert not Path(f"{mine}.bak").exists()


# Before real cameras


class FakeRig:
    """Pictures that stand still, instead of a live rig's."""

    def __init__(self, image):
        self._image = image

    def image(self):
        return self._image

    def watch(self, seconds):
        pixels = np.array([(200.0, 150.0)] * 8)
        return {"A": Sights(np.arange(8.0), pixels)}


@pytest.fixture(scope="module")
def picture():
    scene = Scene(read_arm(find_arm("planar")), read_scene(emulated_setups.SCENE_PREFIX))
    return np.round(to_srgb(scene.image((2.4, 1.2)))).astype(np.uint8)


def test_a_camera_that_moved_is_noticed_by_the_board_in_the_end(picture):
    rig = FakeRig(picture)
    found, check = calibrate._calibrated(rig, None, 98.0)
    assert found.bar == 98.0
    check()
    rig._image = spoilt_rigs.pushed(picture, 4)
    with pytest.raises(BadIdentification, match=r"4\.0 px.*nothing was written"):
        check()
    rig._image = spoilt_rigs.smeared(picture)
    with pytest.raises(BadIdentification, match="blurred"):
        check()


def test_a_camera_file_is_believed_only_where_the_camera_still_is(picture, tmp_path):
    rig, file = FakeRig(picture), tmp_path / "camera.json"
    found, _ = calibrate._calibrated(rig, None, 98.0)
    write_camera(file, found)
    again, _ = calibrate._calibrated(rig, file, None)
    assert again.bar == 98.0
    assert again.camera.position == pytest.approx(found.camera.position)
    with pytest.raises(UsageError, match="--bar is that of .*camera.json: leave it out here"):
        calibrate._calibrated(rig, file, 100.0)
    rig._image = spoilt_rigs.pushed(picture, 10)
    with pytest.raises(BadIdentification, match=r"10\.0 px"):
        calibrate._calibrated(rig, file, None)


def test_whoever_touches_is_asked_for_each_cross(monkeypatch):
    asked = []
    monkeypatch.setattr(calibrate.click, "pause", asked.append)
    monkeypatch.setattr(
        calibrate.sys, "stdin", type("Terminal", (), {"isatty": lambda self: True})()
    )
    touches = calibrate._touched(FakeRig(None), [(1.0, 2.0), (3.0, -4.0)])
    assert asked[1] == "set the pen on the cross at 3, -4 cm, hands off, and press a key"
    assert [touch.pixel for touch in touches] == [(200.0, 150.0)] * 2


def test_where_nobody_can_answer_nothing_is_asked():
    with pytest.raises(ClickException, match="there is no terminal to answer at"):
        calibrate._touched(FakeRig(None), [(1.0, 2.0)])
