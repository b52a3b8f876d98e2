"""Which options go together, command by command: what is refused before anything is done."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

import click


class Excludes(NamedTuple):
    """One of some options is refused beside one of others.

    It says "{option} WHY: leave {other} out."

    why  what the first is, for people
    but  beside one of these all of them may be
    """

    options: Sequence[str]
    others: Sequence[str]
    why: str
    but: Sequence[str] = ()

    def check(self, given: Collection[str]) -> None:
        """Refuse what is given, see `check_rules`."""
        one, other = _first(self.options, given), _first(self.others, given)
        if one and other and not _first(self.but, given):
            raise click.UsageError(
                f"{one} {self.why}: leave {ARGUMENT_NAMES.get(other, other)} out."
            )


class Needs(NamedTuple):
    """Some options have an effect only beside one of others.

    It says "{option} WHY: add {other}."

    why  what the first is, for people
    """

    options: Sequence[str]
    others: Sequence[str]
    why: str

    def check(self, given: Collection[str]) -> None:
        """Refuse what is given, see `check_rules`."""
        one = _first(self.options, given)
        if one and not _first(self.others, given):
            raise click.UsageError(f"{one} {self.why}: add {self.others[0]}.")


class OneOf(NamedTuple):
    """One of some options must be there, or if `alone`, one only; `wish` asks for it."""

    options: Sequence[str]
    wish: str
    alone: bool = False

    def check(self, given: Collection[str]) -> None:
        """Refuse what is given, see `check_rules`."""
        count = sum(option in given for option in self.options)
        if not count or (count > 1 and self.alone):
            raise click.UsageError(self.wish)


ARGUMENT_NAMES = {"SOURCES": "the camera"}
"""Names of arguments for people, where help calls them otherwise."""
CAMERA_PARAMETERS = ("--camera", "SOURCES")
"""Names of the option and of the former argument for a camera."""
A_CAMERA = OneOf(
    (*CAMERA_PARAMETERS, "--simulate"), "Give the camera, --camera 0 say, or --simulate."
)
OF_LIVE = ("--calibration", "--bar", "--marker-height", "--arm-at")

RULES: dict[str, tuple[Excludes | Needs | OneOf, ...]] = {
    "draw": (
        OneOf(
            ("WHAT", "--text", "--line"),
            "give one thing to draw: a FILE, - or a drawing's name, or --text, or --line.",
            alone=True,
        ),
        Excludes(("--line",), ("--paper", "--at", "--size", "--rotate"), "lies where it is"),
        Needs(("--touch-up",), ("--pens",), "is for several pens"),
        Needs(
            (*("--camera", *OF_LIVE), "--scene", "--listen-port", "--forget", "--of"),
            ("--trials",),
            "is for a path that is taught by camera",
        ),
        Needs(("--out", "--plant", "--built"), ("--simulate",), "is for the emulated arm"),
        Excludes(
            ("--simulate",),
            ("--camera", "--calibration", "--bar", "--arm-at", "--listen-port"),
            "has a camera of its own",
        ),
        Excludes(("--resume",), ("--from",), "knows where to go on"),
        Excludes(
            ("--trials",),
            ("--repeat", "--from", "--resume", "--detach"),
            "draws all of it, once",
            but=("--trials 0",),
        ),
        Excludes(("--trials",), ("--to", "--preview"), "moves the arm", but=("--trials 0",)),
        Excludes(("--preview",), ("--simulate",), "moves nothing"),
        Excludes(("--simulate",), ("--resume",), "begins anew"),
        Excludes(("--simulate",), ("--detach", "--brick"), "draws on the emulated brick"),
        Excludes(
            ("--preview", "--to"),
            ("--repeat", "--from", "--resume", "--detach", "--brick"),
            "draws nothing",
            but=("--simulate",),
        ),
    ),
    "measure accuracy": (
        A_CAMERA,
        Excludes(
            ("--simulate",),
            (*CAMERA_PARAMETERS, *OF_LIVE, "--scene", "--effector", "--frame-size", "--brick"),
            "has an arm and cameras of its own",
        ),
        Needs(
            ("--plant", "--built", "--noise", "--seed"), ("--simulate",), "is of what is emulated"
        ),
        Excludes(("--calibration",), ("--bar",), "knows the bar"),
    ),
    "measure arm": (
        A_CAMERA,
        Excludes(
            ("--simulate",),
            (*CAMERA_PARAMETERS, "--calibration", "--effector", "--brick", "--listen-port"),
            "has an arm and a camera of its own",
        ),
        Needs(("--plant", "--built", "--seed"), ("--simulate",), "is of what is emulated"),
        Needs(
            ("--scene",),
            ("--simulate", "--camera synthetic", "SOURCES synthetic"),
            "is of what is emulated",
        ),
    ),
    "measure camera": (
        OneOf(CAMERA_PARAMETERS, "Give the camera, --camera 0 say, or its pictures."),
        Excludes(("--calibration",), ("--bar", "--to"), "compares only"),
    ),
    "measure pen": (
        A_CAMERA,
        Excludes(
            ("--simulate",),
            CAMERA_PARAMETERS,
            "has a camera of its own",
            but=("--camera synthetic", "SOURCES synthetic"),
        ),
        Excludes(("--simulate",), ("--touches",), "touches by itself"),
        Needs(
            ("--scene", "--plant", "--camera synthetic", "SOURCES synthetic"),
            ("--simulate",),
            "is of what is emulated",
        ),
        Excludes(("--touches",), ("--brick", "--pen"), "calls no brick"),
    ),
    "track": (
        Needs(("--bar", "--touched"), ("--board",), "is of the board"),
        Excludes(
            ("--marker-height",),
            ("--no-serve", "--no-page"),
            "is of board and page",
            but=("--board", "--page"),
        ),
        Excludes(("--open",), ("--no-page",), "opens the page"),
    ),
    "markers": (
        Needs(("--paper",), ("--board",), "is of the board"),
        Excludes(("--diameter",), ("--board",), "is of the page of discs; the board's are 25 mm"),
    ),
    "brick arm": (Excludes(("--fetch",), ("FILE",), "fetches an arm"),),
}
"""Rules by command: which of its options go together."""


def check_rules(command: str, given: Collection[str]) -> None:
    """Refuse options that exclude each other, or that would have no effect.

    Args:
        command: its words.
        given: names of the options and arguments that are typed, and of those with words for
            values NAME VALUE, too.

    Raises:
        click.UsageError: in one line.
    """
    for rule in RULES.get(command, ()):
        rule.check(given)


SOURCE_KINDS = {
    **dict.fromkeys(("--font", "--lettering"), "text"),
    **dict.fromkeys(("--tracing",), "picture"),
    **dict.fromkeys(("--layer", "--fill", "--pens"), "SVG"),
}
"""Kinds of source by the option of `draw` that is for them."""


def check_source_options(given: Iterable[str], kind: str, name: str) -> None:
    """Refuse options that do not apply to a source: they would have no effect.

    Args:
        given: as for `check_rules`, in the order in which they are to be looked at.
        kind: of the source, as in Artwork.
        name: of the source, for people.

    Raises:
        click.UsageError: one is given.
    """
    for option in given:
        wanted = SOURCE_KINDS.get(option, kind)
        if wanted != kind:
            article = "an" if wanted == "SVG" else "a"
            raise click.UsageError(
                f"{option} is for a drawing made of {article} {wanted}, and {name} is none: "
                "leave it out."
            )


def _first(options: Iterable[str], given: Collection[str]) -> str:
    return next((option for option in options if option in given), "")
