"""Tracking, measured: the tracker beside the usual OpenCV recipes, and the limit of any estimator.

Every picture comes from the emulator's sensor, so the true place of every marker is known.  All
methods get the same colour, learned in the first picture of their clip; the circle search gets the
marker's radius instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor

from laptop.bench import workers
from laptop.bench.track_light import LIGHTS, SCENES, LightCase
from laptop.bench.track_precision import LOOKS, PrecisionCase
from laptop.bench.track_rims import RADII, RIMS, RimCase
from laptop.bench.track_score import TrackResult

Case = PrecisionCase | LightCase | RimCase


def cases(seeds: range) -> list[Case]:
    """Everything but the cost, the longest first."""
    lights = tuple((name, name) for name in LIGHTS)
    scenes = [(text, ((name, "none"),)) for name, text in SCENES.items()]
    clips = [("", lights[:4]), ("", lights[4:]), *scenes]
    filmed = [LightCase(text, lights, seed) for text, lights in clips for seed in seeds]
    printed = [RimCase(radius, rim, seed) for radius in RADII for rim in RIMS for seed in seeds]
    return [*filmed, *(PrecisionCase(look, seed) for look in LOOKS for seed in seeds), *printed]


def _run(case: Case) -> list[TrackResult]:
    return case.run()


def run(todo: Sequence[Case], executor: Executor | None = None) -> Iterator[list[TrackResult]]:
    """Yield the results of all cases in their order.

    Args:
        todo: the cases.
        executor: does the work; None for all cores of this machine.
    """
    return workers.map_cases(_run, todo, executor=executor)
