"""`bench calibrate`: its figures are what the errors make of them, and its arms their seeds'."""

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import calibrate
from laptop.cli.main import laptop


def result(seed, error, sigma, lines):
    return calibrate.CalibrateResult(
        seed, "", {"elbow.link": error}, {"elbow.link": sigma}, 36, 3.0 + seed, lines
    )


RESULTS = [
    result(0, 0.1, 0.2, ((4.0,), (1.0,), (2.0,))),
    result(1, -0.3, 0.2, ((4.0,), (4.0,), (1.0,))),
    result(2, 0.5, 0.2, ((2.0,), (1.0,), (1.0,))),
    calibrate.CalibrateResult(3, "the elbow slipped"),
]


def test_errors_and_how_often_the_stated_uncertainty_is_true():
    (row,) = calibrate.table(RESULTS)
    told = dict(zip(calibrate.HEADINGS, row, strict=True))
    assert told["number"] == "elbow.link"
    assert told["wanted"] == "0.3 %"
    assert told["rms"] == f"{math.sqrt(0.35 / 3):.3f}"
    assert (told["median"], told["worst"], told["said (median)"]) == ("0.300", "0.500", "0.200")
    assert (told["within 1"], told["within 2"]) == ("33 %", "67 %")


def test_lines_are_compared_by_the_geometric_mean():
    assert calibrate.ratios(RESULTS) == pytest.approx((16 ** (1 / 3), 2 ** (1 / 3)))
    lines = calibrate.summary(RESULTS)
    assert lines[0] == "3 of 4 arms were calibrated"
    assert lines[1] == "seed 3 was refused: the elbow slipped"
    assert "2.52 before, 1.26 after" in lines[-1]
    assert calibrate.summary(RESULTS[3:]) == ["0 of 1 arms were calibrated", lines[1]]


def test_a_seed_is_always_the_same_arm_and_off_by_no_more_than_is_said():
    for seed in range(5):
        case = calibrate.CalibrateCase(seed)
        one, again = calibrate.draw_arm(case), calibrate.draw_arm(case)
        assert one.built == again.built
        assert one.zeros == again.zeros
        for said, true in zip(one.described.joints, one.built.joints, strict=True):
            assert abs(true.link / said.link - 1) <= 0.05
            assert 0 <= math.degrees(true.backlash) <= 4
            assert math.degrees(said.backlash) == pytest.approx(2)
        assert np.abs(one.zeros).max() <= math.radians(1.5)
    other = calibrate.draw_arm(calibrate.CalibrateCase(99))
    assert other.zeros != one.zeros


@pytest.mark.claims
def test_the_command_tells_of_an_arm_that_it_calibrated():
    told = CliRunner().invoke(laptop, ["bench", "calibrate", "--seeds", "100:101", "--json"])
    assert told.exit_code == 0, told.output
    (found,) = json.loads(told.stdout)
    assert found["seed"] == 100
    assert 2 < found["minutes"] <= 3.2
    for name, error in found["errors"].items():
        assert abs(error) < 5 * found["sigmas"][name]
