"""Commands that run beside the tracker: in the folder in which it was started, from any folder."""

import shutil

import pytest
from places import ROOT
from waiting import until

from laptop.cli.track import start_brick


@pytest.mark.long
def test_an_arm_and_a_state_folder_are_those_of_the_folder_one_is_in(tmp_path, monkeypatch):
    """As somebody has them who works in a folder of one's own, which may hold any other file."""
    shutil.copy(ROOT / "shared" / "arms" / "geared.ini", tmp_path / "mine.ini")
    for name in ("laptop", "robot", "random", "threading"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('not a module of theirs')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", "state")
    brick = tmp_path / "state" / "emulated-brick"
    with start_brick("mine.ini", "127.0.0.1:1") as why_ended:
        until(why_ended, "the end, for that is no code")
    said = (brick / "lines.txt").read_text()
    assert "visual_servoing.py: " in said
    assert "motors: A coast, B coast" in said
    assert (brick / "run.json").exists()
