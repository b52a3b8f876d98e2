"""`bench accuracy`: what it judges and how; one small case by all of it."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import accuracy
from laptop.bench.accuracy import AccuracyCase, AccuracyFigure, AccuracyRun
from laptop.cli.main import laptop
from laptop.emulator.scene.board_photographs import CameraPose, Lens
from laptop.measure.accuracy.emulated import LensCamera
from laptop.measure.accuracy.sighting import BoardArmPose
from shared.arm_description import ArmError

FIGURES = [
    AccuracyFigure("planar", 7, "AP P1", 1.05, 0.01, 1.0),  # near, and surer than it may be
    AccuracyFigure("planar", 7, "RP P1", 0.5, 0.2, 0.3),  # far, and says so
    AccuracyFigure("planar", 7, "RT line 10 %", 0.8, 0.05, 1.0),  # neither
    AccuracyFigure("planar", 7, "AT line 10 %", 1.0, 0.1, 1.0),
]


def test_the_verdict_counts_what_is_near_and_what_is_told_truly():
    result = AccuracyRun(AccuracyCase("planar"), FIGURES)
    assert accuracy.verdict(result) == (
        "2 of 4 within 10 % of the truth; of 2 the truth lies within U, of 3 one of both"
    )


def test_an_arm_that_does_not_end_the_test_is_told_and_keeps_nothing_from_the_others(monkeypatch):
    def fail(*args):
        raise ArmError("driver.py: the elbow does not turn")

    monkeypatch.setattr(accuracy, "measure_emulated", fail)
    failed = accuracy.run_case(AccuracyCase("planar", cycles=3, seed=7))
    done = AccuracyRun(AccuracyCase("planar", seed=8), FIGURES)
    table, *lines = accuracy.BENCH.shown([failed, done], None)
    assert len(table.rows) == len(FIGURES)
    assert lines[0] == "planar, seed 7: the test was not ended: driver.py: the elbow does not turn"
    assert lines[1].startswith("planar, seed 8: 2 of 4")
    assert not accuracy.BENCH.holds([failed, done])
    assert accuracy.BENCH.holds([done])


def test_the_table_sets_the_truth_beside_each_value():
    rows = accuracy.table(FIGURES)
    assert len(rows[0]) == len(accuracy.HEADINGS)
    assert rows[0] == ["planar", "7", "AP P1", "1.050", "0.020", "1.000", "+5.0 %", "no"]
    assert rows[1][-2:] == ["+66.7 %", "yes"]


def test_a_true_value_of_nothing_is_missed_by_any():
    assert AccuracyFigure("planar", 7, "AD P2 P4", 0.1, 0.2, 0.0).off == np.inf


def test_a_camera_sees_points_of_the_arm_where_that_stands_on_the_board():
    lens = Lens(600.0, (319.5, 239.5), (-0.1, 0.02, 0, 0, 0))
    stand = CameraPose.looking(50, 0.3, 0.5, 0.0, (0, 0))
    seen = LensCamera(lens, stand, BoardArmPose(np.pi / 2, (3.0, -10.0)))
    # The arm's x is the board's y, its y the board's -x.
    on_board = np.array([(3.0 - 2.0, -10.0 + 12.0, 2.5)])
    assert seen.project(np.array([(12.0, 2.0, 2.5)])) == pytest.approx(stand.pixels(lens, on_board))


def test_an_unknown_arm_is_refused_in_a_line():
    done = CliRunner().invoke(laptop, ["bench", "accuracy", "--arm", "none.ini"])
    assert done.exit_code != 0
    assert "none.ini" in done.output
    assert "Traceback" not in done.output


@pytest.mark.claims
def test_one_arm_is_measured_well_and_all_figures_are_told():
    words = ["bench", "accuracy", "--arm", "planar", "--cycles", "3", "--seeds", "1001:1002"]
    done = CliRunner().invoke(laptop, [*words, "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert len(told) == 27
    assert {(one["arm"], one["seed"]) for one in told} == {("planar", 1001)}
    near = [abs(one["off"]) <= 0.1 for one in told]
    assert sum(near) >= 24, [one["name"] for one, good in zip(told, near, strict=True) if not good]
