import json

import numpy as np
import pytest
from board_views import stand, view

from laptop.calibration.camera_file import read_camera, write_camera
from laptop.calibration.camera_fit import BadCalibration, calibrate


@pytest.fixture
def kept(tmp_path):
    file = tmp_path / "camera.json"
    calibration = calibrate([view(stand(52, 25), np.random.default_rng(0))], 97.5)
    write_camera(file, calibration)
    return file, calibration


def test_a_camera_is_read_as_it_was_written(kept):
    file, was = kept
    now = read_camera(file)
    for name in ("lens", "rotation", "translation", "covariance"):
        assert (getattr(now.camera, name) == getattr(was.camera, name)).all()
    assert now.camera.size == was.camera.size
    assert (now.board, now.bar, now.markers, now.rms) == (was.board, 97.5, was.markers, was.rms)
    assert [path.name for path in file.parent.iterdir()] == ["camera.json"]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"lens": [1, 2]}, "lens is not 8 numbers"),
        ({"lens": [float("nan")] * 8}, "lens is not 8 numbers"),
        ({"lens": [-5] + [0] * 7}, "focal length and variances are above 0"),
        ({"covariance": "no"}, "covariance|could not convert"),
        ({"board": "a3"}, "board is not one of a4, letter"),
        ({"board": []}, "board is not one of|unhashable"),
        ({"size": [640.5, 480]}, "size and markers are whole numbers"),
        ({"size": [640]}, "not enough values"),
        ({"size": 5}, "size is not a list"),
        ({"bar": "97"}, "and bar are numbers"),
        ({"rms": None}, "and bar are numbers"),
        ({"markers": [-1]}, "whole numbers"),
    ],
)
def test_a_spoilt_file_is_refused_in_one_line(kept, change, told):
    file, _ = kept
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(BadCalibration, match=told) as error:
        read_camera(file)
    assert "\n" not in str(error.value)
    assert "make it anew" in str(error.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", "7", "[" * 5000, "\x00\xff"])
def test_what_is_no_such_file_at_all_is_refused(tmp_path, text):
    file = tmp_path / "camera.json"
    file.write_text(text)
    with pytest.raises(BadCalibration, match="this is no camera's file"):
        read_camera(file)


def test_a_file_that_is_not_there_or_cannot_be_written_is_told(tmp_path, kept):
    with pytest.raises(BadCalibration, match="cannot read .*: No such file or directory"):
        read_camera(tmp_path / "none.json")
    with pytest.raises(BadCalibration, match="cannot write .*: No such file or directory"):
        write_camera(tmp_path / "none" / "c.json", kept[1])
    with pytest.raises(BadCalibration, match="is a folder"):
        read_camera(tmp_path)
