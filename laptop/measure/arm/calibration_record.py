"""What a calibration leaves for a report: its figures, and every rest as raw data."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from laptop.measure.arm.calibrating import Identified
from laptop.measure.arm.measured_numbers import Measured
from laptop.see.table.camera_fit import Calibration

KIND = "calibration"
"""By which a report knows it."""
RESTS = "rests.csv"
"""File of all rests, in the run's folder."""


def calibration_files(
    done: Identified, rows: Sequence[Measured], camera: Calibration, more: Mapping[str, Any]
) -> dict[str, Callable[[str], None] | dict[str, Any]]:
    """Return by the files' names what the summary holds, and what writes the rests at a path.

    Args:
        done: the calibration.
        rows: of its table.
        camera: by which it was seen.
        more: of the summary, such as the plant.
    """
    fit = done.fit
    summary = {
        "kind": KIND,
        "arm": fit.model.arm.name,
        "status": 0,
        "reason": "calibrated",
        **more,
        "poses": len(done.poses),
        "on_the_brick_s": round(done.seconds, 1),
        "left_over_px": round(fit.rms, 3),
        "left_over_to_expected": round(fit.noise, 3),
        "bar_mm": camera.bar,
        "numbers": [
            {
                "number": row.name,
                "unit": row.unit,
                "was": round(row.was, 4),
                "is": None if row.why else round(row.found, 4),
                "uncertainty": None if row.why else round(row.sigma, 4),
                "remark": row.why,
            }
            for row in rows
        ],
    }

    def tell_rests(path: str) -> None:
        with open(path, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(rests_table(done))

    return {"summary.json": summary, RESTS: tell_rests}


def rests_table(done: Identified) -> list[list[str]]:
    """Return each rest as each camera saw it, the headings first; "" where it saw nothing.

    `side` is the way by which a joint came there; `off` is what the fit leaves over.
    """
    fit, stood = done.fit, done.rests.stood
    joints = fit.model.arm.joints
    heading = ["pose", "t_s", "camera"]
    for joint in joints:
        heading += [f"{joint.name}_deg", f"{joint.name}_side"]
    table = [[*heading, "u_px", "v_px", "off_u_px", "off_v_px"]]
    for name in sorted(fit.model.cameras):
        pixels = done.rests.pixels[name]
        off = pixels - fit.model.pixels(fit.state, name, stood)
        for k, (t, q, sides) in enumerate(zip(done.times, stood.e, stood.sides, strict=True)):
            row = [str(k + 1), f"{t:.2f}", name]
            for angle, side in zip(np.degrees(q), sides, strict=True):
                row += [f"{angle:.3f}", f"{side:.0f}"]
            seen = [*pixels[k], *off[k]]
            table.append(row + [f"{x:.3f}" if np.isfinite(x) else "" for x in seen])
    return table
