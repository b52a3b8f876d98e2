"""The options of `draw`: what is drawn, where on the table, and where it goes to."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from laptop.cli.brick import THE_BRICK
from laptop.cli.options import (
    ParamType,
    json_option,
    option_group,
    out_option,
    replace_option,
    settings_option,
)


class Centimetres(ParamType):
    """Two numbers with a letter or comma between, or where `one` is set, one."""

    def __init__(self, between: str, one: bool = False) -> None:
        self.name = f"A{between}B"
        self._between, self._one = between, one

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return (a, b), b None where it was left out; fail if these are no numbers."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = [float(part) for part in value.split(self._between)]
        except ValueError:
            numbers = []
        if len(numbers) == 2:
            return tuple(numbers)
        if len(numbers) == 1 and self._one:
            return numbers[0], None
        form = f"5{self._between}10" + (" or 5" if self._one else "")
        self.fail(f"'{value}' is no size or place; write it as {form}, in cm", param, ctx)


@dataclass(frozen=True)
class SourceOptions:
    """Source of a drawing, as it is typed.

    what       a file, "-" for standard input, or the name of a drawing; None: text or line
    text       to be written
    line       points of the table, cm
    font       of a text
    lettering  of a text, by key
    tracing    of a picture, by key
    layers     of an SVG that are drawn; (): all
    pens       of an SVG: "layers" or "colours" have pens of their own; None: one pen draws all
    touch_up   each new pen waits over its first point
    fill       of an SVG's areas, "none" or "hatch"
    """

    what: str | None
    text: str | None
    line: str | None
    font: str
    lettering: dict[str, Any]
    tracing: dict[str, Any]
    layers: tuple[str, ...]
    pens: str | None
    touch_up: bool
    fill: str


SOURCE = option_group(
    click.argument("what", required=False),
    click.option("--text", metavar="TEXT", help="Write this; \\n begins a new line."),
    click.option(
        "--line",
        metavar='"X,Y X,Y"',
        help="A line through points of the table, cm, drawn where it is.",
    ),
    click.option(
        "--font",
        default="plain",
        show_default=True,
        help="Of a text: plain, roman, script, cursive, times, gothic.",
    ),
    settings_option(
        "--lettering",
        {
            "height": click.FLOAT,
            "slant": click.FLOAT,
            "spacing": click.FLOAT,
            "align": click.STRING,
        },
        "Of a text: height of capitals, cm (as large as it fits); slant to the right, degrees (0); "
        "spacing from letter to letter (1); align of lines, left, centre or right (left).",
    ),
    settings_option(
        "--tracing",
        {
            "style": click.Choice(["auto", "photo", "lines"]),
            "detail": click.FLOAT,
            "shades": click.INT,
            "smoothing": click.FLOAT,
        },
        "Of a picture: style, lines of a drawing along their middles, or photo, edges and tones "
        "(auto: as it looks); detail, 0 to 100, how weak an edge gets an outline (50); shades, 0 "
        "to 4 tones that are hatched (3); smoothing, 0 to 100, how much that is fine is left out "
        "(30).",
    ),
    click.option(
        "--layer",
        "layers",
        multiple=True,
        metavar="NAME",
        help="Draw this layer of an SVG; several times if needed.",
    ),
    click.option(
        "--pens",
        type=click.Choice(["layers", "colours"]),
        help="Each layer, or colour, of an SVG has its own pen; it waits until that is put in.",
    ),
    click.option(
        "--touch-up",
        is_flag=True,
        help="With --pens: each new one waits over its first point, and can be nudged.",
    ),
    click.option(
        "--fill",
        type=click.Choice(["none", "hatch"]),
        default="none",
        show_default=True,
        help="Of areas of an SVG: hatched by their tone, or their outlines alone.",
    ),
)


@dataclass(frozen=True)
class PlaceOptions:
    """Place of a drawing, and its style, as they are typed; see DrawingOptions.

    height      of the paper, cm
    tolerance   by which lines may be simplified, mm; None: the usual one
    keep_order  stroke by stroke as it stands in the file
    """

    paper: str | None
    at: tuple[float, float] | None
    size: tuple[float, float | None] | None
    rotate: float
    height: float
    clip: bool
    elbow: str | None
    speed: float | None
    tolerance: float | None
    keep_order: bool


PLACE = option_group(
    click.option(
        "--paper", metavar="SIZE", help="Sheet: a6, a5, a4, letter, a5-landscape, or WxH in cm."
    ),
    click.option(
        "--at",
        type=Centimetres(","),
        metavar="X,Y",
        help="Its centre, cm; of the sheet with --paper.",
    ),
    click.option(
        "--size",
        type=Centimetres("x", one=True),
        metavar="W[xH]",
        help="How large it is to be, cm.  [default: as the arm reaches, or as the paper is]",
    ),
    click.option(
        "--rotate",
        default=0.0,
        metavar="DEG",
        help="Counter-clockwise; 0 is upright for who sits behind the arm.",
    ),
    click.option(
        "--paper-height",
        "height",
        default=0.0,
        metavar="CM",
        help="Of the paper above the table, for an arm in space.",
    ),
    click.option("--clip", is_flag=True, help="Leave out what the arm does not reach."),
    click.option("--elbow", metavar="up|down", help="Keep the elbow so.  [default: as it reaches]"),
    click.option(
        "--speed", type=float, metavar="CM_PER_S", help="Of the tip.  [default: the arm's]"
    ),
    click.option(
        "--tolerance",
        type=float,
        metavar="MM",
        help="By which lines may be simplified.  [default: 0.1]",
    ),
    click.option(
        "--keep-order", is_flag=True, help="Draw stroke by stroke as it stands in the file."
    ),
)


@dataclass(frozen=True)
class DrawOrders:
    """Number of repetitions of a drawing, and where it begins.

    repeat  how often
    resume  whether it goes on where it was left
    share   of its length at which it begins, as "40%"; None: at its beginning
    """

    repeat: int
    resume: bool
    share: str | None

    @property
    def begins(self) -> float:
        """Share of its length at which it begins, 0 to 1."""
        return 0.0 if self.share is None else float(self.share.rstrip("%")) / 100

    def check(self) -> None:
        """Refuse a share that is none.

        Raises:
            click.UsageError: it is none.
        """
        if self.share is None:
            return
        if not re.fullmatch(r"[0-9]{1,3}(\.[0-9]*)?%?", self.share) or self.begins >= 1:
            raise click.UsageError(f"--from {self.share}: give a share of its length, as 40%.")

    def args(self) -> tuple[str, ...]:
        """Return the arguments for the program on the brick."""
        args: tuple[str, ...] = ("--repeat", str(self.repeat)) if self.repeat > 1 else ()
        args += ("--resume",) if self.resume else ()
        return args if self.share is None else (*args, "--from", self.share)


@dataclass(frozen=True)
class DrawTarget:
    """Target of a drawing, as it is typed.

    preview   it is told, and nothing moves
    files     jobs and pictures that are written
    replace   they may replace others
    simulate  it is drawn on the emulated brick
    out       folder for what that leaves; None: a new one
    plant     constants of that brick, as text
    built     file of the emulated arm as it was built; None: as it is described
    detach    the brick draws alone from the start
    name      of the brick; None: the last one
    """

    preview: bool
    files: tuple[Path, ...]
    replace: bool
    simulate: bool
    out: Path | None
    plant: str
    built: str | None
    detach: bool
    name: str | None


WHERE_TO = option_group(
    click.option("--preview", is_flag=True, help="Say how it would be drawn; nothing moves."),
    click.option(
        "--to",
        "files",
        multiple=True,
        type=click.Path(dir_okay=False, path_type=Path),
        metavar="FILE",
        help="Write it there and draw nothing: an .svg or .png to look at, or the .job that "
        "driver.py draws; with --simulate also a .gif, the film of it; several times for several.",
    ),
    replace_option,
    click.option(
        "--simulate", is_flag=True, help="Draw it on the emulated brick; leaves its files in --out."
    ),
    out_option,
    click.option(
        "--plant", default="", metavar="KEY=VALUE,...", help="For --simulate, see simulate."
    ),
    click.option(
        "--repeat",
        type=click.IntRange(1, 10000),
        default=1,
        metavar="N",
        help="Draw it so many times.",
    ),
    click.option(
        "--resume", is_flag=True, help="Go on where this drawing was left by a crash or a stop."
    ),
    click.option(
        "--from", "share", metavar="PERCENT", help="Begin at so much of its length, as 40%."
    ),
    click.option("--detach", is_flag=True, help="Let the brick draw alone from the start."),
    THE_BRICK,
    json_option,
)

SECTIONS = {
    "What is drawn": (
        *("--text", "--font", "--lettering", "--line", "--tracing"),
        *("--layer", "--pens", "--touch-up", "--fill"),
    ),
    "Where, and how": (
        *("--size", "--at", "--paper", "--rotate", "--speed", "--clip", "--tolerance"),
        *("--keep-order", "--elbow", "--paper-height", "--repeat", "--from", "--resume"),
    ),
    "What becomes of it": (
        *("--preview", "--to", "--replace", "--simulate", "--out", "--plant", "--built"),
        *("--brick", "--detach", "--arm", "--json"),
    ),
    "Taught by camera": (
        *("--trials", "--of", "--camera", "--calibration", "--arm-at", "--marker-height", "--bar"),
        *("--forget", "--scene", "--listen-port"),
    ),
}
COMMON_OPTIONS = frozenset(
    ("--text", "--font", "--line", "--size", "--at", "--paper", "--speed")
    + ("--to", "--simulate", "--brick", "--arm", "--trials")
)
"""Options that --help shows."""
