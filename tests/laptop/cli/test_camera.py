import json
import re

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from laptop.cli.main import laptop
from laptop.emulator.scene.optics import to_srgb
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from shared.arm_description import find_arm, read_arm

TEXT = "board=a4,clutter=0"
POSE = (2.6, 1.2)
"""Of the arm, beside the board."""


@pytest.fixture(scope="module")
def scene():
    return Scene(read_arm(find_arm("planar")), read_scene(TEXT))


@pytest.fixture(scope="module")
def pictures(scene, tmp_path_factory):
    """board.png, moved.png, small.png and nothing.png in a folder."""
    folder = tmp_path_factory.mktemp("pictures")
    image = np.round(to_srgb(scene.image(POSE))).astype(np.uint8)
    cv2.imwrite(str(folder / "board.png"), image)
    cv2.imwrite(str(folder / "moved.png"), np.roll(image, 6, axis=1))
    cv2.imwrite(str(folder / "small.png"), image[::4, ::4])
    cv2.imwrite(str(folder / "wide.png"), cv2.resize(image, (1280, 960)))
    cv2.imwrite(str(folder / "turned.png"), np.rot90(image))
    cv2.imwrite(str(folder / "mirrored.png"), image[:, ::-1])
    cv2.imwrite(str(folder / "two.png"), np.vstack([image, image]))
    cv2.imwrite(str(folder / "nothing.png"), np.full((480, 640, 3), 90, np.uint8))
    return folder


@pytest.fixture
def run(pictures, monkeypatch):
    monkeypatch.chdir(pictures)

    def camera(*args, status=0):
        """Of the pictures before the first option."""
        count = next((k for k, word in enumerate(args) if word.startswith("--")), len(args))
        sources = [word for source in args[:count] for word in ("--camera", source)]
        result = CliRunner().invoke(laptop, ["measure", "camera", *sources, *args[count:]])
        assert result.exit_code == status, result.output
        return result

    return camera


def test_a_picture_tells_where_the_camera_stands(run, scene, pictures):
    result = run("board.png", "--bar", "100", "--to", "camera.json")
    assert "markers in 1 view" in result.output
    assert "25 degrees from straight down" in result.output
    assert "bar is 100 mm" in result.output
    reported = json.loads((pictures / "camera.json").read_text())
    rotation, _ = cv2.Rodrigues(np.array(reported["rotation"]))
    position = -rotation.T @ np.array(reported["translation"]) + (9, 0, 0)  # the board is at 9, 0
    assert position == pytest.approx(scene.camera.position, abs=3)
    assert run("board.png", "--calibration", "camera.json").output.startswith(
        "camera and board are"
    )
    moved = run("moved.png", "--calibration", "camera.json", status=1)
    assert " 6.0 px" in moved.output


def test_pictures_without_the_board_are_counted(run):
    result = run("nothing.png", "board.png")
    assert result.output.startswith("1 of 2 ")
    assert "measure the bar" in result.output


def test_pictures_that_cannot_be_read_are_named(run, pictures, tmp_path):
    (tmp_path / "a.png").write_bytes((pictures / "board.png").read_bytes())
    (tmp_path / "b.png").write_bytes((pictures / "board.png").read_bytes()[:90])
    for name in ("c.png", "d.png", "e.jpg"):
        (tmp_path / name).write_bytes(b"no picture")
    result = run(str(tmp_path))
    first, second, *_ = result.output.splitlines()
    assert first.startswith(f"{tmp_path}: 4 of 5 frames")
    assert re.findall(r"\w\.png", first) == ["b.png", "c.png", "d.png"]
    assert "markers in 1 view;" in second


def test_a_picture_that_shows_no_board_as_it_is_is_left_out_with_its_cause(run):
    result = run("mirrored.png", "board.png")
    first, second, *_ = result.output.splitlines()
    assert first.startswith("mirrored.png: ")
    assert second.startswith("1 of 2 ")


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        (["nothing.png"], "no marker"),
        (["small.png"], "no marker of the board is seen|too small|markers are seen"),
        (["mirrored.png"], r"mirrored.png: .* mirrored: 2\d "),
        (["two.png"], r"two.png: two boards .* 2\d "),
        (["board.png", "turned.png"], "480x640, 640x480: .* turned"),
        (["none.png"], "'none.png'"),
        (["board.png", "wide.png"], "1280x960, 640x480: .* one camera"),
        (["board.png", "--bar", "9"], "bar 9 mm"),
        (["board.png", "--bar", "nan"], "bar nan mm"),
        (["board.png", "--to", "no/c.json"], "no/c.json: .*no folder"),
        (
            ["board.png", "--calibration", "no.json"],
            "cannot read no.json",
        ),
        (["board.png", "--calibration", "board.png"], "board.png: .*no camera's file"),
        (["board.png", "--scene", "board=a4"], "only the source synthetic has a scene"),
        (["synthetic", "--scene", "board=a3"], "board = a3"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(run, args, reported, pictures):
    before = set(pictures.iterdir())
    result = run(*args, status=1)
    assert isinstance(result.exception, SystemExit)
    *counted, line = result.output.strip().splitlines()
    assert not counted or "pictures show the board" in counted[0]
    assert re.search(reported, line), line
    assert set(pictures.iterdir()) == before


def test_a_calibration_compares_only(run):
    shown = run("board.png", "--calibration", "c.json", "--bar", "97", status=2).output
    assert "--calibration compares only: leave --bar out" in shown


def test_the_emulated_camera_is_calibrated_as_it_is(run):
    result = run("synthetic", "--scene", TEXT)
    assert "board a4: " in result.output


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        (["--paper", "a4"], "--paper is of the board: add --board"),
        (["--board", "--diameter", "30"], "--diameter is of the page of discs"),
        (["--board", "board.doc"], ".pdf or .svg or .png"),
    ],
)
def test_a_page_that_cannot_be_made_is_refused(args, reported, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["markers", *args])
    assert result.exit_code
    assert reported in result.output
    assert list(tmp_path.iterdir()) == []


def test_the_board_is_written_for_the_paper(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["markers", "--board"])
    assert result.exit_code == 0
    assert re.search(r"^board.pdf: .* a4 .* 100 %.* 132 x 219 mm", result.output, re.DOTALL)
    assert (tmp_path / "board.pdf").read_bytes()[:5] == b"%PDF-"


@pytest.mark.short(every=6)
@pytest.mark.parametrize("options", [[], ["--board"]])
@pytest.mark.parametrize(
    ("name", "begin"), [("page.PNG", b"\x89PNG"), ("page.Pdf", b"%PDF-"), ("page.SVG", b"<?xml")]
)
def test_a_pages_name_may_end_in_capitals(options, name, begin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["markers", *options, name])
    assert result.exit_code == 0, result.output
    assert result.output.startswith(f"{name}: print it ")
    assert (tmp_path / name).read_bytes().startswith(begin)
