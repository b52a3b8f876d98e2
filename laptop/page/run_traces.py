"""The curves of a run that its report shows, from what was recorded of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from laptop.page.run_records import Curve, RunGroup, RunRecord, StatusSample

MAX_GAP = 0.5
"""A camera that has not seen the tip for longer than this, s, leaves a gap in its curve."""
TIME_STEP = 0.05
"""Between two points of a curve of errors, s."""
FINAL_PERIOD = 0.5
"""The end of a run, s: where the tip came to stand is the median over it."""


class RunTraces(NamedTuple):
    """The curves of one run; times in s since the first run of its group began.

    tips     per camera rows (s, u, v) of the tip, NaN where it was not seen
    goals    per camera the last place of the goal, px
    t        moments, TIME_STEP apart
    e        per row of the cameras the error at these as the tracker saw it, px
    samples  of the brick's status
    holds    (s, why) whenever the run was held
    """

    record: RunRecord
    tips: dict[str, np.ndarray]
    goals: dict[str, tuple[float, float]]
    t: np.ndarray
    e: dict[str, np.ndarray]
    samples: list[StatusSample]
    holds: list[tuple[float, str]]

    @property
    def measured(self) -> list[StatusSample]:
        """The samples in which the brick had just measured the error."""
        before = [None, *(sample.e for sample in self.samples)]
        new = zip(self.samples, before, strict=False)
        return [sample for sample, e in new if sample.error is not None and sample.e != e]

    @property
    def errors(self) -> np.ndarray:
        """The length of `e`, px."""
        return np.sqrt(sum((values**2 for values in self.e.values()), np.zeros(len(self.t))))

    @property
    def final_error(self) -> float | None:
        """The error in the end as the tracker saw it, px."""
        last = self.errors[self.t > self.t[-1] - FINAL_PERIOD] if len(self.t) else np.empty(0)
        last = last[np.isfinite(last)]
        return float(np.median(last)) if len(last) and self.e else None

    @property
    def tolerance(self) -> float | None:
        """The tolerance in px, if it was ordered here."""
        return self.record.orders and self.record.orders.tolerance


def traces_of(group: RunGroup) -> list[RunTraces]:
    """Return the curves of each run of a group."""
    began = group.runs[0].began
    return [_traces(run, began) for run in group.runs]


def _traces(run: RunRecord, began: float) -> RunTraces:
    samples = [sample._replace(t=sample.t - began) for sample in run.samples]
    tips = {camera: _since(began, curve) for camera, curve in run.tips.items()}
    goals = {camera: _since(began, curve) for camera, curve in run.goals.items()}
    if run.orders is None:  # perhaps the brick went to a pixel, of which it says only how far off
        goals.update(_goals_from_errors(tips, samples))
    rows = [
        row for row in (samples[-1].e if samples else ()) if row[:-2] in tips and row[:-2] in goals
    ]
    rows = rows or [f"{camera}.{axis}" for camera in tips if camera in goals for axis in "uv"]
    ends = [curve[-1, 0] for curve in tips.values()] + [sample.t for sample in samples[-1:]]
    end = max(ends, default=0.0) + TIME_STEP
    t = np.arange(run.began - began, end, TIME_STEP) if rows else np.empty(0)
    e = {}
    for row in rows:
        camera, column = row[:-2], 1 + "uv".index(row[-1])
        tip, goal = tips[camera], goals[camera]
        values = np.interp(t, tip[:, 0], tip[:, column]) - np.interp(t, goal[:, 0], goal[:, column])
        e[row] = np.where(_is_known(t, tip[:, 0]), values, np.nan)
    return RunTraces(
        run,
        {camera: _with_gaps(tip) for camera, tip in tips.items()},
        {camera: (float(goal[-1, 1]), float(goal[-1, 2])) for camera, goal in goals.items()},
        t,
        e,
        samples,
        [(t - began, why) for t, why in run.holds],
    )


def _since(began: float, curve: Curve) -> np.ndarray:
    """Return rows (s, u, v) with times since `began` (s)."""
    return np.array(curve, float).reshape(-1, 3) - (began, 0.0, 0.0)


def _goals_from_errors(
    tips: dict[str, np.ndarray], samples: Sequence[StatusSample]
) -> dict[str, np.ndarray]:
    """Return per camera the brick's goal, (1, 3): the tip less the error it last measured."""
    e = samples[-1].e if samples else {}
    first = next((sample.t for sample in samples if sample.e == e), 0.0)
    goals = {}
    for camera, tip in tips.items():
        if f"{camera}.u" in e and f"{camera}.v" in e:
            u, v = (np.interp(first, tip[:, 0], tip[:, column]) for column in (1, 2))
            goals[camera] = np.array([[first, u - e[f"{camera}.u"], v - e[f"{camera}.v"]]])
    return goals


def _is_known(t: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return at which moments t (s) a curve is known that was seen at other moments (s)."""
    after = np.searchsorted(seen, t)
    before = np.where(after > 0, seen[np.maximum(after - 1, 0)], -np.inf)
    behind = np.where(after < len(seen), seen[np.minimum(after, len(seen) - 1)], np.inf)
    return (behind - before <= MAX_GAP) | (np.minimum(t - before, behind - t) <= 2 * TIME_STEP)


def _with_gaps(curve: np.ndarray) -> np.ndarray:
    """Return the curve with NaN in its gaps."""
    gaps = np.flatnonzero(np.diff(curve[:, 0]) > MAX_GAP) + 1
    return np.insert(curve, gaps, np.nan, axis=0)
