"""Tracking: the tracker beside the usual OpenCV recipes, and the limit of any estimator.

Every picture comes from the emulator's sensor, so the true place of every marker is known.  All
methods get the same colour, learned in the first picture of their clip; the circle search gets the
marker's radius instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import methodcaller
from typing import Any, NamedTuple

from laptop.bench import show, track_cost, track_table
from laptop.bench.bench import BenchRecord, BenchTable, MachineLine, flat, seeds_of
from laptop.bench.track_cost import Cost
from laptop.bench.track_light import LIGHTS, SCENES, LightCase
from laptop.bench.track_precision import APPEARANCES, PrecisionCase
from laptop.bench.track_rims import RADII, RIMS, RimCase
from laptop.bench.track_score import TrackResult

Case = PrecisionCase | LightCase | RimCase


def cases(seeds: range) -> list[Case]:
    """Return all cases but those of the cost, the longest first."""
    lights = tuple((name, name) for name in LIGHTS)
    scenes = [(text, ((name, "none"),)) for name, text in SCENES.items()]
    clips = [("", lights[:4]), ("", lights[4:]), *scenes]
    filmed = [LightCase(text, lights, seed) for text, lights in clips for seed in seeds]
    printed = [RimCase(radius, rim, seed) for radius in RADII for rim in RIMS for seed in seeds]
    alone = (PrecisionCase(appearance, seed) for appearance in APPEARANCES for seed in seeds)
    return [*filmed, *alone, *printed]


class Tracked(NamedTuple):
    """The scores, the costs, and the part of a core that serving takes."""

    results: list[TrackResult]
    timed: list[Cost]
    serving: float


def _gather(parts: list[list[TrackResult]], it: Any) -> Tracked:
    turns = show.progress(range(track_cost.TURNS), track_cost.TURNS, "timing")
    return Tracked(track_table.gathered(flat(parts)), track_cost.costs(turns), track_cost.serving())


def _shown(found: Tracked, it: Any) -> Iterator[BenchTable | str]:
    results, timed, serving = found
    title = f"{seeds_of(it)}, figures from the emulator"
    precision, light = track_table.precision_table(results), track_table.light_table(results)
    headings = track_table.precision_headings(results)
    rims = track_table.rim_table(results)
    yield BenchTable(f"Precision, px rms per axis; {title}", headings, precision)
    yield BenchTable(f"Printed discs, px; {title}", track_table.RIM_HEADINGS, rims)
    yield BenchTable(f"Light and scene, px; {title}", track_table.LIGHT_HEADINGS, light)
    costs = track_table.cost_table(timed)
    title = "Cost, measured on this machine"
    yield BenchTable(title, track_table.COST_HEADINGS, costs, of_this_machine=True)
    yield MachineLine(f"serving the brick 60 times a second: {100 * serving:.1f} % of a core")
    yield from track_table.errors(results)


BENCH = BenchRecord(
    "tracking",
    lambda it: cases(it.seeds),
    methodcaller("run"),
    _shown,
    figures=lambda found: {
        **track_table.figures(found.results, found.timed),
        "serving": found.serving,
    },
    gather=_gather,
)
