"""`touch`, end to end: an emulated hand on nine crosses, or pictures and points from files."""

import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from run_json import run_in

from laptop.cli.main import laptop
from laptop.emulator.scene.board_items import board_place
from laptop.emulator.scene.marker_items import marker_offset
from laptop.emulator.scene.optics import to_srgb
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.see.markers.board import CROSSES
from laptop.see.table.touch_file import read_touched
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
TEXT = "board=a4,board_x=12,marker_stray=0.5,seed=3,clutter=0"
SIX = (0, 2, 3, 5, 6, 8)


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))

    def touch(*args, status=0):
        result = CliRunner().invoke(laptop, ["measure", "pen", *args])
        assert status in (None, result.exit_code), result.output
        return result

    return touch


@pytest.mark.long
@pytest.mark.parametrize(
    "args",
    [
        ("--plant", "cpu=0", "--crosses", "1,3,4,6,7,9"),
        (),
        ("--arm", "geared", "--plant", "backlash=1,seed=4"),
    ],
    ids=["six crosses", "nine crosses", "behind gears"],
)
def test_an_emulated_hand_finds_the_offset_to_half_a_millimetre(run, tmp_path, args):
    result = run("--simulate", "--out", "out", "--scene", TEXT, *args)
    arm = "geared" if "geared" in args else "planar"
    assert "cross 9 of 9" in result.output
    truth = marker_offset(ARM, read_scene(TEXT))
    found = read_arm(tmp_path / "out" / f"{arm}.ini").marker_offset
    assert np.linalg.norm(truth) == pytest.approx(0.5)
    assert np.linalg.norm(np.array(found) - truth) < 0.05
    stored = read_touched(tmp_path / "out" / f"{arm}.touched.json")
    assert stored.fit.offset == pytest.approx(truth, abs=0.05)
    assert stored.fit.base == pytest.approx((-12, 0), abs=0.3)  # of 2 degrees of play
    assert stored.fit.height == pytest.approx(2.5, abs=0.1)
    reported = run_in(tmp_path / "out")
    assert reported["files"] == [f"{arm}.ini", f"{arm}.touched.json"]
    assert reported["marker"][2]["it is mm"] == pytest.approx(10 * stored.fit.height, abs=0.01)
    assert find_arm("planar") == ARM.file, "an emulated arm leaves the real one alone"


# ---- pictures and points


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder of pictures, the board alone and six crosses, and the points' lines."""
    folder = tmp_path_factory.mktemp("touches")
    scene = Scene(ARM, read_scene(TEXT))
    lines = []

    def photograph(name, q):
        image = np.round(to_srgb(scene.image(q))).astype(np.uint8)
        cv2.imwrite(str(folder / name), image)

    photograph("0.png", (2.6, 1.2))
    for number, k in enumerate(SIX, 1):
        x, y, _ = board_place(scene.constants, CROSSES[k][None])[0]
        q = kinematics.inverse(ARM, (x, y))
        photograph(f"{number}.png", q)
        lines.append(json.dumps({"p": [x, y], "q": q, "t": float(number)}))
    return folder, lines


@pytest.fixture
def touched(run, recorded, tmp_path):
    """Run touch on what was recorded, crosses 2, 5 and 8 left out by blanks, or on other lines."""
    folder, lines = recorded

    def go(*args, lines=lines, pictures=folder, status=0):
        file = tmp_path / "points.jsonl"
        file.write_text("\n".join(lines) + "\n")
        args = ("--effector", "red", "--crosses", "1,3,4,6,7,9", *args)
        return run(str(pictures), "--touches", str(file), *args, status=status)

    return go


def test_pictures_and_points_of_files_give_it_and_the_arm_is_copied(touched, tmp_path):
    result = touched()
    own = tmp_path / "state" / "arms" / "planar.ini"
    assert find_arm("planar") == str(own)
    truth = marker_offset(ARM, read_scene(TEXT))
    assert read_arm(own).marker_offset == pytest.approx(tuple(truth), abs=0.03)
    assert read_touched(tmp_path / "state" / "touched" / "planar.json").arm == "planar"
    assert f"written to {own}" in result.output
    assert not Path(f"{own}.bak").exists()


def test_a_file_of_ones_own_is_changed_and_the_old_one_kept(touched, tmp_path):
    mine = tmp_path / "mine.ini"
    mine.write_text(Path(ARM.file).read_text())
    touched("--arm", str(mine))
    assert "marker_offset = " in mine.read_text()
    assert "marker_offset" not in Path(f"{mine}.bak").read_text()


def nothing_written(tmp_path):
    return (
        not (tmp_path / "state" / "arms").exists() and not (tmp_path / "state" / "touched").exists()
    )


@pytest.mark.parametrize("name", ["planar.ini", "planar.touched.json"])
@pytest.mark.parametrize(
    ("put", "why"),
    [
        (Path.mkdir, "is a folder, not a file"),
        (lambda file: file.symlink_to("nowhere"), "is a link that leads nowhere"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_a_cross_is_touched(
    touched, tmp_path, name, put, why
):
    out = tmp_path / "here"
    out.mkdir()
    put(out / name)
    result = touched("--out", str(out), status=1)
    assert result.output.splitlines()[-1].endswith(f"{name}: {why}; choose another name")
    assert "cross" not in result.output
    assert [file.name for file in out.iterdir()] == [name]


def test_a_file_of_another_and_a_folder_that_is_none_are_told_before(touched, tmp_path):
    out = tmp_path / "here"
    out.mkdir()
    (out / "planar.touched.json").write_text("precious")
    result = touched("--out", str(out), status=1)
    assert "would be lost" in result.output
    assert (out / "planar.touched.json").read_text() == "precious"
    result = touched("--out", str(out / "planar.touched.json"), status=2)
    assert "is a file" in result.output
    result = touched("--out", str(tmp_path / "a\nb"), status=1)
    assert "cannot be shown" in result.output
    assert nothing_written(tmp_path)


def test_a_disc_that_is_not_seen_leaves_its_cross_out(touched, recorded, tmp_path):
    folder, _ = recorded
    pictures = shutil.copytree(folder, tmp_path / "pictures")
    image = cv2.imread(str(folder / "3.png"))
    image[..., 2] = image[..., :2].max(axis=2)  # nothing is red any more
    cv2.imwrite(str(pictures / "3.png"), image)
    result = touched(pictures=pictures, status=1)
    assert "cross 4 is left out" in result.output
    assert re.search(r"\b5 crosses .* 6 ", result.output)
    assert nothing_written(tmp_path)


def test_a_camera_that_moved_writes_nothing(touched, recorded, tmp_path):
    folder, _ = recorded
    pictures = shutil.copytree(folder, tmp_path / "pictures")
    cv2.imwrite(str(pictures / "5.png"), np.roll(cv2.imread(str(folder / "5.png")), 4, axis=1))
    result = touched(pictures=pictures, status=1)
    assert " 4.0 px" in result.output
    assert nothing_written(tmp_path)


def test_a_touch_beside_its_cross_writes_nothing(touched, recorded, tmp_path):
    _, lines = recorded
    spoilt = [*lines[:4], lines[5], lines[5]]
    touched(lines=spoilt, status=1)
    assert nothing_written(tmp_path)


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        ((), "--camera 0"),
        (
            ("--camera", "0", "--simulate"),
            "leave --camera out.",
        ),
        (("--camera", "synthetic"), "add --simulate."),
        (("--camera", "0", "--plant", "cpu=0"), "add --simulate."),
        (("--camera", "0", "--simulate", "--touches", "x"), "leave --camera out"),
        (("--camera", "0", "--touches", "x", "--brick", "ev3"), "--touches calls no brick"),
        (("--simulate", "--arm", "spatial"), "would drop"),
        (("--simulate", "--scene", "board=none"), "the scene has no board to touch"),
        (("--simulate", "--bar", "5"), "bar"),
        (("--simulate", "--crosses", "1,2"), "6 are the least"),
        (("--simulate", "--crosses", "1,2,x"), "'1,2,x'"),
        (("--simulate", "--crosses", "1,1,2,3,4,5,6"), "'1,1,2,3,4,5,6'"),
        (("nowhere.png", "--touches", "x", "--effector", "red"), "nowhere.png"),
        (
            (
                "--camera",
                "0",
            ),
            "has no marker [effector]: say what it is, --effector disc:red",
        ),
    ],
)
def test_what_cannot_be_is_one_line(run, tmp_path, args, reported):
    result = run(*args, status=None)
    assert result.exit_code != 0
    assert reported in result.output
    assert "Traceback" not in result.output
    assert nothing_written(tmp_path)


def test_files_of_points_that_are_none_are_one_line(touched, tmp_path):
    result = touched(lines=["ended, status 0"], status=1)
    assert "'ended, status 0' is no JSON" in result.output
    result = touched(lines=[], status=1)
    assert "0 crosses were touched" in result.output
    assert nothing_written(tmp_path)
