"""The picture of an arm in its home pose: where to put it by hand before its zero is taken.

The documentation's pictures are made of the arms that come along by

    arm = read_arm(find_arm("planar"))
    skeleton = kinematics.joint_positions(arm, [joint.home for joint in arm.joints])
    write_home_pose(Path("laptop/docs/pictures/home-planar.png"), arm, skeleton)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.patches import Arc, Wedge

from laptop.record.figures.sheet import (
    HALF_BASE,
    INK,
    PEAK,
    QUIET,
    REACH_EDGE,
    WANTED,
    Sheet,
    written_figure,
)
from shared.arm_description import PULLED_DOWN, SEEK_BEYOND, Arm

PICTURE_HEIGHT = 800
"""Height of the picture, px."""


def write_home_pose(file: Path, arm: Arm, skeleton: Sequence[Sequence[float]]) -> None:
    """Write the picture as PNG, in the plane from above, in space from the side.

    Args:
        file: where to.
        arm: whose home pose it is.
        skeleton: the base, every joint and the tip in that pose, cm.

    Raises:
        OSError: as the system says it.
    """
    standing = arm.chain in PULLED_DOWN
    joints = arm.joints[1:] if standing else arm.joints
    how = "from the side, its base turned straight ahead" if standing else "from above"
    title = f"Home pose of {arm.name}, seen {how}"
    with written_figure(file, title, height=PICTURE_HEIGHT) as figure:
        sheet = Sheet(figure, (0.062, 0.13, 0.898, 0.77), "xz" if standing else "xy")
        axes, places = sheet.axes, sheet.seen(skeleton)
        axles, tip = places[-1 - len(joints) : -1], places[-1]
        seen = np.concatenate(
            [places, [(-HALF_BASE, -HALF_BASE), (HALF_BASE, HALF_BASE), (tip[0] + 6, 0)]]
        )
        sheet.show(seen, ((3.0, 4.0), (1.0, 4.0)))
        axes.axhline(0, color=REACH_EDGE, lw=1, zorder=0)
        before = 0.0
        for joint, axle, end in zip(joints, axles, [*axles[1:], tip], strict=True):
            along = before + joint.home
            within = [math.degrees(along + side * SEEK_BEYOND) for side in (-1, 1)]
            reach = math.dist(axle, end)
            axes.add_patch(Wedge(axle, reach, *within, fc=WANTED, alpha=0.12, lw=0, zorder=0.5))
            ahead = axle + 1.25 * reach * np.array([math.cos(before), math.sin(before)])
            axes.plot(*np.array([axle, ahead]).T, color=QUIET, lw=0.9, ls=(0, (6, 4)), zorder=4)
            turns = sorted((math.degrees(before), math.degrees(along)))
            axes.add_patch(
                Arc(axle, 6, 6, theta1=turns[0], theta2=turns[1], color=PEAK, lw=1.6, zorder=4)
            )
            axes.annotate(
                f"{joint.name} {math.degrees(joint.home):.0f}°, ±{math.degrees(SEEK_BEYOND):.0f}°",
                axle, (8, -44), textcoords="offset points", color=PEAK, fontsize=12,
            )  # fmt: skip
            before = along
        sheet.arm(skeleton)
        at = ", ".join(f"{value + 0.0:.1f}" for value in skeleton[-1])
        axes.annotate(
            f"tip at {at} cm", tip, (10, 34), textcoords="offset points", color=INK, fontsize=12
        )
