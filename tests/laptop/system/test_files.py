"""Files for people: where they may go, and that they are whole."""

import os
import stat

import pytest

from laptop.system.files import CannotWrite, check_new, write_whole, written

CSV = (".csv",)


def test_a_new_file_and_one_that_may_be_replaced_are_let_through(tmp_path):
    file = tmp_path / "a.csv"
    check_new(file, CSV)
    file.touch()
    check_new(file, CSV, replace=True)
    check_new(tmp_path / "B.CSV", CSV)


@pytest.mark.parametrize(
    ("name", "reported"),
    [
        ("a.svg", "would be no .csv by its name"),
        ("a", "would be no .csv by its name"),
        ("none/a.csv", "there is no folder"),
        ("there.csv", "is there already; choose another name, or give --replace"),
        ("link.csv", "is there already; choose another name, or give --replace"),
        ("folder.csv", "is a folder, not a file; choose another name"),
        ("pipe.csv", "is a pipe, not a file; choose another name"),
        ("device.csv", "is a device, not a file; choose another name"),
        ("nowhere.csv", "is a link that leads nowhere; choose another name"),
        ("loop.csv", "cannot write .*loop.csv: Too many levels of symbolic links; choose"),
        ("notes.csv", "is a link to .*notes.txt, another kind of file"),
        ("a\x1b[2J.csv", "has characters that cannot be shown; choose another name"),
        ("a\udcff.csv", "has characters that cannot be shown; choose another name"),
    ],
)
def test_a_place_where_something_would_be_lost_is_refused(tmp_path, name, reported):
    (tmp_path / "there.csv").write_text("mine")
    (tmp_path / "link.csv").symlink_to("there.csv")
    (tmp_path / "folder.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "device.csv").symlink_to("/dev/null")
    (tmp_path / "nowhere.csv").symlink_to("none.csv")
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "notes.csv").symlink_to("notes.txt")
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(CannotWrite, match=reported):
        check_new(tmp_path / name, CSV)
    if name in ("folder.csv", "pipe.csv", "device.csv", "nowhere.csv"):
        with pytest.raises(CannotWrite, match=reported):
            write_whole(tmp_path / name, b"new")
    assert sorted(os.listdir(tmp_path)) == before
    assert (tmp_path / "there.csv").read_text() == "mine"
    assert stat.S_ISFIFO(os.stat(tmp_path / "pipe.csv").st_mode)


def test_a_file_is_whole_or_as_it_was(tmp_path):
    file = tmp_path / "a.csv"
    write_whole(file, b"old")

    def fail(error):
        with written(file) as draft:
            draft.write_bytes(b"half")
            raise error

    with pytest.raises(ZeroDivisionError):
        fail(ZeroDivisionError())
    with pytest.raises(CannotWrite, match=r"cannot write .*a.csv: No space left on device; make"):
        fail(OSError(28, "No space left on device"))
    assert os.listdir(tmp_path) == ["a.csv"]
    assert file.read_bytes() == b"old"
    write_whole(file, b"new")
    assert file.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_link_stays_and_what_it_leads_to_is_replaced_with_its_mode(tmp_path):
    file, link = tmp_path / "a.csv", tmp_path / "link.csv"
    file.write_text("old")
    file.chmod(0o640)
    link.symlink_to("a.csv")
    write_whole(link, b"new")
    assert (link.is_symlink(), file.read_text()) == (True, "new")
    assert stat.S_IMODE(file.stat().st_mode) == 0o640


def test_a_name_may_be_as_long_as_the_system_takes(tmp_path):
    write_whole(tmp_path / ("a" * 251 + ".csv"), b"new")
    with pytest.raises(CannotWrite, match="File name too long"):
        write_whole(tmp_path / ("a" * 300 + ".csv"), b"new")


def test_who_writes_the_draft_tells_of_the_file(tmp_path):
    def write():
        with written(tmp_path / "a.csv") as draft:
            raise CannotWrite(f"cannot write {draft}: no room")

    with pytest.raises(CannotWrite, match=r"cannot write .*/a.csv: no room"):
        write()


def test_a_new_file_has_the_mode_of_any_other(tmp_path):
    (tmp_path / "usual").touch()
    write_whole(tmp_path / "a.csv", b"")
    assert (tmp_path / "a.csv").stat().st_mode == (tmp_path / "usual").stat().st_mode
