"""Recent angles of the joints, as the brick reports them, and the marker's place.  Pure.

The tip's marker is not where the pen is: `marker_offset` of the arm's file says how far off it sits
on the last link.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from robot.motion import kinematics
from shared.arm_description import Arm

MAX_GAP = 1.0
"""Longest gap between two reports of the joints, s; the angles within a longer one are unknown."""
DURATION = 20.0
"""Time for which the joints' angles are stored, s."""

Joints = Callable[[], tuple[float, Sequence[float]] | None]
"""Reports the joints' last angles, rad, and their time, s; None: the brick has not reported any."""


def marker_shift(arm: Arm, q: Sequence[float]) -> tuple[float, ...]:
    """Return the vector from the pen's tip to the marker with the joints at q (rad), cm.

    As many numbers as a point of this arm has.  In space the last link's y points upwards.
    """
    along, across = arm.marker_offset
    if kinematics.coordinates(arm) == 2:
        heading = sum(q)
        c, s = math.cos(heading), math.sin(heading)
        return along * c - across * s, along * s + across * c
    pitch = sum(q[1:])
    out = along * math.cos(pitch) - across * math.sin(pitch)
    up = along * math.sin(pitch) + across * math.cos(pitch)
    return out * math.cos(q[0]), out * math.sin(q[0]), up


def marker_place(arm: Arm, q: Sequence[float]) -> tuple[float, ...]:
    """Return the marker's place with the joints at q (rad), cm in the arm's frame."""
    pen = kinematics.forward(arm, q)
    return tuple(p + off for p, off in zip(pen, marker_shift(arm, q), strict=True))


class JointTrack:
    """Angles of the joints by time."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, Sequence[float]]] = deque()

    def add(self, t: float, q: Sequence[float]) -> None:
        """Store that the joints were at q (rad) at t (s)."""
        if self._samples and t <= self._samples[-1][0]:
            return
        self._samples.append((t, q))
        while self._samples[0][0] < t - DURATION:
            self._samples.popleft()

    def at(self, t: float) -> tuple[float, ...] | None:
        """Return the angles at t (s), rad, interpolated; None: there is no report of about then.

        What comes after the last word is not known yet, either.
        """
        after = None
        for time, q in reversed(self._samples):
            if time <= t:
                if after is None:
                    return tuple(q) if time == t else None
                if after[0] - time > MAX_GAP:
                    return None
                share = (t - time) / (after[0] - time)
                return tuple(a + share * (b - a) for a, b in zip(q, after[1], strict=True))
            after = time, q
        return None
