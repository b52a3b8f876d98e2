"""`accuracy`, as typed."""

from types import SimpleNamespace

import numpy as np
import pytest
from accuracy_rigs import camera_above
from click.testing import CliRunner
from run_json import run_in

from laptop.cli.accuracy import _calibrate_cameras, _check_still
from laptop.cli.main import laptop
from laptop.measure.accuracy.sighting import BadSighting
from laptop.see.markers.board import BOARDS
from laptop.see.markers.finders import board
from laptop.see.table.camera_fit import Calibration


@pytest.mark.parametrize(
    ("args", "said"),
    [
        ([], "Give the camera, --camera 0 say, or --simulate."),
        (["--camera", "0", "--simulate"], "cameras of its own"),
        (["--camera", "0", "--plant", "cpu=1"], "--plant is of what is emulated: add --simulate."),
        (["--camera", "0", "--noise", "1"], "--noise is of"),
        (["--simulate", "--arm-at", "1,2,3"], "leave --arm-at out"),
        (["--simulate", "--bar", "97"], "leave --bar out"),
        (["--simulate", "--brick"], "leave --brick out"),
        (["--camera", "0", "--bar", "-5"], "bar -5 mm"),
        (["--camera", "0", "--bar", "nan"], "bar nan mm"),
        (
            ["--camera", "0", "--calibration", "a.json", "--bar", "97"],
            "--calibration knows the bar: leave --bar out",
        ),
        (["--simulate", "--at", "1,b"], "'1,b' is not X,Y or X,Y,Z"),
        (["--simulate", "--cycles", "0"], "3<=x<=100"),
        (["--simulate", "--at", "40,0"], "40,0 cm"),
        (["--simulate", "--plant", "cpu=x"], "cpu"),
        (["--camera", "0", "--calibration", "none.json"], "none.json"),
        (
            ["--camera", "0", "--arm", "spatial", "--size", "6", "--at", "14,0,11"],
            "1 camera: an arm in space",
        ),
        (
            ["--camera", "0", "--camera", "1", "--calibration", "a.json"],
            "1 --calibration for 2 --camera: give one for each.",
        ),
        (["--simulate", "--size", "40"], "40 cm"),
        (["--simulate", "--arm", "none.ini"], "none.ini"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(args, said, tmp_path):
    done = CliRunner().invoke(laptop, ["measure", "accuracy", *args, "--out", str(tmp_path)])
    assert done.exit_code != 0
    assert said in done.output
    assert not list(tmp_path.iterdir())


@pytest.mark.claims
def test_an_emulated_arm_is_measured_and_all_files_are_there(tmp_path):
    args = [
        "measure",
        "accuracy",
        "--simulate",
        "--cycles",
        "3",
        "--size",
        "4",
        "--out",
        str(tmp_path),
    ]
    done = CliRunner().invoke(laptop, args)
    assert done.exit_code == 0, done.output
    reported = run_in(tmp_path)
    for one in reported["criteria"]:
        off = abs(one["value mm"] - one["true mm"])
        assert off < max(0.25 * one["true mm"], 2 * one["expanded uncertainty mm"]), one
    written = {"accuracy.png", "accuracy.csv", "run.json"}
    assert {file.name for file in tmp_path.iterdir()} == {*reported["files"], "run.json"} == written


class StillRig:
    """Cameras whose pictures are looked at by nobody."""

    def image(self, name):
        return name


def seen_board(camera, off):
    board = BOARDS["a4"]
    points = np.column_stack([board.centres, np.zeros(len(board.centres))])
    return SimpleNamespace(
        size=camera.size, board=board, points=points, pixels=camera.project(points) + off
    )


@pytest.mark.parametrize(
    ("off", "said"), [(0.1, ""), (4.0, "camera A or its board has moved since .* by 5.7 px")]
)
def test_a_camera_that_moves_in_mid_run_ends_the_test(off, said, monkeypatch):
    camera = camera_above()
    found = Calibration(camera, BOARDS["a4"], None, (26,), 0.05, 0.01, 0.7)
    monkeypatch.setattr(board, "find_board", lambda image: seen_board(camera, off))
    if not said:
        _check_still(StillRig(), {"A": found})
        return
    with pytest.raises(BadSighting, match=said):
        _check_still(StillRig(), {"A": found})


def test_a_board_that_is_covered_when_it_is_looked_at_is_said(monkeypatch, capsys):
    found = Calibration(camera_above(), BOARDS["a4"], None, (26,), 0.05, 0.01, 0.7)
    monkeypatch.setattr(board, "find_board", lambda image: None)
    _check_still(StillRig(), {"A": found})
    assert capsys.readouterr().out.startswith("camera A: the board is covered")
    with pytest.raises(BadSighting, match="camera B does not see the board: lay it flat"):
        _calibrate_cameras(StillRig(), ["B"], None)
