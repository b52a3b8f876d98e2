"""What is told of a test: the table, what goes with it, the CSV, the run."""

import math

import numpy as np
import pytest
from arms import PLANAR as ARM
from csv_rows import rows_in

from laptop.measure.accuracy import report
from laptop.measure.accuracy.accuracy_test import AccuracyResult, Attained, Criterion
from laptop.measure.accuracy.plan import AccuracyPlan
from laptop.measure.accuracy.sighting import BoardArmPose

PLAN = AccuracyPlan(ARM, ARM.elbow, 8.0, np.array([14.0, 0.0]), 3)
OBSERVED = {
    "P1": Attained(
        np.array([[(14.01, 0.0), (14.02, 0.01), (14.03, -0.01)]]),
        np.array([np.diag([4e-6, 1e-6])]),
        np.zeros((1, 2, 0)),
        np.array([(14.0, 0.0)]),
    ),
    "line 100 %": Attained(
        np.array([[(0.01,), (0.02,)], [(-0.03,), (0.0,)]]),
        np.full((2, 1, 1), 9e-6),
        np.zeros((2, 1, 0)),
        np.zeros((2, 1)),
        np.array([1.5, 4.5]),
    ),
}


def result(fitted=False, repeats=0.5):
    criteria = (
        Criterion("AP P1", 0.204, 0.01),
        Criterion("RP P1", repeats, 0.1),
        Criterion("RD P2 P4", 0.9, 0.03),
    )
    arm_pose = BoardArmPose(math.radians(12.0), (1.0, -2.0))
    return AccuracyResult(
        PLAN, OBSERVED, criteria, arm_pose, fitted, {"A": 0.034}, (0.031, 0.008), 1234.5
    )


def test_the_table_has_value_uncertainty_and_the_truth_where_it_is_known():
    headings, rows = report.table(result())
    assert headings == ["", "ISO 9283:1998", "mm", "U mm"]
    assert rows == [
        ["AP P1", "pose accuracy", "0.20", "0.02"],
        ["RP P1", "pose repeatability", "0.50", "0.20"],
        ["RD P2 P4", "distance repeatability", "\u00b10.90", "0.06"],
    ]
    headings, rows = report.table(result(), {"AP P1": 0.211, "RP P1": 0.4, "RD P2 P4": 1.0})
    assert [row[-1] for row in rows] == ["0.21", "0.40", "1.00"]
    assert headings[-1] == "truth mm"


def test_every_criterion_has_its_words():
    for name in ("AP", "RP", "vAP", "AD", "RD", "AT", "RT"):
        assert report.MEANINGS[name]


def test_notes_say_what_a_fitted_stand_hides_and_what_the_camera_cannot_tell():
    assert len(report.notes(result())) == 3
    assert "A 0.03 px in one picture; 0.03 mm on a path, 0.01 mm" in report.notes(result())[0]
    assert any("(--arm-at) is not in U" in note for note in report.notes(result()))
    assert any("fitted to the poses" in note for note in report.notes(result(fitted=True)))
    assert not any("(--arm-at)" in note for note in report.notes(result(fitted=True)))
    assert any("has a U as large as itself" in note for note in report.notes(result(repeats=0.19)))


def test_the_csv_has_every_cycle_in_mm_with_its_noise(tmp_path):
    report.write_csv(tmp_path / "a.csv", result())
    rows = rows_in(tmp_path / "a.csv")
    assert len(rows) == 3 + 2 * 2
    assert (rows[1]["of"], rows[1]["cycle"], rows[1]["first_mm"]) == ("P1", "2", "140.2000")
    assert float(rows[1]["sigma_mm"]) == pytest.approx(10 * math.sqrt(2.5e-6), abs=1e-4)
    assert (rows[5]["plane"], rows[5]["along_cm"], rows[5]["first_mm"]) == ("2", "4.500", "-0.3000")
    assert rows[5]["second_mm"] == ""


def test_the_run_says_what_was_done_how_it_ended_and_all_figures():
    run = report.accuracy_run(result(), {"AP P1": 0.2, "RP P1": 1, "RD P2 P4": 1})
    assert (run.kind, run.ending.status, run.ending.reason) == ("accuracy", 0, "ended")
    values = {row["what"]: row["value"] for row in run.rows("values")}
    place = [values[f"the arm's {name} on the board {unit}"]
             for name, unit in (("x", "cm"), ("y", "cm"), ("turn", "deg"))]  # fmt: skip
    assert place == [1.0, -2.0, 12.0]
    assert run.rows("criteria")[0] == {
        "criterion": "AP P1",
        "meaning": "pose accuracy",
        "value mm": 0.204,
        "expanded uncertainty mm": 0.02,
        "true mm": 0.2,
    }
    assert "true mm" not in report.accuracy_run(result()).rows("criteria")[0]
