"""The brick's folders are found by its own paths, wherever on this computer they are."""

import os

import pytest

from laptop.emulator.host.brick_files import BrickFiles

HOME = "/home/of-nobody-here"


@pytest.fixture
def files(tmp_path):
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "a").write_text("1")
    folders = {HOME: str(tmp_path), HOME + "/.own": str(tmp_path / "state")}
    files = BrickFiles(folders, {"/zzz/812/name": "python3", "/zzz/load": "0.9"})
    yield files
    files.close()


def test_the_nearest_folder_counts_and_others_are_this_computers(files, tmp_path):
    assert files.host_path(HOME + "/.own/a") == str(tmp_path / "state" / "a")
    assert files.host_path(HOME + "/.owner") == str(tmp_path / ".owner")
    for path in (HOME + "er", "a", "/dev/null", "", 3, b"/dev/null"):
        assert files.host_path(path) == path


def test_a_function_takes_the_bricks_paths_and_complains_of_them(files, tmp_path):
    rename = files.wrapping(os.rename, 2)
    rename(HOME + "/.own/a", HOME + "/b")
    assert (tmp_path / "b").read_text() == "1"
    with pytest.raises(FileNotFoundError) as caught:
        rename(HOME + "/none", HOME + "/.own/c")
    assert (caught.value.filename, caught.value.filename2) == (HOME + "/none", HOME + "/.own/c")
    with pytest.raises(FileNotFoundError) as caught:
        files.wrapping(os.stat, 1)(HOME + "/none")
    assert (caught.value.filename, caught.value.filename2) == (HOME + "/none", None)


def test_files_of_the_system_are_made_when_they_are_looked_for_and_do_not_stay(files):
    assert files._made is None
    assert sorted(files.wrapping(os.listdir, 1)("/zzz")) == ["812", "load"]
    made = files.host_path("/zzz/812/name")
    with open(made) as file:
        assert file.read() == "python3"
    with pytest.raises(FileNotFoundError):
        files.wrapping(os.stat, 1)("/zzz/1")
    files.close()
    assert not os.path.exists(made)
