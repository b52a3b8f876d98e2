"""Learned offsets on file, by path and arm.

A file for each path of each arm, in the folder `learned` of the state folder. What is learned holds
for the arm as it was described then: with other numbers only what was missed is compared.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.drawing.preparing import DrawingPlan
from laptop.measure.ilc.learning import Offsets
from laptop.measure.ilc.trials import DrawingLearner, DrawingOffsets, LearningResult
from laptop.system.files import write_whole
from shared.arm_description import Arm
from shared.config_files import InvalidFile, number, read_text
from shared.state import LEARNED_FOLDER, state_folder

MAX_FILE_BYTES = 16_000_000
"""Greatest size of such a file, bytes."""

FORMAT_VERSION = 1
"""Version of the file's format; it rises when something in it changes its meaning."""


@dataclass(frozen=True, eq=False)
class StoredOffsets:
    """Stored offsets of a path that was learned before.

    offsets     with which to draw it; None: the arm is described otherwise now
    trials      how many that took
    without_mm  rms of what was missed before anything was learned
    left_mm     the same in the last trial
    """

    offsets: DrawingOffsets | None
    trials: int
    without_mm: float
    left_mm: float


def find(
    plan: DrawingPlan, emulated: str = "", notes: list[str] | None = None
) -> StoredOffsets | None:
    """Return what was learned of a drawing's path by its arm, or None.

    Args:
        plan: the drawing.
        emulated: which emulated arm, each of which is another one; "": the real one.
        notes: takes a sentence where a file is there that cannot be read.
    """
    file = file_of(plan, emulated)
    try:
        stored = json.loads(read_text(str(file), MAX_FILE_BYTES))
        if stored["format"] != FORMAT_VERSION:
            raise InvalidFile("is of another version")
        offsets = None
        if stored["arm"] == _digest(_numbers(plan.arm)):
            offsets = _read_offsets(plan, stored["offsets"])
        numbers = [number(stored[key]) for key in ("without_mm", "left_mm")]
        return StoredOffsets(offsets, int(stored["rehearsals"]), *numbers)
    except FileNotFoundError:
        return None
    except (
        OSError,
        InvalidFile,
        ValueError,
        LookupError,
        TypeError,
        OverflowError,
        RecursionError,
    ):
        if notes is not None:
            notes.append(f"{file} is spoilt: what was learned before is not known; it is replaced")
        return None


def store(
    plan: DrawingPlan,
    learned: LearningResult,
    emulated: str = "",
    before: StoredOffsets | None = None,
) -> Path:
    """Store what was learned of a drawing on file; return where.

    Args:
        plan: the drawing.
        learned: of it.
        emulated: as for `find`.
        before: what was known of it, if it began with that.

    Raises:
        OSError: as the system says it.
    """
    continued = before is not None and before.offsets is not None
    without = before.without_mm if before and continued else learned.steps[0].rms_mm
    stored = {
        "format": FORMAT_VERSION,
        "drawing": plan.name,
        "arm": _digest(_numbers(plan.arm)),
        "rehearsals": len(learned.steps) + (before.trials if before and continued else 0),
        "without_mm": round(without, 3),
        "left_mm": round(min(step.rms_mm for step in learned.steps), 3),
        "offsets": learned.numbers(),
    }
    file = file_of(plan, emulated)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, json.dumps(stored).encode())
    return file


def file_of(plan: DrawingPlan, emulated: str = "") -> Path:
    """Return the file for what is learned of a drawing."""
    path = [
        plan.arm.name,
        emulated,
        round(plan.speed, 6),
        round(plan.options.height, 6),
        [np.round(stroke.placed.points, 4).tolist() for stroke in plan.strokes],
        [stroke.posture for stroke in plan.strokes],
    ]
    return Path(state_folder()) / LEARNED_FOLDER / f"{_digest(path)}.json"


def _numbers(arm: Arm) -> object:
    """All of an arm that its motion depends on."""
    return [arm.chain, [list(joint) for joint in arm.joints], arm.elbow, list(arm.marker_offset)]


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()[:32]


def _read_offsets(plan: DrawingPlan, stored: Sequence[Sequence[tuple[Any, Any]]]) -> DrawingOffsets:
    """Offsets of a file, which are those of the drawing's pieces."""
    offsets = []
    for own, paths in zip(stored, DrawingLearner(plan).paths, strict=True):
        pieces = []
        for (s, by_joint), path in zip(own, paths, strict=True):
            q = np.array([[number(value) for value in joint] for joint in by_joint]).T
            places = np.array([number(value) for value in s])
            if (
                q.shape != (len(places), path.turns.shape[2])
                or abs(places[-1] - path.length) > 0.01
            ):
                raise InvalidFile("is of another path")
            pieces.append(Offsets(places, q))
        offsets.append(pieces)
    return offsets
