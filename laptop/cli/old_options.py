"""What options were called before: they work for one more version, and say what they are now."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import click

from laptop.cli.commands import command_words

OLD_OPTIONS = {
    "measure accuracy": {
        "--calibrated": "--calibration",
        "--height": "--marker-height",
        "--place": "--arm-at",
        "--size": "--frame-size",
    },
    "measure arm": {
        "--call": "--brick",
        "--camera *.json": "--calibration",
        "--height": "--marker-height",
        "--port": "--listen-port",
        "--touch": "--crosses",
    },
    "measure camera": {
        "--out": "--to",
        "--since": "--calibration",
    },
    "measure pen": {
        "--height": "--marker-height",
    },
    "track": {
        "--height": "--marker-height",
        "--port": "--listen-port",
        "--size": "--frame-size",
    },
    "draw": {
        "--camera-file": "--calibration",
        "--height": "--paper-height",
        "--port": "--listen-port",
    },
    "markers": {
        "--size": "--diameter",
    },
}
"""By command: an old option, perhaps with the ending of its value, and the new one."""


class CommandOfNow(click.Command):
    """A command that takes the old words of OLD_OPTIONS, too."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Say the new words on stderr, and take these."""
        return super().parse_args(ctx, list(in_new_words(command_words(ctx), args)))


def in_new_words(command: str, args: Sequence[str]) -> Iterator[str]:
    """Yield the words of a command with its options as they are called now.

    Args:
        command: its words, as in OLD_OPTIONS.
        args: what is typed behind it.
    """
    table = OLD_OPTIONS.get(command, {})
    for k, word in enumerate(args):
        if word == "--":
            yield from args[k:]
            return
        name, _, value = word.partition("=")
        value = value or next(iter(args[k + 1 : k + 2]), "")
        ending = f"{name} *.{value.rpartition('.')[2]}"
        new = table.get(name) or table.get(ending)
        if new:
            click.echo(f"{name} is now {new}", err=True)
            word = new + word[len(name) :]
        yield word
