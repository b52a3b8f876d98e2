"""What touching has found, as a file."""

import json

import numpy as np
import pytest

from laptop.see.table.marker_offset import BadTouches, MarkerFit
from laptop.see.table.touch_file import TouchedArm, read_touched, touched_file, write_touched

FIT = MarkerFit(
    np.array([0.3, -0.27]), 2.5, 0.1, np.array([-12.0, 0.4]), 1.01, np.diag(np.arange(1, 8.0)), 0.3
)


@pytest.fixture
def stored(tmp_path):
    file = tmp_path / "new" / "mine.json"
    write_touched(file, TouchedArm("mine", "a4", 97.5, FIT))
    return file


def test_what_was_written_is_read(stored):
    found = read_touched(stored)
    assert (found.arm, found.paper, found.bar) == ("mine", "a4", 97.5)
    for name in ("offset", "base", "covariance"):
        assert (getattr(found.fit, name) == getattr(FIT, name)).all()
    for name in ("height", "turn", "scale", "rms_mm"):
        assert getattr(found.fit, name) == getattr(FIT, name)
    assert [one.name for one in stored.parent.iterdir()] == ["mine.json"]


def test_each_arm_has_its_place(monkeypatch, tmp_path):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    assert touched_file("mine") == tmp_path / "touched" / "mine.json"


@pytest.mark.parametrize(
    ("change", "reported"),
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
        ({"bar": "97"}, "something else where a number should be"),
        ({"board": "a3"}, "board is not one of a4, letter"),
        ({"arm": 5}, "arm is not a name"),
    ],
)
def test_a_spoilt_file_is_refused_in_one_line(stored, change, reported):
    stored.write_text(json.dumps(json.loads(stored.read_text()) | change))
    with pytest.raises(BadTouches, match=reported) as error:
        read_touched(stored)
    assert "\n" not in str(error.value)
    assert "touch them anew" in str(error.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", "[" * 5000, "\x00\xff"])
def test_what_is_no_such_file_at_all_is_refused(tmp_path, text):
    file = tmp_path / "touched.json"
    file.write_text(text)
    with pytest.raises(BadTouches, match="this is no file of touched crosses"):
        read_touched(file)


def test_a_file_that_is_not_there_says_how_it_is_made(tmp_path):
    with pytest.raises(BadTouches, match="cannot read .*: No such file.*the command touch"):
        read_touched(tmp_path / "none.json")


def test_where_it_cannot_be_written_it_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadTouches, match="cannot write"):
        write_touched(tmp_path / "file" / "x.json", TouchedArm("mine", "a4", None, FIT))


def test_a_folder_is_told(tmp_path):
    with pytest.raises(BadTouches, match="is a folder"):
        read_touched(tmp_path)
