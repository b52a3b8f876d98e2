"""Height of an arm's marker over the paper: its source, and its memory.

By it the page knows where the paper is, on which the ink lies, below the marker that cameras see.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from laptop.system.files import write_whole
from shared.arm_description import Arm
from shared.config_files import InvalidFile, number, read_json

HEIGHTS_FILE = "heights.json"
"""File in the state folder, of the page alone, so that the brick does not read its name."""
HEIGHT_LIMITS_MM = 0.0, 500.0
"""Limits of a height that is typed, mm."""


class MarkerHeight(NamedTuple):
    """Height of the arm's marker over the paper.

    cm      None: it is not known
    source  who says so, for people
    sigma   standard deviation, cm; 0: it was not measured here
    """

    cm: float | None = None
    source: str = ""
    sigma: float = 0.0


def given_height(mm: float | None, emulated: Mapping[str, Any]) -> MarkerHeight | None:
    """Return the initial height of the marker; None: there is none.

    Args:
        mm: of --marker-height.
        emulated: constants of the emulated arm that the camera sees; {}: it sees a real one.
    """
    if mm is not None:
        return MarkerHeight(mm / 10, "as --marker-height says")
    if "marker_height" in emulated:
        return MarkerHeight(float(emulated["marker_height"]), "as the emulated arm is built")
    return None


class HeightMemory:
    """Remembers heights that people have typed, by the arm's name.

    Args:
        file: that keeps them; None: nothing is kept.
        arm: its name.
    """

    def __init__(self, file: Path | None, arm: str) -> None:
        self._file, self._arm = file, arm

    def read(self) -> MarkerHeight:
        """Return what was typed last."""
        with suppress(KeyError, InvalidFile):
            mm = number(self._all()[self._arm])
            if HEIGHT_LIMITS_MM[0] <= mm <= HEIGHT_LIMITS_MM[1]:
                return MarkerHeight(mm / 10, "as typed here before")
        return MarkerHeight()

    def write(self, cm: float | None) -> str:
        """Store a typed height; return why it cannot be stored, or ""."""
        if self._file is None:
            return ""
        known = self._all()
        known.pop(self._arm, None)
        if cm is not None:
            known[self._arm] = round(10 * cm, 2)
        try:
            self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._file, json.dumps(known, indent=1).encode())
        except OSError as error:
            return f"the height is used, but not kept: {self._file}: {error.strerror}"
        return ""

    def _all(self) -> dict[str, object]:
        if self._file is not None:
            with suppress(OSError, InvalidFile):
                return dict(read_json(self._file))
        return {}


class DrawingArm(NamedTuple):
    """The arm that draws before the page's cameras.

    arm     None: it is not known, and nothing can be drawn
    height  of its marker over the paper, if that is told from the beginning
    memory  of heights that people type; None: they are not kept
    """

    arm: Arm | None = None
    height: MarkerHeight | None = None
    memory: HeightMemory | None = None


UNKNOWN_ARM = DrawingArm()
