"""`bench plot`: its drawings, its floor, and one of them drawn."""

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import draw, plot, plot_drawings, plot_speed
from laptop.cli.main import laptop
from laptop.drawing.artwork import Artwork
from laptop.drawing.options import DrawingOptions
from laptop.drawing.preparing import prepare
from shared.arm_description import find_arm, is_bundled, read_arm
from shared.state import STATE

LENGTHS = {
    "hilbert": 255 * plot_drawings.SIDE / 16,
    "snowflake": 3 * 0.49 * plot_drawings.SIDE * math.sqrt(3) * (4 / 3) ** 3,
    "maze": 81 * plot_drawings.SIDE / 9 * math.sqrt(2),
    "tiles": 72 * math.pi / 2 * plot_drawings.SIDE / 12,
}
"""By their rules, cm."""


@pytest.mark.parametrize("name", sorted(LENGTHS))
def test_a_drawing_is_as_long_as_its_rule_says(name):
    lines = plot_drawings.artwork(name).strokes
    length = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines)
    assert length == pytest.approx(LENGTHS[name], rel=1e-3)


def test_a_drawings_floor_is_that_of_its_line():
    arm = read_arm(find_arm("planar"))
    line = ((10.0, 0.0), (5.0, 10.0))
    artwork = Artwork("line", (np.array(line),), ("",), None, ())
    # (On the sheet up is x and left is y.)
    sheet = Artwork("line", (np.array([(0.0, 10.0), (-10.0, 5.0)]),), ("",), None, ())
    plan = prepare(sheet, arm, DrawingOptions(at=(7.5, 5.0), size=(10.0, None)))
    assert plan.strokes[0].placed.points == pytest.approx(np.array(artwork.strokes[0]), abs=0.01)
    assert plot.floor(plan) == pytest.approx(draw.floor(arm, line), rel=0.02)


def test_ten_drawings_by_three_arms_are_drawn_unless_files_are_given():
    assert len(plot.cases((), plot.ARMS, None)) == 30
    assert [case.drawing for case in plot.cases(("rose", "a.svg"), ("planar",), None)] == [
        *("rose", "a.svg")
    ]


def test_vpypes_way_is_measured_where_it_is_installed(tmp_path, monkeypatch):
    program = tmp_path / "vpype"
    program.write_text("#!/bin/sh\ncat\n")  # leaves all as it was
    program.chmod(0o755)
    lines = [np.array([(0.0, 0.0), (1.0, 0.0)]), np.array([(4.0, 4.0), (5.0, 4.0)])]
    monkeypatch.setattr(shutil, "which", lambda name: str(program))
    way, count = plot.by_vpype(lines)
    assert (way, count) == (pytest.approx(5.0, abs=1e-3), 2)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert plot.by_vpype(lines) is None


@pytest.mark.claims
def test_a_drawing_is_drawn_and_measured(tmp_path):
    file = tmp_path / "dash.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4">'
        '<path d="M0,0H3M0,1H3" fill="none" stroke="black"/></svg>'
    )
    words = ["bench", "plot", "--arm", "planar", "--json", "--out", str(tmp_path), str(file)]
    done = CliRunner().invoke(laptop, words)
    assert done.exit_code == 0, done.output
    (one,) = json.loads(done.stdout)
    assert (one["strokes"], one["drawn_strokes"], one["error"]) == (2, 2, "")
    assert one["greatest_mm"] < 4
    assert one["missed_mm"] < 4
    assert one["standing_s"] < 0.5
    assert abs(one["estimated_s"] / one["drawn_s"] - 1) < 0.05
    assert (tmp_path / "dash-planar.png").stat().st_size > 10000


def test_what_is_no_drawing_is_refused_before_anything_is_drawn(tmp_path):
    done = CliRunner().invoke(laptop, ["bench", "plot", "rose", str(tmp_path / "none.svg")])
    assert done.exit_code == 1
    assert "there is no such file" in done.output


def test_the_arms_measured_are_those_that_come_along(tmp_path, monkeypatch):
    """Else the figures are of whatever was calibrated here."""
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms" / "planar.ini").write_text(Path(find_arm("planar")).read_text())
    monkeypatch.setenv(STATE, str(tmp_path))
    taken = []

    def drawn(cases):
        taken.append(read_arm(find_arm("planar")))
        return iter(())

    monkeypatch.setattr(plot, "BENCH", replace(plot.BENCH, in_turn=drawn))
    done = CliRunner().invoke(laptop, ["bench", "plot", "--arm", "planar", "--json", "rose"])
    assert done.exit_code == 0, done.output
    assert is_bundled(taken[0])
    assert not is_bundled(read_arm(find_arm("planar"))), "as before"


@pytest.mark.long
def test_large_drawings_are_read_and_ordered_with_all_their_lines(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(plot_speed.SIZES, "spokes", lambda: plot_speed._spokes(12))
    monkeypatch.setitem(plot_speed.SIZES, "apart", lambda: plot_speed._scattered(3, 4))
    spokes, apart = (plot_speed.measure(name) for name in ("spokes", "apart"))
    assert (spokes.ours_strokes, apart.ours_strokes) == (6, 3)
    # From the end of a diameter to that of the next, at the best.
    assert spokes.ours_cm == pytest.approx(5 * 16 * math.sin(math.pi / 12), rel=1e-3)
    assert spokes.ours_s > 0
    row = plot_speed.table([spokes])[0]
    assert row[2:4] == ["-", "-"]


@pytest.mark.long
def test_vpype_reads_the_same_drawing_beside(tmp_path, monkeypatch):
    program = tmp_path / "vpype"
    program.write_text('#!/bin/sh\n[ "$9" = - ] && cat "$3"\n')  # leaves all as it was
    program.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(program))
    monkeypatch.setitem(plot_speed.SIZES, "spokes", lambda: plot_speed._spokes(12))
    spokes = plot_speed.measure("spokes")
    assert spokes.vpype_strokes == 12
    assert spokes.vpype_cm == pytest.approx(11 * 8, rel=1e-3)  # from each end to the middle
    assert plot_speed.table([spokes])[0][2:4] != ["-", "-"]


def test_planning_is_of_its_own_drawings():
    done = CliRunner().invoke(laptop, ["bench", "planning", "rose"])
    assert done.exit_code == 2
    assert "unexpected extra argument" in done.output
