"""The height of a marker is remembered, arm by arm, whatever has become of the file."""

import pytest

from laptop.page.marker_height import HeightMemory, MarkerHeight


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
