"""What touching has found, as a file."""

import json

import numpy as np
import pytest

from laptop.calibration.marker_offset import BadTouches, MarkerFit
from laptop.calibration.touch_file import TouchedArm, read_touched, touched_file, write_touched

FIT = MarkerFit(
    np.array([0.3, -0.27]), 2.5, 0.1, np.array([-12.0, 0.4]), 1.01, np.diag(np.arange(1, 8.0)), 0.3
)


@pytest.fixture
def kept(tmp_path):
    file = tmp_path / "new" / "mine.json"
    write_touched(file, TouchedArm("mine", "a4", 97.5, FIT))
    return file


def test_what_was_written_is_read(kept):
    found = read_touched(kept)
    assert (found.arm, found.paper, found.bar) == ("mine", "a4", 97.5)
    for name in ("offset", "base", "covariance"):
        assert (getattr(found.fit, name) == getattr(FIT, name)).all()
    for name in ("height", "turn", "scale", "rms_mm"):
        assert getattr(found.fit, name) == getattr(FIT, name)
    assert [one.name for one in kept.parent.iterdir()] == ["mine.json"]


def test_each_arm_has_its_place(monkeypatch, tmp_path):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    assert touched_file("mine") == tmp_path / "touched" / "mine.json"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"offset": [1]}, "offset is not 2 numbers"),
        ({"base": [1, "x"]}, "could not convert"),
        ({"covariance": [[-1.0] * 7] * 7}, "above 0"),
        ({"scale": 0}, "above 0"),
        ({"height": True}, "height is not a number"),
        ({"turn": None}, "turn is not a number"),
        ({"bar": "97"}, "bar is not a number"),
        ({"board": "a3"}, "board is not one of a4, letter"),
        ({"arm": 5}, "arm is not a name"),
    ],
)
def test_what_is_none_is_refused(kept, change, told):
    kept.write_text(json.dumps({**json.loads(kept.read_text()), **change}))
    with pytest.raises(BadTouches, match=told):
        read_touched(kept)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{}", "it has no offset"),
        ("[]", "holds no JSON object"),
        ("{", "is no JSON"),
        ("\x00", "is no JSON"),
    ],
)
def test_a_spoilt_file_is_told(kept, text, told):
    kept.write_text(text)
    with pytest.raises(BadTouches, match=rf"mine.json: this is no file of touches \({told}"):
        read_touched(kept)


def test_a_file_that_is_not_there_says_how_it_is_made(tmp_path):
    with pytest.raises(BadTouches, match="cannot read .*: No such file.*the command touch"):
        read_touched(tmp_path / "none.json")


def test_where_it_cannot_be_written_it_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadTouches, match="cannot write"):
        write_touched(tmp_path / "file" / "x.json", TouchedArm("mine", "a4", None, FIT))
