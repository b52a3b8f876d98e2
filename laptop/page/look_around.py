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
TIP_SPEED = 6.0
"""Speed of the tip, cm/s: slow, so that its place at a time is well known."""
SWEEP_ANGLE = math.radians(55)
"""Greatest turn of the base or shoulder to each side of the middle of its range, rad."""
SWEEPS = {2: 3, 3: 2}
"""Number of sweeps to and fro, by the number of a point's coordinates."""
TIP_HEIGHTS = (2.5, 9.0)
"""Heights of the tip of an arm in space, cm: all sweeps at each."""
REACH_SHARES = (0.62, 0.92)
"""Shares of its reach between which the tip goes out and in."""
Point = tuple[float, ...]
"""A place of the tip, cm."""
LIMIT_MARGIN = math.radians(4)


def survey_job(arm: Arm, file: Path) -> job.JobHeader:
    """Write the job of looking around to a file.

    Raises:
        ArmError: the arm cannot move like that.
    """
    strokes, t, length = [], 0.0, 0.0
    for path in _sweep_paths(arm):
        path, plans = _planned(arm, path)
        cm = sum(math.dist(a, b) for a, b in zip(path, path[1:], strict=False))
        strokes.append(job.Stroke("", round(cm, 3), round(t, 2), [p.numbers() for p in plans]))
        t += sum(plan.duration for plan in plans) + 1.0
        length += cm
    header: job.JobHeader = job.header_of(arm, NAME, min(TIP_SPEED, arm.speed), strokes, 0.0, t)
    job.write_job(str(file), header, strokes)
    return header


def _sweep_paths(arm: Arm) -> Iterator[list[Point]]:
    """Yield paths of the tip, cm: out and in while the base or shoulder sweeps."""
    first = arm.joints[0]
    middle = min(max(0.0, first.lower + SWEEP_ANGLE), first.upper - SWEEP_ANGLE)
    middle = (
        middle if first.upper - first.lower > 2 * SWEEP_ANGLE else (first.lower + first.upper) / 2
    )
    half = min(SWEEP_ANGLE, (first.upper - first.lower) / 2 - LIMIT_MARGIN)
    _, reach = kinematics.reach(arm)
    coordinates = kinematics.coordinates(arm)
    rounds = SWEEPS[coordinates]
    for height in TIP_HEIGHTS if coordinates == 3 else (None,):
        path: list[Point] = []
        for k in range(2 * rounds + 1):
            angle = middle + half * (k / rounds - 1)
            for share in REACH_SHARES if k % 2 else REACH_SHARES[::-1]:
                p = share * reach * math.cos(angle), share * reach * math.sin(angle)
                path.append(p if height is None else (*p, height))
        yield path


def _planned(arm: Arm, path: list[Point]) -> tuple[list[Point], list[trajectory.Trajectory]]:
    """Return what of a way can be gone with the elbow bent one way, and how: the more of both.

    Raises:
        kinematics.Unreachable: next to nothing of it can.
    """
    best: tuple[list[Point], list[trajectory.Trajectory]] = ([], [])
    why = None
    for elbow in ("up", "down"):
        reachable = [point for point in path if _is_there(arm, point, elbow)]
        if len(reachable) <= max(2, len(best[0])):
            continue
        try:
            best = (
                reachable,
                trajectory.plan(arm, paths.polyline(reachable), min(TIP_SPEED, arm.speed), elbow),
            )
        except kinematics.Unreachable as error:
            why = error
    if not best[0]:
        raise why or kinematics.Unreachable("it reaches next to nothing within its joints' limits")
    return best


def _is_there(arm: Arm, point: Point, elbow: str) -> bool:
    try:
        kinematics.inverse(arm, point, elbow)
    except kinematics.Unreachable:
        return False
    return True
