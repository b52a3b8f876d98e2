"""Visual servoing: ours, the report's method, the literature's, and two that know the truth.

One seed is one set-up: arm, errors of its description, camera, start, goal and noise; all methods
run on it.  Everything is real but the points: the servo loop, the arm's control on emulated motors,
the encoded messages on a socket, in virtual time.  With `rendered` the points are real, too: frames
are rendered and tracked.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from laptop.bench.servo_peers import PeerServo, TrueJacobian, law_named, true_jacobians
from laptop.bench.servo_phases import phases_of
from laptop.bench.servo_scenarios import (
    ARMS,
    BASELINE,
    CLAIRVOYANT,
    ORACLE,
    PEERS,
    SCENARIOS,
    ServoScenario,
    methods_of,
)
from laptop.bench.servo_setups import (
    HEIGHT,
    WIDTH,
    PinholeCameras,
    Pixel,
    Pixels,
    SetUp,
    image_distance,
    is_in_image,
    moving_goal,
    rendered_set_up,
    set_up,
)
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.plant_constants import CPU, read_plant
from laptop.emulator.host.program import Program
from laptop.emulator.rendered_tracker import rendered
from laptop.emulator.rig import Rig
from laptop.emulator.scene import scene as pictured
from laptop.emulator.virtual_tracker import FrameChain, Markers, See, VirtualTracker
from robot.motion import kinematics

MAX_MOVES, TIME_BUDGET = 60, 180.0
"""Limits of every run, moves and s, which a failure counts as."""

SUCCESS_TOLERANCES = 1.6
"""Greatest true distance at which a claim is true, in tolerances."""

FOLLOW_WINDOW = (6.0, 20.0)
"""Time from which and up to which the distance from a moving goal counts, s."""


@dataclass(frozen=True)
class ServoResult:
    """One run: px, s; `moves` and `seconds` of a failure are those of the budget.

    success  claimed and true; where the goal moves, that it was followed to the end
    error    true distance from the goal at the end, in the image, all cameras' together
    miss     the same where they are, mm; None where the goal moves
    rms      true distance from a moving goal; None where it stands
    phases   where the seconds of the run went, by PHASES
    """

    scene: str
    arm: str
    method: str
    seed: int
    success: bool
    claimed: bool
    verdict: str
    moves: float
    measurements: int
    frames: int
    seconds: float
    error: float
    miss: float | None = None
    rms: float | None = None
    phases: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ServoCase:
    """One seed under one scenario on one arm, with its methods and rows (servo.Rows)."""

    name: str
    scenario: ServoScenario
    arm: str
    seed: int
    methods: tuple[str, ...]
    rendered: bool = False
    rows: str = "stereo"
    cpu: float = CPU


def points(
    cameras: PinholeCameras,
    brick: EmulatedBrick,
    goal: Callable[[float], Pixels],
    scenario: ServoScenario,
    seed: int,
) -> See:
    """Return a tracker's view: the true places with noise, and outliers anywhere in the image."""
    rngs = {
        name: random.Random(f"{seed}/noise" + (f"/{name}" if name != "A" else ""))
        for name in cameras
    }

    def seen(place: Pixel, draw: random.Random) -> tuple[float, float, float] | None:
        noisy = [x + draw.gauss(0, scenario.sigma) for x in place]
        astray = draw.uniform(0, WIDTH), draw.uniform(0, HEIGHT)
        u, v = astray if draw.random() < scenario.outliers else noisy
        return (u, v, 1.0) if is_in_image(place) else None

    def see(name: str, index: int, t: float) -> Markers:
        draw = rngs[name]
        tip = seen(cameras[name](brick.plant.q), draw)
        return {"effector": tip, "goal": seen(goal(t)[name], draw)}

    return see


class ServoView(NamedTuple):
    """The cameras of a run.

    cameras  ideal ones
    shown    scenes that are rendered, by camera; {}: the ideal cameras' points are seen
    goal     time, s -> place of the goal in each picture, px
    """

    cameras: PinholeCameras
    shown: dict[str, pictured.Scene]
    goal: Callable[[float], Pixels]

    def see(self, brick: EmulatedBrick, case: ServoCase) -> See:
        """Return the tracker's view of a brick's arm."""
        if self.shown:
            return rendered(self.shown, brick)
        return points(self.cameras, brick, self.goal, case.scenario, case.seed)


def _set_up(case: ServoCase) -> tuple[SetUp, ServoView]:
    """Return the set-up of a case, and its cameras."""
    scenario = case.scenario
    shown: dict[str, pictured.Scene] = {}
    if case.rendered:
        setting, cameras, shown = rendered_set_up(case.arm, case.seed, scenario)
    else:
        setting, cameras = set_up(case.arm, case.seed, scenario)
    if scenario.speed:
        return setting, ServoView(cameras, shown, moving_goal(cameras, setting, scenario.speed))
    fixed = {name: one.truth(setting.goal)["goal"] for name, one in shown.items()}
    fixed = fixed or cameras(setting.goal)
    return setting, ServoView(cameras, shown, lambda t: fixed)


def _bounds(scenario: ServoScenario) -> dict[str, Any]:
    """Return the options of RunTerms that say when a run ends."""
    moves = bool(scenario.speed)
    return {
        "budget": FOLLOW_WINDOW[1] if moves else TIME_BUDGET,
        "most_moves": None if moves else MAX_MOVES,
        "follow": scenario.tolerance if moves else None,
    }


def run_one(case: ServoCase, method: str) -> ServoResult:
    """Run one method on one set-up."""
    scenario, moves = case.scenario, bool(case.scenario.speed)
    setting, view = _set_up(case)
    cameras, goal = view.cameras, view.goal
    chain = FrameChain(30.0, scenario.latency, scenario.jitter, scenario.drops)
    plant = f"{setting.plant},cpu={case.cpu}"
    verdict, rms, seconds = None, None, TIME_BUDGET
    with Rig(setting.configured, setting.arm, plant, start=setting.start) as rig:
        world, brick = rig.world, rig.brick
        with (
            VirtualTracker(
                world, view.see(brick, case), chain, tuple(cameras), case.seed
            ) as tracker,
            servo_loop(case, method, setting, cameras, tracker, rig, **_bounds(scenario)) as loop,
        ):
            began = world.now()
            try:
                if method == CLAIRVOYANT:
                    loop.go_to_goal(setting)
                verdict = loop.servoing.run()
                seconds = world.now() - began
                loop.arm.park()
                word = verdict.word
            except Exception as problem:  # a crash is a result here, and must not end the bench
                word = f"{type(problem).__name__}: {problem}"
            if moves:
                # A servo that gave up early stands while the goal goes on.
                world.sleep(max(0.0, began + FOLLOW_WINDOW[1] - world.now()))
                rms = _rms(brick, cameras, goal, began)
    q = brick.plant.q
    error = image_distance(cameras(q), goal(world.now()), loop.servo.rows)
    miss = 10 * math.dist(*(kinematics.forward(setting.arm, pose) for pose in (q, setting.goal)))
    claimed = word == "converged"
    success = claimed and error <= SUCCESS_TOLERANCES * scenario.tolerance
    if moves:
        success, claimed = word in ("converged", "budget spent"), False
    return ServoResult(
        scene=case.name,
        arm=case.arm,
        method=method,
        seed=case.seed,
        success=success,
        claimed=claimed,
        verdict=word,
        moves=verdict.moves + (method == CLAIRVOYANT) if verdict and success else MAX_MOVES,
        measurements=verdict.measurements if verdict else 0,
        frames=verdict.frames if verdict else 0,
        seconds=seconds if success else TIME_BUDGET,
        error=error,
        miss=None if moves else miss,
        rms=rms,
        phases=phases_of(loop.decisions, brick.record, began),
    )


class ServoLoop(NamedTuple):
    """A program's VisualServoing, its servo and its arm, the program, and what it decides.

    decisions  (when, s; action; computing, s) of each, as they come
    """

    servoing: Any
    servo: Any
    arm: Any
    program: Program
    decisions: list[tuple[float, str, float]]

    def go_to_goal(self, setting: SetUp) -> None:
        """Go to the goal's joint angles, by one who is told them, and by how much the zero is off.

        At the speed of the servo's own moves.  It counts as decided at once, and as a move.
        """
        self.decisions.append((self.program.clock.now(), "move", 0.0))
        error = math.radians(read_plant(setting.plant)["zero_error"])
        fastest = max(joint.max_speed for joint in setting.arm.joints)
        speed = min(1.0, self.program["robot.servoing.loop"].MAX_JOINT_SPEED / fastest)
        self.arm.reach([a - error for a in setting.goal], speed)


@contextmanager
def servo_loop(
    case: ServoCase,
    method: str,
    setting: SetUp,
    cameras: PinholeCameras,
    tracker: VirtualTracker,
    rig: Rig,
    **options: Any,
) -> Iterator[ServoLoop]:
    """Provide a servo loop on a rig, before a tracker.

    Args:
        case: to be run.
        method: its name.
        setting: of the case.
        cameras: ideal ones, for the oracle.
        tracker: that the loop listens to.
        rig: with the emulated brick.
        options: of RunTerms.
    """
    with rig.program() as program:
        state = program["robot.motion.zero"].Zero(setting.configured, rig.state_folder)
        arm = program["robot.motion.arm"].RobotArm(
            setting.configured, program.clock, state, say=lambda line: None
        )
        arm.load_zero()
        servo, stream = _servo(program, method, setting, cameras, rig.brick, case)
        client = tracker.client(program.clock, make=program["robot.tracking_client"].TrackingClient)
        reporter = program["robot.servoing.run_reporter"].RunReporter(say=lambda line: None)
        decisions = noted_decisions(reporter)
        servoing = program["robot.servoing.loop"]
        terms = servoing.RunTerms(**options)
        loop = servoing.VisualServoing(arm, client, program.clock, servo, terms, stream, reporter)
        yield ServoLoop(loop, servo, arm, program, decisions)


def noted_decisions(reporter: Any) -> list[tuple[float, str, float]]:
    """Return a list to which a RunReporter adds each step from now on, as ServoLoop has them."""
    decisions: list[tuple[float, str, float]] = []
    step = reporter.step

    def noted(
        t: float, servo: Any, q: Any, seen: Any, decision: Any, frames: int, computing: float
    ) -> None:
        decisions.append((t, decision.action, computing))
        step(t, servo, q, seen, decision, frames, computing)

    reporter.step = noted
    return decisions


def _servo(
    program: Program,
    method: str,
    setting: SetUp,
    cameras: PinholeCameras,
    brick: EmulatedBrick,
    case: ServoCase,
) -> tuple[Any, Any]:
    scenario, described = case.scenario, setting.configured
    rows = program["robot.servoing.rows"].Rows(case.rows, len(described.joints))
    if method in PEERS:
        truth = true_jacobians(cameras, brick)
        return PeerServo(law_named(method), described, scenario.tolerance, rows, truth), None
    if method in (ORACLE, CLAIRVOYANT):
        kind = program["robot.servoing.image_models"].ModelKind
        models = kind(ORACLE, lambda name: TrueJacobian(cameras[name], brick))
        servo = program["robot.servoing.servo"].Servo(
            described, models, scenario.tolerance, known=True, rows=rows
        )
        return servo, program["robot.servoing.stream"].Stream(
            servo
        ) if scenario.mode == "stream" else None
    if method.startswith(BASELINE):
        # It ends where it is near; after a goal that moves it has to go on.
        tolerance = 0.0 if scenario.speed else scenario.tolerance
        make = program["robot.servoing.report_servo"].ReportServo
        return make(described.joints, tolerance, rows, robust=method != BASELINE), None
    make = program["robot.servoing.runs"].make_servo
    return make(described, method, scenario.mode, scenario.tolerance, setting.seed, case.rows)


def _rms(
    brick: EmulatedBrick, cameras: PinholeCameras, goal: Callable[[float], Pixels], began: float
) -> float:
    squares = [
        image_distance(cameras(sample.q), goal(sample.t)) ** 2
        for sample in brick.record[::8]
        if FOLLOW_WINDOW[0] <= sample.t - began <= FOLLOW_WINDOW[1]
    ]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.inf


def run_case(case: ServoCase) -> list[ServoResult]:
    """Run all methods on one set-up."""
    return [run_one(case, method) for method in case.methods]


def cases(
    seeds: range,
    name: str,
    arms: Sequence[str] = ARMS,
    methods: Sequence[str] = (),
    rendered: bool = False,
    rows: str = "stereo",
    cpu: float = CPU,
) -> list[ServoCase]:
    """Return a case per seed, arm and condition of a scene, by default with the scene's methods."""
    methods = tuple(methods) or methods_of(name, rendered)
    kinds = "rendered" if rendered else "", rows if rows != "stereo" else ""
    return [
        ServoCase(
            ", ".join(filter(None, (label or name, *kinds))),
            scene,
            arm,
            seed,
            methods,
            rendered,
            rows,
            cpu,
        )  # fmt: skip
        for arm in arms
        for label, scene in SCENARIOS[name]
        for seed in seeds
    ]
