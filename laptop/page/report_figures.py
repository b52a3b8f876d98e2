"""The figures of a run's report.

Slow, and to be called by one thread at a time: matplotlib's style is everybody's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes

from laptop.page.run_records import RunGroup
from laptop.page.run_traces import RunTraces
from laptop.record.figures.charts import (
    GOALS,
    draw_angle,
    draw_error,
    draw_goal,
    draw_legend,
    draw_way,
    frame_angles,
    frame_condition,
    frame_errors,
    name_camera,
    name_curves,
    show_picture,
)
from laptop.record.figures.sheet import (
    BAND,
    JOINTS,
    QUIET,
    REACH_EDGE,
    WIDTH,
    new_figure,
    png_of,
)

MAX_NUMBERED_GOALS = 9
"""More goals than these are not numbered in the image."""
LEFT_PANEL, RIGHT_PANEL = (0.065, 0.12, 0.42, 0.76), (0.56, 0.12, 0.42, 0.76)
"""The places of two panels, as shares of a figure."""


def draw_cameras(group: RunGroup, runs: Sequence[RunTraces]) -> bytes | None:
    """Draw the tip's path into the last image of each camera, as PNG; None if there is none."""
    images: dict[str, Any] = {
        camera: cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        for camera, jpeg in sorted(group.images.items())
    }
    if not images:
        return None
    count = len(images)
    tall = max(round(WIDTH / count * len(i) / len(i[0])) for i in images.values()) + 90
    with new_figure(tall) as figure:
        for k, (camera, image) in enumerate(images.items()):
            axes = figure.add_axes((k / count, 90 / tall, 1 / count, 1 - 90 / tall))
            height, width = image.shape[:2]
            show_picture(axes, image, width, height)
            for number, run in enumerate(runs, 1):
                numbered = 1 < len(runs) <= MAX_NUMBERED_GOALS
                _draw_run(axes, run, camera, number if numbered else 0, count > 1)
            if count > 1:
                name_camera(axes, camera, height)
        grey: dict[str, Any] = {"ls": "", "color": QUIET}
        axes = figure.add_axes((0, 0, 1, 1), zorder=-1)
        axes.set_axis_off()
        draw_legend(
            figure,
            [
                (axes.plot([], [], color=GOALS[0], lw=2.4)[0], "way of the tip"),
                (axes.plot([], [], marker="o", ms=8, mfc="white", mew=2, **grey)[0], "start"),
                (axes.plot([], [], marker="o", ms=4.5, **grey)[0], "where it looked"),
                (axes.plot([], [], marker="+", ms=11, mew=2, **grey)[0], "goal, tolerance"),
            ],
            42 / tall,
        )
        return png_of(figure)


def _draw_run(axes: Axes, run: RunTraces, camera: str, number: int, small: bool) -> None:
    """Draw one run into a camera's image; number 0: its goal bears none."""
    colour = _colour(number)
    goal = run.goals.get(camera)
    looks = []
    if goal and not (run.record.orders and run.record.orders.follow):
        rows = f"{camera}.u", f"{camera}.v"
        looks = [
            [g + sample.e[row] for g, row in zip(goal, rows, strict=True)]
            for sample in run.measured
            if sample.e.keys() >= set(rows)
        ]
    if camera in run.tips:
        draw_way(axes, run.tips[camera][:, 1:], np.array(looks).reshape(-1, 2), colour)
    if goal:
        draw_goal(axes, *goal, run.tolerance, colour, str(number or ""), small)


def _colour(number: int) -> str:
    """Return the colour of a run by its number, from 1 on; 0: there is but one."""
    return GOALS[max(number - 1, 0) % len(GOALS)]


def draw_errors(group: RunGroup, runs: Sequence[RunTraces]) -> bytes:
    """Draw the error over time, and its components, as PNG."""
    tolerance = runs[0].tolerance
    with new_figure(700) as figure:
        axes = figure.add_axes(LEFT_PANEL)
        told = [sample.error for run in runs for sample in run.measured if sample.error is not None]
        seen = [error for run in runs for error in run.errors[np.isfinite(run.errors)]]
        frame_errors(axes, max([10.0, *told, *seen]), tolerance, "Distance from the goal", 0.012)
        axes.set_ylabel("distance from the goal  px")
        for number, run in enumerate(runs, 1):
            looks = np.array([(sample.t, sample.error) for sample in run.measured])
            if len(run.t):
                draw_error(axes, run.t, run.errors, looks, _colour(number), "")
        axes.set_xlim(0, _end(runs))
        axes = figure.add_axes(RIGHT_PANEL)
        frame_angles(axes, "Tip less goal")
        axes.set_ylabel("px")
        axes.axhline(0, color=REACH_EDGE, lw=1.2)
        if tolerance:
            axes.axhspan(-tolerance, tolerance, color=BAND, alpha=0.16, lw=0)
        for k, row in enumerate(sorted({row for run in runs for row in run.e})):
            colour = JOINTS[k % len(JOINTS)]
            for number, run in enumerate(runs):
                if row in run.e:
                    label = row if not number else None
                    axes.plot(run.t, run.e[row], color=colour, lw=1.6, label=label)
                    measured = [
                        (sample.t, sample.e[row]) for sample in run.measured if row in sample.e
                    ]
                    x, y = np.array(measured).reshape(-1, 2).T
                    axes.plot(x, y, "o", color=colour, ms=4, mec="white", mew=0.7)
        axes.set_xlim(0, _end(runs))
        name_curves(axes)
        return png_of(figure)


def draw_joints(group: RunGroup, runs: Sequence[RunTraces]) -> bytes:
    """Draw the joints and the condition of the image Jacobian over time, as PNG."""
    told = [sample for run in runs for sample in run.samples]
    measured = [sample for run in runs for sample in run.measured]
    with new_figure(620) as figure:
        axes = figure.add_axes(LEFT_PANEL)
        for joint in range(max((len(sample.q) for sample in told), default=0)):
            curves = (
                [(sample.t, sample.q[joint]) for sample in chosen if joint < len(sample.q)]
                for chosen in (told, measured)
            )
            draw_angle(axes, joint, f"joint {joint + 1}", *curves)
        frame_angles(axes, "Joint angles")
        axes.set_ylabel("degrees")
        axes.set_xlim(0, _end(runs))
        name_curves(axes)
        axes = figure.add_axes(RIGHT_PANEL)
        known = [
            (sample.t, sample.condition) for sample in measured if sample.condition is not None
        ]
        x, y = np.array(known, float).reshape(-1, 2).T
        axes.plot(x, y, color=GOALS[0], lw=1.4, marker="o", ms=4, drawstyle="steps-post")
        frame_condition(axes, max(10.0, float(y.max(initial=0.0))))
        axes.set_xlabel("s")
        axes.set_xlim(0, _end(runs))
        return png_of(figure)


def _end(runs: Sequence[RunTraces]) -> float:
    """Return the end of the axis of time, s."""
    last = [run.t[-1] for run in runs if len(run.t)]
    last += [sample.t for run in runs for sample in run.samples[-1:]]
    return max([1.0, *last]) * 1.02


Draw = Callable[[RunGroup, Sequence[RunTraces]], bytes | None]
FIGURES: tuple[tuple[str, str, Draw], ...] = (
    (
        "What the camera saw",
        "The last picture of each camera, with the way of the tip as the tracker saw it. A ring is "
        "where it started, dots where the brick stopped to look, a cross the goal with its circle "
        "of tolerance. Nothing about camera or arm was calibrated: the first short moves show how "
        "the picture answers to each joint, every later one corrects that.",
        draw_cameras,
    ),
    (
        "The way to the goal in time",
        "Lines are what the tracker saw in its pictures, dots what the brick measured when it stood"
        " and looked; the shaded band is the tolerance. The left axis is logarithmic.",
        draw_errors,
    ),
    (
        "What the joints did",
        "The joint angles as the brick told them; and how well the image Jacobian could be "
        "inverted: 1 means that the picture answers alike to every motion of the joints. Where it "
        "peaks, a small error of the estimate becomes a large one of the step.",
        draw_joints,
    ),
)
"""Heading, caption and function of each figure."""
