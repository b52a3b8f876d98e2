"""The set-up of a report: the arms, as the runs' summaries or the arm files have them."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.report.findings import (
    NOT_THERE,
    DamagedRun,
    LabRun,
    LabTable,
    clean,
    clean_table,
)
from laptop.record.report.run_files import items, number, word
from shared.arm_description import ARMS_FOLDER, ArmError, read_arm
from shared.message_fields import MAX_JOINTS

HEADINGS = (
    *("joint", "link cm", "motor", "port", "gear", "from deg", "to deg", "backlash deg"),
    *("greatest deg/s", "mass g"),
)
_KEYS = ("lower_deg", "upper_deg", "backlash_deg", "max_speed_deg_s")


@dataclass(eq=False)
class DescribedArm:
    """An arm of some runs.

    Attributes:
        table: its joints, a row each.
        chain: of its joints, as the arm's file names it.
        source: where its numbers are from, in words.
        runs: whose arm it is.
    """

    table: LabTable
    chain: str
    source: str
    runs: list[LabRun] = field(default_factory=list)


def describe_arms(runs: Sequence[LabRun]) -> list[DescribedArm]:
    """Return the arms of runs, each once; where one cannot be told, that is a gap of its run."""
    found: list[tuple[tuple[Any, str], DescribedArm]] = []
    for run in runs:
        told = [(run.arm_numbers, SUMMARY), (run.built_numbers, BUILT)]
        if run.arm_numbers is None and run.arm:
            told[0] = (_coming_along(run.arm), COMES_ALONG)
            if told[0][0] is None:
                run.gaps.append(f"its files do not hold the numbers of its arm {run.arm}")
        for numbers, source in told:
            if numbers is None:
                continue
            for key, arm in found:
                if key == (numbers, source):
                    arm.runs.append(run)
                    break
            else:
                try:
                    described = describe(numbers, source)
                except DamagedRun as error:
                    run.gaps.append(clean(f"left out: {error}"))
                    continue
                described.runs.append(run)
                found.append(((numbers, source), described))
    return [arm for _, arm in found]


SUMMARY = "the runs' summary.json"
COMES_ALONG = "the arm file of that name that comes with BrickServo"
BUILT = "the runs' summary.json: the arm as the emulator had it built, unlike what the program knew"


def describe(numbers: dict[str, Any], source: str) -> DescribedArm:
    """Return an arm's numbers as a table.

    Raises:
        DamagedRun: they are not as they are written.
    """
    joints, rows = items(numbers, "joints", dict), []
    if len(joints) > MAX_JOINTS:
        raise DamagedRun(f"summary.json holds an arm of more than {MAX_JOINTS} joints")
    for joint in joints:
        joint = joint or {}
        cells = [word(joint, "name"), _number(joint, "link_cm"), word(joint, "motor")]
        cells += [word(joint, "port"), _number(joint, "gear")]
        mass = _number(joint, "mass_g") if joint.get("mass_g") else NOT_THERE  # 0: not known
        rows.append([*cells, *(_number(joint, key) for key in _KEYS), mass])
    # (Each by itself: between two paths in a line the words would go, too.)
    name, speed = clean(word(numbers, "name")), _number(numbers, "speed_cm_s")
    caption = f"The arm {name}: draws at {speed} cm/s"
    pen = numbers.get("pen")
    if isinstance(pen, dict):
        motor, port = (clean(word(pen, key)) for key in ("motor", "port"))
        caption += f", pen by a {motor} motor at port {port}"
    else:
        caption += ", no pen motor"
    chain = word(numbers, "chain")
    if not rows:
        raise DamagedRun(f"summary.json holds no joint of the arm {name}")
    return DescribedArm(clean_table(LabTable(caption, HEADINGS, rows)), chain, source)


def _coming_along(name: str) -> dict[str, Any] | None:
    """Return the numbers of an arm that comes with the programs; None if there is none so named."""
    if not re.fullmatch(r"\w+", name):
        return None
    file = os.path.join(ARMS_FOLDER, name + ".ini")
    try:
        return numbers_of(read_arm(file)) if os.path.exists(file) else None
    except ArmError:
        return None


def _number(values: dict[str, Any], key: str) -> str:
    value = number(values, key)
    return NOT_THERE if value is None else f"{value:g}".replace("-", "\u2212")
