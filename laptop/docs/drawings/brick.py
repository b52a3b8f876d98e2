"""Drawings of the brick: what a tick is spent on, when the arm stands, and what is emulated."""

from __future__ import annotations

import json
import math
import statistics
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import FancyBboxPatch

from laptop.bench.bench import silenced
from laptop.bench.servo_scenarios import DEFAULT, ServoScenario
from laptop.docs.drawings.picture import arrow, label, picture
from laptop.docs.drawings.sight import servo_run
from laptop.emulator.bundled_scripts import BENCH_BRICK
from laptop.emulator.rig import Rig
from laptop.record.figures.sheet import BAND, BAND_TEXT, INK, QUIET, REACH_EDGE, STEEL, WANTED
from robot.ev3.motors import DEAD_MAN
from robot.motion.pace import MIN_PERIOD
from robot.servoing.sightings import SIGHT_TIMEOUT

TICKS = (
    ("draw", "planar: tick, line", 2),
    ("draw,\nin space", "spatial: tick, line", 3),
    ("servo", "planar, stream: tick", 2),
    ("servo,\nin space", "spatial, stream: tick", 3),
)
"""Ticks: label, name in the brick's measurement, joints."""

ACCESSES = 3
"""Accesses to a motor in a tick: one to read, two to set."""


def pace_drawing(file: Path) -> None:
    """Draw what of a control tick goes where, measured on the emulated brick."""
    laps, access = _laps()
    period = 1000 * MIN_PERIOD
    with picture(file, 500) as figure:
        axes = figure.add_axes((0.19, 0.18, 0.77, 0.69))
        for row, (_, name, joints) in enumerate(TICKS):
            motors = 1000 * ACCESSES * joints * access
            computing = 1000 * statistics.median_high(laps[name])
            axes.barh(row, period, 0.7, color=REACH_EDGE)
            axes.barh(row, motors + computing, 0.7, color=WANTED)
            axes.barh(row, motors, 0.7, color=BAND)
            label(axes, (motors / 2, row), f"{motors:.1f}", INK)
            label(axes, (motors + computing / 2, row), f"{computing:.1f}", "white")
        axes.set(xlim=(0, period), ylim=(3.5, -0.5), xlabel="ms", xticks=range(0, 21, 5))
        axes.set_yticks(range(len(TICKS)), [text for text, *_ in TICKS], color=INK)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set(visible=False)
        label(axes, (0, -0.75), "motors", BAND_TEXT, ha="left")
        label(axes, (5, -0.75), "computing", WANTED, ha="left")
        label(axes, (period, -0.75), "left over", QUIET, ha="right")


def _laps() -> tuple[Mapping[str, Sequence[float]], float]:
    """Return how long pieces of work take on the emulated brick, s, and an access to a motor."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "brick.json"
        with silenced(), Rig("planar") as rig:
            rig.run(BENCH_BRICK, "--json", file)
        figures = json.loads(file.read_text("utf-8"))
        return figures["laps_s"], figures["access_s"]


STRUCK, HIDDEN = 3.7, 1.2
"""Time at which a fault strikes a line, s, and from which a tip is hidden: links turn."""

FAULTS = (
    ("motor unplugged", "unplug:A", 0.0),
    ("encoder dead", "dead-encoder:A", 0.0),
    ("Ctrl-C", "int", 0.0),
    ("program frozen", "freeze", DEAD_MAN),
)
"""Faults of a line: label, as `simulate --fault` takes it, and the time limit that ends it, s."""


def safety_drawing(file: Path) -> None:
    """Draw when the arm stands after a fault, in emulated runs."""
    rows = [(text, _stands_after(fault), limit) for text, fault, limit in FAULTS]
    blind = servo_run(DEFAULT, ServoScenario(mode="stream"), HIDDEN, budget=4.0)
    rows.append(("tip unseen", _stands(blind.record, HIDDEN), SIGHT_TIMEOUT))
    with picture(file, 480) as figure:
        axes = figure.add_axes((0.27, 0.19, 0.69, 0.67))
        for row, (_, stands, limit) in enumerate(rows):
            axes.barh(row, stands, 0.6, color=WANTED)
            axes.barh(row, limit, 0.6, color=BAND)
            label(axes, (stands + 0.01, row), f"{stands:.2f} s", INK, ha="left")
        axes.set(xlim=(0, 0.6), ylim=(len(rows) - 0.5, -0.5), xlabel="s after it happens")
        axes.set_yticks(range(len(rows)), [text for text, *_ in rows], color=INK)
        axes.tick_params(axis="y", length=0)
        label(axes, (0, -0.85), "time limit", BAND_TEXT, ha="left")
        label(axes, (0.19, -0.85), "until the arm stands", WANTED, ha="left")


def _stands_after(fault: str) -> float:
    """Return how long after a fault the arm stands, s, that strikes while it draws a line."""
    with silenced(), Rig("planar") as rig:
        rig.run("driver.py", "line", "10,0", "5,10", faults=f"{fault}@{STRUCK}")
        return _stands(rig.record, STRUCK)


def _stands(record: Sequence[Any], since: float) -> float:
    """Return how long after a time, s, a joint was last a tenth of a degree from its end."""
    off = np.abs(np.array([sample.q for sample in record]) - record[-1].q).max(axis=1)
    last: float = record[int(np.flatnonzero(off > math.radians(0.1))[-1])].t
    return last - since


REAL, EMULATED = "#DCEBF5", "#FBE7C6"
"""Colours of boxes."""

ROWS, HALF = (0.74, 0.44, 0.14), (0.18, 0.09)
"""Heights of the boxes' middles, and half of a box, shares of the drawing."""

COLUMNS = (
    (0.2, "real", REAL, ("tracker", "your script", "python-ev3dev2")),
    (0.8, "emulated", EMULATED, ("camera", "arm with play", "motors")),
)
"""Columns: middle, heading, colour, boxes from the top."""

ARROWS = (
    ((0.62, 0.74), (0.38, 0.74)),
    ((0.2, 0.65), (0.2, 0.53)),
    ((0.2, 0.35), (0.2, 0.23)),
    ((0.38, 0.14), (0.62, 0.14)),
    ((0.8, 0.23), (0.8, 0.35)),
    ((0.8, 0.53), (0.8, 0.65)),
    ((0.44, 0.44), (0.38, 0.44)),
)
"""Arrows, from and to."""

NAMES = (
    (0.5, 0.79, "pictures"),
    (0.26, 0.59, "TCP"),
    (0.5, 0.19, "/sys/class"),
)
"""Names of what goes along arrows."""


def emulator_drawing(file: Path) -> None:
    """Draw what is real and what is emulated, and what goes from one to the other."""
    with picture(file, 540) as figure:
        axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 1), ylim=(0, 1))
        axes.set_axis_off()
        boxes = [(x, y, HALF[0], text, colour) for x, _, colour, texts in COLUMNS
                 for y, text in zip(ROWS, texts, strict=True)]  # fmt: skip
        for x, y, half, text, colour in [*boxes, (0.5, ROWS[1], 0.06, "clock", EMULATED)]:
            size, rounded = (2 * half, 2 * HALF[1]), "round,pad=0,rounding_size=0.02"
            corner = x - half, y - HALF[1]
            axes.add_patch(FancyBboxPatch(corner, *size, rounded, fc=colour, ec=STEEL))
            label(axes, (x, y), text, INK)
        for start, end in ARROWS:
            arrow(axes, start, end, QUIET)
        for x, y, text in NAMES:
            label(axes, (x, y), text, QUIET, size=18)
        for x, text, *_ in COLUMNS:
            label(axes, (x, 0.92), text, INK, weight="bold")
