"""Checks of `draw`'s options, and the files that it writes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from laptop.system.files import check_new


def style_of(tracing: dict[str, Any]) -> dict[str, Any]:
    """Return a Tracing's settings with its style: who says how tones are drawn wants a photo's.

    Raises:
        click.UsageError: it is another one.
    """
    asked = [key for key in ("detail", "shades", "smoothing") if key in tracing]
    if asked and tracing.get("style") == "lines":
        raise click.UsageError(f"{asked[0]} of --tracing is for style=photo: leave it out.")
    return {**tracing, "style": "photo"} if asked else tracing


JOB_SUFFIX, FILM_SUFFIX, PREVIEW_SUFFIXES = ".job", ".gif", (".svg", ".png")
"""Endings of what is written."""


def is_job(file: Path) -> bool:
    """Return whether a file of this name is a job, and no picture."""
    return file.suffix.lower() == JOB_SUFFIX


def is_film(file: Path) -> bool:
    """Return whether a file of this name is a film of the arm that draws."""
    return file.suffix.lower() == FILM_SUFFIX


def check_files(source: str | None, files: Sequence[Path], replace: bool) -> None:
    """Refuse to write a file over what is drawn, over another one, or where there is no folder.

    Args:
        source: what is drawn, if it is a file.
        files: jobs and pictures that are to be written.
        replace: whether they may replace others.

    Raises:
        click.UsageError: one would be lost.
        CannotWrite: one cannot be written.
    """
    taken = {}
    if source and os.path.exists(source):  # else it is the name of one that comes along
        taken[os.path.realpath(source)] = "what is drawn"
    for file in files:
        place = os.path.realpath(file)
        if place in taken:
            raise click.UsageError(f"{file} is {taken[place]}, too: write to another file.")
        taken[place] = "a file that is written"
        if str(file) == "-":
            raise click.UsageError("- would be a file of this name: name another one.")
    for file in files:
        check_new(file, (JOB_SUFFIX, FILM_SUFFIX, *PREVIEW_SUFFIXES), replace)
