"""Numbers go into an arm's file; all else in it stays, and so does the file before."""

import os
import shutil
from pathlib import Path

import pytest

from laptop.see.table.arm_file import ArmNotWritten, check_writable, own_file, write_values
from laptop.system.files import CannotWrite
from shared.arm_description import find_arm, read_arm, user_arm_file

OFFSET = {("arm", "marker_offset"): "0.350 -0.200"}


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))


@pytest.fixture
def mine(tmp_path):
    return Path(shutil.copyfile(find_arm("planar"), tmp_path / "mine.ini"))


def test_a_key_that_is_missing_is_added_to_its_section(mine):
    before = mine.read_text()
    assert write_values(read_arm(mine), OFFSET) == (mine, Path(f"{mine}.bak"))
    assert read_arm(mine).marker_offset == (0.35, -0.2)
    added = [line for line in mine.read_text().splitlines() if line not in before.splitlines()]
    assert added == ["marker_offset = 0.350 -0.200"]
    assert mine.read_text().replace(added[0] + "\n", "") == before
    assert Path(f"{mine}.bak").read_text() == before
    assert sorted(one.name for one in mine.parent.glob("*mine*")) == ["mine.ini", "mine.ini.bak"]


def test_a_key_that_is_there_is_changed_and_its_comment_stays(mine):
    mine.write_text(
        mine.read_text().replace("[arm]\n", "[arm]\nmarker_offset = 1 2   ; by ruler\n")
    )
    write_values(read_arm(mine), {**OFFSET, ("elbow", "link"): "9.612"})
    text = mine.read_text()
    assert "marker_offset = 0.350 -0.200 ; by ruler\n" in text
    assert "link = 9.612        ; from the elbow's axis to the tip" in text
    assert read_arm(mine).joints[1].link == 9.612


@pytest.mark.parametrize("end", [b"\r\n", b"\n"])
def test_the_ends_of_lines_and_a_mark_at_the_begin_stay(mine, end):
    plain = mine.read_bytes()
    mine.write_bytes(b"\xef\xbb\xbf" + plain.replace(b"\n", end).rstrip())
    write_values(read_arm(mine), {**OFFSET, ("pen", "down"): "61"})
    now = mine.read_bytes()
    assert now.startswith(b"\xef\xbb\xbf#")
    assert now.count(b"\n") == now.count(end)
    assert read_arm(mine).marker_offset == (0.35, -0.2)


def test_each_file_before_is_kept_and_nothing_that_is_there_is_written_over(mine):
    first, others = mine.read_text(), mine.with_name("others.txt")
    others.write_text("precious")
    Path(f"{mine}.bak2").symlink_to(others)
    assert write_values(read_arm(mine), OFFSET).before == Path(f"{mine}.bak")
    second = mine.read_text()
    offset = {("arm", "marker_offset"): "0.5 0.5"}
    assert write_values(read_arm(mine), offset).before == Path(f"{mine}.bak3")
    assert Path(f"{mine}.bak").read_text() == first
    assert Path(f"{mine}.bak3").read_text() == second
    assert others.read_text() == "precious"


def test_a_draft_of_another_leads_nowhere(mine):
    others = mine.with_name("others.txt")
    others.write_text("precious")
    mine.with_name(".mine.ini.new").symlink_to(others)
    write_values(read_arm(mine), OFFSET)
    assert others.read_text() == "precious"
    assert not mine.is_symlink()


def a_pipe(file):
    os.mkfifo(file)


@pytest.mark.parametrize(
    ("put", "why"),
    [
        (a_pipe, "is a pipe, not a file"),
        (Path.mkdir, "is a folder, not a file"),
        (lambda file: file.symlink_to("/dev/null"), "is a device, not a file"),
        (lambda file: file.symlink_to("nowhere"), "is a link that leads nowhere"),
    ],
)
def test_what_is_no_file_is_left_as_it_is(mine, tmp_path, put, why):
    place = tmp_path / "new.ini"
    put(place)
    before = os.lstat(place)
    with pytest.raises(CannotWrite, match=why):
        check_writable(place)
    with pytest.raises(ArmNotWritten, match=why):
        write_values(read_arm(mine), OFFSET, place)
    assert os.lstat(place) == before


def test_a_folder_that_is_none_is_told_before(mine, tmp_path):
    with pytest.raises(CannotWrite, match=r"mine.ini is no folder; name another one"):
        check_writable(mine / "deeper" / "new.ini")
    check_writable(tmp_path / "deeper" / "new.ini")


def test_an_arm_that_comes_along_is_copied_and_never_changed():
    shipped = find_arm("planar")
    before = Path(shipped).read_bytes()
    arm = read_arm(shipped)
    path = write_values(arm, OFFSET).file
    assert path == own_file(arm) == Path(user_arm_file("planar"))
    assert find_arm("planar") == str(path), "its name means the copy from now on"
    assert read_arm(path).marker_offset == (0.35, -0.2)
    assert Path(shipped).read_bytes() == before
    with pytest.raises(ArmNotWritten, match=r"it is yours, and .*planar.ini was measured"):
        write_values(read_arm(shipped), OFFSET)


@pytest.mark.parametrize(
    ("values", "reported"),
    [
        ({("arm", "marker_offset"): "far off"}, "must be two numbers"),
        ({("base", "link"): "3"}, r"there is no section \[base\]"),
        ({("elbow", "link"): "-3"}, "link = -3"),
    ],
)
def test_what_no_arm_can_have_is_not_written(mine, values, reported):
    before = mine.read_bytes()
    with pytest.raises(ArmNotWritten, match=reported) as problem:
        write_values(read_arm(mine), values)
    assert "write there: [" in str(problem.value)
    assert ".new" not in str(problem.value)
    assert mine.read_bytes() == before
    assert [one.name for one in mine.parent.glob("*mine*")] == ["mine.ini"]


def test_a_folder_that_takes_no_file_is_told(mine, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ArmNotWritten, match="is not changed"):
        write_values(read_arm(mine), OFFSET, tmp_path / "file" / "mine.ini")


def test_notes_stand_first_in_comments_and_take_the_place_of_older_ones(mine):
    link, home = ("elbow", "link"), ("elbow", "home")
    note = "+- 0.02 cm, seen by a camera {}"
    values = {link: "9.612", home: "1.5", **OFFSET}
    for day in ("2026-05-01", "2026-06-02"):
        notes = {place: note.format(day) for place in values}
        write_values(read_arm(mine), values, notes=notes)
    lines = mine.read_text().splitlines()
    now = note.format("2026-06-02")
    assert f"link = 9.612        ; {now}; from the elbow's axis to the tip of the pen" in lines
    assert f"marker_offset = 0.350 -0.200 ; {now}" in lines
    assert not any("2026-05-01" in line for line in lines)
    assert sum(now in line for line in lines) == 3, "no other section's link and home"
    assert read_arm(mine).joints[1].link == 9.612
