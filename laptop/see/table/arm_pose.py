"""The pen's place, by the marker that a camera sees and the arm's pose on the board.

The marker is a point of the last link.  So where it is tells how the joints must stand, by the
inverse kinematics of an arm whose last link ends there, and thereby where the pen is beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from laptop.see.table.marker_offset import BadTouches, MarkerFit
from laptop.see.table.plane_motion import rotation
from robot.motion import kinematics
from shared.arm_description import Arm, ArmError

SLACK, SLACK_ANGLE = 0.3, math.radians(3)
"""Distance, cm, and angle, rad, by which the marker may be seen beyond what links and limits allow.
"""

Point = tuple[float, float]
"""A place (x, y), cm."""


class ArmPose:
    """An arm on the board.

    Args:
        fit: what touching the board's crosses gave.
        arm: in a plane.

    Attributes:
        height: of the marker over the board, cm.

    Raises:
        BadTouches: the arm moves in space.
    """

    def __init__(self, fit: MarkerFit, arm: Arm) -> None:
        if kinematics.coordinates(arm) != 2:
            raise BadTouches(
                f"touched crosses tell of arms in a plane, and {arm.name} moves in space; "
                "leave --touched out, or name the arm by BRICKSERVO_ARM"
            )
        self._fit = fit
        self.height = fit.height
        self.turn = rotation(fit.turn)
        last = arm.joints[-1]
        # In the arm's own measure, as the links are.
        along, left = fit.offset / fit.scale
        length = math.hypot(last.link + along, left)
        self._bend = math.atan2(left, last.link + along)
        ends = [joint._replace(lower=joint.lower - SLACK_ANGLE, upper=joint.upper + SLACK_ANGLE)
                for joint in arm.joints]  # fmt: skip
        ends[-1] = ends[-1]._replace(
            link=length, lower=ends[-1].lower + self._bend, upper=ends[-1].upper + self._bend
        )
        self._to_marker = arm._replace(joints=tuple(ends))
        self._reach = kinematics.reach(self._to_marker)

    def in_arm(self, place: Point) -> Point:
        """Return a place on the board, cm, in the arm's frame."""
        x, y = (np.array(place) - self._fit.base) @ self.turn / self._fit.scale
        return float(x), float(y)

    def pen(self, marker: Point, q: Sequence[float] | None = None) -> Point | None:
        """Return the pen's place on the board, cm; None: no pose of the arm puts the marker there.

        Args:
            marker: where that is on the board, cm.
            q: about how the joints stand, rad, if that is known: where both ways of bending the
                elbow are possible, it says which; otherwise the arm's usual one is.
        """
        x, y = self.in_arm(marker)
        far = math.hypot(x, y)
        # A stretched arm is seen a little beyond its reach as often as a little within.
        within = min(max(far, self._reach[0]), self._reach[1])
        if abs(within - far) > SLACK or not far:
            return None
        try:
            poses = kinematics.branches(self._to_marker, (x * within / far, y * within / far))
        except ArmError:
            return None
        if not poses:
            return None
        pose = (
            poses[0] if q is None else min(poses, key=lambda one: abs(one[-1] - self._bend - q[-1]))
        )
        off = rotation(self._fit.turn + sum(pose) - self._bend) @ self._fit.offset
        return float(marker[0] - off[0]), float(marker[1] - off[1])
