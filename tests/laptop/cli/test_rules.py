"""Which options go together: three kinds of rules, each with the sentence that it refuses by."""

import click
import pytest

from laptop.cli import rules
from laptop.cli.rules import Excludes, Needs, OneOf, check_rules, check_source_options

FREE = Excludes(("--free", "--easy"), ("--paper", "SOURCES"), "lies anywhere", but=("--any",))
TOUCH = Needs(("--touch",), ("--pens", "--pen"), "is for several pens")
ONE = OneOf(("--line", "--text"), "Give one of them.", alone=True)
SOME = OneOf(("--line", "--text"), "Give one of them.")


@pytest.mark.parametrize(
    ("rule", "given", "refused"),
    [
        (FREE, ["--paper", "--easy"], "--easy lies anywhere: leave --paper out."),
        (FREE, ["--paper", "--free", "--easy"], "--free lies anywhere: leave --paper out."),
        (FREE, ["SOURCES", "--free"], "--free lies anywhere: leave the camera out."),
        (FREE, ["--paper", "--free", "--any"], ""),
        (FREE, ["--free"], ""),
        (FREE, ["--paper"], ""),
        (TOUCH, ["--touch"], "--touch is for several pens: add --pens."),
        (TOUCH, ["--touch", "--pen"], ""),
        (TOUCH, [], ""),
        (ONE, [], "Give one of them."),
        (ONE, ["--line", "--text"], "Give one of them."),
        (ONE, ["--text", "--free"], ""),
        (SOME, ["--free"], "Give one of them."),
        (SOME, ["--line", "--text"], ""),
    ],
)
def test_a_rule_refuses_what_does_not_go_together_and_nothing_else(
    monkeypatch, rule, given, refused
):
    monkeypatch.setitem(rules.RULES, "draw", (rule,))
    if not refused:
        check_rules("draw", given)
        return
    with pytest.raises(click.UsageError) as error:
        check_rules("draw", given)
    assert error.value.message == refused


def test_the_first_rule_that_is_broken_is_the_one_that_is_told(monkeypatch):
    monkeypatch.setitem(rules.RULES, "draw", (TOUCH, FREE))
    with pytest.raises(click.UsageError, match="--touch"):
        check_rules("draw", {"--touch", "--free", "--paper"})


def test_a_command_without_rules_takes_all():
    assert "where" not in rules.RULES
    check_rules("where", {"--free", "--paper"})


@pytest.mark.parametrize(
    ("given", "kind", "refused"),
    [
        (["--seed", "--font"], "picture", "--font is for a drawing made of a text, and x is none"),
        (["--layer"], "text", "--layer is for a drawing made of an SVG, and x is none"),
        (["--tracing"], "SVG", "--tracing is for a drawing made of a picture, and x is none"),
        (["--tracing", "--seed"], "picture", ""),
        (["--layer", "--pens"], "SVG", ""),
    ],
)
def test_an_option_of_another_kind_of_source_is_refused(given, kind, refused):
    if not refused:
        check_source_options(given, kind, "x")
        return
    with pytest.raises(click.UsageError) as error:
        check_source_options(given, kind, "x")
    assert error.value.message == refused + ": leave it out."
