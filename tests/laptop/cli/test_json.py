"""`--json`: figures as JSON on standard output, and all that is for people on standard error."""

import json

import click
import pytest
from click.testing import CliRunner

from laptop.cli.main import laptop

WITH_FIGURES = {
    "bench draw": None,
    "class check": None,
    "doctor": None,
    "draw": None,
    "measure accuracy": None,
    "measure arm": None,
    "measure camera": None,
    "measure pen": None,
    "simulate": None,
    "track": None,
}


@pytest.fixture
def figures(tmp_path, monkeypatch):
    """Run a command with --json; returns its figures, and what it says to people."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        result = CliRunner().invoke(laptop, [*args[:1], "--json", *args[1:]])
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout), result.stderr

    return run


@pytest.mark.parametrize("args", WITH_FIGURES)
def test_who_has_figures_has_the_option(args):
    command = laptop
    for word in args.split():
        command = command.commands[word]
    assert any("--json" in param.opts for param in command.params)


def test_a_run_tells_its_record(figures, tmp_path):
    args = ("--out", "try", "--no-picture", "driver.py", "line", "10,0", "9,2")
    reported, said = figures("simulate", *args)
    assert reported == json.loads((tmp_path / "try" / "run.json").read_text())
    assert reported["kind"] == "drawing"
    assert "run.json" in said, "people are told on the other stream"


def test_a_drawing_that_is_only_planned_tells_its_size(figures):
    reported, said = figures("draw", "grid", "--size", "4", "--preview")
    assert reported["size_cm"] == pytest.approx([4, 4])
    assert f"{reported['strokes']} strokes, {reported['drawn_cm']:.0f} cm drawn" in said


def test_without_the_option_no_figures_are_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["draw", "grid", "--size", "4", "--preview"])
    assert "about " in result.stdout
    assert "{" not in result.stdout
    assert click.get_current_context(silent=True) is None
