"""Criteria for the handouts' solutions, each by an oracle that knows nothing of the solution.

The oracles are numpy and the emulator's truth: where the links really were, not what the script
believes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from laptop.course.examination import Question, Returned, TrialRun, ask, run, the_arm

GOALS = ((14, 9), (4, 15), (16, -4), (13, -7))
"""Goals of the first handout, cm."""
GOAL_TOLERANCE = 0.6
"""Greatest distance of the resting arm from a goal, cm: two degrees of the shoulder's backlash."""
REST_SPAN, REST_TIME = 0.05, 0.3
"""Greatest span of the tip, cm, and least duration, s, of what counts as a rest."""

TARGETS, TARGET_TIME = (40.0, -20.0, 10.0), 3.0
"""Targets of the second handout, deg, and the time at each, s."""
PUSHING_PLANT = "backlash=1,load=0.05"
"""Plant on which a load pushes the elbow all the time: without KI it rests beside its target."""
RISE_TIME, OVERSHOOT, TARGET_TOLERANCE, HUNTING = 0.8, 12.0, 2.0, 2.5
"""Limits of a step response: s to come within a tenth of the step, deg of overshoot, deg off the
target at the end, and deg to and fro at the end."""

LINE = (16.0, -4.0), (8.0, 12.0)
LINE_TOLERANCE, END_TOLERANCE = 0.8, 0.9
"""Limits of the third handout: greatest distances of the ink from the line, and of its ends from
the line's, cm."""

SCENES = ("tilt=25,seed=1", "tilt=40,azimuth=70,seed=2,goal_x=5,goal_y=14")
SIGHT_TOLERANCE = 8.0
"""Greatest true distance of the tip from the goal at the end of the fourth handout, px."""

TEST_STEP = [0.3, -0.2]
"""Joint step with which an update is tested, rad."""

_UNTRIED = "the arm is not tried while a function does not end"


@dataclass(frozen=True)
class CheckPoint:
    """A property of a solution that was checked: whether it is right, and the figures."""

    right: bool
    text: str


def check_kinematics(script: Path) -> Iterator[CheckPoint]:
    """Check the first handout's functions against numpy, and its arm against the truth."""
    draw = np.random.default_rng(1)
    poses = draw.uniform((-1.0, 0.4), (2.0, 2.2), (5, 2))
    J, e = draw.uniform(-15, 15, (5, 2, 2)), draw.uniform(-3, 3, (5, 2))
    J[:, 0, 0] += 20  # regular
    starts = [(q + draw.uniform(-0.25, 0.25, 2), q) for q in poses]
    goals = [_tip(q) for _, q in starts]
    tests = (
        [("forward", [list(q)]) for q in poses],
        [("jacobian", [list(q)]) for q in poses],
        [("newton_step", [a.tolist(), b.tolist()]) for a, b in zip(J, e, strict=True)],
        [
            ("broyden_update", [a.tolist(), TEST_STEP, b.tolist()])
            for a, b in zip(J, e, strict=True)
        ],
        *(
            [("search", [p, list(q), exact]) for p, (q, _) in zip(goals, starts, strict=True)]
            for exact in (True, False)
        ),
    )
    answers = iter(ask(script, list(chain(*tests))))
    part = [[next(answers) for _ in group] for group in tests]
    yield _compare(tests[0], part[0], [_tip(q) for q in poses], "cm")
    yield _compare(tests[1], part[1], [_slopes(q) for q in poses], "cm/rad")
    yield _compare(tests[2], part[2], np.linalg.solve(J, e[:, :, None])[:, :, 0], "rad")
    yield _secant(J, e, part[3])
    for name, found, most in (("Newton", part[4], 8), ("Broyden", part[5], 15)):
        yield _searched(name, found, goals, most)
    if any(answer.endless for answer in chain(*part)):
        yield CheckPoint(False, _UNTRIED)
        return
    trial = run(script)
    yield from _failed(trial)
    if trial.endless:
        return
    rests = resting_places(trial)
    for goal in GOALS:
        off = min((math.dist(goal, place) for place in rests), default=math.inf)
        yield CheckPoint(
            off <= GOAL_TOLERANCE,
            f"goal {goal}: the tip truly rests {10 * off:.1f} mm off, "
            f"{10 * GOAL_TOLERANCE:g} are allowed"
            if math.isfinite(off)
            else f"goal {goal}: the tip never rests anywhere",
        )


def check_pid(script: Path) -> Iterator[CheckPoint]:
    """Check the second handout by the elbow's true angle, free and pushed."""
    for plant, name in (("backlash=1", "free"), (PUSHING_PLANT, "pushed")):
        trial = run(script, plant)
        yield from _failed(trial)
        if trial.endless:
            return
        q = np.degrees(trial.q[:, 1]) if len(trial.q) else np.zeros(1)
        t = trial.t if len(trial.t) else np.zeros(1)
        moving = np.flatnonzero(np.abs(q - q[0]) > 2.0)
        if not len(moving):
            yield CheckPoint(
                False, f"{name}: the elbow does not move; does control() return a duty?"
            )
            return
        begin, before = t[moving[0]] - 0.1, q[0]
        for target in TARGETS:
            span = (t >= begin) & (t < begin + TARGET_TIME)
            yield _step_response(
                f"{name}, to {target:g} deg", t[span] - begin, q[span], before, target
            )
            begin, before = begin + TARGET_TIME, target


def check_line(script: Path) -> Iterator[CheckPoint]:
    """Check the third handout by the true ink."""
    trial = run(script)
    yield from _failed(trial)
    if trial.endless:
        return
    ink = trial.tip[trial.pen]
    if len(ink) < 2:
        yield CheckPoint(False, "there is no ink: the pen was never down")
        return
    a, b = map(np.array, LINE)
    along = np.clip((ink - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    off = 10 * np.linalg.norm(ink - (a + along[:, None] * (b - a)), axis=1).max()
    yield CheckPoint(
        off <= 10 * LINE_TOLERANCE,
        f"the ink is up to {off:.1f} mm off the straight line, {10 * LINE_TOLERANCE:g} are allowed",
    )
    for name, place, point in (("begins", ink[0], a), ("ends", ink[-1], b)):
        off = 10 * float(np.linalg.norm(place - point))
        yield CheckPoint(
            off <= 10 * END_TOLERANCE,
            f"the ink {name} {off:.1f} mm from where it should, {10 * END_TOLERANCE:g} are allowed",
        )


def check_servoing(script: Path) -> Iterator[CheckPoint]:
    """Check the fourth handout by where tip and goal truly are in the pictures of two cameras."""
    from laptop.emulator.scene.scene import Scene  # OpenCV is slow to import
    from laptop.emulator.scene.scene_constants import read_scene

    draw = np.random.default_rng(2)
    J, e = draw.uniform(-300, 300, (5, 2, 2)), draw.uniform(-80, 80, (5, 2))
    J[:, 0, 0] += 400
    turned = math.radians(8)
    tests = (
        [("first_jacobian", [(a.T * turned).tolist()]) for a in J],
        [("step", [a.tolist(), b.tolist()]) for a, b in zip(J, e, strict=True)],
        [
            ("broyden_update", [a.tolist(), TEST_STEP, b.tolist()])
            for a, b in zip(J, e, strict=True)
        ],
    )
    answers = iter(ask(script, list(chain(*tests))))
    part = [[next(answers) for _ in group] for group in tests]
    yield _compare(tests[0], part[0], J, "px/rad")
    yield _compare(tests[1], part[1], -np.linalg.solve(J, e[:, :, None])[:, :, 0], "rad")
    yield _secant(J, e, part[2])
    if any(answer.endless for answer in chain(*part)):
        yield CheckPoint(False, _UNTRIED)
        return
    for number, text in enumerate(SCENES, 1):
        trial = run(script, scene=text)
        yield from _failed(trial)
        if trial.endless:
            return
        places = Scene(the_arm(), read_scene(text)).truth(trial.q[-1] if len(trial.q) else (0, 0))
        off = math.dist(places["effector"], places["goal"])
        yield CheckPoint(
            off <= SIGHT_TOLERANCE,
            f"camera {number}: at the end the tip truly is {off:.1f} px off the goal, "
            f"{SIGHT_TOLERANCE:g} are allowed",
        )


def resting_places(trial: TrialRun) -> list[tuple[float, float]]:
    """Return the places at which the tip rested, cm, in order, the start included."""
    places: list[tuple[float, float]] = []
    if len(trial.t) < 2:
        return places
    count = max(1, round(REST_TIME / float(np.median(np.diff(trial.t)))))
    for k in range(0, len(trial.t) - count, max(1, count // 4)):
        window = trial.tip[k : k + count]
        if np.ptp(window, axis=0).max() < REST_SPAN:
            places.append((float(window[-1, 0]), float(window[-1, 1])))
    return places


def _tip(q: Sequence[float]) -> list[float]:
    """Return the tip by complex numbers, cm."""
    first, second = (joint.link for joint in the_arm().joints)
    place = first * np.exp(1j * q[0]) + second * np.exp(1j * (q[0] + q[1]))
    return [float(place.real), float(place.imag)]


def _slopes(q: Sequence[float], h: float = 1e-5) -> np.ndarray:
    """Return the Jacobian of the tip by the joints, from small differences, cm/rad."""
    ends = [
        [np.array(_tip(np.add(q, sign * h * np.eye(2)[k]))) for sign in (1, -1)] for k in (0, 1)
    ]
    return np.column_stack([(after - before) / (2 * h) for after, before in ends])


def _compare(
    asked: Sequence[Question],
    answers: Sequence[Returned],
    right: Sequence[object] | np.ndarray,
    unit: str,
) -> CheckPoint:
    """Compare a function's answers with what numpy says."""
    for (name, arguments), answer, wanted in zip(asked, answers, right, strict=True):
        true = np.array(wanted, dtype=float)
        got = answer.array(*true.shape)
        call = f"{name}({', '.join(map(_shown, arguments))})"
        if answer.error:
            return CheckPoint(False, f"{call} fails: {answer.error}")
        if got is None:
            size = " x ".join(map(str, true.shape))
            return CheckPoint(False, f"{call} gives {answer.value!r:.60}, not {size} numbers")
        if not np.allclose(got, true, rtol=1e-3, atol=1e-3):
            return CheckPoint(False, f"{call} gives {_shown(got)}, but it is {_shown(true)} {unit}")
    return CheckPoint(True, f"{asked[0][0]} is right in {len(answers)} cases")


def _secant(J: np.ndarray, dp: np.ndarray, answers: Sequence[Returned]) -> CheckPoint:
    """Check that an update explains the step, and leaves what is across it as it was."""
    dq, across = np.array(TEST_STEP), np.array((-TEST_STEP[1], TEST_STEP[0]))
    for before, wanted, answer in zip(J, dp, answers, strict=True):
        after = answer.array(2, 2)
        if after is None:
            return CheckPoint(
                False, f"broyden_update fails: {answer.error or repr(answer.value)[:60]}"
            )
        if not np.allclose(after @ dq, wanted, rtol=1e-6, atol=1e-6):
            return CheckPoint(
                False,
                f"broyden_update: the new J times dq is {_shown(after @ dq)}, "
                f"but the step was {_shown(wanted)}",
            )
        if not np.allclose(after @ across, before @ across, rtol=1e-6, atol=1e-6):
            return CheckPoint(
                False, "broyden_update changes J in a direction that the step says nothing of"
            )
    return CheckPoint(True, "broyden_update explains each step, and changes nothing else")


def _searched(
    name: str, answers: Sequence[Returned], goals: Sequence[Sequence[float]], most: int
) -> CheckPoint:
    """Check that a search ends at its goal, and soon."""
    steps = []
    for goal, answer in zip(goals, answers, strict=True):
        poses = answer.array(len(answer.value), 2) if isinstance(answer.value, list) else None
        if answer.error or poses is None or not len(poses):
            return CheckPoint(False, f"{name}: search fails: {answer.error or 'it gives no poses'}")
        off = math.dist(_tip(poses[-1]), goal)
        if off > 0.002:
            return CheckPoint(
                False,
                f"{name}: after {len(poses) - 1} steps the tip is {off:.3g} cm from "
                f"{_shown(goal)}, 0.001 are allowed",
            )
        steps.append(len(poses) - 1)
    return CheckPoint(
        max(steps) <= most,
        f"{name}: at the goal after {', '.join(map(str, steps))} steps, {most} are allowed",
    )


def _step_response(
    name: str, t: np.ndarray, q: np.ndarray, before: float, target: float
) -> CheckPoint:
    """Judge how a joint went from one angle to another, deg."""
    end = q[t > TARGET_TIME - 0.5] if len(t) else q
    if not len(end):
        return CheckPoint(False, f"{name}: the script ended before")
    step = target - before
    inside = np.flatnonzero(np.abs(q - target) < abs(step) / 10)
    rise = float(t[inside[0]]) if len(inside) else math.inf
    beyond = float(np.max((q - target) * math.copysign(1, step)))
    off, hunting = abs(float(end.mean()) - target), float(np.ptp(end))
    is_right = (
        rise <= RISE_TIME and beyond <= OVERSHOOT and off <= TARGET_TOLERANCE and hunting <= HUNTING
    )
    return CheckPoint(
        is_right,
        f"{name}: near after {rise:.2f} s ({RISE_TIME:g}), beyond by {max(0, beyond):.1f} deg "
        f"({OVERSHOOT:g}), at the end {off:.1f} deg off ({TARGET_TOLERANCE:g}) and "
        f"{hunting:.1f} deg to and fro ({HUNTING:g})",
    )


def _failed(trial: TrialRun) -> Iterator[CheckPoint]:
    if trial.complaint:
        yield CheckPoint(False, f"the script failed: {trial.complaint}")


def _shown(values: object) -> str:
    """Return numbers for people."""
    return np.array2string(
        np.asarray(values, dtype=float), precision=3, suppress_small=True, separator=", "
    ).replace("\n", "")
