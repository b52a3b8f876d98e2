"""Record of a calibration for a report: its figures, and every rest as raw data."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence

import numpy as np

from laptop.measure.arm.arm_result import Measured
from laptop.measure.arm.calibrating import Identified
from laptop.record.run import CALIBRATION, Ending, Run, settings, table
from laptop.see.table.camera_fit import Calibration

RESTS = "rests.csv"
"""File of all rests, in the run's folder."""


def calibration_run(
    done: Identified, rows: Sequence[Measured], camera: Calibration
) -> tuple[Run, dict[str, tuple[Callable[[str], None], str]]]:
    """Return the run of a calibration; and by name what writes its files, and what they hold.

    Args:
        done: the calibration.
        rows: of its table.
        camera: by which it was seen.
    """
    fit = done.fit
    values = {
        "poses": len(done.poses),
        "left over px": round(fit.rms, 3),
        "left over, to what is expected": round(fit.noise, 3),
        "the board's bar mm": camera.bar,
    }
    numbers = [
        [
            *(row.name, row.unit, round(row.was, 4)),
            *((None, None) if row.why else (round(row.found, 4), round(row.sigma, 4))),
            row.why or None,
        ]
        for row in rows
    ]
    headings = ["number", "unit", "was", "is", "standard uncertainty", "remark"]
    caption = "The arm's numbers: as its file had them, and as the camera found them"
    run = Run(
        kind=CALIBRATION,
        what="calibration of the arm",
        ending=Ending(0, "calibrated", round(done.seconds, 1)),
        tables=[table("numbers", caption, headings, numbers), settings(values)],
    )

    def write_rests(path: str) -> None:
        with open(path, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(rests_table(done))

    return run, {RESTS: (write_rests, "every rest as the camera saw it, and what the fit leaves")}


def rests_table(done: Identified) -> list[list[str]]:
    """Return each rest as each camera saw it, the headings first; "" where it saw nothing.

    `side` is the way by which a joint came there; `off` is what the fit leaves over.
    """
    fit, joint_states = done.fit, done.rests.joint_states
    joints = fit.model.arm.joints
    heading = ["pose", "t_s", "camera"]
    for joint in joints:
        heading += [f"{joint.name}_deg", f"{joint.name}_side"]
    table = [[*heading, "u_px", "v_px", "off_u_px", "off_v_px"]]
    for name in sorted(fit.model.cameras):
        pixels = done.rests.pixels[name]
        off = pixels - fit.model.pixels(fit.state, name, joint_states)
        for k, (t, q, sides) in enumerate(
            zip(done.times, joint_states.e, joint_states.sides, strict=True)
        ):
            row = [str(k + 1), f"{t:.2f}", name]
            for angle, side in zip(np.degrees(q), sides, strict=True):
                row += [f"{angle:.3f}", f"{side:.0f}"]
            seen = [*pixels[k], *off[k]]
            table.append(row + [f"{x:.3f}" if np.isfinite(x) else "" for x in seen])
    return table
