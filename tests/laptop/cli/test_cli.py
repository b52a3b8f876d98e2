"""All commands alike: help that is there at once, and one line where a library is missing."""

import os
from pathlib import Path

import click
import pytest
from own_python import python

from laptop.cli import main

SLOW = ("numpy", "cv2", "matplotlib", "nicegui", "rich")


def test_no_command_imports_what_is_slow_to_say_how_it_is_called():
    program = f"""
import sys
from click.testing import CliRunner
from laptop.cli.main import laptop

def show(command, *words):
    shown = CliRunner().invoke(laptop, [*words, "--help"]).output
    assert shown.startswith("Usage: laptop " + " ".join(words)), shown
    slow = set({SLOW}) & set(sys.modules)
    print(" ".join(words), "imports " + ", ".join(sorted(slow)) if slow else "is quick")
    for name, inner in getattr(command, "commands", {{}}).items():
        show(inner, *words, name)

show(laptop)
"""
    done = python("-c", program)
    assert done.stderr == ""
    reported = done.stdout.splitlines()
    assert {" is quick", "simulate is quick", "bench draw is quick"} < set(reported)
    assert [line for line in reported if not line.endswith(" is quick")] == []


@pytest.mark.parametrize(
    "problem",
    [
        click.ClickException("no\x1b[31m file"),
        click.UsageError("no\x1b]0;title\x07 option."),
        OSError(2, "No such file", "a\x9b\nb"),
    ],
    ids=lambda problem: type(problem).__name__,
)
def test_nothing_that_is_told_of_a_failure_steers_the_terminal(monkeypatch, capsys, problem):
    def fail(**options):
        raise problem

    monkeypatch.setattr(main, "laptop", fail)
    assert main.main() in (1, 2)
    reported = capsys.readouterr().err
    assert reported.startswith(
        "laptop: No such file" if isinstance(problem, OSError) else "laptop: no"
    )
    assert reported[:-1].isprintable()
    assert reported.endswith("\n")


@pytest.mark.parametrize("problem", ["'3x' is no size", "leave it out.", "Did you mean --at?"])
def test_what_is_told_of_a_wrong_word_is_a_sentence_and_so_is_the_next_step(
    monkeypatch, capsys, problem
):
    def fail(**options):
        raise click.UsageError(problem)

    monkeypatch.setattr(main, "laptop", fail)
    main.main()
    reported = capsys.readouterr().err
    assert reported.startswith(f"laptop: {problem}" + "." * problem.endswith("size") + " See ")


@pytest.mark.parametrize(
    ("there", "words", "missing"),
    [([], ["--help"], "click"), (["click"], ["simulate", "robot/driver.py", "where"], "msgspec")],
)
def test_a_library_that_is_not_there_is_named_in_one_line(tmp_path, there, words, missing):
    if there:
        (tmp_path / "click").symlink_to(Path(click.__file__).parent)
    done = python("-S", "-m", "laptop", *words, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert done.returncode == 1
    assert done.stderr == (
        f"laptop: {missing} is not installed here; run .uv/bin/uv run brickservo\n"
    )
