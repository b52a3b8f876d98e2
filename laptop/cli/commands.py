"""Hints about commands: their uses, their former names, and wrong words."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence

import click

from shared.state import laptop_program

TYPED = "laptop.typed"
"""Key of a click context's meta for the words of the command."""

SECTIONS = {
    "Start": ("demo", "page", "doctor"),
    "Draw": ("draw", "simulate"),
    "See": ("track", "markers"),
    "Measure": ("measure",),
    "Brick": ("brick",),
    "Class": ("guide", "class", "report", "bundle"),
    "Developers": ("bench",),
}
RENAMED = {
    ("accuracy",): ("measure", "accuracy"),
    ("calibrate",): ("measure", "arm"),
    ("camera",): ("measure", "camera"),
    ("touch",): ("measure", "pen"),
    ("guide", "check"): ("class", "check"),
    ("guide", "handouts"): ("class", "new"),
    ("draw", "--cancel"): ("brick", "jobs", "--remove"),
    ("draw", "--jobs"): ("brick", "jobs"),
    ("draw", "--watch"): ("brick", "watch"),
    ("bench", "plot", "--speed"): ("bench", "planning"),
}
"""Old words, which are good for one more version, and the new ones; an option stands anywhere."""

DRIVER_COMMANDS = (
    "arc",
    "check",
    "circle",
    "home",
    "inverse",
    "line",
    "lines",
    "move",
    "polyline",
    "where",
)
"""Commands of the brick's driver.py."""
OTHER_COMMANDS = {
    **dict.fromkeys(
        DRIVER_COMMANDS,
        "is of the brick's driver.py: {program} simulate driver.py {word} ... on the emulated arm, "
        "{program} brick run driver.py {word} ... on the real one",
    ),
    **dict.fromkeys(
        ("servo", "servoing"),
        "is a program of the brick: {program} simulate --scene '' visual_servoing.py, or with a "
        "page {program} page",
    ),
    **dict.fromkeys(("plot", "print"), "is {program} draw"),
    **dict.fromkeys(("find", "install", "key", "log", "shell"), "is {program} brick {word}"),
    "run": "is {program} simulate SCRIPT on the emulated brick, {program} brick run SCRIPT on the "
    "real one",
    **dict.fromkeys(("handouts", "new"), "is {program} class new"),
    **dict.fromkeys(("arm", "pen"), "is {program} measure {word}"),
    "help": "is {program} --help",
    **dict.fromkeys(
        ("python", "python3"), "is not typed here: {program} simulate SCRIPT runs a script"
    ),
}
"""Hints by the name of a command that has another name."""


OTHER_OPTIONS = {
    "--size": ("--width", "--scale", "--large"),
    "--rotate": ("--angle", "--turn", "--rotation"),
    "--at": ("--position", "--pos", "--place", "--center", "--centre"),
    "--out": ("--output", "--folder", "--dir", "-o"),
    "--camera": ("--cam", "--webcam", "--source", "--video", "--input", "-c"),
    "--effector": ("--color", "--colour", "--marker", "--tip"),
    "--brick": ("--robot", "--ip", "--address", "--ev3"),
    "--replace": ("--force", "--overwrite", "-f"),
    "--plant": ("--backlash", "--physics"),
    "--scene": ("--tilt", "--view"),
    "--speed": ("--velocity", "--feed"),
    "--text": ("--write", "--string"),
    "--pick": ("--click", "--learn"),
    "--json": ("--format",),
    "--to": ("--save", "--file", "--export", "--png", "--svg", "--image"),
    "--trials": ("--rehearse", "--rehearsals", "--passes"),
    "--preview": ("--dry-run", "--show", "--check"),
    "--lettering": ("--letters", "--letter-height", "--italic"),
    "--simulate": ("--emulate", "--sim", "--fake"),
}
"""Options, and what else is typed for them."""


class FullHelpGroup(click.Group):
    """Group of commands whose help is not cut to one line."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands with what each does."""
        self.format_section(formatter, "Commands", sorted(self.commands), 0)

    def format_section(
        self, formatter: click.HelpFormatter, title: str, names: Sequence[str], width: int
    ) -> None:
        """Write some of the commands, their names at least so many characters wide."""
        rows = [
            (name.ljust(width), self.commands[name].get_short_help_str(limit=200)) for name in names
        ]
        with formatter.section(title):
            formatter.write_dl(rows)


class CommandSections(FullHelpGroup):
    """All commands, in sections; the typed arguments are stored in the context."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Store the typed arguments, and parse the group's own."""
        ctx.meta[TYPED] = list(args)
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is typed, also by its old words; fail with the right ones."""
        for old, new in RENAMED.items():
            k = len(old) - 1
            if old[-1].startswith("--") and old[-1] in args:
                k = args.index(old[-1])
            if (*args[: len(old) - 1], *args[k : k + 1]) == old:
                click.echo(f"{' '.join(old)} is now {' '.join(new)}", err=True)
                args = [*new, *args[k + 1 :], *args[len(old) - 1 : k]]
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            raise click.UsageError(no_command(args[0], self.commands), ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands with what each does, a section after the other."""
        for title, names in SECTIONS.items():
            self.format_section(formatter, title, names, max(map(len, self.commands)))


def no_command(word: str, commands: Mapping[str, click.Command]) -> str:
    """Return the message for a word that is no command."""
    program = laptop_program()
    if word in OTHER_COMMANDS:
        return f"'{word}' {OTHER_COMMANDS[word].format(program=program, word=word)}."
    if word.endswith(".py"):
        return f"'{word}' is a script: {program} simulate {word}."
    old = {" ".join(name_parts): " ".join(new) for name_parts, new in RENAMED.items()}
    near: Sequence[str] = difflib.get_close_matches(word, [*commands, *old], 1)
    more = f"did you mean {old.get(near[0], near[0])}?" if near else f"{program} --help lists them."
    return f"There is no command '{word}'; {more}"


def no_option(error: click.NoSuchOption) -> str:
    """Return the message for a word that is no option of the command."""
    word, command = error.option_name, error.ctx and error.ctx.command
    for param in command.params if command else ():
        if any(word in OTHER_OPTIONS.get(name, ()) for name in param.opts):
            value = f" {param.metavar}" if param.metavar else ""
            return f"{word} is {param.opts[0]}{value} here."
    return error.format_message()


def no_value(error: click.BadOptionUsage) -> str:
    """Return the message for an option without its value."""
    for param in error.ctx.command.params if error.ctx else ():
        if error.option_name in param.opts and param.metavar:
            default = re.search(r"\[default: (.*?)\]", getattr(param, "help", None) or "")
            without = f"; without it, it is {default[1]}" if default else ""
            return f"{error.option_name} takes {param.metavar}{without}."
    return error.format_message()


def command_name(ctx: click.Context) -> str:
    """Return a command's name with its groups, without the program's name."""
    names = []
    while ctx.parent is not None:
        names.append(ctx.info_name or "")
        ctx = ctx.parent
    return " ".join(reversed(names))
