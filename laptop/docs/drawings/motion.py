"""Drawings of the arm's geometry, and of a joint that turns round."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Arc

from laptop.docs.drawings.picture import arrow, label, picture
from laptop.record.figures.sheet import (
    BAND,
    INK,
    PEAK,
    QUIET,
    REACH,
    REACH_EDGE,
    TRAVEL,
    WANTED,
    Sheet,
)
from robot.drawing_commands import LINES
from robot.motion import classic_steps, kinematics, paths, trajectory
from robot.motion.backlash import BacklashCompensation, crossing_time
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))

LINE, ELBOW = LINES[2][1], "up"
"""Ends of the line that is looked at, cm, and the elbow's side."""

TIP = (8.0, 14.0)
"""Place of the tip that two poses reach, cm."""


def kinematics_drawing(file: Path) -> None:
    """Draw the arm with its letters and both elbows, and a line by the Jacobian's steps."""
    with picture(file, 600) as figure:
        _draw_poses(Sheet(figure, (0.0, 0.0, 0.53, 1.0)))
        _draw_steps(Sheet(figure, (0.54, 0.0, 0.46, 1.0)))


def _draw_poses(sheet: Sheet) -> None:
    """Draw both poses that reach the tip, and the letters of one of them."""
    axes, (x, y) = sheet.axes, TIP
    axes.set_axis_off()
    q = kinematics.inverse(ARM, TIP, "up")
    pose, other = (
        np.array(kinematics.joint_positions(ARM, kinematics.inverse(ARM, TIP, elbow)))
        for elbow in ("up", "down")
    )
    sheet.show(np.concatenate([pose, other]), ((2.6, 3.0), (4.0, 2.2)))
    axes.plot(*other.T, color=TRAVEL, ls=(0, (3, 2)), marker="o", ms=9, zorder=1)
    axes.plot([0, x, x], [0, 0, y], color=REACH_EDGE, lw=2.5, zorder=0)
    base, elbow, tip = pose
    axes.plot([0, 12], [0, 0], color=QUIET, lw=1.5, zorder=1)
    axes.plot(*np.array([elbow, 1.4 * elbow]).T, color=QUIET, lw=1.5, ls=(0, (4, 3)), zorder=1)
    sheet.arm(pose)
    first, both = math.degrees(q[0]), math.degrees(sum(q))
    for centre, begin, end, name in ((base, 0.0, first, "q1"), (elbow, first, both, "q2")):
        axes.add_patch(Arc(centre, 6.4, 6.4, theta1=begin, theta2=end, color=PEAK, lw=3, zorder=4))
        label(axes, centre + _polar(4.6, (begin + end) / 2), name, PEAK)
    label(axes, (base + elbow) / 2 + _polar(1.6, first + 90), "a", INK)
    label(axes, 0.25 * elbow + 0.75 * tip + _polar(1.6, both - 90), "b", INK)
    label(axes, (x / 2 + 1, -1.3), "x", WANTED)
    label(axes, (x - 1, y / 3 + 1.5), "y", WANTED)
    label(axes, (x + 3, y + 0.8), "(x, y)", WANTED)


def _polar(radius: float, degrees: float) -> np.ndarray:
    """Return the point at this distance and angle from the origin."""
    angle = math.radians(degrees)
    return radius * np.array([math.cos(angle), math.sin(angle)])


def stepped_line() -> np.ndarray:
    """Return the places of the tip, cm, after each of the lab report's steps by ideal motors."""
    start, goal = LINE
    q = kinematics.inverse(ARM, start, ELBOW)
    displacement = tuple(b - a for a, b in zip(start, goal, strict=True))
    tips = [start]
    while not classic_steps.has_arrived(start, goal, tips[-1]):
        step = classic_steps.jacobian_step(ARM, q, displacement)
        q = tuple(angle + turn for angle, turn in zip(q, step, strict=True))
        tips.append(kinematics.forward(ARM, q))
    return np.array(tips)


def _draw_steps(sheet: Sheet) -> None:
    """Draw a line, and what the Jacobian's steps make of it."""
    line, tips, axes = np.array(LINE), stepped_line(), sheet.axes
    axes.set_axis_off()
    sheet.show(np.concatenate([line, tips]), ((0.6, 1.6), (0.8, 0.8)))
    axes.plot(*line.T, color=WANTED, lw=4, zorder=2)
    axes.plot(*tips.T, "o-", color=PEAK, ms=8, zorder=3)
    along = (line[1] - line[0]) / math.dist(*line)
    off = np.abs((tips - line[0]) @ np.array([-along[1], along[0]])).max()
    label(axes, (8.4, 8.6), "line", WANTED, ha="left")
    label(axes, (5.6, 5.4), f"steps by J:\n{10 * off:.0f} mm off", PEAK, va="top")
    arrow(axes, (6.4, 5.6), tips[len(tips) // 2] - 0.25, PEAK)


def backlash_drawing(file: Path) -> None:
    """Draw the set-points of motor and link while the elbow turns round."""
    (motion,) = trajectory.plan(ARM, [paths.polyline(list(LINE))[0]], elbow=ELBOW)
    plan = BacklashCompensation(ARM.joints, motion, [float(way) for way in motion.directions])
    joint, (turn,) = ARM.joints[1], motion.reversals[1]
    t = np.linspace(-0.3, 0.3, 301)
    link, motor = (np.degrees([one.at(turn + dt)[0][1] for dt in t]) for one in (motion, plan))
    play, crossing = math.degrees(joint.backlash), crossing_time(joint)
    with picture(file) as figure:
        axes = figure.add_axes((0.13, 0.16, 0.83, 0.81))
        axes.fill_between(t, link - play / 2, link + play / 2, color=REACH)
        axes.axvspan(-crossing / 2, crossing / 2, color=BAND, alpha=0.15, lw=0)
        for edge in (-play / 2, play / 2):
            axes.plot(t, link + edge, color=TRAVEL, lw=1.5, ls=(0, (4, 3)))
        axes.plot(t, link, color=WANTED, lw=5)
        axes.plot(t, motor, color=PEAK, lw=5)
        axes.set(xlabel="s from where the joint turns round", ylabel="elbow, degrees")
        axes.margins(x=0)
        label(axes, (-0.18, _at(-0.18, t, motor) + 0.6), "motor", PEAK, ha="right")
        label(axes, (-0.125, _at(-0.1, t, link) - 0.58), "link", WANTED, ha="left")
        middle = _at(0.22, t, link)
        axes.annotate(
            "",
            (0.22, middle - play / 2),
            (0.22, middle + play / 2),
            arrowprops={"arrowstyle": "<->", "color": QUIET, "lw": 2},
        )
        label(axes, (0.2, middle + play / 2 + 0.85), f"play {play:g}°", QUIET, ha="left")
        label(axes, (0.0, link.min() + 0.3), f"crossing\n{crossing:g} s", INK)


def _at(x: float, known: np.ndarray, values: np.ndarray) -> Any:
    """Return a curve's value between its known points."""
    return np.interp(x, known, values)
