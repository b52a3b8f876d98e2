"""The commands by name: in sections, by their old words, and what is said to wrong ones."""

import re

import click
import pytest
from click.testing import CliRunner
from commands import parse_script

from laptop.cli.commands import (
    DRIVER_COMMANDS,
    OTHER_COMMANDS,
    OTHER_OPTIONS,
    RENAMED,
    SECTIONS,
    no_command,
)
from laptop.cli.main import laptop, main


def shown(*args):
    """What a command prints, at 80 columns."""
    result = CliRunner().invoke(laptop, list(args), terminal_width=80)
    return result.exit_code, result.output


def test_every_command_stands_in_one_section_and_there_are_few():
    names = [name for section in SECTIONS.values() for name in section]
    assert sorted(names) == sorted(laptop.commands)
    assert len(names) <= 14


@pytest.mark.parametrize("args", [[], ["measure"], ["brick"], ["class"], ["bench"]])
def test_help_says_whole_what_each_command_does(args):
    status, text = shown(*args, "--help")
    assert status == 0
    assert "..." not in text.partition("Commands:")[2].partition("Examples:")[0]
    assert not args or "..." not in text.split("Options:")[1].partition("Examples:")[0]
    assert max(map(len, text.splitlines())) <= 80
    group = laptop
    for word in args:
        group = group.commands[word]
    for name, command in group.commands.items():
        first = command.get_short_help_str(limit=200)
        said = re.search(rf"^  {name} +(.*\n(?:   .*\n)*)", text, re.MULTILINE)[1]
        assert " ".join(said.split()) == first


@pytest.mark.parametrize(("old", "new"), RENAMED.items(), ids=" ".join)
def test_an_old_word_still_works_and_says_the_new_one(old, new):
    takes_a_value = new[-1].startswith("--")
    status, text = shown(*old, *["a"] * takes_a_value, "--help")
    assert status == 0
    first, usage, *_ = text.splitlines()
    assert first == f"{' '.join(old)} is now {' '.join(new)}"
    command = new[:-1] if takes_a_value else new
    assert usage.startswith(f"Usage: laptop {' '.join(command)} ")


def test_an_old_word_may_stand_behind_others():
    status, text = shown("draw", "--brick", "ev3", "--jobs", "--help")
    assert (status, text.splitlines()[0]) == (0, "draw --jobs is now brick jobs")


@pytest.mark.parametrize("word", OTHER_COMMANDS)
def test_what_is_said_to_a_wrong_word_is_there(word):
    text = no_command(word, laptop.commands)
    assert text.startswith(f"'{word}' is ")
    advised = re.findall(r"brickservo (\S+?)(?: ([a-z]+)\b)?[ .,]", text + " ")
    assert advised
    for name, part in advised:
        if name != "--help":
            group = laptop.commands[name]
            assert not isinstance(group, click.Group) or part in group.commands


@pytest.mark.parametrize("word", DRIVER_COMMANDS)
def test_the_words_of_driver_py_are_its_own(word, capsys):
    with pytest.raises(SystemExit, match="^0$"):
        parse_script("driver.py", [word, "--help"])
    assert f"driver.py {word}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("calibrat", "There is no command 'calibrat'; did you mean measure arm?"),
        ("drow", "There is no command 'drow'; did you mean draw?"),
        ("xyzzy", "There is no command 'xyzzy'; brickservo --help lists them."),
        ("lab1.py", "'lab1.py' is a script: brickservo simulate lab1.py."),
    ],
)
def test_a_word_that_is_no_command_is_answered(word, said):
    status, text = shown(word)
    assert status == 2
    assert said in " ".join(text.split())


def test_the_page_is_track_with_its_page_open(monkeypatch):
    begun = []
    args = ("page", "open", "camera", "arm_file", "simulate")
    monkeypatch.setattr(
        *(laptop.commands["track"], "callback"),
        lambda **options: begun.append(tuple(options[word] for word in args)),
    )
    assert shown("page")[0] == 0
    status, reported = shown("page", "--camera=0", "--arm", "spatial", "--no-brick")
    assert (status, reported) == (0, "--no-brick is now --no-simulate\n")
    assert begun == [
        (True, True, ("synthetic",), None, True),
        (True, True, ("0",), "spatial", False),
    ]


@pytest.mark.parametrize(
    ("args", "said"),
    [
        ("draw house --width 10", "--width is --size W[xH] here. See brickservo draw --help."),
        ("track --cam=0", "--cam is --camera SOURCE here. See brickservo track --help."),
        ("simulate -o x", "-o is --out DIR here. See brickservo simulate --help."),
        ("draw house --png a.png", "--png is --to FILE here. See brickservo draw --help."),
        (
            "draw house --brick",
            "--brick takes NAME; without it, it is the last one. See brickservo draw --help.",
        ),
        (
            "guide --to",
            "--to takes FILE; without it, it is guide.html, which is opened. See brickservo guide "
            "--help.",
        ),
        (
            "measure pen --simulate 0",
            "--simulate has a camera of its own: leave the camera out. See brickservo measure pen "
            "--help.",
        ),
        ("draw house --xyzzy", "No such option '--xyzzy'. See brickservo draw --help."),
        ("demo --width 10", "No such option '--width'. See brickservo demo --help."),
    ],
)
def test_a_wrong_option_is_answered_with_the_one_of_that_command(monkeypatch, capsys, args, said):
    monkeypatch.setattr("sys.argv", ["brickservo", *args.split()])
    assert main() == 2
    assert capsys.readouterr().err == f"laptop: {said}\n"


def test_no_wrong_option_is_one_of_some_command():
    existing = set()
    groups = [laptop]
    while groups:
        for command in groups.pop().commands.values():
            existing.update(name for param in command.params for name in param.opts)
            groups += [command] if isinstance(command, click.Group) else []
    assert set(OTHER_OPTIONS) <= existing
    wrong = [word for args in OTHER_OPTIONS.values() for word in args]
    assert len(set(wrong)) == len(wrong)
    assert not set(wrong) & existing
