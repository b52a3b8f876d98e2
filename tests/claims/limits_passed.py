"""How far joints were beyond their limits."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from shared.arm_description import Arm


def beyond_limits(arm: Arm, poses: Iterable[Sequence[float]]) -> float:
    """By how much a joint was beyond its limit at most, deg; negative: how far from it.

    Args:
        arm: whose limits.
        poses: its joints' angles, rad.
    """
    return math.degrees(
        max(
            max(joint.lower - angle, angle - joint.upper)
            for pose in poses
            for joint, angle in zip(arm.joints, pose, strict=True)
        )
    )
