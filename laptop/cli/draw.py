"""`draw`: an SVG, a text, a picture or a test card; seen before, tried, and drawn by the brick."""

from __future__ import annotations

import dataclasses
import math
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.brick import talk
from laptop.cli.command import OwnCommand, typed_options
from laptop.cli.draw_files import check_files, is_film, is_job, style_of
from laptop.cli.draw_options import (
    COMMON_OPTIONS,
    PLACE,
    SECTIONS,
    SOURCE,
    WHERE_TO,
    DrawOrders,
    DrawTarget,
    PlaceOptions,
    SourceOptions,
)
from laptop.cli.groups import in_groups
from laptop.cli.ilc_options import ILC_OPTIONS, TypedIlcOptions, read_ilc_options
from laptop.cli.options import arm_option, examples, importing, in_one_line, print_json
from laptop.cli.rules import check_source_options
from laptop.drawing.gallery_files import gallery
from laptop.system.files import written
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.cli.ilc_options import IlcOptions
    from laptop.drawing.artwork import Artwork
    from laptop.drawing.options import DrawingOptions
    from laptop.drawing.preparing import DrawingPlan

MAX_INPUT_BYTES = 20_000_000
"""Greatest size of what comes on standard input, bytes."""

TEST_PATTERNS = ("grid", "star", "circles", "iso9283", "reach")
"""Test cards, by their names."""
UNPLACED_PATTERN = "reach"
"""The card that is not placed: it shows where the arm's reach ends."""

LETTERING_FIELDS = {"height": "size"}
"""Fields of Lettering by the key of --lettering, where they differ."""

HELP = f"""\
Draw WHAT: an SVG, PNG, JPEG or text file, - for standard input, or a drawing by its name.

Drawings that come along: {", ".join(gallery())}.  Test cards: {", ".join(TEST_PATTERNS)}.
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
    common=COMMON_OPTIONS,
)
@SOURCE
@PLACE
@ILC_OPTIONS
@WHERE_TO
@arm_option("Arm that draws")
@in_groups(
    source=SourceOptions,
    place=PlaceOptions,
    ilc_options=TypedIlcOptions,
    orders=DrawOrders,
    target=DrawTarget,
)
def draw(
    arm_file: str,
    source: SourceOptions,
    place: PlaceOptions,
    ilc_options: TypedIlcOptions,
    orders: DrawOrders,
    target: DrawTarget,
) -> None:
    """Draw what is asked for, see HELP."""
    with importing():  # numpy and OpenCV
        from laptop.drawing import preview as previews

    with in_one_line():
        orders.check()
        check_files(source.what, target.files, target.replace)
        films = tuple(filter(is_film, target.files))
        if films and not target.simulate:
            raise click.UsageError(f"{films[0]} is to be a film of the arm: give --simulate, too.")
        arm = read_arm(find_arm(arm_file))
        emulated = f"--plant {target.plant} --built {target.built or ''}"
        asked = read_ilc_options(ilc_options, arm, emulated if target.simulate else None)
        artwork = _artwork(source, arm)
        check_source_options(typed_options(click.get_current_context()), artwork.kind, artwork.name)
        plan = _prepared(artwork, arm, _options(source, place, artwork))
        _show(plan, [file for file in target.files if not is_job(file) and file not in films])
        offsets = []
        if asked and not asked.times and not target.simulate:
            from laptop.cli.draw_ilc import offsets_on_file

            offsets = offsets_on_file(plan, asked)
        for file in filter(is_job, target.files):
            with written(file) as draft:
                plan.write_job(draft, offsets)
            click.echo(f"{file} is written")
        built = read_arm(find_arm(target.built)) if target.built else None
        if target.simulate:
            brick = (target.plant, built)
            sys.exit(_simulated(plan, asked, target.out, brick, orders, films))
        if target.preview or target.files:
            print_json(previews.plan_numbers(plan))
            return
        if asked and asked.times:
            from laptop.cli.draw_ilc import draw_ilc

            sys.exit(draw_ilc(plan, asked, arm_file))
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{Path(plan.name).stem or 'drawing'}.job"
            plan.write_job(file, offsets)
            sys.exit(_sent(target.name, file, ("--arm", arm.name, *orders.args()), target.detach))


def _show(plan: DrawingPlan, pictures: Sequence[Path]) -> None:
    """Say how it would be drawn, and show it in pictures; refuse what cannot be drawn."""
    from laptop.drawing import preview as previews

    for line in previews.lines_of(plan):
        click.echo(line)
    for file in pictures:
        previews.write_preview(plan, file)
        click.echo(f"{file} is written")
    if not (pictures and plan.missed):
        plan.check()


def _simulated(
    plan: DrawingPlan,
    asked: IlcOptions | None,
    out: Path | None,
    brick: tuple[str, Arm | None],
    orders: DrawOrders,
    films: Sequence[Path],
) -> int:
    """Draw on the emulated brick, rehearsed if that is asked for; return the exit status."""
    from laptop.cli.draw_ilc import simulate_ilc  # there is more to import
    from laptop.cli.draw_simulated import OUTPUT_FILES, EmulatedBrickSpec, draw_simulated
    from laptop.record.run_folder import run_folder

    drawn_on = EmulatedBrickSpec(*brick)
    with run_folder("draw", out, *OUTPUT_FILES) as folder:
        if asked:
            return simulate_ilc(plan, asked, folder, drawn_on, orders, films)
        return draw_simulated(plan, folder, drawn_on, orders, films=films)


def _artwork(source: SourceOptions, arm: Arm) -> Artwork:
    """Return what is to be drawn."""
    from laptop.drawing import lettering, pictures, sources, test_patterns
    from laptop.drawing.lines import line_through

    what, text, asked = source.what, source.text, source.lettering
    if source.line is not None:
        return line_through(_points(source.line))
    letters = dataclasses.replace(
        lettering.Lettering(source.font),
        **{LETTERING_FIELDS.get(key, key): value for key, value in asked.items()},
    )
    if "slant" in asked:
        letters = dataclasses.replace(letters, slant=math.radians(asked["slant"]))
    is_hatched = source.fill == "hatch"
    tracing = dataclasses.replace(pictures.Tracing(), **style_of(source.tracing))
    if text is not None:
        return lettering.write_text(text.replace("\\n", "\n"), letters)
    if is_card(what):
        return test_patterns.draw_test_pattern(str(what), arm=arm)
    if what == "-":
        data = sys.stdin.buffer.read(MAX_INPUT_BYTES + 1)
        if len(data) > MAX_INPUT_BYTES:
            raise click.ClickException(
                f"more than {MAX_INPUT_BYTES // 1_000_000} MB on standard input; "
                "simplify the drawing"
            )
        return sources.read_source(data, "standard input", letters, tracing, is_hatched)
    assert what is not None
    return sources.read_source(what, "", letters, tracing, is_hatched)


def is_card(what: str | None) -> bool:
    """Return whether this is the name of a test card, and of no file here."""
    return what in TEST_PATTERNS and not os.path.exists(what)


def _options(source: SourceOptions, place: PlaceOptions, artwork: Artwork) -> DrawingOptions:
    """Return how it is to be drawn."""
    from laptop.drawing import lines
    from laptop.drawing.artwork import bounds
    from laptop.drawing.options import TOLERANCE, DrawingOptions

    height = source.lettering.get("height")
    if height is not None and place.size:
        raise click.UsageError("height of --lettering says how large it is: leave --size out.")
    if source.what == UNPLACED_PATTERN and is_card(source.what):
        low, high = bounds(artwork.strokes, artwork.name)
        across, along = (low + high) / 2
        given = [key for key in ("paper", "at", "size", "rotate") if getattr(place, key)]
        if given:
            raise click.UsageError(
                f"the card {UNPLACED_PATTERN} lies where it is: leave --{given[0]} out."
            )
        size = high[0] - low[0], None
        place = dataclasses.replace(place, at=(across, along), size=size, rotate=90.0)
    wished = DrawingOptions(
        place.paper,
        place.at,
        place.size,
        place.rotate,
        place.height,
        place.speed,
        place.elbow,
        place.clip,
        TOLERANCE if place.tolerance is None else place.tolerance / 10,
        not place.keep_order,
        source.layers or None,
        None if height is None else 1.0,
        source.pens,
        source.touch_up,
    )
    return wished if source.line is None else lines.in_place(artwork, wished)


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


def _sent(name: str | None, file: Path, args: tuple[str, ...], detach: bool) -> int:
    """Let the brick draw a job; return the exit status."""
    from rich.console import Console

    from laptop.brick import jobs
    from laptop.cli.job_display import JobDisplay

    display = JobDisplay(Console())
    with display.shown():
        return talk(name, jobs.draw, file, args, display.show, detach)
