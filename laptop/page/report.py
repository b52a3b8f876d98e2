"""The report of a run on the page: one HTML file, made of what the tracker's side knows.

Slow, and to be called by one thread at a time: matplotlib's style is everybody's.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from html import escape
from typing import Any, NamedTuple

import cv2
import numpy as np
from matplotlib.axes import Axes

from laptop.page.record import Curve, Record, Run, Told
from laptop.page.snapshots import VERDICTS, points
from laptop.reporting.charts import (
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
from laptop.reporting.document import cells, document, figures, section, table
from laptop.reporting.line_plot import BAND, JOINTS, QUIET, REACH_EDGE, WIDTH, new_figure, png_of

BLIND = 0.5
"""A camera that has not seen the tip for longer than this, s, leaves a gap."""
GRID = 0.05
"""Between two points of a curve of errors, s."""
RECENT = 0.5
"""The last so many seconds tell where the tip came to stand."""
FEW = 9
"""More goals than these are not numbered in the picture."""
LEFT, RIGHT = (0.065, 0.12, 0.42, 0.76), (0.56, 0.12, 0.42, 0.76)
"""Where two panels are, as shares of a figure."""


class Leg(NamedTuple):
    """One run as it is drawn; times in s since the record began.

    run     what it is made of
    ways    per camera rows (s, u, v) of the tip, NaN where it was not seen
    goals   per camera where the goal was in the end, px
    t       moments, GRID apart
    e       per row of the pictures what the tracker saw of the error at these, px
    told    what the brick said; held: (s, why) when it was held
    """

    run: Run
    ways: dict[str, np.ndarray]
    goals: dict[str, tuple[float, float]]
    t: np.ndarray
    e: dict[str, np.ndarray]
    told: list[Told]
    held: list[tuple[float, str]]

    @property
    def measured(self) -> list[Told]:
        """What the brick said when it had just measured the error."""
        before = [None, *(said.e for said in self.told)]
        new = zip(self.told, before, strict=False)
        return [said for said, e in new if said.error is not None and said.e != e]

    @property
    def errors(self) -> np.ndarray:
        """The length of `e`, px."""
        return np.sqrt(sum((values**2 for values in self.e.values()), np.zeros(len(self.t))))

    @property
    def seen(self) -> float | None:
        """The error in the end as the tracker saw it, px."""
        last = self.errors[self.t > self.t[-1] - RECENT] if len(self.t) else np.empty(0)
        last = last[np.isfinite(last)]
        return float(np.median(last)) if len(last) and self.e else None

    @property
    def tolerance(self) -> float | None:
        """In px, if it was ordered here."""
        return self.run.orders and self.run.orders.tolerance


def write(record: Record) -> str:
    """The report as the text of an HTML file."""
    legs = legs_of(record)
    last = legs[-1].run
    body = [
        f'<p><a href="" download="{file_name(record)}" style="color:inherit">Save this report</a>',
        *(
            section(heading, caption, picture)
            for heading, caption, draw in _FIGURES
            if (picture := draw(record, legs))
        ),
        "<section><h2>Every step</h2>",
        *(_steps(leg, number if len(legs) > 1 else 0) for number, leg in enumerate(legs, 1)),
        "</section>",
    ]
    return document(
        f"BrickServo: run {record.number}",
        last.verdict == "converged" or last.ended is None,
        verdict_of(last),
        headline(legs),
        ", ".join(_facts(record)),
        table(_HEADINGS, [f"<tr>{cells(row)}</tr>" for row in _rows(legs)]),
        _NOTE,
        "\n".join(body),
    )


def file_name(record: Record) -> str:
    """What to call the file."""
    return time.strftime(
        f"brickservo-%Y-%m-%d-run-{record.number}.html", time.localtime(record.when)
    )


# What is known


def legs_of(record: Record) -> list[Leg]:
    """What is to be drawn of a record."""
    began = record.runs[0].began
    return [_leg(run, began) for run in record.runs]


def _leg(run: Run, began: float) -> Leg:
    told = [said._replace(t=said.t - began) for said in run.told]
    tips = {camera: _since(began, curve) for camera, curve in run.tips.items()}
    goals = {camera: _since(began, curve) for camera, curve in run.goals.items()}
    if run.orders is None:  # perhaps the brick went to a pixel, of which it says only how far off
        goals.update(_goals_told(tips, told))
    rows = [row for row in (told[-1].e if told else ()) if row[:-2] in tips and row[:-2] in goals]
    rows = rows or [f"{camera}.{axis}" for camera in tips if camera in goals for axis in "uv"]
    ends = [curve[-1, 0] for curve in tips.values()] + [said.t for said in told[-1:]]
    t = np.arange(run.began - began, max(ends, default=0.0) + GRID, GRID) if rows else np.empty(0)
    e = {}
    for row in rows:
        camera, column = row[:-2], 1 + "uv".index(row[-1])
        tip, goal = tips[camera], goals[camera]
        values = np.interp(t, tip[:, 0], tip[:, column]) - np.interp(t, goal[:, 0], goal[:, column])
        e[row] = np.where(_known(t, tip[:, 0]), values, np.nan)
    return Leg(
        run,
        {camera: _torn(tip) for camera, tip in tips.items()},
        {camera: (float(goal[-1, 1]), float(goal[-1, 2])) for camera, goal in goals.items()},
        t,
        e,
        told,
        [(t - began, why) for t, why in run.held],
    )


def _since(began: float, curve: Curve) -> np.ndarray:
    return np.array(curve, float).reshape(-1, 3) - (began, 0.0, 0.0)


def _goals_told(tips: dict[str, np.ndarray], told: Sequence[Told]) -> dict[str, np.ndarray]:
    """Per camera where the brick's goal is, (1, 3): the tip less the error it last measured."""
    e = told[-1].e if told else {}
    first = next((said.t for said in told if said.e == e), 0.0)
    goals = {}
    for camera, tip in tips.items():
        if f"{camera}.u" in e and f"{camera}.v" in e:
            u, v = (np.interp(first, tip[:, 0], tip[:, column]) for column in (1, 2))
            goals[camera] = np.array([[first, u - e[f"{camera}.u"], v - e[f"{camera}.v"]]])
    return goals


def _known(t: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """At which of the moments t (s) a curve is known that was seen at others."""
    after = np.searchsorted(seen, t)
    before = np.where(after > 0, seen[np.maximum(after - 1, 0)], -np.inf)
    behind = np.where(after < len(seen), seen[np.minimum(after, len(seen) - 1)], np.inf)
    return (behind - before <= BLIND) | (np.minimum(t - before, behind - t) <= 2 * GRID)


def _torn(curve: np.ndarray) -> np.ndarray:
    """The curve with NaN in its gaps."""
    gaps = np.flatnonzero(np.diff(curve[:, 0]) > BLIND) + 1
    return np.insert(curve, gaps, np.nan, axis=0)


# In words


def verdict_of(run: Run) -> str:
    """The verdict for people."""
    if run.ended is not None and not run.verdict:
        return "How it ended was not heard: the link was lost."
    if run.verdict == "" and run.orders and run.orders.follow:
        return "Following the goal marker."
    return VERDICTS.get(run.verdict, f"{run.verdict.capitalize()}.")


def headline(legs: Sequence[Leg]) -> str:
    """What it came to, in one line."""
    runs = [leg.run for leg in legs]
    last = runs[-1]
    ends = [said.t for leg in legs for said in leg.told[-1:]] or [0.0]
    end = ends[-1] if last.ended is None else last.ended - runs[0].began
    moves = sum(run.told[-1].moves for run in runs if run.told)
    parts = [f"{moves} move{'s' * (moves != 1)}, {end:.1f} s"]
    error = last.told[-1].error if last.told else None
    if error is not None:
        parts.insert(0, f"{error:.1f} px off as the brick measured it")
    if len(legs) > 1:
        there = sum(run.verdict == "converged" for run in runs)
        parts.append(f"{points(there)} of the path reached")
    return (f"{last.reason[:1].upper()}{last.reason[1:]}; " if last.reason else "") + "; ".join(
        parts
    )


def _facts(record: Record) -> list[str]:
    orders = record.runs[0].orders
    when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(record.when))
    facts = [when, f"brick {record.brick.removeprefix('::ffff:')}"]
    if orders is None:
        return [*facts, "ordered on the brick, so that method and tolerance are not known here"]
    facts += [f"method {orders.method}", f"mode {orders.mode}"]
    if len(orders.goals) > 1 or len(record.pictures) > 1:
        facts.append(f"rows {orders.rows}")
    facts += [f"tolerance {orders.tolerance:g} px", f"budget {orders.budget:g} s"]
    return [*facts, "the goal marker is followed"] if orders.follow else facts


_HEADINGS = ("goal", "method", "brick says", "brick\npx", "tracker\npx", "moves", "s")

_NOTE = (
    "All of this is what the tracker saw and what the brick told. Distances are in pixels, of all "
    "cameras together: as the brick last measured its own, and as the tracker saw tip and goal in "
    "the last half second. Where tip and goal truly are in space nobody knows here."
)


def _rows(legs: Sequence[Leg]) -> list[tuple[str, ...]]:
    return [
        (
            _goal(leg),
            leg.run.orders.method if leg.run.orders else "not known",
            leg.run.verdict or ("goes on" if leg.run.ended is None else "not heard"),
            _figure(leg.run.told[-1].error if leg.run.told else None),
            _figure(leg.seen),
            str(leg.run.told[-1].moves if leg.run.told else 0),
            _figure(leg.run.ended and leg.run.ended - leg.run.began),
        )
        for leg in legs
    ]


def _goal(leg: Leg) -> str:
    orders = leg.run.orders
    if orders and not orders.goals:
        return "the marker"
    where = [
        f"{camera}: " * (len(leg.goals) > 1) + f"{u:.0f}, {v:.0f}"
        for camera, (u, v) in sorted(leg.goals.items())
    ]
    return "; ".join(where) or "not known"


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def _steps(leg: Leg, number: int) -> str:
    """What the brick told of every step of a run, to be unfolded."""
    rows = [
        (
            f"{said.t:.1f}",
            str(said.moves),
            _figure(said.error),
            figures(list(said.e.values()), "{:+.1f}"),
            figures([math.degrees(angle) for angle in said.q], "{:.1f}"),
            _figure(said.condition),
        )
        for said in leg.measured
    ]
    components = ", ".join(leg.measured[-1].e if leg.measured else ()) or "components"
    names = ("s", "moves", "off, px", f"{components}, px", "joints, deg", "condition")
    held = "".join(f"<li>{t:.1f} s: held, {escape(why)}</li>" for t, why in leg.held)
    title = f"goal {number}, {_goal(leg)}" if number else _goal(leg)
    return (
        f"<details><summary>To {escape(title)}</summary>{f'<ul>{held}</ul>' if held else ''}"
        f'<div class="wide">{table(names, [f"<tr>{cells(row)}</tr>" for row in rows])}</div>'
        "</details>"
    )


# Pictures


def draw_cameras(record: Record, legs: Sequence[Leg]) -> bytes | None:
    """The last picture of each camera with the ways of the tip, as PNG; None if there is none."""
    images: dict[str, Any] = {
        camera: cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        for camera, jpeg in sorted(record.pictures.items())
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
            for number, leg in enumerate(legs, 1):
                _draw_leg(axes, leg, camera, number if 1 < len(legs) <= FEW else 0, count > 1)
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


def _draw_leg(axes: Axes, leg: Leg, camera: str, number: int, small: bool) -> None:
    colour = _colour(number)
    goal = leg.goals.get(camera)
    looks = []
    if goal and not (leg.run.orders and leg.run.orders.follow):
        rows = f"{camera}.u", f"{camera}.v"
        looks = [
            [g + said.e[row] for g, row in zip(goal, rows, strict=True)]
            for said in leg.measured
            if said.e.keys() >= set(rows)
        ]
    if camera in leg.ways:
        draw_way(axes, leg.ways[camera][:, 1:], np.array(looks).reshape(-1, 2), colour)
    if goal:
        draw_goal(axes, *goal, leg.tolerance, colour, str(number or ""), small)


def _colour(number: int) -> str:
    return GOALS[max(number - 1, 0) % len(GOALS)]


def draw_errors(record: Record, legs: Sequence[Leg]) -> bytes:
    """The error in time, and its components, as PNG."""
    tolerance = legs[0].tolerance
    with new_figure(700) as figure:
        axes = figure.add_axes(LEFT)
        told = [said.error for leg in legs for said in leg.measured if said.error is not None]
        seen = [error for leg in legs for error in leg.errors[np.isfinite(leg.errors)]]
        frame_errors(axes, max([10.0, *told, *seen]), tolerance, "Distance from the goal", 0.012)
        axes.set_ylabel("distance from the goal  px")
        for number, leg in enumerate(legs, 1):
            looks = np.array([(said.t, said.error) for said in leg.measured])
            if len(leg.t):
                draw_error(axes, leg.t, leg.errors, looks, _colour(number), "")
        axes.set_xlim(0, _end(legs))
        axes = figure.add_axes(RIGHT)
        frame_angles(axes, "Tip less goal")
        axes.set_ylabel("px")
        axes.axhline(0, color=REACH_EDGE, lw=1.2)
        if tolerance:
            axes.axhspan(-tolerance, tolerance, color=BAND, alpha=0.16, lw=0)
        for k, row in enumerate(sorted({row for leg in legs for row in leg.e})):
            colour = JOINTS[k % len(JOINTS)]
            for number, leg in enumerate(legs):
                if row in leg.e:
                    label = row if not number else None
                    axes.plot(leg.t, leg.e[row], color=colour, lw=1.6, label=label)
                    measured = [(said.t, said.e[row]) for said in leg.measured if row in said.e]
                    x, y = np.array(measured).reshape(-1, 2).T
                    axes.plot(x, y, "o", color=colour, ms=4, mec="white", mew=0.7)
        axes.set_xlim(0, _end(legs))
        name_curves(axes)
        return png_of(figure)


def draw_joints(record: Record, legs: Sequence[Leg]) -> bytes:
    """The joints and the condition of the image Jacobian in time, as PNG."""
    told = [said for leg in legs for said in leg.told]
    measured = [said for leg in legs for said in leg.measured]
    with new_figure(620) as figure:
        axes = figure.add_axes(LEFT)
        for joint in range(max((len(said.q) for said in told), default=0)):
            curves = (
                [(said.t, said.q[joint]) for said in said_so if joint < len(said.q)]
                for said_so in (told, measured)
            )
            draw_angle(axes, joint, f"joint {joint + 1}", *curves)
        frame_angles(axes, "Joint angles")
        axes.set_ylabel("degrees")
        axes.set_xlim(0, _end(legs))
        name_curves(axes)
        axes = figure.add_axes(RIGHT)
        known = [(said.t, said.condition) for said in measured if said.condition is not None]
        x, y = np.array(known, float).reshape(-1, 2).T
        axes.plot(x, y, color=GOALS[0], lw=1.4, marker="o", ms=4, drawstyle="steps-post")
        frame_condition(axes, max(10.0, float(y.max(initial=0.0))))
        axes.set_xlabel("s")
        axes.set_xlim(0, _end(legs))
        return png_of(figure)


def _end(legs: Sequence[Leg]) -> float:
    """Up to where time is shown, s."""
    last = [leg.t[-1] for leg in legs if len(leg.t)]
    last += [said.t for leg in legs for said in leg.told[-1:]]
    return max([1.0, *last]) * 1.02


_FIGURES: tuple[tuple[str, str, Callable[[Record, Sequence[Leg]], bytes | None]], ...] = (
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
