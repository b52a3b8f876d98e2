"""The height of a marker is remembered, arm by arm, whatever has become of the file."""

import pytest

from laptop.page.marker_height import HeightMemory, MarkerHeight, given_height


def test_what_was_typed_is_known_the_next_time_arm_by_arm(tmp_path):
    file = tmp_path / "new" / "heights.json"
    planar, other = HeightMemory(file, "planar"), HeightMemory(file, "other")
    assert planar.read() == MarkerHeight()
    assert planar.write(2.5) == other.write(3.14) == ""
    assert planar.read() == MarkerHeight(2.5, "as typed here before")
    assert other.read().cm == pytest.approx(3.14)
    assert planar.write(None) == ""
    assert planar.read() == MarkerHeight()
    assert other.read().cm == pytest.approx(3.14)


@pytest.mark.parametrize("content", ["", "[1]", '{"planar": "x"}', '{"planar": 1e9}', "{", "\0"])
def test_a_spoilt_file_is_as_good_as_none_and_is_mended(tmp_path, content):
    file = tmp_path / "heights.json"
    file.write_text(content)
    memory = HeightMemory(file, "planar")
    assert memory.read() == MarkerHeight()
    assert memory.write(2.0) == ""
    assert memory.read().cm == 2.0


def test_what_cannot_be_kept_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    why = HeightMemory(tmp_path / "file" / "heights.json", "planar").write(2.0)
    assert why.startswith("the height is used, but not kept: ")


def test_what_the_command_line_says_goes_before_how_an_emulated_arm_is_built():
    emulated = {"marker_height": 2.5, "tilt": 25.0}
    assert given_height(31.0, emulated) == MarkerHeight(3.1, "as --marker-height says")
    assert given_height(None, emulated) == MarkerHeight(2.5, "as the emulated arm is built")
    assert given_height(0.0, {}).cm == 0.0
    assert given_height(None, {}) is None
