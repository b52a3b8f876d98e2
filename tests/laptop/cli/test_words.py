"""The words of the command line: how many there are, and that each means one thing."""

from collections import defaultdict

import click
import pytest

from laptop.cli.command import name_of
from laptop.cli.commands import OTHER_OPTIONS
from laptop.cli.exit_status import MEANINGS, ExitStatus
from laptop.cli.main import laptop
from laptop.cli.old_options import OLD_OPTIONS
from laptop.cli.rules import RULES

MOST_NAMES = 87
SEVERAL_FORMS = {
    "--arm": {"FILE", "ARM", "choice"},  # of a bench those that it can
    "--arm-at": {"X,Y,DEG"},
    "--at": {"X,Y", "X,Y[,Z]"},  # of a place in space
    "--brick": {"NAME", "[NAME]"},  # a switch where it may be told to begin by itself
    "--calibration": {"FILE.json"},
    "--json": {"boolean"},
    "--listen-port": {"P", "[HOST:]P"},
    "--paper": {"SIZE", "choice"},  # of a page some
    "--plant": {"KEY=VALUE,...", "cpu=FACTOR"},  # of a bench that one
    "--seed": {"N", "integer range"},
    "--size": {"W[xH]", "CM"},  # of a square one number
    "--timeout": {"S", "float range"},
    "--to": {"FILE", "FILE.json"},
}
"""Options whose values are written differently here and there, though they mean the same."""


def options(command=laptop, words=()):
    """Yield the words of each command and its options."""
    if isinstance(command, click.Group):
        for name, one in command.commands.items():
            yield from options(one, (*words, name))
    for param in command.params:
        if isinstance(param, click.Option):
            yield " ".join(words), param


def commands():
    """Return the words of each command, and it."""
    found, groups = [], [((), laptop)]
    while groups:
        words, group = groups.pop()
        for name, command in group.commands.items():
            if isinstance(command, click.Group):
                groups.append(((*words, name), command))
            else:
                found.append((" ".join((*words, name)), command))
    return found


def sections(command):
    """Return the sections of a command's help."""
    return getattr(command, "_sections", {})


def test_there_are_few_names():
    names = {name_of(param) for _, param in options()}
    assert len(names) <= MOST_NAMES, sorted(names)


def test_a_name_means_the_same_everywhere():
    forms = defaultdict(set)
    for _, param in options():
        forms[name_of(param)].add(param.metavar or param.type.name)
    several = {name: found for name, found in forms.items() if len(found) > 1}
    assert all(found <= SEVERAL_FORMS.get(name, set()) for name, found in several.items()), several


def test_nothing_has_a_second_name():
    """Words that are answered with another one are no options of any command."""
    there = {name for _, param in options() for name in param.opts + param.secondary_opts}
    synonyms = {word for words in OTHER_OPTIONS.values() for word in words}
    assert not synonyms & there
    for command, words in OLD_OPTIONS.items():
        own = {name for typed, param in options() if typed == command for name in param.opts}
        assert not {word for word in words if " " not in word} & own, command


@pytest.mark.parametrize("command", RULES)
def test_rules_are_of_options_that_are_there(command):
    """Else a rule is never heard."""
    made = laptop
    for word in command.split():
        made = made.commands[word]
    there = {name for param in made.params for name in (name_of(param), *param.secondary_opts)}
    for rule in RULES[command]:
        words = [word for part in rule if isinstance(part, tuple) for word in part]
        assert {word.split()[0] for word in words} <= there, rule


@pytest.mark.parametrize("words", [words for words, command in commands() if sections(command)])
def test_sections_of_a_help_hold_all_options(words):
    (command,) = (one for name, one in commands() if name == words)
    named = [name for names in sections(command).values() for name in names]
    own = [name_of(param) for param in command.params if isinstance(param, click.Option)]
    assert sorted(named) == sorted(set(own) - {"--help-all"})


def test_every_exit_status_is_told():
    """The page of files has all of MEANINGS, in a table that is made of it."""
    assert set(MEANINGS) == set(ExitStatus)


def test_help_of_draw_is_short_and_help_all_is_whole(capsys):
    from laptop.cli.draw_options import COMMON_OPTIONS, SECTIONS

    draw = laptop.commands["draw"]
    assert len(COMMON_OPTIONS) == 12
    assert {name for names in SECTIONS.values() for name in names} | {"--help-all"} == {
        name_of(param) for param in draw.params if isinstance(param, click.Option)
    }
    with pytest.raises(SystemExit):
        laptop(["draw", "--help"])
    short = capsys.readouterr().out
    assert there(short) == {*COMMON_OPTIONS, "--help-all", "--help"}
    with pytest.raises(SystemExit):
        laptop(["draw", "--help-all"])
    whole = capsys.readouterr().out
    assert {name_of(param) for param in draw.params if isinstance(param, click.Option)} <= there(
        whole
    )
    assert all(len(line) <= 80 for line in short.split("Examples:")[0].splitlines())


def there(text):
    """Return the options that begin a line of a help."""
    return {
        word.strip(",")
        for line in text.splitlines()
        if line.startswith("  -")
        for word in line.split()[:2]
        if word.startswith("--")
    }
