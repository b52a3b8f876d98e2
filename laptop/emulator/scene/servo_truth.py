"""The truth about a run of the servo, from the emulator's record."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from laptop.emulator.scene.camera_rig import CameraRig, Vector, slope
from laptop.record.servo.servo_log import Log
from laptop.record.servo.servo_run import Space, Truth

PATH_SPACING = 0.2
"""Distance between the stored points of the true path, px."""
STILL_ANGLE = 1e-4
"""Motion of a joint below which it has not moved, rad."""
MIN_REST_TIME = 0.05
"""Shortest rest whose end is stored, s."""


class TruePose(Protocol):
    """A sample of a record: s, true joint angles (rad)."""

    @property
    def t(self) -> float:
        """Time of the sample, s."""

    @property
    def q(self) -> Vector:
        """True joint angles, rad."""


def truth_of(
    rig: CameraRig,
    rows: Sequence[TruePose],
    log: Log,
    began: float,
    goal: Sequence[float] | None = None,
) -> Truth:
    """Return the truth about a run.

    Args:
        rig: the cameras.
        rows: of the emulator's record, on its clock.
        log: the servo's.
        began: when its clock said 0, on the emulator's clock, s.
        goal: its true place, u and v in each picture, px; None: as the servo last had it, which
            for a marker is where the tracker saw it.
    """
    path = true_path(rig, rows)
    ended = began + (log.verdict or {}).get("t", math.inf)
    last = next((row for row in reversed(rows) if row.t <= ended), rows[0])
    wanted = tuple(goal) if goal is not None else _last_goal(rig, log)
    place = rig.place_at(wanted, "effector")
    return Truth(
        tuple(rig),
        wanted,
        np.array([(t - began, *rig.truth(q)) for t, q in path]),
        10 * math.dist(rig.centre("effector", last.q), place),
        _space(rig, path, place) if len(rig) > 1 else None,
    )


def _last_goal(rig: CameraRig, log: Log) -> Vector:
    steps = [step for step in log.steps if step.get("goal") is not None]
    reported = dict(zip(steps[-1]["rows"], steps[-1]["goal"], strict=True))
    return tuple(float(reported[f"{camera}.{axis}"]) for camera in rig for axis in "uv")


def _space(rig: CameraRig, path: Sequence[tuple[float, Vector]], place: Vector) -> Space:
    """Return the path in space.

    A px is worth the greatest distance, mm, of places near the goal that are 1 px apart in the
    pictures: that is in the direction in which the cameras together measure worst.
    """
    singular = np.linalg.svd(slope(rig.project, place), compute_uv=False)
    tips = np.array([rig.centre("effector", q) for _, q in path])
    return Space(place, tips, 10 / float(singular[-1]))


def true_path(rig: CameraRig, rows: Sequence[TruePose]) -> list[tuple[float, Vector]]:
    """Return times (s) and true joint angles (rad) between which pictures show straight lines."""
    stored = rows[0]
    place = rig.truth(stored.q)
    path = [(stored.t, stored.q)]
    for left, (before, row) in zip(
        reversed(range(len(rows) - 1)), itertools.pairwise(rows), strict=True
    ):
        if left and max(map(abs, np.subtract(row.q, stored.q))) < STILL_ANGLE:
            continue
        here = rig.truth(row.q)
        if not left or math.dist(here, place) > PATH_SPACING:
            if before.t - stored.t > MIN_REST_TIME:
                path.append((before.t, stored.q))
            path.append((row.t, row.q))
            stored, place = row, here
    return path
