"""A drawing seen before it is drawn: what the picture shows; written as SVG or PNG.

The table is seen from behind the arm, as its person sees it: up is x, to the right is -y.
"""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from laptop.drawing import reach
from laptop.drawing.artwork import BadArtwork, stroke_length
from laptop.drawing.durations import in_minutes
from laptop.drawing.preparing import DrawingPlan
from laptop.drawing.preview_scene import PreviewScene
from laptop.system.files import check_kind, write_whole
from robot.motion import kinematics

FORMATS = (".svg", ".png")

MARGIN = 1.0
"""Around all that is shown, cm."""

FIRST_COLOUR, LAST_COLOUR = 0, 200
"""Of a colour map of 256, those of the first and the last stroke: what comes after is too light."""

OUTLINE_PRECISION, FINER = 0.02, 4
"""Of the reach's outline, cm; and how much finer than the map it is drawn, so that it looks smooth.
"""


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
    seen = scene(plan)
    if ending == ".svg":
        from laptop.drawing.preview_svg import svg_text

        write_whole(file, svg_text(seen).encode())
    else:
        from laptop.drawing.preview_png import png_bytes  # matplotlib takes a second to load

        write_whole(file, png_bytes(seen))


def seen_from_behind(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the table, cm, as they are on the picture."""
    return np.column_stack([-points[:, 1], points[:, 0]])


def scene(plan: DrawingPlan) -> PreviewScene:
    """What the preview of a plan shows."""
    strokes = [seen_from_behind(stroke.placed.points) for stroke in plan.strokes]
    ways = [
        np.vstack([a[-1], b[0]])
        for a, b in zip(strokes, strokes[1:], strict=False)
        if np.hypot(*(a[-1] - b[0])) > 0
    ]
    missed = [seen_from_behind(miss.points) for miss in plan.missed]
    outlines = reach_outlines(plan)
    paper = None if plan.placement.paper is None else seen_from_behind(plan.placement.paper)
    home = kinematics.joint_positions(plan.arm, [joint.home for joint in plan.arm.joints])
    joints = seen_from_behind(np.array(home, float)[:, :2])
    shown = np.vstack([*outlines, *strokes, *missed, joints, *([] if paper is None else [paper])])
    starts = plan.estimate.starts
    total = max(plan.estimate.seconds, 1e-9)
    return PreviewScene(
        plan.name,
        tuple(lines_of(plan)),
        shown.min(axis=0) - MARGIN,
        shown.max(axis=0) + MARGIN,
        tuple(outlines),
        paper,
        tuple(strokes),
        tuple(colours([start / total for start in starts])),
        tuple(ways),
        tuple(missed),
        strokes[0][0] if strokes else None,
        joints,
        tuple(colours([k / 24 for k in range(25)])),
        plan.estimate.seconds,
    )


def colours(shares: list[float]) -> list[str]:
    """The colours of shares of the time, 0 to 1, as "#rrggbb"."""
    if not shares:
        return []
    span = LAST_COLOUR - FIRST_COLOUR
    numbers = (FIRST_COLOUR + np.clip(np.array(shares), 0, 1) * span).astype(np.uint8)
    blended = cv2.applyColorMap(numbers.reshape(-1, 1), cv2.COLORMAP_PLASMA)[:, 0]
    return [f"#{red:02x}{green:02x}{blue:02x}" for blue, green, red in blended.tolist()]


def reach_outlines(plan: DrawingPlan) -> list[np.ndarray]:
    """Outlines of what the arm reaches in the postures that it may take, outer and inner ones."""
    table = reach.reach_map(plan.arm, plan.options.height, plan.options.postures(plan.arm))
    soft = cv2.GaussianBlur((table.cells > 0).astype(np.float32), (0, 0), 1.5)
    finer = np.arange(FINER * (len(soft) - 1) + 1, dtype=np.float32) / FINER
    x, y = np.meshgrid(finer, finer)
    inner = cv2.remap(soft, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
    found, _ = cv2.findContours(
        (inner > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    cell = reach.RASTER / FINER
    out = []
    for contour in found:
        smooth = cv2.approxPolyDP(contour, OUTLINE_PRECISION / cell, True)[:, 0]
        if len(smooth) > 2:
            out.append(seen_from_behind(table.origin + smooth * cell))
    return out


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
    return [*lines, *plan.told_pens(), *plan.notes]
