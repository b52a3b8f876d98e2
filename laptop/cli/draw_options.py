"""The options of `draw`: what is drawn, where on the table, and where it goes to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from laptop.cli.brick import THE_BRICK
from laptop.cli.options import option_group, out_option, replace_option


class Centimetres(click.ParamType):
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


SOURCE = option_group(
    click.argument("what", required=False),
    click.option("--text", metavar="TEXT", help="Write this; \\n begins a new line."),
    click.option(
        "--card", metavar="NAME", help="A test card: grid, star, circles, iso9283, reach."
    ),
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
    click.option(
        "--letters",
        type=float,
        metavar="CM",
        help="Height of capitals.  [default: as large as it fits]",
    ),
    click.option(
        "--slant", default=0.0, show_default=True, metavar="DEG", help="Of letters, to the right."
    ),
    click.option(
        "--spacing", default=1.0, metavar="X", help="From letter to letter.  [default: 1]"
    ),
    click.option("--align", default="left", show_default=True, help="Lines: left, centre, right."),
    click.option(
        "--detail",
        default=50.0,
        show_default=True,
        metavar="0..100",
        help="Of a picture: how weak an edge gets an outline; 0 draws none.",
    ),
    click.option(
        "--shades",
        default=3,
        show_default=True,
        metavar="0..4",
        help="Of a picture: tones that are hatched.",
    ),
    click.option(
        "--smoothing",
        default=30.0,
        show_default=True,
        metavar="0..100",
        help="Of a picture: how much that is fine is left out.",
    ),
    click.option(
        "--style",
        type=click.Choice(["auto", "photo", "lines"]),
        default="auto",
        show_default=True,
        help="Of a picture: edges and tones, or the lines of a drawing along their middles.",
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

PLACE = option_group(
    click.option(
        "--fit", is_flag=True, help="As large as the arm reaches, or as the paper is (default)."
    ),
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
        help="How large it is to be, cm.",
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

WHERE_TO = option_group(
    click.option(
        "--preview",
        "previews",
        multiple=True,
        type=click.Path(dir_okay=False, path_type=Path),
        metavar="FILE",
        help="Show it in an .svg or .png, and draw nothing.",
    ),
    click.option(
        "--job",
        "job_file",
        type=click.Path(dir_okay=False, path_type=Path),
        metavar="FILE",
        help="Write the job's file, and draw nothing.",
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
    click.option("--watch", is_flag=True, help="Show the drawing that is on, and give it orders."),
    click.option("--jobs", is_flag=True, help="List the jobs on the brick."),
    click.option("--cancel", metavar="NAME", help="Remove a job from the brick."),
    THE_BRICK,
)
