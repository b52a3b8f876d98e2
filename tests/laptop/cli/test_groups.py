from dataclasses import dataclass

import click
import pytest
from click.testing import CliRunner

from laptop.cli.groups import in_groups


@dataclass(frozen=True)
class Place:
    x: float
    y: float


@dataclass(frozen=True)
class Way:
    speed: float


def command_of(reported):
    @click.command()
    @click.option("--x", type=float)
    @click.option("--speed", type=float, default=2.0)
    @click.option("--name", default="")
    @click.option("--y", type=float, default=1.0)
    @in_groups(place=Place, way=Way)
    def go(place, way, name):
        """Go there."""
        reported.append((place, way, name))

    return go


def test_a_command_gets_its_options_in_groups_whatever_their_order_and_the_rest_as_it_was():
    reported = []
    result = CliRunner().invoke(command_of(reported), ["--x", "3", "--name", "here"])
    assert result.exit_code == 0, result.output
    assert reported == [(Place(3.0, 1.0), Way(2.0), "here")]


def test_its_help_stays():
    command = command_of([])
    assert command.help == "Go there."
    assert command.name == "go"
    assert [param.name for param in command.params] == ["x", "speed", "name", "y"]


def test_a_field_that_is_no_option_is_a_mistake_of_whoever_has_written_it():
    @click.command()
    @click.option("--x", type=float)
    @in_groups(place=Place)
    def go(place):
        pass

    with pytest.raises(KeyError, match="y"):
        CliRunner().invoke(go, ["--x", "3"], catch_exceptions=False)
