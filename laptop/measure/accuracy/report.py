"""Results of a test, for people and for programs: lines, a CSV, a run."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping

import numpy as np

from laptop.measure.accuracy.accuracy_test import AccuracyResult
from laptop.measure.accuracy.criteria import MM
from laptop.measure.accuracy.plan import AccuracyPlan
from laptop.record.run import ACCURACY, Ending, Run, settings
from laptop.record.run import table as run_table

STANDARD = "ISO 9283:1998"
MEANINGS = {
    "AP": "pose accuracy",
    "RP": "pose repeatability",
    "vAP": "multi-directional pose accuracy variation",
    "AD": "distance accuracy",
    "RD": "distance repeatability",
    "AT": "path accuracy",
    "RT": "path repeatability",
}


def describe_plan(plan: AccuracyPlan) -> str:
    """Say what will be done, in a line."""
    place = ", ".join(f"{c:g}" for c in plan.centre)
    what = "square" if len(plan.centre) == 2 else "cube"
    return (
        f"a {what} of {plan.side:g} cm around ({place}) cm: five poses and {len(plan.directions)} "
        f"directions, {plan.cycles} cycles each; a line and a circle at three speeds, "
        f"{plan.path_cycles} cycles each"
    )


def table(
    result: AccuracyResult, truth: Mapping[str, float] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows of the table to cite.

    Args:
        result: of the test.
        truth: by name, mm, where somebody knows it.
    """
    rows = []
    for one in result.criteria:
        sign = "\u00b1" if one.name.startswith("RD") else ""
        cells = [f"{sign}{one.mm:.2f}", f"{2 * one.u_mm:.2f}"]
        rows.append(
            [
                *(one.name, MEANINGS[one.name.split()[0]], *cells),
                *([f"{truth[one.name]:.2f}"] if truth else []),
            ]
        )
    return ["", STANDARD, "mm", "U mm", *(["truth mm"] if truth else [])], rows


def notes(result: AccuracyResult) -> list[str]:
    """Return what has to be said with the figures, a line each."""
    cameras = ", ".join(f"{name} {sigma:.2f} px" for name, sigma in result.sigma.items())
    single, rest = result.noise_mm
    out = [
        f"camera noise, taken off: {cameras} in one picture; {single:.2f} mm on a path, {rest:.2f} "
        "mm at a rest (sigma along an axis)",
        "U: expanded uncertainty (k = 2) by the camera's noise and its calibration; that another "
        f"{result.plan.cycles} cycles give other figures is not in it",
    ]
    if result.is_fitted:
        out.append(
            "how the arm stands on the board was fitted to the poses, so an error that all poses "
            "share, such as a turned zero of the first joint, is not in AP, AT: give --arm-at"
        )
    else:
        out.append(
            "how exactly the arm's place on the board is known (--arm-at) is not in U: by what "
            "that is off AP and AT may be off, too"
        )
    if any(one.mm < 2 * one.u_mm for one in result.criteria if one.name[:2] in ("RP", "RT", "RD")):
        out.append(
            "what repeats better than the camera sees has a U as large as itself: bring the camera "
            "nearer, or light the marker better"
        )
    return out


def accuracy_run(result: AccuracyResult, truth: Mapping[str, float] | None = None) -> Run:
    """Return the run of a test.

    Args:
        result: of the test.
        truth: by name, mm, where somebody knows it.
    """
    plan = result.plan
    criteria = [
        [one.name, MEANINGS[one.name.split()[0]], round(one.mm, 4), round(2 * one.u_mm, 4)]
        + ([round(truth[one.name], 4)] if truth else [])
        for one in result.criteria
    ]
    headings = ["criterion", "meaning", "value mm", "expanded uncertainty mm"]
    caption = "What was measured, with its expanded uncertainty (k = 2)"
    values = {
        "standard": STANDARD,
        "cycles of a pose": plan.cycles,
        "cycles of a path": plan.path_cycles,
        "side of the square or cube cm": plan.side,
        "its centre, cm": ", ".join(f"{round(float(c), 3):g}" for c in plan.centre),
        "speed cm/s": plan.arm.speed,
        "the arm's place was fitted": result.is_fitted,
        "the arm's x on the board cm": round(result.arm_pose.base[0], 3),
        "the arm's y on the board cm": round(result.arm_pose.base[1], 3),
        "the arm's turn on the board deg": round(math.degrees(result.arm_pose.turn), 3),
        **{f"noise of camera {name} px": round(s, 4) for name, s in result.sigma.items()},
        "noise of a point of a path mm": round(result.noise_mm[0], 4),
        "noise of a rest mm": round(result.noise_mm[1], 4),
    }
    return Run(
        kind=ACCURACY,
        what="accuracy and repeatability",
        ending=Ending(0, "ended"),
        tables=[
            run_table("criteria", caption, headings + ["true mm"] * bool(truth), criteria),
            settings(values),
        ],
    )


def write_csv(file: str | os.PathLike[str], result: AccuracyResult) -> None:
    """Write where the tip was in each cycle: what all figures come from.

    Of a pose x, y and z are in the arm's frame; of a path they are across it, at `along_cm`.  The
    camera's noise is still in them.

    Raises:
        OSError: as the system says it.
    """
    with open(file, "w", newline="", encoding="utf-8") as out:
        table = csv.writer(out)
        table.writerow(
            ["of", "plane", "along_cm", "cycle", "first_mm", "second_mm", "third_mm", "sigma_mm"]
        )
        for name, one in result.observed.items():
            sigma = MM * np.sqrt(np.trace(one.noise, axis1=1, axis2=2) / one.noise.shape[1])
            for plane, (values, at, s) in enumerate(zip(one.values, one.at, sigma, strict=True), 1):
                for cycle, value in enumerate(MM * values, 1):
                    numbers = [f"{x:.4f}" for x in value] + [""] * (3 - len(value))
                    table.writerow([name, plane, f"{at:.3f}", cycle, *numbers, f"{s:.4f}"])
