"""The files of a run: whole, named in its summary, and none of anybody else's taken away."""

import json
from pathlib import Path

import click
import pytest

from laptop.cli.run_folder import SUMMARY, check_room, write_files
from laptop.system.files import CannotWrite


def text(words):
    return lambda path: Path(path).write_text(words)


def test_the_summary_names_each_file_of_its_run(tmp_path):
    (tmp_path / "trace.csv").write_text("of an earlier run")
    told = {"kind": "calibration", "poses": 3}
    write_files(tmp_path, {SUMMARY: told, "rests.csv": text("a")}, written=["planar.ini"])
    assert json.loads((tmp_path / SUMMARY).read_text()) == {
        **told,
        "files": ["planar.ini", SUMMARY, "rests.csv"],
    }
    assert (tmp_path / "trace.csv").read_text() == "of an earlier run"


def test_only_what_is_named_as_of_an_earlier_run_goes(tmp_path):
    for name in ("learning.png", "picture.png", "mine.png"):
        (tmp_path / name).write_text("old")
    write_files(tmp_path, {"picture.png": text("new")}, ("learning.png", "picture.png"))
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {
        "picture.png": "new",
        "mine.png": "old",
    }


def test_a_file_that_cannot_be_written_leaves_the_old_one_whole(tmp_path):
    def fail(path):
        Path(path).write_text("half")
        raise OSError(28, "No space left on device")

    (tmp_path / "rests.csv").write_text("old")
    with pytest.raises(click.ClickException, match="No space left.*; make room, or choose .*--out"):
        write_files(tmp_path, {"rests.csv": fail})
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


@pytest.mark.parametrize("told", ["hello", "[1]", '{"a": 1}', "[" * 100_000, "\0"])
def test_a_summary_of_no_run_stays(tmp_path, told):
    (tmp_path / "summary.json").write_text(told)
    with pytest.raises(click.ClickException, match=r"summary.json is of no run and would be lost"):
        check_room(tmp_path)
    for own in ('{"kind": "calibration"}', '{"script": "driver.py"}', ""):
        (tmp_path / "summary.json").write_text(own)
        check_room(tmp_path)


def test_a_file_that_only_some_runs_write_stays_where_none_was(tmp_path):
    (tmp_path / "rests.csv").write_text("mine")
    with pytest.raises(click.ClickException, match=r"rests.csv is of no run, as there is no summ"):
        check_room(tmp_path, "rests.csv")
    check_room(tmp_path)


def test_a_folder_that_is_none_is_told(tmp_path):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("nowhere")
    for place in (tmp_path / "file", tmp_path / "file" / "in", tmp_path / "link"):
        with pytest.raises(click.ClickException, match="it is no folder; choose another one with"):
            check_room(place)
    with pytest.raises(CannotWrite, match="has characters that cannot be shown"):
        check_room(tmp_path / "a\x1b[31m")
