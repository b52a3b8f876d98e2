"""`accuracy`, as typed."""

import json

import pytest
from click.testing import CliRunner

from laptop.cli.main import laptop


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "Give the camera's SOURCE, 0 say, or --simulate."),
        (["0", "--simulate"], "--simulate has cameras of its own"),
        (["0", "--plant", "cpu=1"], "--plant and --built are of the emulated arm"),
        (["--simulate", "--at", "1,b"], "'1,b' is not X,Y or X,Y,Z"),
        (["--simulate", "--side", "40"], "no room for a test square of 40 cm anywhere"),
        (["--simulate", "--arm", "none.ini"], "none.ini"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(words, said, tmp_path):
    done = CliRunner().invoke(laptop, ["accuracy", *words, "--out", str(tmp_path)])
    assert done.exit_code != 0
    assert said in done.output
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_an_emulated_arm_is_measured_and_all_files_are_there(tmp_path):
    words = ["accuracy", "--simulate", "--cycles", "3", "--side", "4", "--out", str(tmp_path)]
    done = CliRunner().invoke(laptop, words)
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "summary.json").read_text())
    for one in told["criteria"]:
        off = abs(one["value_mm"] - one["true_mm"])
        assert off < max(0.25 * one["true_mm"], 2 * one["expanded_uncertainty_mm"]), one
    assert {file.name for file in tmp_path.iterdir()} == {
        *("accuracy.png", "accuracy.csv", "summary.json"),
    }
