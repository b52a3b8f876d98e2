"""The emulated brick's computing beside the real Python's: `robot/bench_brick.py` on both.

On CPython 3.5.3, built soft-float for an ARM926, instructions were counted; on the emulated brick
seconds of its clock are taken, and an instruction takes SECONDS_PER_INSTRUCTION.
"""

from __future__ import annotations

import json
import os
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, silenced
from laptop.emulator.bundled_scripts import BENCH_BRICK
from laptop.emulator.host.processor import SECONDS_PER_INSTRUCTION
from laptop.emulator.rig import Rig
from shared.arm_description import find_arm, read_arm

COUNTED: dict[str, tuple[float, float]] = {
    "check and decode an observation": (105, 105),
    "planar: planning a line": (7991, 7991),
    "planar: inverse": (140, 140),
    "planar: tick, moving": (285, 1201),
    "planar: tick, line": (320, 933),
    "read position": (22.4, 22.4),
    "write speed_sp": (26.6, 26.6),
    "write command": (24.3, 24.3),
    "planar, stream: steering by a frame": (40, 40),
    "a full collection": (6355, 6355),
    "spatial: planning a line": (12143, 12143),
    "spatial: inverse": (295, 295),
    "spatial: tick, moving": (402, 2619),
    "spatial: tick, line": (457, 3076),
    "spatial, stream: steering by a frame": (40, 41),
}
"""Thousand instructions on CPython 3.5.3: the median and the greatest; of what is called again and
again, the median alone.  To be counted
anew where the code changes: `--marks` says of what."""

UNCOUNTED = (
    "planar, look: tick",
    "planar, look: learning from a frame",
    "planar, look: decision, explore",
    "planar, look: decision, move",
    "planar, look: decision, end",
    "planar, stream: tick",
    "planar, stream: learning from a frame",
    "spatial, look: tick",
    "spatial, look: learning from a frame",
    "spatial, look: decision, explore",
    "spatial, look: decision, move",
    "spatial, look: decision, end",
    "spatial, stream: tick",
    "spatial, stream: learning from a frame",
)
"""Pieces whose code has changed since, and which the emulator alone has counted."""

STARTS = {
    "driver.py where": 142000,
    "driver.py inverse 10,5": 113038,
    "driver.py line 1,1": 103587,
    "visual_servoing.py --budget none": 133955,
    "tracking_client.py --seconds none": 127316,
}
"""The same of whole programs, from the start of Python to where it looks for the first motor; of
those that need no brick, to its end."""


@dataclass(frozen=True)
class InstructionCount:
    """One piece of work: thousand instructions as counted, and as the emulated brick has them.

    `counted` is None where the code has changed since.
    """

    what: str
    counted: float | None
    emulated: float

    @property
    def ratio(self) -> float | None:
        """Emulated by counted; None without a count."""
        return self.emulated / self.counted if self.counted else None


def _spreads(median: float, greatest: float) -> bool:
    """Return True if the greatest is worth a row of its own."""
    return greatest > 1.2 * median


def count() -> int:
    """Number of rows."""
    rows = sum(1 + _spreads(*counted) for counted in COUNTED.values())
    return rows + len(UNCOUNTED) + len(STARTS)


def run() -> Iterator[InstructionCount]:
    """Every piece, its median first and then, where it differs, its greatest."""
    arm = read_arm(find_arm("planar"))
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "laps.json")
        with silenced(), Rig(arm, plant="cpu=1") as rig:
            rig.run(BENCH_BRICK, "--json", file)
        with open(file) as laps:
            taken = json.load(laps)["laps_s"]
        for what, (median, greatest) in COUNTED.items():
            thousands = [lap / SECONDS_PER_INSTRUCTION / 1000 for lap in taken[what]]
            yield InstructionCount(what, median, statistics.median_high(thousands))
            if _spreads(median, greatest):
                yield InstructionCount(what + ", greatest", greatest, max(thousands))
        for what in UNCOUNTED:
            thousands = [lap / SECONDS_PER_INSTRUCTION / 1000 for lap in taken[what]]
            yield InstructionCount(what, None, statistics.median_high(thousands))
        for words, counted in STARTS.items():
            script, *args = words.split()
            with silenced(), Rig(arm, plant="cpu=1") as rig:
                outcome = rig.run(script, *args).outcome
            yield InstructionCount(
                "start: " + words, counted, (outcome.start or 0.0) / SECONDS_PER_INSTRUCTION / 1000
            )


HEADINGS = ("what", "counted, k", "emulated, k", "ratio", "ms")


def table(rows: list[InstructionCount]) -> list[tuple[str, ...]]:
    """For people."""
    return [
        (
            row.what,
            f"{row.counted:,.0f}" if row.counted else "-",
            f"{row.emulated:,.0f}",
            f"{row.ratio:.2f}" if row.ratio else "-",
            f"{1e6 * SECONDS_PER_INSTRUCTION * (row.counted or row.emulated):,.1f}",
        )
        for row in rows
    ]


TITLE = "thousand instructions of CPython 3.5.3 on an ARM926; ms at 300 MHz and CPI 6.8"

BENCH: BenchRecord[Any, InstructionCount] = BenchRecord(
    "computing",
    lambda it: range(count()),
    None,
    lambda rows, it: [BenchTable(TITLE, HEADINGS, table(rows))],
    in_turn=lambda rows: run(),
)
