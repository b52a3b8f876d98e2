"""What of `draw`'s options goes together, and the files that it writes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import click
from click.core import ParameterSource

from laptop.system.files import check_new

BRICK_ALONE = ("watch", "jobs", "cancel", "name")
"""What is asked of the brick without a drawing: --brick goes with it, and nothing else."""

HEARD_BY = {
    **dict.fromkeys(("font", "letters", "slant", "spacing", "align"), "text"),
    **dict.fromkeys(("detail", "shades", "smoothing", "style"), "picture"),
    **dict.fromkeys(("layers", "fill", "pens"), "SVG"),
}
"""Of which kind of source an option is."""


def _given() -> dict[str, str]:
    """Return the options that the command line says: names, and how people write them."""
    here = click.get_current_context()
    return {
        param.name or "": param.opts[0]
        for param in here.command.params
        if here.get_parameter_source(param.name or "") is ParameterSource.COMMANDLINE
    }


def check_heard(kind: str, name: str) -> None:
    """Refuse options that a source does not hear: they would do nothing.

    Args:
        kind: of the source, as in Artwork.
        name: of the source, for people.

    Raises:
        click.UsageError: one is given.
    """
    for option, written in _given().items():
        wanted = HEARD_BY.get(option, kind)
        if wanted != kind:
            article = "an" if wanted == "SVG" else "a"
            raise click.UsageError(
                f"{written} is for a drawing made of {article} {wanted}, and {name} is none: "
                "leave it out."
            )


def check_together(to_brick: bool, simulate: bool, drawn: bool) -> None:
    """Refuse options that would be heard by nobody.

    Args:
        to_brick: the brick is asked for something without a drawing.
        simulate: it is drawn on the emulated brick.
        drawn: it is drawn at all.

    Raises:
        click.UsageError: one is given.
    """
    given = _given()
    if to_brick:
        alone = [name for name in given if name in BRICK_ALONE[:3]]
        if len(alone) > 1 or not set(given) <= set(BRICK_ALONE):
            raise click.UsageError("--watch, --jobs and --cancel stand alone: leave all else out.")
        return
    for name, why in (
        ("out", "" if simulate else "is for --simulate"),
        ("plant", "" if simulate else "is for --simulate"),
        ("detach", "is for drawing on the brick" if simulate or not drawn else ""),
        ("resume", "is for drawing on the brick; an emulated one begins anew" if simulate else ""),
        *(
            (name, "" if drawn else "is for drawing; behind driver.py job FILE it is told the job")
            for name in ("repeat", "share", "resume")
        ),
    ):
        if why and name in given:
            raise click.UsageError(f"{given[name]} {why}: leave it out.")


def style_of(style: str) -> str:
    """Return the style of a picture: who says how edges and tones are drawn wants these.

    Raises:
        click.UsageError: it is another one.
    """
    given = _given()
    asked = [given[name] for name in ("detail", "shades", "smoothing") if name in given]
    if asked and style == "lines":
        raise click.UsageError(f"{asked[0]} is for --style photo: leave it out.")
    return "photo" if asked else style


JOB, PREVIEW = (".job",), (".svg", ".png")
"""Endings of what is written."""


def check_files(
    source: str | None, jobs: Sequence[Path], previews: Sequence[Path], replace: bool
) -> None:
    """Refuse to write a file over what is drawn, over another one, or where there is no folder.

    Args:
        source: what is drawn, if it is a file.
        jobs: files of jobs that are to be written.
        previews: of previews.
        replace: whether they may replace others.

    Raises:
        click.UsageError: one would be lost.
        CannotWrite: one cannot be written.
    """
    taken = {}
    if source and os.path.exists(source):  # else it is the name of one that comes along
        taken[os.path.realpath(source)] = "what is drawn"
    for file in (*jobs, *previews):
        place = os.path.realpath(file)
        if place in taken:
            raise click.UsageError(f"{file} is {taken[place]}, too: write to another file.")
        taken[place] = "a file that is written"
        if str(file) == "-":
            raise click.UsageError("- would be a file of this name: name another one.")
    for file in (*jobs, *previews):
        check_new(file, JOB if file in jobs else PREVIEW, replace)
