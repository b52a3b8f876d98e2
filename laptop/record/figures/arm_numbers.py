"""An arm's numbers as a run stores them for its reports."""

from __future__ import annotations

import math
from typing import Any

from shared.arm_description import Arm


def numbers_of(arm: Arm) -> dict[str, Any]:
    """Return an arm's numbers for JSON, in its file's units: cm, degrees, cm/s, g.

    The path of its file on this computer is not among them.
    """
    return {
        "name": arm.name,
        "chain": arm.chain,
        "speed_cm_s": arm.speed,
        "joints": [
            {
                "name": joint.name,
                "link_cm": joint.link,
                "motor": joint.motor,
                "port": joint.port,
                "gear": joint.gear,
                "lower_deg": _degrees(joint.lower),
                "upper_deg": _degrees(joint.upper),
                "backlash_deg": _degrees(joint.backlash),
                "max_speed_deg_s": _degrees(joint.max_speed),
                "mass_g": round(1000 * joint.mass, 6),
            }
            for joint in arm.joints
        ],
        "pen": arm.pen and {"motor": arm.pen.motor, "port": arm.pen.port},
        "marker_offset_cm": list(arm.marker_offset),
    }


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), 6)
