"""The folder of a run: whole files, and none of anybody else's taken away."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from lab_runs import left

from laptop.record.names import RUN
from laptop.record.run import Ending, Run, RunFile, read_run
from laptop.record.run_folder import NoRunFolder, run_folder
from laptop.system.files import CannotWrite


def a_run(**values):
    return Run(kind="script", what="x", ending=Ending(0, "ended"), **values)


def text(words, holds=""):
    return (lambda path: Path(path).write_text(words), holds)


def write(out, files, *names):
    with run_folder("test", out, *names) as folder:
        return folder.write(a_run(), files)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_each_run_has_a_folder_of_its_own_with_the_time_and_the_command(here):
    told = [write(None, {"a.csv": text("x", "what it holds")}) for _ in range(3)]
    assert len({*told}) == 3
    assert all(
        re.fullmatch(r"runs/\d{4}-\d\d-\d\d-\d{6}-test(-\d)?/a.csv, run.json", one) for one in told
    )
    (folder, *_) = sorted((here / "runs").iterdir())
    assert [(file.name, file.holds) for file in read_run(folder).files] == [
        ("a.csv", "what it holds")
    ]
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_folder_in_which_nothing_came_to_be_goes(here):
    with pytest.raises(ValueError, match="refused"), run_folder("test", None):
        raise ValueError("refused")
    assert [*here.iterdir()] == []


def test_the_earlier_run_goes_from_a_folder_that_was_asked_for_and_nothing_else(tmp_path):
    write(tmp_path, {"a.csv": text("old"), "b.png": text("old")}, "a.csv", "b.png")
    (tmp_path / "mine.png").write_text("mine")
    write(tmp_path, {"a.csv": text("new")}, "a.csv", "b.png")
    assert {file.name for file in tmp_path.iterdir()} == {"a.csv", "mine.png", RUN}
    assert (tmp_path / "a.csv").read_text() == "new"


def test_all_that_an_earlier_run_names_goes_but_for_what_is_behind_a_link(tmp_path):
    out, private = tmp_path / "out", tmp_path / "private"
    private.mkdir()
    (private / "a.csv").write_text("mine")
    left(out, files=[RunFile("x.jsonl"), RunFile("sub/a.csv"), RunFile("folder")])
    (out / "x.jsonl").write_text("a log")
    (out / "sub").symlink_to(private)
    (out / "folder").mkdir()
    write(out, {"a.csv": text("new")}, "a.csv")
    assert not (out / "x.jsonl").exists()
    assert (private / "a.csv").read_text() == "mine"


def test_a_file_that_the_earlier_run_does_not_name_is_not_lost(tmp_path):
    write(tmp_path, {})
    (tmp_path / "picture.png").write_text("mine")
    with pytest.raises(NoRunFolder, match="of no run, as the run.json beside it does not name it"):
        write(tmp_path, {"picture.png": text("new")}, "picture.png")
    assert (tmp_path / "picture.png").read_text() == "mine"


def test_where_runs_is_no_folder_it_is_told(here):
    (here / "runs").write_text("mine")
    with pytest.raises(NoRunFolder, match="^cannot write to runs: "):
        write(None, {})


def test_a_file_that_cannot_be_written_leaves_the_old_one_whole(tmp_path):
    def fail(path):
        Path(path).write_text("half")
        raise OSError(28, "No space left on device")

    write(tmp_path, {"a.csv": text("old")}, "a.csv")
    with pytest.raises(NoRunFolder, match="No space left.*; make room, or choose .*--out"):
        write(tmp_path, {"a.csv": (fail, "")}, "a.csv")
    assert (tmp_path / "a.csv").read_text() == "old"
    assert {file.name for file in tmp_path.iterdir()} == {"a.csv", RUN}


@pytest.mark.parametrize("told", ["hello", "[1]", '{"a": 1}', "[" * 100_000, "\0"])
def test_what_is_no_run_stays(tmp_path, told):
    (tmp_path / RUN).write_text(told)
    with pytest.raises(NoRunFolder, match=r"run.json is of no run and would be lost"):
        write(tmp_path, {})
    assert (tmp_path / RUN).read_text() == told


def test_a_file_of_no_run_is_not_lost(tmp_path):
    (tmp_path / "rests.csv").write_text("mine")
    with pytest.raises(NoRunFolder, match=r"rests.csv is of no run, as there is no run.json besi"):
        write(tmp_path, {}, "rests.csv")
    write(tmp_path, {})
    assert (tmp_path / "rests.csv").read_text() == "mine"


def test_a_folder_that_is_none_is_told(tmp_path):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("nowhere")
    for place in (tmp_path / "file", tmp_path / "file" / "in", tmp_path / "link"):
        with pytest.raises(NoRunFolder, match="it is no folder; choose another one with"):
            write(place, {})
    with pytest.raises(CannotWrite, match="has characters that cannot be shown"):
        write(tmp_path / "a\x1b[31m", {})


def test_one_run_has_it_alone(tmp_path):
    with run_folder("test", tmp_path):
        (tmp_path / "a.csv").write_text("of the run that is at work")
        with pytest.raises(NoRunFolder, match="another run is at work"):
            write(tmp_path, {}, "a.csv")
    (tmp_path / "a.csv").unlink()
    write(tmp_path, {}, "a.csv")


def test_whether_an_earlier_run_moved_anything_is_known(tmp_path):
    with run_folder("test", tmp_path) as folder:
        assert not folder.keeps_earlier_run()
        left(tmp_path, ending=Ending(1, "refused", 0.0, {"refused": True}))
        assert not folder.keeps_earlier_run()
        left(tmp_path)
        assert folder.keeps_earlier_run()


@pytest.mark.skipif(os.name != "posix", reason="a process is killed")
def test_a_run_that_was_killed_holds_no_folder(tmp_path):
    code = (
        "import os, sys\nfrom pathlib import Path\n"
        "from laptop.record.run_folder import run_folder\n"
        "with run_folder('test', Path(sys.argv[1])): os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path])
    write(tmp_path, {})
