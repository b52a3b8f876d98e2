"""`draw`: an SVG, a text, a picture or a test card; seen before, tried, and drawn by the brick."""

from __future__ import annotations

import dataclasses
import math
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.brick import talk
from laptop.cli.command import OwnCommand
from laptop.cli.draw_files import check_files, check_heard, is_job, style_of
from laptop.cli.draw_options import COMMON, PLACE, SECTIONS, SOURCE, WHERE_TO
from laptop.cli.options import arm_option, examples, importing, in_one_line, tell_figures
from laptop.cli.sight_options import BY_SIGHT, read_sight_options
from laptop.drawing.gallery_files import gallery
from laptop.system.files import written
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.cli.sight_options import SightOptions
    from laptop.drawing.artwork import Artwork
    from laptop.drawing.options import DrawingOptions
    from laptop.drawing.preparing import DrawingPlan

MAX_INPUT = 20_000_000
"""Greatest size of what comes on standard input, bytes."""

CARDS = ("grid", "star", "circles", "iso9283", "reach")
"""Test cards, by their names."""
IN_PLACE = "reach"
"""The card that is not placed: it shows where the arm's reach ends."""

LETTERING = {"height": "size"}
"""What a key of --lettering is called in Lettering, where that differs."""

HELP = f"""\
Draw WHAT: an SVG, PNG, JPEG or text file, - for standard input, or a drawing by its name.

Drawings that come along: {", ".join(gallery())}.  Test cards: {", ".join(CARDS)}.
Without --preview, --to or --simulate the brick draws it: Ctrl-C pauses, a second one aborts, and
when this computer is closed the brick goes on; `brick watch` shows what it draws.
"""

EXAMPLES = examples(
    "draw rose --to rose.png",
    "draw house.svg --size 9 --simulate",
    'draw --text "Hello\\nworld" --font script --at 12,4 --to hello.svg',
    "draw photo.jpg --tracing detail=60,shades=2 --clip --brick ev3dev",
    'draw --line "10,0 5,10" --trials 3 --camera 0',
)


@click.command(
    cls=OwnCommand,
    short_help="Draw an SVG, a text, a picture or a test card.",
    help=HELP,
    epilog=EXAMPLES,
    sections=SECTIONS,
    common=COMMON,
)
@SOURCE
@PLACE
@BY_SIGHT
@WHERE_TO
@arm_option("Arm that draws")
def draw(
    what: str | None,
    arm_file: str,
    preview: bool,
    files: tuple[Path, ...],
    replace: bool,
    simulate: bool,
    out: Path,
    plant: str,
    repeat: int,
    resume: bool,
    share: str | None,
    detach: bool,
    name: str | None,
    **options: Any,
) -> None:
    """Draw what is asked for, see HELP."""
    with importing():  # numpy and OpenCV
        from laptop.drawing import preview as previews

    with in_one_line():
        words = _words(repeat, resume, share)
        check_files(what, files, replace)
        arm = read_arm(find_arm(arm_file))
        asked = read_sight_options(options, arm, plant if simulate else None)
        artwork = _artwork(what, arm, options)
        check_heard(artwork.kind, artwork.name)
        plan = _prepared(artwork, arm, _options(what, options, artwork))
        for line in previews.lines_of(plan):
            click.echo(line)
        pictures = [file for file in files if not is_job(file)]
        for file in pictures:
            previews.write_preview(plan, file)
            click.echo(f"{file} is written")
        if not (pictures and plan.missed):
            plan.check()
        offsets = []
        if asked and not asked.times and not simulate:
            from laptop.cli.draw_by_sight import offsets_on_file

            offsets = offsets_on_file(plan, asked)
        for file in filter(is_job, files):
            with written(file) as draft:
                plan.write_job(draft, offsets)
            click.echo(f"{file} is written")
        built = options["built"] and read_arm(find_arm(options["built"]))
        if simulate:
            sys.exit(_simulated(plan, asked, built, out, plant, words, repeat, share))
        if preview or files:
            tell_figures(previews.figures_of(plan))
            return
        if asked and asked.times:
            from laptop.cli.draw_by_sight import draw_by_sight

            sys.exit(draw_by_sight(plan, asked, arm_file))
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{Path(plan.name).stem or 'drawing'}.job"
            plan.write_job(file, offsets)
            sys.exit(_sent(name, file, ("--arm", arm.name, *words), detach))


def _simulated(
    plan: DrawingPlan,
    asked: SightOptions | None,
    built: Arm | None,
    out: Path | None,
    plant: str,
    words: tuple[str, ...],
    repeat: int,
    share: str | None,
) -> int:
    """Draw on the emulated brick, rehearsed if that is asked for; return the exit status."""
    from laptop.cli.draw_by_sight import simulate_by_sight  # there is more to import
    from laptop.cli.draw_simulated import FILES, draw_simulated
    from laptop.record.run_folder import run_folder

    with run_folder("draw", out, *FILES) as folder:
        if asked:
            return simulate_by_sight(plan, asked, built, folder, plant, words, repeat, share)
        return draw_simulated(plan, folder, plant, words, repeat, share, built=built)


def _artwork(what: str | None, arm: Arm, options: dict[str, Any]) -> Artwork:
    """Return what is to be drawn."""
    from laptop.drawing import cards, lettering, pictures, sources
    from laptop.drawing.lines import line_through

    text, line, asked = options["text"], options["line"], options["lettering"]
    if line is not None:
        return line_through(_points(line))
    letters = dataclasses.replace(
        lettering.Lettering(options["font"]),
        **{LETTERING.get(key, key): value for key, value in asked.items()},
    )
    if "slant" in asked:
        letters = dataclasses.replace(letters, slant=math.radians(asked["slant"]))
    is_hatched = options["fill"] == "hatch"
    tracing = dataclasses.replace(pictures.Tracing(), **style_of(options["tracing"]))
    if text is not None:
        return lettering.write_text(text.replace("\\n", "\n"), letters)
    if is_card(what):
        return cards.draw_card(str(what), arm=arm)
    if what == "-":
        data = sys.stdin.buffer.read(MAX_INPUT + 1)
        if len(data) > MAX_INPUT:
            raise click.ClickException(
                f"more than {MAX_INPUT // 1_000_000} MB on standard input; simplify the drawing"
            )
        return sources.read_source(data, "standard input", letters, tracing, is_hatched)
    assert what is not None
    return sources.read_source(what, "", letters, tracing, is_hatched)


def is_card(what: str | None) -> bool:
    """Return whether this is the name of a test card, and of no file here."""
    return what in CARDS and not os.path.exists(what)


def _options(what: str | None, options: dict[str, Any], artwork: Artwork) -> DrawingOptions:
    """Return how it is to be drawn."""
    from laptop.drawing import lines
    from laptop.drawing.artwork import bounds
    from laptop.drawing.options import TOLERANCE, DrawingOptions

    tolerance, height = options["tolerance"], options["lettering"].get("height")
    if height is not None and options["size"]:
        raise click.UsageError("height of --lettering says how large it is: leave --size out.")
    if what == IN_PLACE and is_card(what):
        low, high = bounds(artwork.strokes, artwork.name)
        across, along = (low + high) / 2
        in_place = {"at": (across, along), "size": (high[0] - low[0], None), "rotate": 90.0}
        given = [key for key in ("paper", *in_place) if options[key]]
        if given:
            raise click.UsageError(f"the card {IN_PLACE} lies where it is: leave --{given[0]} out.")
        options = {**options, **in_place}
    wished = DrawingOptions(
        options["paper"],
        options["at"],
        options["size"],
        options["rotate"],
        options["height"],
        options["speed"],
        options["elbow"],
        options["clip"],
        TOLERANCE if tolerance is None else tolerance / 10,
        not options["keep_order"],
        options["layers"] or None,
        None if height is None else 1.0,
        options["pens"],
        options["touch_up"],
    )
    return wished if options["line"] is None else lines.in_place(artwork, wished)


def _points(text: str) -> list[tuple[float, float]]:
    """Points of a line, cm."""
    points = []
    for part in text.split():
        try:
            x, y = (float(number) for number in part.split(","))
        except ValueError:
            raise click.UsageError(
                f"--line {text!r}: '{part}' is no point; write it as \"10,0 5,10\", in cm."
            ) from None
        points.append((x, y))
    return points


def _prepared(artwork: Artwork, arm: Arm, options: DrawingOptions) -> DrawingPlan:
    """Return the plan, with a bar while that takes time."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from laptop.drawing.preparing import prepare

    for sentence in artwork.left_out:
        click.echo(sentence, err=True)
    console = Console(stderr=True)
    if not console.is_terminal:
        return prepare(artwork, arm, options)
    columns = (BarColumn(bar_width=30), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0)
        return prepare(
            artwork,
            arm,
            options,
            lambda stage, share: bar.update(task, completed=share, description=stage),
        )


def _words(repeat: int, resume: bool, share: str | None) -> tuple[str, ...]:
    """Return what the program on the brick is told of how to draw it."""
    words: tuple[str, ...] = ("--repeat", str(repeat)) if repeat > 1 else ()
    words += ("--resume",) if resume else ()
    if share is None:
        return words
    if not re.fullmatch(r"[0-9]{1,3}(\.[0-9]*)?%?", share) or float(share.rstrip("%")) >= 100:
        raise click.UsageError(f"--from {share}: give a share of its length, as 40%.")
    return (*words, "--from", share)


def _sent(name: str | None, file: Path, words: tuple[str, ...], detach: bool) -> int:
    """Let the brick draw a job; return the exit status."""
    from rich.console import Console

    from laptop.brick import jobs
    from laptop.cli.job_display import JobDisplay

    display = JobDisplay(Console())
    with display.shown():
        return talk(name, jobs.draw, file, words, display.show, detach)
