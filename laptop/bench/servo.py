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
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from laptop.bench.servo_peers import PeerServo, TrueJacobian, law_named, true_jacobians
from laptop.bench.servo_phases import phases_of
from laptop.bench.servo_scenarios import (
    ARMS,
    BASELINE,
    CLAIRVOYANT,
    MOVED,
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
    further_goals,
    goal_circle,
    image_distance,
    is_in_image,
    moved_cameras,
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
    """One run to one goal: px, s; `moves` and `seconds` of a failure are those of the budget.

    success  claimed and true; where the goal moves, that it was followed to the end
    error    true distance from the goal at the end, in the image, all cameras' together
    miss     the same where they are, mm; None where the goal moves
    rms      true distance from a moving goal; None where it stands
    phases   where the seconds of the run went, by PHASES
    mode     "look" or "stream", as the method ran
    goal     number of the goal, from 1 on
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
    mode: str = "look"
    goal: int = 1


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

    def scene_of(self, goal: int) -> str:
        """Return the name of what a goal, by its number, belongs to."""
        if self.scenario.goals == 1:
            return self.name
        return f"{self.name}, {'first' if goal == 1 else 'later'}"


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


class StandingGoals:
    """Goals that stand, one after the other: time, s -> place of the goal in each picture, px."""

    def __init__(self, first: Pixels) -> None:
        self._since: list[tuple[float, Pixels]] = [(-math.inf, first)]

    def add(self, t: float, goal: Pixels) -> None:
        """Add the goal from t on, s."""
        self._since.append((t, goal))

    def __call__(self, t: float) -> Pixels:
        """Return the goal's place at t."""
        return next(goal for since, goal in reversed(self._since) if since <= t)


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
        at_first = replace(setting, goal=goal_circle(setting)[0])
        return at_first, ServoView(cameras, shown, moving_goal(cameras, setting, scenario.speed))
    fixed = {name: one.truth(setting.goal)["goal"] for name, one in shown.items()}
    return setting, ServoView(cameras, shown, StandingGoals(fixed or cameras(setting.goal)))


def _bounds(scenario: ServoScenario) -> dict[str, Any]:
    """Return the options of RunTerms that say when a run ends."""
    moves = bool(scenario.speed)
    return {
        "budget": FOLLOW_WINDOW[1] if moves else TIME_BUDGET,
        "most_moves": None if moves else MAX_MOVES,
        "follow": scenario.tolerance if moves else None,
    }


def run_one(case: ServoCase, method: str) -> list[ServoResult]:
    """Run one method on one set-up, to each of its goals.

    It goes on from where it stands, and as robot.servoing.runs does: with what it has learned if
    it says that it has reached the goal before; as a new program, with what that has stored.
    """
    scenario = case.scenario
    setting, view = _set_up(case)
    view = view._replace(cameras=PinholeCameras(view.cameras))  # a set-up is another run's, too
    moves = scenario.meanwhile == MOVED
    later = moved_cameras(setting, view.cameras) if moves else view.cameras
    goals = [setting.goal, *further_goals(setting, later, scenario)]
    chain = FrameChain(30.0, scenario.latency, scenario.jitter, scenario.drops)
    plant = f"{setting.plant},cpu={case.cpu}"
    results: list[ServoResult] = []
    with Rig(setting.configured, setting.arm, plant, start=setting.start) as rig:
        world, cameras = rig.world, view.cameras
        see = view.see(rig.brick, case)
        with (
            VirtualTracker(world, see, chain, tuple(cameras), case.seed) as tracker,
            servo_loop(case, method, setting, cameras, tracker, rig, **_bounds(scenario)) as loop,
        ):
            for goal in goals:
                if results and isinstance(view.goal, StandingGoals):
                    cameras.update(later)
                    view.goal.add(world.now(), cameras(goal))
                    learned = results[-1].claimed and loop.servo.LEARNS
                    if scenario.meanwhile:
                        loop.prepare(views=loop.servo.models.views() if learned else None)
                    else:
                        loop.prepare(learned=learned)
                aimed = replace(setting, goal=goal)
                results.append(_run(case, method, len(results) + 1, aimed, view, rig, loop))
    return results


def _run(
    case: ServoCase,
    method: str,
    number: int,
    setting: SetUp,
    view: ServoView,
    rig: Rig,
    loop: ServoLoop,
) -> ServoResult:
    """Run a loop to the goal of this number, the setting's."""
    scenario, moves = case.scenario, bool(case.scenario.speed)
    world, brick, cameras = rig.world, rig.brick, view.cameras
    verdict, rms, seconds, began = None, None, TIME_BUDGET, world.now()
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
        rms = _rms(brick, cameras, view.goal, began)
    q = brick.plant.q
    error = image_distance(cameras(q), view.goal(world.now()), loop.servo.rows)
    miss = 10 * math.dist(*(kinematics.forward(setting.arm, pose) for pose in (q, setting.goal)))
    claimed = word == "converged"
    success = claimed and error <= SUCCESS_TOLERANCES * scenario.tolerance
    if moves:
        success, claimed = word in ("converged", "budget spent"), False
    return ServoResult(
        scene=case.scene_of(number),
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
        mode="stream" if loop.stream else "look",
        goal=number,
    )


class ServoLoop:
    """The loops of one method on a rig, a run after the other, as robot.servoing.runs has them.

    Args:
        program: that they run in.
        arm: its RobotArm.
        make: () -> a new servo, and the stream to steer by or None.
        options: of RunTerms.

    Attributes:
        servoing: VisualServoing of the run.
        servo: of the run.
        stream: of the run, or None.
        client: TrackingClient.
        arm: RobotArm.
        program: Program.
        decisions: (when, s; action; computing, s) of each of the run, as they come.
    """

    def __init__(
        self,
        program: Program,
        arm: Any,
        make: Callable[[], tuple[Any, Any]],
        options: dict[str, Any],
    ) -> None:
        self.program, self.arm = program, arm
        self._make, self._options = make, options
        self.servo, self.stream = make()
        self.client: Any = None
        self._pictures: Any = None

    def prepare(
        self, learned: bool = False, views: dict[str, Any] | None = None, **options: Any
    ) -> None:
        """Prepare the next run.

        Args:
            learned: whether the servo goes on with what it has learned; else it is a new one.
            views: what a new one begins with, of the one before.
            options: of RunTerms, in place of those of all runs.
        """
        if not learned:
            self.servo, self.stream = self._make()
        if views:
            self.servo.models.recall(views)
        program = self.program
        reporter = program["robot.servoing.run_reporter"].RunReporter(say=lambda line: None)
        self.decisions = noted_decisions(reporter)
        loop = program["robot.servoing.loop"]
        terms = loop.RunTerms(**{**self._options, **options})
        if self._pictures is None:
            repeated = program["robot.servoing.repeated_pictures"].RepeatedPictures
            self._pictures = repeated(self.arm.description.joints)
        self.servoing = loop.VisualServoing(
            self.arm, self.client, program.clock, self.servo, terms, self.stream, reporter,
            self._pictures,
        )  # fmt: skip

    def go_to_goal(self, setting: SetUp) -> None:
        """Go to the goal's joint angles, by one who is told them, and by how much the zero is off.

        At the speed of the servo's own moves.  It counts as decided at once, and as a move, and is
        within the run's budget.
        """
        clock = self.program.clock
        began = clock.now()
        error = math.radians(read_plant(setting.plant)["zero_error"])
        fastest = max(joint.max_speed for joint in setting.arm.joints)
        speed = min(1.0, self.program["robot.servoing.loop"].MAX_JOINT_SPEED / fastest)
        self.arm.reach([a - error for a in setting.goal], speed)
        self.prepare(learned=True, budget=self._options["budget"] - (clock.now() - began))
        self.decisions.append((began, "move", 0.0))


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

        def make() -> tuple[Any, Any]:
            return _servo(program, method, setting, cameras, rig.brick, case)

        loop = ServoLoop(program, arm, make, options)
        client = program["robot.tracking_client"].TrackingClient
        loop.client = tracker.client(program.clock, make=client)
        loop.prepare(learned=True)
        yield loop


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
        steers = scenario.mode == "stream"
        return servo, program["robot.servoing.stream"].Stream(servo) if steers else None
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
    return [result for method in case.methods for result in run_one(case, method)]


def cases(
    seeds: range,
    name: str,
    arms: Sequence[str] = ARMS,
    methods: Sequence[str] = (),
    rendered: bool = False,
    rows: str = "stereo",
    cpu: float = CPU,
    mode: str | None = None,
) -> list[ServoCase]:
    """Return a case per seed, arm and condition of a scene.

    By default with the scene's methods, in the scene's mode.
    """
    methods = tuple(methods) or methods_of(name, rendered)
    kinds = "rendered" if rendered else "", rows if rows != "stereo" else ""
    return [
        ServoCase(
            ", ".join(filter(None, (label or name, *kinds))),
            replace(scene, mode=mode or scene.mode),
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
