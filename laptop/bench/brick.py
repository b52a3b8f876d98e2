"""The emulated brick's computing beside the real Python's: `robot/bench_brick.py` on both.

On CPython 3.5.3, built soft-float for an ARM926, instructions were counted; on the emulated brick
seconds of its clock are taken, and an instruction takes SECONDS.
"""

from __future__ import annotations

import contextlib
import json
import os
import statistics
import tempfile
from collections.abc import Iterator
from typing import NamedTuple

from laptop.simulator import session
from laptop.simulator.plant import read_plant
from laptop.simulator.processor import SECONDS
from shared.arm_description import find_arm, read_arm

ROBOT = os.path.join(os.path.dirname(__file__), "..", "..", "robot")

COUNTED: dict[str, tuple[float, float]] = {
    "decode an observation": (169, 169),
    "planar: planning a line": (78218, 78218),
    "planar: inverse": (157, 157),
    "planar: tick, moving": (594, 1334),
    "planar: tick, line": (803, 1242),
    "read position": (22.4, 22.4),
    "write speed_sp": (26.6, 26.6),
    "write command": (24.3, 24.3),
    "planar, look: tick": (1178, 26641),
    "planar, look: decision, explore": (2730, 2730),
    "planar, look: learning from a frame": (339, 485),
    "planar, look: decision, move": (2521, 24420),
    "planar, look: decision, end": (1096, 1096),
    "planar, stream: tick": (1231, 26664),
    "planar, stream: decision, explore": (2732, 2732),
    "planar, stream: learning from a frame": (354, 480),
    "planar, stream: decision, move": (24417, 24417),
    "planar, stream: steering by a frame": (1575, 3325),
    "planar, stream: decision, end": (1092, 1092),
    "a full collection": (6552, 6552),
    "spatial: planning a line": (137483, 137483),
    "spatial: inverse": (328, 328),
    "spatial: tick, moving": (809, 4695),
    "spatial: tick, line": (1151, 11796),
    "spatial, look: tick": (1651, 69609),
    "spatial, look: decision, explore": (8488, 9559),
    "spatial, look: learning from a frame": (393, 911),
    "spatial, look: decision, move": (8807, 66058),
    "spatial, look: decision, end": (7214, 7214),
    "spatial, stream: tick": (1878, 69626),
    "spatial, stream: decision, explore": (8496, 9559),
    "spatial, stream: learning from a frame": (353, 907),
    "spatial, stream: decision, move": (66072, 66072),
    "spatial, stream: steering by a frame": (3315, 7691),
    "spatial, stream: decision, end": (7217, 7217),
}
"""Thousand instructions on CPython 3.5.3: the median and the greatest; of what is called again and
again, the median alone.  To be counted anew where the code changes: `--marks` says of what."""

STARTS = {
    "driver.py inverse 10,5": 228691,
    "driver.py line 1,1": 218045,
    "visual_servoing.py --budget none": 283049,
    "tracking_client.py --seconds none": 227608,
}
"""The same of whole programs, from the start of Python to its end: those that need no brick."""


class Row(NamedTuple):
    """One piece of work: thousand instructions as counted, and as the emulated brick has them."""

    what: str
    counted: float
    emulated: float

    @property
    def ratio(self) -> float:
        """Emulated by counted."""
        return self.emulated / self.counted


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    """Nobody wants to read what a script says."""
    with (
        open(os.devnull, "w") as nobody,
        contextlib.redirect_stdout(nobody),
        contextlib.redirect_stderr(nobody),
    ):
        yield


def _told(median: float, greatest: float) -> bool:
    """Whether the greatest is worth a row of its own."""
    return greatest > 1.2 * median


def count() -> int:
    """How many rows there are."""
    return len(STARTS) + sum(1 + _told(*counted) for counted in COUNTED.values())


def run() -> Iterator[Row]:
    """Every piece, its median first and then, where it differs, its greatest."""
    arm = read_arm(find_arm("planar"))
    plant = read_plant("cpu=1")
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "laps.json")
        with _unheard():
            session.run(arm, os.path.join(ROBOT, "bench_brick.py"), ["--json", file], plant)
        with open(file) as laps:
            taken = json.load(laps)
        for what, (median, greatest) in COUNTED.items():
            thousands = [lap / SECONDS / 1000 for lap in taken[what]]
            yield Row(what, median, statistics.median_high(thousands))
            if _told(median, greatest):
                yield Row(what + ", greatest", greatest, max(thousands))
        for words, counted in STARTS.items():
            script, *args = words.split()
            with _unheard():
                outcome = session.run(arm, os.path.join(ROBOT, script), args, plant).outcome
            yield Row("start: " + words, counted, (outcome.start or 0.0) / SECONDS / 1000)


HEADINGS = ("what", "counted, k", "emulated, k", "ratio", "ms")


def table(rows: list[Row]) -> list[tuple[str, ...]]:
    """For people."""
    return [
        (
            row.what,
            f"{row.counted:,.0f}",
            f"{row.emulated:,.0f}",
            f"{row.ratio:.2f}",
            f"{1e6 * SECONDS * row.counted:,.1f}",
        )
        for row in rows
    ]
