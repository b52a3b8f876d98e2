import json

import numpy as np
import pytest
from board_views import stand, view

from laptop.see.table.camera_file import read_camera, write_camera
from laptop.see.table.camera_fit import BadCalibration, calibrate


@pytest.fixture
def stored(tmp_path):
    file = tmp_path / "camera.json"
    calibration = calibrate([view(stand(52, 25), np.random.default_rng(0))], 97.5)
    write_camera(file, calibration)
    return file, calibration


def test_a_camera_is_read_as_it_was_written(stored):
    file, was = stored
    now = read_camera(file)
    for name in ("lens", "rotation", "translation", "covariance"):
        assert (getattr(now.camera, name) == getattr(was.camera, name)).all()
    assert now.camera.size == was.camera.size
    assert (now.board, now.bar, now.markers, now.rms) == (was.board, 97.5, was.markers, was.rms)
    assert [path.name for path in file.parent.iterdir()] == ["camera.json"]


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"lens": [1, 2]}, "lens is not 8 numbers"),
        ({"lens": [float("nan")] * 8}, "lens is not 8 numbers"),
        ({"lens": [-5] + [0] * 7}, "focal length is -0.0078125; a camera's is from 0.1 to 30"),
        ({"covariance": "no"}, "covariance|could not convert"),
        ({"board": "a3"}, "board is not one of a4, letter"),
        ({"board": []}, "board is not one of|unhashable"),
        ({"size": [640.5, 480]}, "size and markers are whole numbers"),
        ({"size": [640]}, "not enough values"),
        ({"size": [True, 480]}, "size and markers are whole numbers"),
        ({"size": [640, 99999]}, "size is 99999; a camera's is from 16 to 20000"),
        ({"size": 5}, "size is not a list"),
        ({"bar": "97"}, "bar is not a number"),
        ({"bar": 0}, "bar is 0; a camera's is from 50 to 200"),
        ({"rms": None}, "rms is not a number"),
        ({"rms": True}, "rms is not a number"),
        ({"rms": 1e5}, r"rms is 100000; a camera's is from 0 to 1\)"),
        ({"blur": -1}, "blur is -1"),
        ({"markers": [-1]}, "markers is -1; a camera's is from 4 to 26"),
        ({"markers": [27]}, "markers is 27"),
        ({"translation": [0, 0, 0]}, "height over the table, cm, is 0; a camera's is from 1 to"),
        ({"translation": [0, 0, 1e308]}, "translation is farther"),
        ({"rotation": [0, 0, 0]}, "height over the table, cm, is -"),
        ({"rotation": [1e308, 0, 0]}, "rotation is more than 12.6 rad"),
    ],
)
def test_a_spoilt_file_is_refused_in_one_line(stored, change, reported):
    file, _ = stored
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(BadCalibration, match=reported) as error:
        read_camera(file)
    assert "\n" not in str(error.value)
    assert "make it anew" in str(error.value)


@pytest.mark.parametrize(
    ("key", "at", "value", "reported"),
    [
        ("lens", 0, 1e308, "focal length is "),
        ("lens", 1, 1e308, "cx in the picture's sides is "),
        ("lens", 2, -900, "cy in the picture's sides is -1.875; a camera's is from -1 to 2"),
        ("lens", 3, 1e308, "k1 is 1e.308; a camera's is from -20 to 20"),
        ("lens", 5, 2, "p1 is 2; a camera's is from -1 to 1"),
        ("lens", 7, -1e308, "k3 is -1e.308"),
        ("translation", 2, -40, "height over the table, cm, is -.*; a camera.s is from 1 to 10000"),
        ("covariance", (0, 0), -1, "covariance has variances below 0"),
        ("covariance", (0, 0), 1e308, "covariance has variances .* larger than nobody knows them"),
        ("covariance", (12, 12), 1e9, "covariance has variances .* larger than nobody knows them"),
        ("covariance", (0, 1), 1e308, "covariance is none"),
        ("covariance", (0, 1), 1.0, "covariance is none: it is not symmetric"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_number_that_no_camera_has_is_refused_in_one_line(stored, key, at, value, reported):
    file, _ = stored
    known = json.loads(file.read_text())
    numbers = np.array(known[key])
    numbers[at] = value
    file.write_text(json.dumps(known | {key: numbers.tolist()}))
    with pytest.raises(BadCalibration, match=reported) as error:
        read_camera(file)
    assert "\n" not in str(error.value)
    assert "make it anew" in str(error.value)


@pytest.mark.short(every=6)
@pytest.mark.parametrize("paper", ["a4", "letter"])
@pytest.mark.parametrize("focal", [330.0, 610.0, 1400.0])
@pytest.mark.parametrize("tilts", [(0,), (70,), (30, 35, 0)])
def test_honest_cameras_are_believed(tmp_path, paper, focal, tilts):
    lens = (focal, 318, 242, -0.2, 0.06, 0, 0)
    rng = np.random.default_rng(2)
    stands = [stand(focal / 12, tilt, 100 * tilt) for tilt in tilts]
    found = calibrate([view(one, rng, 0.1, lens, paper) for one in stands])
    write_camera(tmp_path / "camera.json", found)
    assert read_camera(tmp_path / "camera.json").markers == found.markers


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", "7", "[" * 5000, "\x00\xff"])
def test_what_is_no_such_file_at_all_is_refused(tmp_path, text):
    file = tmp_path / "camera.json"
    file.write_text(text)
    with pytest.raises(BadCalibration, match="this is no camera's file"):
        read_camera(file)


def test_a_file_that_is_not_there_or_cannot_be_written_is_told(tmp_path, stored):
    with pytest.raises(BadCalibration, match="cannot read .*: No such file or directory"):
        read_camera(tmp_path / "none.json")
    with pytest.raises(BadCalibration, match="cannot write .*: No such file or directory"):
        write_camera(tmp_path / "none" / "c.json", stored[1])
    with pytest.raises(BadCalibration, match="is a folder"):
        read_camera(tmp_path)
