"""Temporary folders: none outlives its owner for long, none is swept before he ends."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from laptop.emulator import temporary_folders
from laptop.emulator.temporary_folders import made, make, remove, sweep
from laptop.system import platforms

ROOT = str(Path(__file__).parents[3])

OWNER = """
import sys
from laptop.system import platforms
from laptop.emulator import temporary_folders
print(temporary_folders.make("home", sys.argv[1]), flush=True)
open(temporary_folders.make("sysfs", sys.argv[1]) + "/file", "w").close()
print("there", flush=True)
sys.stdin.read()
"""


def test_a_folder_is_ones_own_until_it_is_removed(tmp_path):
    with made("home", str(tmp_path)) as path:
        assert os.path.basename(path).startswith("brickservo-home-")
        assert os.stat(path).st_mode & 0o077 == 0
        assert sweep([str(tmp_path)]) == 0
        name = os.path.basename(path)
        assert sorted(os.listdir(str(tmp_path))) == [name, name + ".lock"]
    assert os.listdir(str(tmp_path)) == []
    assert temporary_folders._HELD == {}


def test_it_goes_with_what_is_in_it_whatever_happens(tmp_path):
    def fail():
        with made("home", str(tmp_path)) as path:
            os.mkdir(os.path.join(path, "inside"))
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert os.listdir(str(tmp_path)) == []


def test_without_a_place_it_is_where_temporary_files_are(monkeypatch, tmp_path):
    path = make("home")
    assert os.path.dirname(path) in (temporary_folders.IN_MEMORY, os.environ.get("TMPDIR", "/tmp"))
    remove(path)
    monkeypatch.setattr(temporary_folders, "IN_MEMORY", str(tmp_path / "none"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = make("home")
    assert os.path.dirname(path) == str(tmp_path)
    remove(path)


def test_what_a_killed_process_has_left_is_swept_and_what_a_living_one_has_is_not(tmp_path):
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(tmp_path)],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        universal_newlines=True,
    )
    try:
        path = owner.stdout.readline().strip()
        assert owner.stdout.readline() == "there\n"
        (tmp_path / "another's").mkdir()
        (tmp_path / "brickservo-folder").mkdir()
        assert sweep([str(tmp_path)]) == 0
        assert os.path.isdir(path)
    finally:
        owner.kill()
        owner.communicate()
    assert os.path.isdir(path)
    assert sweep([str(tmp_path), str(tmp_path / "none")]) == 2
    assert sorted(os.listdir(str(tmp_path))) == ["another's", "brickservo-folder"]


def test_who_sweeps_while_a_folder_is_made_takes_no_place_of_it(tmp_path, monkeypatch):
    real = platforms.lock

    def swept_before(descriptor):
        monkeypatch.setattr(platforms, "lock", real)
        assert sweep([str(tmp_path)]) == 1
        return real(descriptor)

    monkeypatch.setattr(platforms, "lock", swept_before)
    with made("home", str(tmp_path)) as path:
        assert sweep([str(tmp_path)]) == 0
        assert os.path.isdir(path)
    assert os.listdir(str(tmp_path)) == []


def test_where_an_open_file_cannot_be_removed_nothing_is_left_either(tmp_path, monkeypatch):
    open_files = set()
    real_remove, real_close = os.remove, os.close

    def remove_file(path):  # as Windows does
        if path.endswith(".lock") and open_files:
            raise PermissionError(13, "in use", path)
        real_remove(path)

    def close(descriptor):
        open_files.discard(descriptor)
        real_close(descriptor)

    path = make("home", str(tmp_path))
    open_files.add(temporary_folders._HELD[path])
    monkeypatch.setattr(os, "remove", remove_file)
    monkeypatch.setattr(os, "close", close)
    remove(path)
    assert os.listdir(str(tmp_path)) == []
