"""Moves of the arm that tell where the table is in a picture: a job that is drawn with no pen.

They sweep the middle of what the joints can do, so that the tip comes to many places far apart,
and in space to several heights.  Pure but for the job's file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from robot.motion import kinematics, paths, trajectory
from shared import job
from shared.arm_description import Arm

NAME = "look around"
SPEED = 6.0
"""Of the tip, cm/s: slowly, so that it is known when it was where."""
SWEEP = math.radians(55)
"""The base or shoulder turns by so much to each side of the middle of its range, at the most."""
ROUNDS = 3
"""So many times to and fro."""
HEIGHTS = (2.0, 6.0, 10.0)
"""Of the tip of an arm in space, cm."""
RADII = (0.62, 0.92)
"""Between so many shares of its reach the tip goes out and in."""
LIMIT_MARGIN = math.radians(4)


def look_job(arm: Arm, file: Path) -> job.JobHeader:
    """Write the job of looking around to a file.

    Raises:
        ArmError: the arm cannot move like that.
    """
    strokes, t, length = [], 0.0, 0.0
    for way in _ways(arm):
        plans = trajectory.plan(arm, paths.polyline(way), min(SPEED, arm.speed))
        cm = sum(math.dist(a, b) for a, b in zip(way, way[1:], strict=False))
        strokes.append(job.Stroke("", round(cm, 3), round(t, 2), [p.numbers() for p in plans]))
        t += sum(plan.duration for plan in plans) + 1.0
        length += cm
    header: job.JobHeader = job.header_of(arm, NAME, min(SPEED, arm.speed), strokes, 0.0, t)
    job.write_job(str(file), header, strokes)
    return header


def _ways(arm: Arm) -> Iterator[list[tuple[float, ...]]]:
    """Yield ways of the tip, cm: out and in while the base or shoulder sweeps."""
    first = arm.joints[0]
    middle = min(max(0.0, first.lower + SWEEP), first.upper - SWEEP)
    middle = middle if first.upper - first.lower > 2 * SWEEP else (first.lower + first.upper) / 2
    half = min(SWEEP, (first.upper - first.lower) / 2 - LIMIT_MARGIN)
    _, reach = kinematics.reach(arm)
    for height in HEIGHTS if kinematics.coordinates(arm) == 3 else (None,):
        way: list[tuple[float, ...]] = []
        for k in range(2 * ROUNDS + 1):
            angle = middle + half * (k / ROUNDS - 1)
            for share in RADII if k % 2 else RADII[::-1]:
                p = share * reach * math.cos(angle), share * reach * math.sin(angle)
                point: tuple[float, ...] = p if height is None else (*p, height)
                if _is_easy(arm, point):
                    way.append(point)
        yield way


def _is_easy(arm: Arm, point: tuple[float, ...]) -> bool:
    try:
        kinematics.inverse(arm, point)
    except kinematics.Unreachable:
        return False
    return True
