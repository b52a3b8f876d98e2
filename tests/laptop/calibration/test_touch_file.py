import json

import numpy as np
import pytest

from laptop.calibration.marker_offset import BadTouches, MarkerFit
from laptop.calibration.touch_file import read_touch, write_touch

FIT = MarkerFit(
    np.array([0.45, -0.3]), 2.2, 0.1, np.array([-12.3, 0.8]), 1.003, 1e-4 * np.eye(7), 0.21
)


@pytest.fixture
def kept(tmp_path):
    file = tmp_path / "touched.json"
    write_touch(file, FIT)
    return file


def test_a_fit_is_read_as_it_was_written(kept):
    now = read_touch(kept)
    for name in ("offset", "base", "covariance"):
        assert (getattr(now, name) == getattr(FIT, name)).all()
    for name in ("height", "turn", "scale", "rms_mm"):
        assert getattr(now, name) == getattr(FIT, name)
    assert now.height_sigma == pytest.approx(0.01)
    assert [path.name for path in kept.parent.iterdir()] == ["touched.json"]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"offset": [1]}, "offset is not 2 numbers"),
        ({"offset": ["a", "b"]}, "offset is not 2 numbers"),
        ({"base": [1e9, 0]}, "farther than 500 cm"),
        ({"base": {}}, "base is not 2 numbers"),
        ({"covariance": np.eye(6).tolist()}, "covariance is not 7 x 7 numbers"),
        ({"covariance": (-np.eye(7)).tolist()}, "variances are above 0"),
        ({"height": "2"}, "something else where a number should be"),
        ({"height": 300}, "height 300 is not from -5 to 50"),
        ({"scale": 0}, "scale 0 is not from 0.5 to 2"),
        ({"turn": True}, "something else where a number should be"),
    ],
)
def test_a_spoilt_file_is_refused_in_one_line(kept, change, told):
    kept.write_text(json.dumps(json.loads(kept.read_text()) | change))
    with pytest.raises(BadTouches, match=told) as error:
        read_touch(kept)
    assert "\n" not in str(error.value)
    assert "touch them anew" in str(error.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", "[" * 5000, "\x00\xff"])
def test_what_is_no_such_file_at_all_is_refused(tmp_path, text):
    file = tmp_path / "touched.json"
    file.write_text(text)
    with pytest.raises(BadTouches, match="this is no file of touched crosses"):
        read_touch(file)


def test_a_file_that_is_not_there_or_cannot_be_written_is_told(tmp_path):
    with pytest.raises(BadTouches, match="cannot read .*: No such file or directory"):
        read_touch(tmp_path / "none.json")
    with pytest.raises(BadTouches, match="cannot write .*: No such file or directory"):
        write_touch(tmp_path / "none" / "c.json", FIT)
    with pytest.raises(BadTouches, match="is a folder"):
        read_touch(tmp_path)
