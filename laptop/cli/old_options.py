"""Former names of options: they work for one more version, and say what they are now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase

import click

OLD_OPTIONS = {
    "measure accuracy": {
        "--calibrated": "--calibration",
        "--height": "--marker-height",
        "--place": "--arm-at",
        "--side": "--size",
        "--size *x*": "--frame-size",
    },
    "measure arm": {
        "--call": "--brick",
        "--camera *.json": "--calibration",
        "--dry-run": "--preview",
        "--height": "--marker-height",
        "--port": "--listen-port",
        "--seconds": "--timeout",
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
        "--announce": "--json",
        "--brick": "--simulate",
        "--csv": "--to",
        "--height": "--marker-height",
        "--host": "--listen-port {}:",
        "--no-brick": "--no-simulate",
        "--page-host": "--page-port {}:",
        "--picture": "--to",
        "--port": "--listen-port",
        "--size": "--frame-size",
    },
    "demo": {
        "--page-host": "--page-port {}:",
    },
    "draw": {
        "--align": "--lettering align={}",
        "--by-sight": "--trials",
        "--camera-file": "--calibration",
        "--card": "{}",
        "--detail": "--tracing detail={}",
        "--fit": "",
        "--height": "--paper-height",
        "--job": "--to",
        "--letters": "--lettering height={}",
        "--port": "--listen-port",
        "--preview *.png": "--to",
        "--preview *.svg": "--to",
        "--shades": "--tracing shades={}",
        "--slant": "--lettering slant={}",
        "--smoothing": "--tracing smoothing={}",
        "--spacing": "--lettering spacing={}",
        "--style": "--tracing style={}",
    },
    "simulate": {
        "--sensor": "--plug",
    },
    "guide": {
        "--out": "--to",
    },
    "report": {
        "--out": "--to",
        "--pdf": "--to",
    },
    "class new": {
        "--out": "{}",
    },
    "brick log": {
        "--out": "{}",
    },
    "brick bench": {
        "--json": "--to",
    },
    "markers": {
        "--size": "--diameter",
    },
    "bench plot": {
        "--pictures": "--out",
    },
    "bench servo": {
        "--cpu": "--plant cpu={}",
        "--scene": "{}",
    },
    "bench draw": {
        "--cpu": "--plant cpu={}",
    },
    "bench ilc": {
        "--cpu": "--plant cpu={}",
    },
}
"""Old options by command, each perhaps with a pattern of its value, and what is typed now.

What is typed now may say where the old option's value goes, {}; "" where it needs not be typed.
"""


def renamed_args(command: str, args: Sequence[str]) -> Iterator[str]:
    """Yield the words of a command with its options as they are called now.

    Args:
        command: its words, as in OLD_OPTIONS.
        args: what is typed behind it.
    """
    table = OLD_OPTIONS.get(command, {})
    new_args = list(args)
    while new_args:
        word = new_args.pop(0)
        if word == "--" or word.endswith(".py"):  # all behind it is a script's
            yield from (word, *new_args)
            return
        name, equals, value = word.partition("=")
        new = _new(table, name, value if equals or not new_args else new_args[0])
        if new is None:
            yield word
        elif "{}" in new:
            value = value if equals or not new_args else new_args.pop(0)
            click.echo(f"{name} {value} is now {new.format(value)}", err=True)
            yield from (part.format(value) for part in new.split())
        elif new:
            click.echo(f"{name} is now {new}", err=True)
            yield new + equals + value
        else:
            click.echo(f"{name} needs not be typed any more", err=True)


def _new(table: Mapping[str, str], name: str, value: str) -> str | None:
    """Return what is typed now for an option with this value; None: it is none of before."""
    for old, new in table.items():
        option, _, pattern = old.partition(" ")
        if option == name and fnmatchcase(value, pattern or "*"):
            return new
    return None
