"""Preview of a drawing: its numbers and lines for people, and its picture as SVG or PNG."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from laptop.drawing.artwork import BadArtwork, stroke_length
from laptop.drawing.preparing import DrawingPlan
from laptop.drawing.timing import in_minutes
from laptop.system.files import check_kind, write_whole

FORMATS = (".svg", ".png")


class BadPreview(BadArtwork):
    """A file that no preview can be written to."""


def check_name(file: str | os.PathLike[str]) -> str:
    """Return the ending of a preview's file, as it is in FORMATS.

    Raises:
        BadPreview: it is another one.
    """
    ending = Path(file).suffix.lower()
    if ending not in FORMATS:
        raise BadPreview(f"{file}: a preview is written as {' or '.join(FORMATS)}; name it so")
    return ending


def write_preview(plan: DrawingPlan, file: str | os.PathLike[str]) -> None:
    """Write the picture of a plan, as SVG or PNG by the file's ending, whole or not at all.

    Raises:
        BadPreview: another ending.
        CannotWrite: a device or the like is there, or there is no room.
    """
    file = Path(file)
    ending = check_name(file)
    check_kind(file)
    from laptop.drawing.preview_plot import preview_bytes  # matplotlib takes a second to load

    write_whole(file, preview_bytes(plan, lines_of(plan), ending))


def plan_numbers(plan: DrawingPlan) -> dict[str, Any]:
    """Return a plan's size and place, cm, strokes, lengths, cm, and the time it takes, s."""
    return {
        "size_cm": list(plan.placement.size),
        "centre_cm": list(plan.placement.centre),
        "strokes": len(plan.strokes),
        "drawn_cm": plan.cm,
        "pen_up_cm": plan.after.pen_up_cm,
        "seconds": plan.estimate.seconds,
        "speed_cm_s": plan.speed,
        "unreached_cm": sum(stroke_length(miss.points) for miss in plan.missed),
    }


def lines_of(plan: DrawingPlan) -> list[str]:
    """Say what a plan is, a few lines for people."""
    width, height = plan.placement.size
    x, y = (round(value, 1) + 0.0 for value in plan.placement.centre)  # no -0.0
    count = len(plan.strokes)
    lines = [
        f"{width:.1f} x {height:.1f} cm around ({x:.1f}, {y:.1f}) cm, "
        f"{count} stroke{'' if count == 1 else 's'}, "
        f"{plan.cm:.0f} cm drawn, {plan.after.pen_up_cm:.0f} cm with the pen up",
        f"about {in_minutes(plan.estimate.seconds)} with the {plan.arm.name} arm at "
        f"{plan.speed:g} cm/s",
    ]
    if plan.missed:
        length = sum(stroke_length(miss.points) for miss in plan.missed)
        left = ", and are left out" if plan.options.clip else ""
        lines.append(f"{length:.1f} cm cannot be reached (red){left}")
    return [*lines, *plan.pen_lines(), *plan.notes]
