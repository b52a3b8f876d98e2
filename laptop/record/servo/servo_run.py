"""One run of the servo to one goal, from a log, the page or an emulator that knows the truth.

All figures and tables of servo runs are made of this.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from laptop.record.run import DamagedRun, RunTable, table
from laptop.record.servo.servo_log import Log

MAX_TRUE_TOLERANCES = 1.6
"""Greatest true distance at which a goal counts as reached, in tolerances."""
GOALS, STEPS = "goals", "steps"
"""Names of the tables."""
MALFORMED = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
"""Errors that reading malformed values ends in."""
NO_LOG = "the log is not as visual_servoing.py writes it"
NO_ROWS = np.zeros((0, 2))
"""Empty rows (t, value)."""


class Space(NamedTuple):
    """The path to a goal in space.

    place      x, y, z of the goal, cm
    tips       the same of the true tip, row by row of the path
    mm_per_px  greatest distance of places there that differ by 1 px in the pictures, mm
    """

    place: tuple[float, ...]
    tips: np.ndarray
    mm_per_px: float


class Truth(NamedTuple):
    """The truth about a run, from an emulator.

    cameras  their names
    goal     its true place in the pictures, u and v in each, px
    path     rows (s since the servo began, u, v in each picture) of the true tip, px
    miss_mm  when the servo ended, from the true tip to the place that shows at the goal; in the
             plane at the tip's height; None where that place is unknown
    space    the path in space; None in the plane
    """

    cameras: tuple[str, ...]
    goal: tuple[float, ...]
    path: np.ndarray
    miss_mm: float | None
    space: Space | None = None


@dataclass(eq=False)
class ServoRun:
    """One run of the servo; places in px, times in s since it began, angles in rad.

    Attributes:
        name: of the goal, for people.
        goal: where it is, for people.
        arm, method, mode: by name, "" where not known.
        tolerance: px, or None.
        verdict: a word; "" where it is not known.
        reason: of the verdict, or "".
        moves: number of them.
        seconds: duration, or None.
        error: at the end, as the servo measured it, px, or None.
        seen_error: at the end, as the tracker measured it, px, or None.
        joints: their names.
        paths: by camera, rows (t, u, v) of the tip: true where that is known, else as it was seen;
            NaN in gaps.
        goals: by camera, where the goal was at last.
        samples: by camera, rows (u, v) at which the servo stopped to look.
        errors: rows (t, px), the distance from the goal; of all cameras together.
        measured: the same as the servo measured it.
        components: by row of the error as "A.u", rows (t, px).
        angles, decided: by joint, rows (t, rad): all the time, and where it decided on a step.
        condition: rows (t, condition number of the image Jacobian).
        steps: every step as a table, or None.
        remarks: (t, text).
        truth: the emulator's, or None.
    """

    name: str
    goal: str
    arm: str = ""
    method: str = ""
    mode: str = ""
    tolerance: float | None = None
    verdict: str = ""
    reason: str = ""
    moves: int = 0
    seconds: float | None = None
    error: float | None = None
    seen_error: float | None = None
    joints: list[str] = field(default_factory=list)
    paths: dict[str, np.ndarray] = field(default_factory=dict)
    goals: dict[str, tuple[float, float]] = field(default_factory=dict)
    samples: dict[str, np.ndarray] = field(default_factory=dict)
    errors: np.ndarray = field(default_factory=lambda: NO_ROWS)
    measured: np.ndarray = field(default_factory=lambda: NO_ROWS)
    components: dict[str, np.ndarray] = field(default_factory=dict)
    angles: dict[str, np.ndarray] = field(default_factory=dict)
    decided: dict[str, np.ndarray] = field(default_factory=dict)
    condition: np.ndarray = field(default_factory=lambda: NO_ROWS)
    steps: RunTable | None = None
    remarks: Sequence[tuple[float, str]] = ()
    truth: Truth | None = None

    @property
    def true_error(self) -> float | None:
        """True distance at the end, px."""
        return float(self.errors[-1, 1]) if self.truth else None

    @property
    def claimed(self) -> bool:
        """Whether the brick reports that the goal is reached."""
        return self.verdict == "converged"

    @property
    def within_mm(self) -> float | None:
        """Distance that counts as reached in space, mm; None in the plane, where px decide."""
        space = self.truth and self.truth.space
        return MAX_TRUE_TOLERANCES * (self.tolerance or 0.0) * space.mm_per_px if space else None

    @property
    def reached(self) -> bool:
        """Whether the goal is truly reached; False where the truth is unknown."""
        if self.truth is None or self.true_error is None:
            return False
        if self.within_mm is not None and self.truth.miss_mm is not None:
            return self.truth.miss_mm <= self.within_mm
        return self.true_error <= MAX_TRUE_TOLERANCES * (self.tolerance or 0.0)

    @property
    def outcome(self) -> str:
        """True outcome in a few words."""
        if self.reached:
            if self.claimed:
                return "reached"
            return f"reached, though the brick says '{self.verdict}'"
        if self.claimed:
            return "not reached, though the brick says so"
        return f"not reached: {self.verdict}"

    @property
    def summary(self) -> str:
        """True outcome in words, with px, mm, moves and s."""
        miss = self.truth and self.truth.miss_mm
        off = "" if miss is None else f" ({miss:.1f} mm)"
        return (
            f"{self.outcome}: truly {self.true_error or 0.0:.1f} px{off} off after "
            f"{self.moves} moves, {self.seconds or 0.0:.1f} s"
        )


def run_of_log(name: str, log: Log, truth: Truth | None = None) -> ServoRun:
    """Return the run that a log holds.

    Args:
        name: of the goal, for people.
        log: of the servo.
        truth: about it, from an emulator.

    Raises:
        DamagedRun: the log is not as visual_servoing.py writes it.
    """
    try:
        return _run_of_log(name, log, truth)
    except MALFORMED:
        raise DamagedRun(NO_LOG) from None


def _run_of_log(name: str, log: Log, truth: Truth | None) -> ServoRun:
    verdict = log.verdict or {}
    seen = [one for one in log.seen if one.get("s") is not None]
    cameras = sorted({str(one["camera"]) for one in seen})
    joints = [str(joint) for joint in log.run.get("joints") or []]
    run = ServoRun(
        name,
        goal_text(log.run.get("goal")),
        arm=str(log.run.get("arm") or ""),
        method=str(log.run["method"]),
        mode=str(log.run.get("mode") or ""),
        tolerance=float(log.run["tolerance"]),
        verdict=str(verdict.get("verdict") or ""),
        reason=str(verdict.get("reason") or ""),
        moves=int(verdict.get("moves") or 0),
        seconds=_number(verdict.get("t")),
        error=_number(verdict.get("error")),
        joints=joints,
        paths={
            camera: _rows([(one["t"], *one["s"][:2]) for one in seen if one["camera"] == camera], 3)
            for camera in cameras
        },
        remarks=[(float(note["t"]), str(note["text"])) for note in log.notes],
        truth=truth,
    )
    _add_samples(run, log, cameras)
    run.measured = _rows(
        [(one["t"], one["error"]) for one in log.steps if one.get("error") is not None]
    )
    run.errors = run.measured
    with_goal = [one for one in seen if one.get("goal") is not None]
    if len(cameras) == 1:  # of several, each is seen at a time of its own
        run.errors = _rows([(one["t"], math.dist(one["s"], one["goal"])) for one in with_goal])
    for camera in cameras:
        for k, axis in enumerate("uv"):
            rows = [(o["t"], o["s"][k] - o["goal"][k]) for o in with_goal if o["camera"] == camera]
            run.components[f"{camera}.{axis}"] = _rows(rows)
    for k, joint in enumerate(joints):
        run.angles[joint] = _rows([(one["t"], one["q"][k]) for one in log.seen if one.get("q")])
        run.decided[joint] = _rows([(one["t"], one["q"][k]) for one in log.steps if one.get("q")])
    known = [(one["t"], one["condition"]) for one in log.steps if one.get("condition") is not None]
    run.condition = _rows(known)
    run.condition = run.condition[np.isfinite(run.condition).all(axis=1)]
    run.condition = run.condition[run.condition[:, 1] >= 1]  # no matrix has a smaller one
    run.steps = _steps(run, log)
    if truth is not None:
        _add_truth(run, truth)
    return run


def _add_samples(run: ServoRun, log: Log, cameras: Sequence[str]) -> None:
    """Add the places at which the servo looked, and the goal then."""
    for camera in cameras:
        rows = [f"{camera}.u", f"{camera}.v"]
        reported = [
            [dict(zip(step["rows"], step[key], strict=True)) for key in ("s", "goal")]
            for step in log.steps
            if step.get("s") is not None
            and step.get("goal") is not None
            and set(rows) <= set(step["rows"])
        ]
        if reported:
            run.samples[camera] = np.array([[at[row] for row in rows] for at, _ in reported], float)
            goal = reported[-1][1]
            run.goals[camera] = (float(goal[rows[0]]), float(goal[rows[1]]))


def _add_truth(run: ServoRun, truth: Truth) -> None:
    """Replace the seen path, errors and goals by the true ones."""
    t, seconds = truth.path[:, 0], run.seconds
    off = np.linalg.norm(truth.path[:, 1:] - truth.goal, axis=1)
    run.errors = np.column_stack([t, off])
    if seconds is not None and len(t):  # what follows is the arm's rest, and no part of the run
        end = np.interp(seconds, t, off)
        run.errors = np.vstack([run.errors[t < seconds], [seconds, end]])
    for k, camera in enumerate(truth.cameras):
        columns = [0, 1 + 2 * k, 2 + 2 * k]
        run.paths[camera] = truth.path[:, columns]
        run.goals[camera] = (truth.goal[2 * k], truth.goal[2 * k + 1])


def _steps(run: ServoRun, log: Log) -> RunTable | None:
    if not log.steps:
        return None
    headings = ["t s", "action", "model", "off px", *(f"{name} deg" for name in run.joints)]
    headings += [*(f"{name} turned by deg" for name in run.joints), "condition", "frames"]
    rows = []
    for step in log.steps:
        q = [math.degrees(angle) for angle in step.get("q") or []]
        wanted = [math.degrees(angle) for angle in step.get("q_wanted") or []]
        turns = [b - a for a, b in zip(q, wanted, strict=True)] if wanted else []
        blank = [None] * len(run.joints)
        cells = [_round(step["t"], 1), step.get("action"), step.get("model")]
        cells += [_round(step.get("error"), 1)]
        cells += [_round(angle, 1) for angle in q] or blank
        cells += [_round(turn, 1) for turn in turns] or blank
        rows.append([*cells, _round(step.get("condition"), 1), step.get("frames")])
    return steps_table(f"{run.name}, method {run.method}", headings, rows)


def steps_table(name: str, headings: Sequence[str], rows: Sequence[Sequence[Any]]) -> RunTable:
    """Return a table of the servo's measurements and actions towards a goal of this name."""
    caption = f"What the servo measured and did, step by step: {name}"
    return table(STEPS, caption, headings, rows)


def goals_table(runs: Sequence[tuple[str, ServoRun]]) -> RunTable:
    """Return a table of the goals and their outcomes, a row each.

    Args:
        runs: with the name of each goal.
    """
    headings = ["arm", "goal", "method", "ended", "moves", "time s", "off, the servo says px"]
    headings += ["off, as the tracker saw px", "truly off px", "truly off mm", "truly reached"]
    rows = [
        [
            *(run.arm or None, name, run.method or None, run.verdict or None, run.moves),
            *(_round(run.seconds, 1), _round(run.error, 1), _round(run.seen_error, 1)),
            _round(run.true_error, 1),
            _round(run.truth.miss_mm if run.truth else None, 1),
            run.reached if run.truth else None,
        ]
        for name, run in runs
    ]
    return table(GOALS, "Goals: how each was reached", headings, rows, compared=True)


def goal_text(goal: Any) -> str:
    """Return a goal as a log has it for people: "400, 200", or by camera."""
    if not isinstance(goal, Mapping):
        return str(goal or "the marker")
    places = {
        str(camera): ", ".join(f"{float(value):.4g}" for value in place)
        for camera, place in goal.items()
    }
    if len(places) == 1:
        return next(iter(places.values()))
    return "; ".join(f"{camera}: {place}" for camera, place in places.items())


def _rows(rows: Sequence[Sequence[float]], width: int = 2) -> np.ndarray:
    return np.array(rows, float).reshape(-1, width)


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _round(value: Any, digits: int) -> float | None:
    return None if value is None else round(float(value), digits)
