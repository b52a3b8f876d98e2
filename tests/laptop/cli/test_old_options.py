"""The words of before: they do what they did, and say what they are now."""

import click
import pytest
from click.testing import CliRunner

from laptop.cli.main import laptop
from laptop.cli.old_options import OLD_OPTIONS, renamed_args


def command_of(words):
    command = laptop
    for word in words.split():
        command = command.commands[word]
    return command


@pytest.mark.parametrize("words", OLD_OPTIONS)
def test_each_old_option_is_one_of_now_and_none_of_now_is_old(words):
    command = command_of(words)
    existing = {name for param in command.params for name in param.opts + param.secondary_opts}
    table = OLD_OPTIONS[words]
    now = {new.split()[0] for new in table.values() if new not in ("", "{}")}
    assert now <= existing
    assert "{}" not in table.values() or any(
        isinstance(param, click.Argument) for param in command.params
    )
    assert not existing & {old for old in table if " " not in old}


def test_the_new_words_take_the_place_of_the_old_ones(capsys):
    args = ["--camera", "a.json", "--camera", "0", "--height=25", "--touch", "1,2,3", "--call"]
    assert list(renamed_args("measure arm", args)) == [
        *("--calibration", "a.json", "--camera", "0", "--marker-height=25"),
        *("--crosses", "1,2,3", "--brick"),
    ]
    assert capsys.readouterr().err == (
        "--camera is now --calibration\n--height is now --marker-height\n"
        "--touch is now --crosses\n--call is now --brick\n"
    )
    args = ["rose", "--slant=10", "--align", "centre", "--fit", "--preview", "a.png", "--card", "x"]
    assert list(renamed_args("draw", args)) == [
        *("rose", "--lettering", "slant=10", "--lettering", "align=centre", "--to", "a.png", "x")
    ]
    assert capsys.readouterr().err == (
        "--slant 10 is now --lettering slant=10\n--align centre is now --lettering align=centre\n"
        "--fit needs not be typed any more\n--preview is now --to\n--card x is now x\n"
    )
    assert list(renamed_args("draw", ["--preview", "rose"])) == ["--preview", "rose"]
    args = ["--sensor", "in1=touch", "lab.py", "--sensor", "3"]
    assert list(renamed_args("simulate", args)) == ["--plug", *args[1:]]
    assert capsys.readouterr().err == "--sensor is now --plug\n"
    args = ["--board", "--", "--height"]
    assert list(renamed_args("track", args)) == args
    assert list(renamed_args("demo", ["--height", "3"])) == ["--height", "3"]
    assert not capsys.readouterr().err


def test_sources_without_an_option_are_taken_and_told_how(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["measure", "camera", "none.png", "--out", "c.json"])
    reported = result.output.splitlines()
    assert reported[:2] == ["--out is now --to", "none.png is now --camera none.png"]
    assert "none.png" in reported[2]
    assert "SOURCE]" not in CliRunner().invoke(laptop, ["measure", "camera", "--help"]).output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("measure accuracy --simulate --brick", "leave --brick out"),
        ("measure arm --simulate --brick ev3", "leave --brick out"),
    ],
)
def test_a_brick_may_be_named_or_not(words, said):
    result = CliRunner().invoke(laptop, words.split())
    assert result.exit_code == 2
    assert said in result.output


def test_a_brick_without_a_name_is_the_last_one():
    for command, rest in (("accuracy", []), ("arm", [])):
        made = laptop.commands["measure"].commands[command]
        for args, name in (([], None), (["--brick"], ""), (["--brick", "ev3"], "ev3")):
            context = made.make_context(command, [*args, *rest], parent=click.Context(laptop))
            assert context.params["call"] == name
