"""Runs of the servo as the page has recorded them, for their report."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from laptop.page.run_records import Curve, RunGroup, RunRecord, StatusSample
from laptop.record.run import RunTable
from laptop.record.servo.servo_run import NO_ROWS, ServoRun, goal_text, steps_table

MAX_GAP = 0.5
"""A camera that has not seen the tip for longer than this, s, leaves a gap in its curve."""
TIME_STEP = 0.05
"""Time between two points of a curve of errors, s."""
FINAL_PERIOD = 0.5
"""The end of a run, s: where the tip came to stand is the median over it."""


def servo_runs(group: RunGroup) -> list[ServoRun]:
    """Return the runs of a group; times in s since the first one began."""
    began = group.runs[0].began
    several = len(group.runs) > 1
    return [
        _servo_run(run, began, f"goal {number}" if several else "goal")
        for number, run in enumerate(group.runs, 1)
    ]


def _servo_run(record: RunRecord, began: float, name: str) -> ServoRun:
    samples = [sample._replace(t=sample.t - began) for sample in record.samples]
    tips = {camera: _since(began, curve) for camera, curve in record.tips.items()}
    curves = {camera: _since(began, curve) for camera, curve in record.goals.items()}
    orders = record.orders
    if orders is None:  # perhaps the goal was a pixel, of which the brick reports only the error
        curves.update(_goals_from_errors(tips, samples))
    goals = {camera: (float(g[-1, 1]), float(g[-1, 2])) for camera, g in curves.items()}
    t, e = _components(record.began - began, tips, curves, samples)
    errors = np.sqrt(sum((values**2 for values in e.values()), np.zeros(len(t))))
    before = [None, *(sample.e for sample in samples)]
    measured = [
        sample
        for sample, known in zip(samples, before, strict=False)
        if sample.error is not None and sample.e != known
    ]
    last = samples[-1] if samples else None
    count = max((len(sample.q) for sample in samples), default=0)
    joints = [f"joint {k + 1}" for k in range(count)]
    verdict = record.verdict or ("goes on" if record.ended is None else "not heard")
    return ServoRun(
        name,
        _goal_in_words(record, goals),
        method=orders.method if orders else "",
        mode=orders.mode if orders else "",
        tolerance=orders.tolerance if orders else None,
        verdict=verdict,
        reason=record.reason,
        moves=last.moves if last else 0,
        seconds=record.ended and record.ended - record.began,
        error=last and last.error,
        seen_error=_at_the_end(t, errors) if e else None,
        joints=joints,
        paths={camera: _with_gaps(tip) for camera, tip in tips.items()},
        goals=goals,
        samples={} if orders and orders.follow else _image_samples(goals, measured),
        errors=np.column_stack([t, errors]) if e else NO_ROWS,
        measured=_rows([(sample.t, sample.error) for sample in measured]),
        components={row: np.column_stack([t, values]) for row, values in e.items()},
        angles={name: _angles(samples, k) for k, name in enumerate(joints)},
        decided={name: _angles(measured, k) for k, name in enumerate(joints)},
        condition=_rows([(s.t, s.condition) for s in measured if s.condition is not None]),
        steps=_steps(name, measured, joints),
        remarks=[(when - began, f"held, {why}") for when, why in record.holds],
    )


def _components(
    begins: float,
    tips: dict[str, np.ndarray],
    goals: dict[str, np.ndarray],
    samples: Sequence[StatusSample],
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return moments, TIME_STEP apart, and of each row the tip less the goal as it was seen."""
    reported = samples[-1].e if samples else ()
    rows = [row for row in reported if row[:-2] in tips and row[:-2] in goals]
    rows = rows or [f"{camera}.{axis}" for camera in tips if camera in goals for axis in "uv"]
    ends = [curve[-1, 0] for curve in tips.values()] + [sample.t for sample in samples[-1:]]
    end = max(ends, default=0.0) + TIME_STEP
    t = np.arange(begins, end, TIME_STEP) if rows else np.empty(0)
    e = {}
    for row in rows:
        camera, column = row[:-2], 1 + "uv".index(row[-1])
        tip, goal = tips[camera], goals[camera]
        values = np.interp(t, tip[:, 0], tip[:, column]) - np.interp(t, goal[:, 0], goal[:, column])
        e[row] = np.where(_is_known(t, tip[:, 0]), values, np.nan)
    return t, e


def _at_the_end(t: np.ndarray, errors: np.ndarray) -> float | None:
    """Return the error where the tip came to stand, px."""
    last = errors[t > t[-1] - FINAL_PERIOD] if len(t) else errors
    last = last[np.isfinite(last)]
    return float(np.median(last)) if len(last) else None


def _image_samples(
    goals: dict[str, tuple[float, float]], measured: Sequence[StatusSample]
) -> dict[str, np.ndarray]:
    """Return by camera the places (n, 2) where the brick sampled, from the errors it reported."""
    found = {}
    for camera, goal in goals.items():
        rows = f"{camera}.u", f"{camera}.v"
        samples_at_goals = [
            [g + sample.e[row] for g, row in zip(goal, rows, strict=True)]
            for sample in measured
            if sample.e.keys() >= set(rows)
        ]
        found[camera] = _rows(samples_at_goals)
    return found


def _steps(name: str, measured: Sequence[StatusSample], joints: Sequence[str]) -> RunTable | None:
    if not measured:
        return None
    rows = sorted({row for sample in measured for row in sample.e})
    headings = ["t s", "moves", "off px", *(f"{row} off px" for row in rows)]
    headings += [*(f"{joint} deg" for joint in joints), "condition"]
    cells = []
    for one in measured:
        angles = [round(math.degrees(one.q[k]), 1) if k < len(one.q) else None
                  for k in range(len(joints))]  # fmt: skip
        off = [round(one.e[row], 1) if row in one.e else None for row in rows]
        condition = None if one.condition is None else round(one.condition, 1)
        error = None if one.error is None else round(one.error, 1)
        cells.append([round(one.t, 1), one.moves, error, *off, *angles, condition])
    return steps_table(name, headings, cells)


def _goal_in_words(record: RunRecord, goals: dict[str, tuple[float, float]]) -> str:
    """Return the goal for people."""
    if record.orders and not record.orders.goals:
        return "the marker"
    return goal_text({camera: goals[camera] for camera in sorted(goals)} or "not known")


def _angles(samples: Sequence[StatusSample], joint: int) -> np.ndarray:
    return _rows([(sample.t, sample.q[joint]) for sample in samples if joint < len(sample.q)])


def _rows(rows: Sequence[Sequence[float | None]]) -> np.ndarray:
    return np.array(rows, float).reshape(-1, 2)


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
