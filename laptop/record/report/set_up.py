"""The set-up of a report: the arms, as the runs or the arm files have them."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.names import RUN
from laptop.record.report.report_run import NO_VALUE, ReportRun, TextTable, clean
from laptop.record.run import MAX_NUMBER, DamagedRun
from shared.arm_description import ARMS_FOLDER, ArmError, read_arm
from shared.message_fields import MAX_JOINTS

HEADINGS = (
    *("joint", "link cm", "motor", "port", "gear", "from deg", "to deg", "backlash deg"),
    *("greatest deg/s", "mass g"),
)
"""Headings of the table of joints."""
_KEYS = ("lower_deg", "upper_deg", "backlash_deg", "max_speed_deg_s")


@dataclass(eq=False)
class DescribedArm:
    """An arm of some runs.

    Attributes:
        table: its joints, a row each.
        chain: of its joints, as the arm's file names it.
        reported_by: source of its numbers, in words -> the runs that have them from there.
    """

    table: TextTable
    chain: str
    reported_by: dict[str, list[ReportRun]] = field(default_factory=dict)

    @property
    def runs(self) -> list[ReportRun]:
        """Runs with this arm."""
        return list(dict.fromkeys(run for runs in self.reported_by.values() for run in runs))

    @property
    def source(self) -> str:
        """Source of its numbers, in words; by run where there are several."""
        if len(self.reported_by) == 1:
            return next(iter(self.reported_by))
        labels = {
            source: ", ".join(run.label for run in runs)
            for source, runs in self.reported_by.items()
        }
        return "; ".join(f"{runs}: {source}" for source, runs in labels.items())


def describe_arms(runs: Sequence[ReportRun]) -> list[DescribedArm]:
    """Return the arms of runs, each once; an unknown one is a gap of its run."""
    found: dict[str, DescribedArm] = {}
    for run in runs:
        sources = [(run.run.arm, RECORD), (run.run.built, BUILT)]
        if run.run.arm is not None and "joints" not in run.run.arm:
            sources[0] = (_coming_along(str(run.run.arm.get("name"))), COMES_ALONG)
            if sources[0][0] is None:
                run.gaps.append(f"its files do not hold the numbers of its arm {run.arm}")
        for numbers, source in sources:
            if numbers is None:
                continue
            key = json.dumps(numbers, sort_keys=True)
            try:
                arm = found.get(key) or describe(numbers)
            except DamagedRun as error:
                run.leave_out(error)
                continue
            found[key] = arm
            arm.reported_by.setdefault(source, []).append(run)
    return [*found.values()]


RECORD = f"the runs' {RUN}"
COMES_ALONG = "the arm file of that name that comes with BrickServo"
BUILT = f"{RECORD}: the arm as the emulator had it built, unlike what the program knew"


def describe(numbers: dict[str, Any]) -> DescribedArm:
    """Return an arm's numbers as a table.

    Raises:
        DamagedRun: they are not as they are written.
    """
    joints, rows = numbers.get("joints"), []
    if not isinstance(joints, list) or not all(isinstance(joint, dict) for joint in joints):
        raise DamagedRun(f"{RUN} holds no joints of the arm as they are written")
    if len(joints) > MAX_JOINTS:
        raise DamagedRun(f"run.json holds an arm of more than {MAX_JOINTS} joints")
    for joint in joints:
        cells = [_text(joint, "name"), _number(joint, "link_cm"), _text(joint, "motor")]
        cells += [_text(joint, "port"), _number(joint, "gear")]
        mass = _number(joint, "mass_g") if joint.get("mass_g") else NO_VALUE  # 0: not known
        rows.append([*map(clean, cells), *(_number(joint, key) for key in _KEYS), mass])
    # (Each by itself: between two paths in a line the words would go, too.)
    name, speed = clean(_text(numbers, "name")), _number(numbers, "speed_cm_s")
    caption = f"The arm {name}: draws at {speed} cm/s"
    pen = numbers.get("pen")
    if isinstance(pen, dict):
        motor, port = (clean(_text(pen, key)) for key in ("motor", "port"))
        caption += f", pen by a {motor} motor at port {port}"
    else:
        caption += ", no pen motor"
    chain = _text(numbers, "chain")
    if not rows:
        raise DamagedRun(f"run.json holds no joint of the arm {name}")
    return DescribedArm(TextTable("arm", caption, HEADINGS, rows), chain)


def _coming_along(name: str) -> dict[str, Any] | None:
    """Return the numbers of an arm that comes with the programs; None if there is none so named."""
    if not re.fullmatch(r"\w+", name):
        return None
    file = os.path.join(ARMS_FOLDER, name + ".ini")
    try:
        return numbers_of(read_arm(file)) if os.path.exists(file) else None
    except ArmError:
        return None


def _text(values: dict[str, Any], key: str) -> str:
    value = values.get(key)
    if value is not None and not isinstance(value, str):
        raise DamagedRun(f"{RUN}: '{key}' of the arm is no text; do this run again")
    return value or ""


def _number(values: dict[str, Any], key: str) -> str:
    value = values.get(key)
    if value is None:
        return NO_VALUE
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not abs(value) <= MAX_NUMBER:
        raise DamagedRun(f"{RUN}: '{key}' of the arm is no number; do this run again")
    return f"{value:g}".replace("-", "\u2212")
