"""Basins of attraction: from which start a search ends in which pose, and after how many steps."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from laptop.record.figures.sheet import INK, QUIET
from robot.motion.inverse_iteration import Solution, broyden_inverse, newton_inverse
from robot.motion.kinematics import TURN, Unreachable, branches
from shared.arm_description import Arm

METHODS: tuple[tuple[str, Callable[..., Solution]], ...] = (
    ("Newton", newton_inverse),
    ("Broyden", broyden_inverse),
)
UP, DOWN, NOWHERE = "#1f5fae", "#d9822b", "#555555"
MOST_STEPS = 40
"""Greatest number of steps that the colours' lightness still tells apart."""


def free(arm: Arm) -> Arm:
    """Return the arm without joint limits: those end a search, they do not bend its way."""
    joints = tuple(joint._replace(lower=-20.0, upper=20.0) for joint in arm.joints)
    return arm._replace(joints=joints)


def basin(
    method: Callable[..., Solution],
    arm: Arm,
    goal: Sequence[float],
    shoulders: np.ndarray,
    elbows: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Search from each start of a grid.

    Args:
        method: newton_inverse or broyden_inverse.
        arm: planar arm of two links.
        goal: where the tip is to go, (x, y), cm.
        shoulders: first joint's angles of the starts, rad, (n,).
        elbows: second joint's angles of the starts, rad, (m,).

    Returns:
        Which elbow was found, +1 up, -1 down, 0 none; and the number of steps; m x n each.
    """
    arm = free(arm)
    found, steps = np.zeros((2, len(elbows), len(shoulders)))
    for row, second in enumerate(elbows):
        for column, first in enumerate(shoulders):
            try:
                solution = method(arm, goal, (float(first), float(second)), tolerance=1e-4)
            except Unreachable:
                continue
            found[row, column] = math.copysign(1, math.sin(solution.q[1]))
            steps[row, column] = len(solution.trace) - 1
    return found, steps


def draw_basins(arm: Arm, goal: Sequence[float], count: int = 61) -> bytes:
    """Return both methods' basins side by side, as PNG.

    Args:
        arm: planar arm of two links.
        goal: where the tip is to go, (x, y), cm.
        count: starts along each side.
    """
    angles = np.radians(np.linspace(-180, 180, count))
    figure = Figure(figsize=(6.9, 3.7), dpi=200, layout=ConstrainedLayoutEngine(wspace=0.08))
    for axes, (name, method) in zip(figure.subplots(1, 2, sharey=True), METHODS, strict=True):
        found, steps = basin(method, arm, goal, angles, angles)
        axes.imshow(_colours(found, steps), extent=(-180, 180, -180, 180), origin="lower")
        _label(axes, f"{name}: {np.mean(steps[found != 0]):.1f} steps on average")
        for pose in _poses(arm, goal):
            axes.plot(*np.degrees(pose), "o", mfc="white", mec=INK, ms=5)
    figure.axes[0].set_ylabel("elbow at the start, deg", color=QUIET, size=8)
    out = io.BytesIO()
    figure.savefig(out, format="png")
    return out.getvalue()


def _poses(arm: Arm, goal: Sequence[float]) -> set[tuple[float, ...]]:
    """Return both poses at the goal, rad, within half a turn."""
    poses = branches(free(arm), goal)
    return {tuple(round(math.remainder(angle, TURN), 9) for angle in q) for q in poses}


def _label(axes: Any, title: str) -> None:
    axes.set_title(title, size=9, color=INK)
    axes.set_xlabel("shoulder at the start, deg", color=QUIET, size=8)
    axes.set(xticks=range(-180, 181, 90), yticks=range(-180, 181, 90))
    axes.tick_params(labelsize=7, colors=QUIET)


def _colours(found: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return RGB: the pose by its hue, lighter the more steps it took."""
    light = np.clip(steps / MOST_STEPS, 0, 1)[..., None] ** 0.6
    picture = np.empty((*found.shape, 3))
    for sign, colour in ((1, UP), (-1, DOWN), (0, NOWHERE)):
        picture[found == sign] = to_rgb(colour)
    return np.where(found[..., None] != 0, picture * (1 - 0.85 * light) + 0.85 * light, picture)
