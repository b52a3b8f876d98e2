"""`draw --trials` as typed: what is learned, what is drawn of it, what is refused in a line."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from run_json import run_in

from laptop.cli.main import laptop
from laptop.measure.ilc import stored_offsets
from laptop.measure.ilc.learning import Offsets
from shared.job import Job

LINE = ("--line", "10,1 8,5")
PLANT = ("--simulate", "--plant", "cpu=0,backlash=0,zero_error=1.5")


@pytest.fixture
def draw(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))

    def run(*args):
        return CliRunner().invoke(laptop, ["draw", *args])

    return run


def refused(done, complaint):
    assert done.exit_code != 0
    assert "Traceback" not in done.output
    assert complaint in " ".join(done.output.split())


def off(folder):
    """Greatest distance of the true ink, mm."""
    return run_in(Path(folder))["drawings"][0]["greatest mm"]


@pytest.mark.long
def test_what_was_rehearsed_is_kept_and_drawn_again(draw, tmp_path):
    done = draw(*LINE, "--trials", "2", *PLANT, "--out", "first")
    assert done.exit_code == 0, done.output
    assert "rehearsal 1 of 2: the tip missed its path by" in done.output
    assert "what was learned is kept in" in done.output
    assert (tmp_path / "first" / "learning.png").exists()
    (file,) = (tmp_path / "state" / "learned").iterdir()
    again = draw(*LINE, "--trials", "0", *PLANT, "--out", "again")
    assert again.exit_code == 0, again.output
    assert "as 2 rehearsals have taught:" in again.output
    # Of an emulated arm the real one learns nothing.
    refused(draw(*LINE, "--trials", "0", "--to", "a.job"), "nothing is learned of this path")
    assert not (tmp_path / "a.job").exists()
    plain = draw(*LINE, *PLANT, "--out", "plain")
    assert plain.exit_code == 0, plain.output
    assert off("again") < 0.6 * off("plain")
    assert json.loads(file.read_text())["rehearsals"] == 2


@pytest.mark.long
def test_a_few_rehearsed_strokes_teach_all(draw, tmp_path):
    places = [(10, 10), (40, 15), (70, 10), (20, 50), (60, 45), (85, 60), (40, 80)]
    lines = "".join(
        f'<line x1="{x}" y1="{y}" x2="{x + 12 * (-1) ** k}" y2="{y + 14}"/>'
        for k, (x, y) in enumerate(places)
    )
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g stroke="black">'
    (tmp_path / "seven.svg").write_text(f"{head}{lines}</g></svg>")
    common = ("seven.svg", "--size", "10", *PLANT)
    plain = draw(*common, "--out", "plain")
    assert plain.exit_code == 0, plain.output
    done = draw(*common, "--trials", "2", "--of", "4", "--out", "taught")
    assert done.exit_code == 0, done.output
    assert "4 of 7 strokes were rehearsed; foretold from one another they miss" in done.output
    assert off("taught") < 0.6 * off("plain")
    # What was foretold is kept beside what was rehearsed.
    again = draw(*common, "--trials", "0", "--out", "again")
    assert again.exit_code == 0, again.output
    assert off("again") == pytest.approx(off("taught"))
    more = draw(*common, "--trials", "1", "--of", "4", "--out", "more")
    assert "the others keep what was learned before" in more.output


def test_a_job_is_written_with_what_was_learned(draw, monkeypatch):
    stored = stored_offsets.StoredOffsets(
        [[Offsets(np.array([0.0, 4.4721]), np.full((2, 2), 0.01))]], 2, 3.0, 0.5
    )
    monkeypatch.setattr(
        stored_offsets, "find", lambda plan, emulated, notes: None if emulated else stored
    )
    done = draw(*LINE, "--trials", "0", "--to", "a.job")
    assert done.exit_code == 0, done.output
    assert "as 2 rehearsals have taught: 3.0 mm were missed before, 0.5 after" in done.output
    assert Job("a.job").stroke(1).offsets == [([0.0, 4.4721], [[0.01, 0.01], [0.01, 0.01]])]


@pytest.mark.parametrize(
    ("args", "complaint"),
    [
        ((*LINE, "--trials", "-1"), "0<=x<=20"),
        ((*LINE, "--trials", "99"), "0<=x<=20"),
        ((*LINE, "--trials", "two"), "'two'"),
        ((*LINE, "--trials", "0", *PLANT), "give --trials 3"),
        ((*LINE, "--trials", "3", "--repeat", "2"), "--trials draws all of it, once"),
        ((*LINE, "--trials", "3", "--arm-at", "4,5"), "write it as -9,0,0"),
        ((*LINE, "--trials", "3", "--arm-at", "nan,0,0"), "write it as -9,0,0"),
        ((*LINE, "--trials", "3", *PLANT, "--arm-at", "4,5,0"), "leave --arm-at out"),
        ((*LINE, "--trials", "3", *PLANT, "--camera", "0"), "leave --camera out"),
        ((*LINE, "--camera", "0"), "--camera is for a path that is taught by camera: add --trials"),
        ((*LINE, "--forget"), "--forget is for"),
        ((*LINE, "--of", "6"), "--of is for"),
        ((*LINE, "--trials", "3", "--of", "2"), "x>=3"),
        ((*LINE, "--built", "planar"), "add --simulate"),
        (("house", "--arm", "spatial", "--trials", "3"), "spatial moves"),
        (("--line", "10,0", "--trials", "3"), "two points"),
        (("--line", "10,0 90,0", "--trials", "3"), "cannot be reached"),
        (
            (*LINE, "--trials", "3", "--to", "a.job"),
            "leave --to out",
        ),
    ],
)
def test_bad_input_is_told_in_a_line(draw, args, complaint):
    refused(draw(*args), complaint)
