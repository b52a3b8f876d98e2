"""Servoing while something goes wrong: nothing may be claimed that is not so, nothing move blindly.

One seed is one set-up of the servo bench.  In mid-motion a disturbance strikes.  What is judged is
the truth of the emulator: where the tip is, which motors were driven while no camera showed
anything new, how far beyond its limit a joint went.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, grouped, seeds_of
from laptop.bench.servo import (
    MAX_MOVES,
    SUCCESS_TOLERANCES,
    ServoCase,
    points,
    servo_loop,
)
from laptop.bench.servo_scenarios import DEFAULT, ServoScenario
from laptop.bench.servo_setups import (
    HEIGHT,
    WIDTH,
    PinholeCameras,
    Pixel,
    Pixels,
    image_distance,
    is_in_image,
    set_up,
)
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.plant_constants import CPU
from laptop.emulator.host.world import World
from laptop.emulator.rig import Rig
from laptop.emulator.virtual_tracker import Markers, See, VirtualTracker
from shared.messages import Stop
from tests.claims.limits_passed import beyond_limits

MODES = ("look", "stream")

BUDGET = 60.0
"""Of every run, s."""

STRIKE = (0.5, 2.0)
"""Between these times of a run something goes wrong, s: as soon as a link turns fast, if one does.
"""
FAST, PATIENCE = 0.6, 1.0
"""How fast, rad/s, and for how long that is waited for, s."""

WOULD_SHOW = math.radians(1)
"""A joint that has turned by more must be seen to have, rad."""

NOTICED = 0.6
"""After what no camera shows has lasted so long, s, the arm stands: a sight is old after 0.3 s, a
picture takes a while to come and to be looked at, and a motor another to come to rest."""

BEYOND = 3.0
"""A limit is passed where a joint is beyond it by more, deg: its zero is off by up to 1.5."""

JUMP = 100.0
"""From the tip to what is taken for it, px."""


class DisturbedRun:
    """What a disturbance may do something to, while a run is on.

    Attributes:
        hidden: whether the tip is covered.
        decoy: where something else is taken for the tip, px, by camera; None: nothing is.
        bumped: whether the camera was knocked: by 10 degrees of roll and 40 px.
        outliers: share of false sightings.
        every: only every so many pictures come.
        shift: of the goal, px.
        struck: when it struck, s; None: not yet.
        blind: from when to when no camera shows anything new of the tip, s; inf: for ever.
        round: of pictures in a loop, how long it is, s: a brick that looks at one in three of them
            may have looked at none before they come round again.
    """

    def __init__(self, world: World, brick: EmulatedBrick, cameras: PinholeCameras) -> None:
        self.world, self.brick, self.cameras = world, brick, cameras
        self.tracker: VirtualTracker
        self.hidden = self.bumped = False
        self.decoy: Pixels | None = None
        self.outliers, self.every, self.shift = 0.0, 1, 0.0
        self.struck: float | None = None
        self.blind: tuple[float, float] | None = None
        self.round = 0.0
        self.goal: Pixels = {}
        self.luck = random.Random(0)

    def goals(self, t: float) -> Pixels:
        """Where the goal is, px, by camera."""
        return {name: (u + self.shift, v - self.shift) for name, (u, v) in self.goal.items()}

    def blind_for(self, seconds: float) -> None:
        """From now on nothing new is to be seen."""
        self.blind = self.world.t, self.world.t + seconds

    def later(self, seconds: float, what: Callable[[], None]) -> None:
        """Do something in so many seconds."""
        self.world.at(self.world.t + seconds, what)

    def taken_for_tip(self, near_goal: bool) -> None:
        """Let something else be taken for the tip: at the goal, or some way from the tip."""
        tips = self.cameras(self.brick.plant.q)
        self.decoy = self.goals(0.0) if near_goal else {n: _inside(tip) for n, tip in tips.items()}

    def see(self, look: See) -> See:
        """Return what is seen of what `look` would show."""

        def seen(name: str, index: int, t: float) -> Markers | None:
            if index % self.every:
                return None
            markers = dict(look(name, index, t) or {})
            if self.decoy:
                markers["effector"] = tuple(  # type: ignore[assignment]
                    [x + self.luck.gauss(0, 0.5) for x in self.decoy[name]] + [1.0]
                )
            if self.hidden:
                markers["effector"] = None
            for marker, place in markers.items():
                if place and self.luck.random() < self.outliers:
                    astray = self.luck.uniform(0, WIDTH), self.luck.uniform(0, HEIGHT)
                    markers[marker] = (*astray, 1.0)
                elif place and self.bumped:
                    knocked = _knocked(place[:2])
                    markers[marker] = (*knocked, 1.0) if is_in_image(knocked) else None
            return markers

        return seen


def _inside(tip: Pixel) -> Pixel:
    """A place JUMP from the tip, towards the middle of the picture, px."""
    way = WIDTH / 2 - tip[0], HEIGHT / 2 - tip[1]
    far = math.hypot(*way) or 1.0
    return tip[0] + JUMP * way[0] / far, tip[1] + JUMP * way[1] / far


def _knocked(place: Pixel) -> Pixel:
    """Where a place is seen after the knock, px."""
    u, v = place[0] - WIDTH / 2, place[1] - HEIGHT / 2
    c, s = math.cos(math.radians(10)), math.sin(math.radians(10))
    return WIDTH / 2 + c * u - s * v + 40, HEIGHT / 2 + s * u + c * v + 40


def _hide(stage: DisturbedRun, seconds: float) -> None:
    stage.hidden = True
    stage.blind_for(seconds)
    if seconds < BUDGET:
        stage.later(seconds, lambda: setattr(stage, "hidden", False))


def _freeze(stage: DisturbedRun, seconds: float, frames: int = 1) -> None:
    stage.tracker.pictures.freeze(frames=frames)
    stage.blind_for(seconds)
    stage.round = (frames - 1) / stage.tracker.fps
    if seconds < BUDGET:
        stage.later(seconds, stage.tracker.pictures.release)


def _mistake(stage: DisturbedRun, seconds: float, near_goal: bool = False) -> None:
    stage.taken_for_tip(near_goal)
    if seconds < BUDGET:
        stage.later(seconds, lambda: setattr(stage, "decoy", None))


def _delay(stage: DisturbedRun, seconds: float) -> None:
    for name in stage.tracker.latency:
        stage.tracker.latency[name] = seconds
    if seconds > 1.0:  # older ones are not looked at
        stage.blind_for(math.inf)


def _silence(stage: DisturbedRun, seconds: float) -> None:
    stage.tracker.silence(seconds)
    stage.blind_for(seconds)


DISTURBANCES: dict[str, Callable[[DisturbedRun], object]] = {
    "tip hidden for 1 s": lambda stage: _hide(stage, 1.0),
    "tip hidden for ever": lambda stage: _hide(stage, math.inf),
    "picture frozen for 2 s": lambda stage: _freeze(stage, 2.0),
    "picture frozen for ever": lambda stage: _freeze(stage, math.inf),
    "last 8 pictures in a loop": lambda stage: _freeze(stage, math.inf, 8),
    "each picture shown twice": lambda stage: stage.tracker.pictures.repeat(2),
    "pictures 0.5 s late": lambda stage: _delay(stage, 0.5),
    "pictures 1.5 s late": lambda stage: _delay(stage, 1.5),
    "2 pictures a second": lambda stage: setattr(stage, "every", 15),
    "another thing taken for the tip for 1 s": lambda stage: _mistake(stage, 1.0),
    "another thing taken for the tip": lambda stage: _mistake(stage, math.inf),
    "a thing at the goal taken for the tip": lambda stage: _mistake(stage, math.inf, True),
    "camera knocked": lambda stage: setattr(stage, "bumped", True),
    "30 % outliers": lambda stage: setattr(stage, "outliers", 0.3),
    "goal moved by 60 px": lambda stage: setattr(stage, "shift", 42.0),
    "link cut": lambda stage: stage.tracker.cut(),
    "laptop out of reach for 5 s": lambda stage: _silence(stage, 5.0),
    "shoulder blocked": lambda stage: stage.brick.jam("A"),
    "elbow unplugged": lambda stage: stage.brick.unplug("B"),
    "stopped by the laptop": lambda stage: stage.tracker.server.send(Stop("enough")),
}
"""By name: what is done in mid-run."""


@dataclass(frozen=True)
class DisturbedCase:
    """One disturbance of one run."""

    name: str
    mode: str
    arm: str
    seed: int
    cpu: float = CPU


@dataclass(frozen=True)
class DisturbedResult:
    """The outcome of one run.

    error    true distance from the goal at the end, px
    false    it says converged, and that is not true
    struck   when it struck, s since the run began; None: the run was over before
    blind_s  for how long a motor was driven after there was nothing new to be seen, s
    blind_deg  how far a link turned after NOTICED of that, deg
    beyond   by how much a joint was beyond its limit at most, deg
    """

    name: str
    mode: str
    arm: str
    seed: int
    verdict: str
    reason: str
    seconds: float
    moves: int
    error: float
    false: bool
    struck: float | None
    blind_s: float
    blind_deg: float
    beyond: float


def cases(seeds: range, arms: Sequence[str] = ("planar",), cpu: float = CPU) -> list[DisturbedCase]:
    """Every disturbance in both modes, for each seed and arm."""
    return [
        DisturbedCase(name, mode, arm, seed, cpu)
        for arm in arms
        for name in DISTURBANCES
        for mode in MODES
        for seed in seeds
    ]


def run_case(case: DisturbedCase) -> DisturbedResult:
    """Do one run, and disturb it."""
    scene = ServoScenario(mode=case.mode)
    setting, cameras = set_up(case.arm, case.seed, scene)
    plant = f"{setting.plant},cpu={case.cpu}"
    servo_case = ServoCase(case.name, scene, case.arm, case.seed, (DEFAULT,), cpu=case.cpu)
    bounds = {"budget": BUDGET, "most_moves": MAX_MOVES}
    with Rig(setting.configured, setting.arm, plant, start=setting.start) as rig:
        world, brick = rig.world, rig.brick
        stage = DisturbedRun(world, brick, cameras)
        stage.goal = cameras(setting.goal)
        stage.luck = random.Random(f"{case.seed}/{case.name}")
        truth = _Truth(stage)
        world.bodies.append(truth.note)
        see = stage.see(points(cameras, brick, stage.goals, scene, case.seed))
        with (
            VirtualTracker(world, see, cameras=tuple(cameras), seed=case.seed) as stage.tracker,
            servo_loop(servo_case, DEFAULT, setting, cameras, stage.tracker, rig, **bounds) as loop,
        ):
            began = world.t
            _strike_in_motion(stage, truth, began, DISTURBANCES[case.name])
            try:
                verdict = loop.servoing.run()
                word, reason, moves = verdict.word, verdict.reason, verdict.moves
                with suppress(loop.program["shared.arm_description"].ArmError):  # one is told
                    loop.arm.park()
            except Exception as problem:  # a crash is a result here, and must not end the rest
                word, reason, moves = type(problem).__name__, str(problem), 0
            ended = world.t
    error = image_distance(cameras(brick.plant.q), stage.goals(world.t), loop.servo.rows)
    return DisturbedResult(
        case.name,
        case.mode,
        case.arm,
        case.seed,
        word,
        reason,
        ended - began,
        moves,
        error,
        word == "converged" and error > SUCCESS_TOLERANCES * scene.tolerance,
        stage.struck and stage.struck - began,
        *truth.blindly(ended),
        beyond_limits(setting.arm, (q for _, _, q in truth.moments)),
    )


class _Truth:
    """What the emulated arm truly did: every 2 ms, when, whether driven, and where it was."""

    PERIOD = 0.002

    def __init__(self, stage: DisturbedRun) -> None:
        self._stage = stage
        self.moments: list[tuple[float, bool, tuple[float, ...]]] = []

    def note(self, t: float) -> None:
        """Take a moment down; one of the world's bodies."""
        if not self.moments or t - self.moments[-1][0] >= self.PERIOD:
            brick = self._stage.brick
            self.moments.append((t, bool(brick.driven()), tuple(brick.plant.q)))

    @property
    def speed(self) -> float:
        """Of the fastest link, rad/s."""
        return max(abs(link.speed) for link in self._stage.brick.plant.links)

    def blindly(self, end: float) -> tuple[float, float]:
        """(s that a motor was driven, deg that a link turned) when nothing new was to be seen.

        The first counts from when the tip had moved by so much that it should have been seen, or
        from when nothing was; the second from NOTICED later on, and the round of a loop.
        """
        if self._stage.blind is None:
            return 0.0, 0.0
        begin, until = self._stage.blind
        during = [m for m in self.moments if begin <= m[0] < min(until, end)]
        if not during:
            return 0.0, 0.0
        if self._stage.tracker.pictures.frozen:
            there = during[0][2]
            during = [m for m in during if _turned(m[2], there) > WOULD_SHOW]
            begin = during[0][0] if during else begin
        driven = max([t - begin for t, is_driven, _ in during if is_driven], default=0.0)
        late = [q for t, _, q in during if t > begin + NOTICED + self._stage.round]
        turned = max([_turned(q, late[0]) for q in late], default=0.0)
        return driven, math.degrees(turned)


def _turned(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _strike_in_motion(
    stage: DisturbedRun, truth: _Truth, began: float, act: Callable[[DisturbedRun], object]
) -> None:
    """Let it happen at a drawn time, once a link turns fast or that was waited for in vain."""
    due = began + stage.luck.uniform(*STRIKE)

    def look() -> None:
        if truth.speed > FAST or stage.world.t > due + PATIENCE:
            stage.struck = stage.world.t
            act(stage)
        else:
            stage.world.at(stage.world.t + 0.005, look)

    stage.world.at(due, look)


HEADINGS = (
    "disturbance", "mode", "runs", "verdicts", "false", "worst px off", "blind, s", "blind, deg",
    "beyond limit, deg",
)  # fmt: skip
LEGEND = (
    "false: says converged, and is not; blind: driven after there was nothing new to see, and "
    f"turned {NOTICED:g} s (and a round of the loop) later; beyond limit: negative, it kept away"
)


def table(results: Sequence[DisturbedResult]) -> list[tuple[str, ...]]:
    """One row per disturbance and mode; worst figures of its runs."""
    rows: list[tuple[str, ...]] = []
    for (name, mode), group in grouped(results, lambda r: (r.name, r.mode)).items():
        words = [result.verdict for result in group]
        verdicts = ", ".join(
            f"{words.count(word)} x {word}" for word in sorted(set(words), key=words.index)
        )
        claimed = [result.error for result in group if result.verdict == "converged"]
        rows.append(
            (
                name,
                mode,
                f"{len(group)}",
                verdicts,
                f"{sum(result.false for result in group)}",
                f"{max(claimed):.1f}" if claimed else "-",
                f"{max(result.blind_s for result in group):.2f}",
                f"{max(result.blind_deg for result in group):.1f}",
                f"{max(result.beyond for result in group):.1f}",
            )
        )
    return rows


def summary(results: Sequence[DisturbedResult]) -> str:
    """Return the outcome in one line."""
    struck = sum(result.struck is not None for result in results)
    return (
        f"{len(results)} runs, {struck} struck: {sum(r.false for r in results)} false converged, "
        f"{sum(r.blind_deg > math.degrees(WOULD_SHOW) for r in results)} moved blindly, "
        f"{sum(r.beyond > BEYOND for r in results)} more than {BEYOND:g} deg beyond a limit"
    )


def _shown(results: Sequence[DisturbedResult], it: Any) -> Iterator[BenchTable | str]:
    title = f"{seeds_of(it)}, cpu={it.cpu:g}, figures from the emulator; {LEGEND}"
    yield BenchTable(title, HEADINGS, table(results), 1)
    yield summary(results)


BENCH = BenchRecord(
    "disturbing", lambda it: cases(it.seeds, it.arms or ("planar",), it.cpu), run_case, _shown
)
