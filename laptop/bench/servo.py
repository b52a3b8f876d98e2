"""Servoing, measured: the report's method, ours, and an oracle that knows the true Jacobian.

One seed is one set-up: arm, errors of its description, camera, start, goal and noise; all methods
run on it.  Everything is real but the points: the servo loop, the arm's control on emulated motors,
the encoded messages on a socket, in virtual time.  With `rendered` the points are real, too: frames
are rendered and tracked.
"""

from __future__ import annotations

import functools
import gc
import itertools
import math
import random
import re
import tempfile
import time
import timeit
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.bench import workers
from laptop.simulator.device.brick import EmulatedBrick
from laptop.simulator.device.plant import CPU, read_plant
from laptop.simulator.host import program as programs
from laptop.simulator.host.program import Program
from laptop.simulator.host.world import World
from laptop.simulator.scene import scene as pictured
from laptop.simulator.scene.scene import completed, marker_centre, place_camera, read_scene
from laptop.simulator.scene.sight import rendered
from laptop.simulator.session import park_on_file
from laptop.simulator.virtual_tracker import Markers, See, VirtualTracker
from robot.motion import kinematics
from robot.servoing.chain_model import ROUND
from robot.servoing.image_model import LinearImageModel, straight
from robot.servoing.measurement import Measurement
from robot.servoing.rows import Rows
from robot.servoing.runs import make_servo
from robot.servoing.servo import Servo
from shared.arm_description import Arm, find_arm, read_arm
from shared.messages import LEAST_CONFIDENCE

Pose = tuple[float, ...]
Pixel = tuple[float, float]
Pixels = dict[str, Pixel]
"""By camera."""

ARMS = ("planar", "geared")
"""Those of the plane, of which the scenes' figures are told; an arm in space is asked for."""
METHODS = ("report", "report, median", "broyden", "kalman", "chain", "oracle")
DEFAULT = "chain"

MOST_MOVES, BUDGET = 60, 180.0
"""Of every run; a failure counts as so many moves and seconds."""

MOST_DRAWN = 1000
"""Poses; where no two of so many are far enough apart in the image, another camera is drawn."""

WIDTH, HEIGHT = 640, 480
"""Of every picture, px."""

TRUE = 1.6
"""A claim is true when the tip is within so many tolerances of the goal."""

FOLLOWED = (6.0, 20.0)
"""Between these times the distance from a moving goal counts, s."""


@dataclass(frozen=True)
class Scene:
    """What a set-up is drawn from, and what is asked."""

    tolerance: float = 5.0
    sigma: float = 1.0
    outliers: float = 0.0
    latency: float = 0.06
    jitter: float = 0.0
    drops: float = 0.0
    tilt: float = 55.0
    bend: tuple[float, float] = (20.0, 125.0)
    turn: float = 85.0
    speed: float = 0.0
    mode: str = "look"


SCENES = {
    "nominal": [("", Scene())],
    "outliers": [("10 % outliers", Scene(outliers=0.1))],
    "lego": [
        (
            "LEGO stress",
            Scene(tolerance=8.0, sigma=2.0, outliers=0.05, tilt=70.0, bend=(5.0, 138.0), turn=92.0),
        )
    ],
    "precise": [("2 px", Scene(tolerance=2.0))],
    "latency": [
        (f"stream, {1000 * t:.0f} ms", Scene(latency=t, jitter=0.02, drops=0.05, mode="stream"))
        for t in (0.03, 0.12, 0.25, 0.4)
    ],
    "moving": [
        (f"goal at {v:.0f} px/s", Scene(latency=0.12, speed=v, mode="stream"))
        for v in (10.0, 25.0, 50.0)
    ],
}
"""By name: what is asked, and of which scene."""

LINKS = {
    "planar": ((10, 16), (8, 14)),
    "spatial": ((11, 14), (10, 13), (8, 11)),
}
"""Between which lengths links are drawn, by kind of chain, cm."""

LOW, NARROW = 2.0, 5.0
"""In space a tip starts and ends at least so high above the table and so far from the axis of the
base (where the base moves nothing), cm."""

INSIDE = math.radians(10)
"""And its joints are so far from their limits, as those in the plane are, rad."""

ABOVE, ASIDE = (0.0, 20.0), (75.0, 90.0)
"""Tilt of the first camera of an arm in space, and of the second, degrees."""

AWAY, WIDE = (55.0, 65.0), (420.0, 520.0)
"""Their distances from the middle of the arm's workspace, cm, and their focal lengths, px."""

RENDERED = ("nominal", "precise", "latency")
"""Those that differ by more than the noise of points."""


def methods_of(name: str, rendered: bool = False) -> tuple[str, ...]:
    """The rows of a scene if nothing is said."""
    if rendered:
        return (DEFAULT,)
    if name == "latency":
        return DEFAULT, "oracle"
    return ("report", DEFAULT, "oracle") if name == "moving" else METHODS


@dataclass(frozen=True)
class SetUp:
    """One arm, its cameras, one task.

    Attributes:
        arm: as it is.
        told: as the brick believes it to be: its links are off by up to 5 %.
        plant: as read_plant has it: the zero is off by up to 1.5 degrees.
        scenes: constants of the synthetic camera, by camera.
        start, goal: joint angles, rad.
    """

    seed: int
    arm: Arm
    told: Arm
    plant: str
    scenes: dict[str, dict[str, Any]]
    start: Pose
    goal: Pose


class Camera:
    """Where the marker on the tip is seen, px, without noise."""

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self._arm = arm
        self._constants = completed(arm, constants)
        self._pinhole = place_camera(arm, constants)

    def __call__(self, q: Sequence[float]) -> Pixel:
        """(u, v) with the joints at q, rad."""
        place = marker_centre(self._arm, self._constants, tuple(q))
        u, v = self._pinhole.project(place[None])[0]
        return float(u), float(v)

    def jacobian(self, q: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """ds/dq at q by central differences, px/rad."""
        h = 1e-5
        columns = []
        for k in range(len(q)):
            ahead, behind = (
                self([a + sign * h * (i == k) for i, a in enumerate(q)]) for sign in (1, -1)
            )
            columns.append([(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)])
        return tuple(zip(*columns, strict=True))


class Cameras(dict[str, Camera]):
    """All of a set-up, by name."""

    def __call__(self, q: Sequence[float]) -> Pixels:
        """Where each sees the tip with the joints at q, rad."""
        return {name: camera(q) for name, camera in self.items()}

    def shows(self, q: Sequence[float]) -> bool:
        """Whether the tip is in every picture."""
        return all(map(_inside, self(q).values()))


def _inside(place: Pixel) -> bool:
    return 0 <= place[0] <= WIDTH - 1 and 0 <= place[1] <= HEIGHT - 1


def apart(one: Pixels, other: Pixels, rows: Rows | None = None) -> float:
    """Distance in the image, px, in the rows that count (all if None) of all cameras together."""
    rows = rows or Rows("stereo", 0)
    return math.dist(rows.values(one), rows.values(other))


def _drawn_arm(name: str, draw: random.Random) -> Arm:
    arm = read_arm(find_arm(name))
    lengths = [draw.uniform(*bounds) for bounds in LINKS[arm.chain]]
    joints = [j._replace(link=link) for j, link in zip(arm.joints, lengths, strict=True)]
    if arm.chain == "planar":
        joints = [
            joint._replace(
                lower=-math.radians(limit),
                upper=math.radians(limit),
                stop_lower=-math.radians(limit + 10),
                stop_upper=math.radians(limit + 10),
                home=0.0,
            )
            for joint, limit in zip(joints, (95, 140), strict=True)
        ]
    return arm._replace(joints=tuple(joints))


def _drawn_scenes(arm: Arm, seed: int, scene: Scene, draw: random.Random) -> dict[str, dict]:
    """Any camera; of an arm in space, one that looks down on it and one from some side."""

    def turned() -> str:
        return f"azimuth={draw.uniform(-180, 180):.3f},roll={draw.uniform(-180, 180):.3f}"

    if arm.chain == "planar":
        texts = {
            "A": f"tilt={draw.uniform(0, scene.tilt):.3f},{turned()},"
            f"focal={draw.uniform(500, 900):.1f}"
        }
    else:
        texts = {
            name: f"tilt={draw.uniform(*tilts):.3f},{turned()},"
            f"distance={draw.uniform(*AWAY):.2f},focal={draw.uniform(*WIDE):.1f}"
            for name, tilts in (("A", ABOVE), ("B", ASIDE))
        }
    return {name: read_scene(f"{text},seed={seed}", name) for name, text in texts.items()}


def _drawn_poses(arm: Arm, scene: Scene, side: int, draw: random.Random) -> Iterator[Pose]:
    """Poses of one elbow branch."""
    while True:
        turn = math.radians(draw.uniform(-scene.turn, scene.turn))
        if arm.chain == "planar":
            yield turn, side * math.radians(draw.uniform(*scene.bend))
            continue
        shoulder, elbow = arm.joints[1:]
        pitch = draw.uniform(shoulder.lower + INSIDE, shoulder.upper - INSIDE)
        pose = turn, pitch, -math.radians(draw.uniform(*scene.bend))
        x, y, z = kinematics.forward(arm, pose)
        if pose[2] > elbow.lower + INSIDE and z > LOW and math.hypot(x, y) > NARROW:
            yield pose


@functools.lru_cache(maxsize=8)
def set_up(arm_name: str, seed: int, scene: Scene) -> tuple[SetUp, Cameras]:
    """The set-up of a seed, after section 2.1 of the method's facts: the same for all methods."""
    draw = random.Random(f"{seed}/{scene.tilt}/{scene.bend}/{scene.turn}")
    arm = _drawn_arm(arm_name, draw)
    told = arm._replace(
        joints=tuple(j._replace(link=j.link * (1 + draw.uniform(-0.05, 0.05))) for j in arm.joints)
    )
    while True:
        scenes = _drawn_scenes(arm, seed, scene, draw)
        cameras = Cameras({name: Camera(arm, constants) for name, constants in scenes.items()})
        poses = _drawn_poses(arm, scene, draw.choice((-1, 1)), draw)
        for _ in range(MOST_DRAWN):
            start, goal = next(poses), next(poses)
            seen = cameras.shows(start) and cameras.shows(goal)
            if seen and apart(cameras(start), cameras(goal)) >= 80:
                plant = f"zero_error={draw.uniform(-1.5, 1.5):.3f}"
                return SetUp(seed, arm, told, plant, scenes, start, goal), cameras


class TrueJacobian:
    """What an oracle knows: J at the true pose; the door of robot.servoing's models."""

    def __init__(self, camera: Camera, brick: EmulatedBrick) -> None:
        self._camera, self._brick = camera, brick

    def observe(self, q: Any, s: Any, variance: float, standing: bool = True) -> None:
        """Nothing is learned."""

    def prepare(self, q: Any, s: Any, variance: float) -> Iterator[None]:
        """Nothing is learned."""
        return iter(())

    def seen_from(self, q: Sequence[float], s: Sequence[float]) -> LinearImageModel:
        """J is right here; elsewhere it is not."""
        jacobian = self._camera.jacobian(self._brick.plant.q)
        offset = [
            y - sum(a * b for a, b in zip(row, q, strict=True))
            for y, row in zip(s, jacobian, strict=True)
        ]
        return straight(jacobian, offset)

    def refit(self) -> Iterator[None]:
        """There is nothing to fit."""
        return iter(())

    def shape(self) -> Any:
        """The same, but for its place in the image."""
        return straight(self._camera.jacobian(self._brick.plant.q))

    def covariance(self) -> list[list[float]]:
        """There is no doubt."""
        n = len(self._brick.arm.joints)
        return [[0.0] * n for _ in range(n)]

    def doubt_all(self) -> None:
        """There is no doubt."""


@dataclass(frozen=True)
class Result:
    """One run: px, s; `moves` and `seconds` of a failure are those of the budget.

    success  claimed and true; where the goal moves, that it was followed to the end
    error    true distance from the goal at the end, in the image, all cameras' together
    miss     the same where they are, mm; None where the goal moves
    rms      true distance from a moving goal; None where it stands
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


@dataclass(frozen=True)
class Case:
    """One seed under one scene on one arm; which methods, by which rows (servo.Rows)."""

    name: str
    scene: Scene
    arm: str
    seed: int
    methods: tuple[str, ...]
    rendered: bool = False
    rows: str = "stereo"
    cpu: float = CPU


def moving_goal(cameras: Cameras, set_up: SetUp, speed: float) -> Callable[[float], Pixels]:
    """Where a goal is that runs round at a steady `speed`, px/s: a circle on the table."""
    draw = random.Random(f"{set_up.seed}/path")
    radius = draw.uniform(2.5, 5)
    side = math.copysign(1, set_up.goal[-1])

    def pose(p: np.ndarray) -> Pose | None:
        """The posture there, on the goal's side of the elbow, away from stretched and folded."""
        try:
            q = kinematics.inverse(set_up.arm, tuple(p), "up" if side > 0 else "down")
        except kinematics.Unreachable:
            return None
        return q if math.radians(25) < abs(q[-1]) < math.radians(125) else None

    way = np.linspace(0, draw.choice((-1, 1)) * 2 * math.pi, 200)
    ring = radius * np.column_stack([np.cos(way), np.sin(way)])
    poses: list[Pose | None] = [None]
    while None in poses:
        turn, bend = math.radians(draw.uniform(-70, 70)), side * math.radians(draw.uniform(40, 110))
        middle = np.array(kinematics.forward(set_up.arm, (turn, bend)))
        poses = [pose(middle + p) for p in ring]
        radius *= 0.99
        ring *= 0.99
    path = np.array([[x for place in cameras(q).values() for x in place] for q in poses if q])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])

    def at(t: float) -> Pixels:
        row = [float(np.interp((speed * t) % along[-1], along, column)) for column in path.T]
        return dict(zip(cameras, zip(row[::2], row[1::2], strict=True), strict=True))

    return at


def points(
    cameras: Cameras, brick: EmulatedBrick, goal: Callable[[float], Pixels], scene: Scene, seed: int
) -> See:
    """What a tracker would say: the true places with noise, and outliers anywhere in the image."""
    luck = {
        name: random.Random(f"{seed}/noise" + (f"/{name}" if name != "A" else ""))
        for name in cameras
    }

    def seen(place: Pixel, draw: random.Random) -> tuple[float, float, float] | None:
        noisy = [x + draw.gauss(0, scene.sigma) for x in place]
        astray = draw.uniform(0, WIDTH), draw.uniform(0, HEIGHT)
        u, v = astray if draw.random() < scene.outliers else noisy
        return (u, v, 1.0) if _inside(place) else None

    def see(name: str, index: int, t: float) -> Markers:
        draw = luck[name]
        tip = seen(cameras[name](brick.plant.q), draw)
        return {"effector": tip, "goal": seen(goal(t)[name], draw)}

    return see


def under_the_tip(arm: Arm, constants: dict[str, Any], q: Pose) -> tuple[float, float]:
    """Where a marker must lie on the paper, cm, for the tip's marker to cover it at q.

    It lies where the camera's ray through the tip's marker meets the paper.
    """
    eye = place_camera(arm, constants).position
    x, y = kinematics.forward(arm, q)
    height = constants["marker_height"]
    share = eye[2] / (eye[2] - height)
    return float(eye[0] + share * (x - eye[0])), float(eye[1] + share * (y - eye[1]))


PAPER = (-0.3, 1.0), (-0.7, 1.1)
"""Where a goal marker is laid, x and y in reaches of the arm: on the paper."""


@functools.lru_cache(maxsize=4)
def rendered_set_up(
    arm_name: str, seed: int, scene: Scene
) -> tuple[SetUp, Cameras, dict[str, pictured.Scene]]:
    """A set-up whose goal is a marker, on the paper or in space; both are seen at the start.

    In space, where the arm may stand before it, the tip is seen at the goal, too.  The first of the
    seed's own, then of those far behind it, for which that is so.
    """
    for turn in itertools.count():
        setting, cameras = set_up(arm_name, seed + turn * 1_000_000, scene)
        arm = setting.arm
        if kinematics.coordinates(arm) == 2:
            x, y = under_the_tip(arm, setting.scenes["A"], setting.goal)
            reach = kinematics.reach(arm)[1]
            if not all(a < z / reach < b for z, (a, b) in zip((x, y), PAPER, strict=True)):
                continue
            goal = {"goal_x": x, "goal_y": y}
        else:
            names = ("goal_x", "goal_y", "goal_z")
            goal = dict(zip(names, kinematics.forward(arm, setting.goal), strict=True))
        shown = {
            name: pictured.Scene(arm, {**constants, **goal, "fps_wander": 0.0})
            for name, constants in setting.scenes.items()
        }
        seen = [min(s.visible(setting.start).values()) for s in shown.values()]
        if kinematics.coordinates(arm) == 3:
            seen += [s.visible(setting.goal)["effector"] for s in shown.values()]
        if min(seen) > 0.95 and (kinematics.coordinates(arm) == 2 or _found(setting, shown)):
            return setting, cameras, shown
    raise AssertionError("never")


def _found(setting: SetUp, shown: dict[str, pictured.Scene]) -> bool:
    """Whether the tracker is sure of both markers in every camera's first frame."""
    brick = EmulatedBrick(World(), setting.arm, read_plant(setting.plant), setting.start)
    see = rendered(shown, brick)
    seen = [marker for name in shown for marker in (see(name, 0, 0.0) or {}).values()]
    return all(marker is not None and marker[2] >= LEAST_CONFIDENCE for marker in seen)


def run_one(case: Case, method: str, log: Any = None, say: Any = None) -> Result:
    """One method on one set-up."""
    scene = case.scene
    shown: dict[str, pictured.Scene] = {}
    if case.rendered:
        setting, cameras, shown = rendered_set_up(case.arm, case.seed, scene)
    else:
        setting, cameras = set_up(case.arm, case.seed, scene)
    world = World()
    plant = read_plant(f"{setting.plant},cpu={case.cpu}")
    brick = EmulatedBrick(world, setting.arm, plant, setting.start)
    if scene.speed:
        goal = moving_goal(cameras, setting, scene.speed)
    else:
        fixed = {name: pictured.truth(setting.goal)["goal"] for name, pictured in shown.items()}
        fixed = fixed or cameras(setting.goal)

        def goal(t: float) -> Pixels:
            return fixed

    see = rendered(shown, brick) if shown else points(cameras, brick, goal, scene, case.seed)
    verdict, rms = None, None
    with (
        tempfile.TemporaryDirectory() as folder,
        programs.on(brick) as program,
        VirtualTracker(
            world, see, 30.0, scene.latency, scene.jitter, scene.drops, tuple(cameras), case.seed
        ) as tracker,
    ):
        park_on_file(setting.told, setting.start, folder)
        state = program["robot.motion.zero"].Zero(setting.told.name, folder)
        arm = program["robot.motion.arm"].RobotArm(
            setting.told, program.clock, state, say=lambda line: None
        )
        arm.wake()
        servo, stream = _servo(program, method, setting, cameras, brick, case)
        loop = program["robot.servoing.loop"].VisualServoing(
            arm,
            tracker.client(program.clock, make=program["robot.tracking_client"].TrackingClient),
            program.clock,
            servo,
            stream=stream,
            budget=FOLLOWED[1] if scene.speed else BUDGET,
            most_moves=None if scene.speed else MOST_MOVES,
            follow=scene.tolerance if scene.speed else None,
            log=log,
            say=say or (lambda line: None),
        )
        began = world.now()
        try:
            verdict = loop.run()
            arm.park()
            word = verdict.word
        except Exception as problem:  # a crash is a result here, and must not end the bench
            if log:
                raise
            word = f"{type(problem).__name__}: {problem}"
        if scene.speed:
            # Whoever gave up early stands while the goal goes on.
            world.sleep(max(0.0, began + FOLLOWED[1] - world.now()))
            rms = _rms(brick, cameras, goal, began)
    q = brick.plant.q
    error = apart(cameras(q), goal(world.now()), servo.rows)
    miss = 10 * math.dist(*(kinematics.forward(setting.arm, pose) for pose in (q, setting.goal)))
    claimed = word == "converged"
    success = claimed and error <= TRUE * scene.tolerance
    if scene.speed:
        success, claimed = word in ("converged", "budget spent"), False
    return Result(
        case.name,
        case.arm,
        method,
        case.seed,
        success,
        claimed,
        word,
        verdict.moves if verdict and success else MOST_MOVES,
        verdict.measurements if verdict else 0,
        verdict.frames if verdict else 0,
        verdict.seconds if verdict and success else BUDGET,
        error,
        None if scene.speed else miss,
        rms,
    )


def _servo(
    program: Program,
    method: str,
    setting: SetUp,
    cameras: Cameras,
    brick: EmulatedBrick,
    case: Case,
) -> tuple[Any, Any]:
    scene, told = case.scene, setting.told
    rows = program["robot.servoing.rows"].Rows(case.rows, len(told.joints))
    if method == "oracle":
        models = {"oracle": lambda name: TrueJacobian(cameras[name], brick)}
        servo = program["robot.servoing.servo"].Servo(
            told, models, scene.tolerance, known=True, rows=rows
        )
        return servo, program["robot.servoing.stream"].Stream(
            servo
        ) if scene.mode == "stream" else None
    if method.startswith("report"):
        # It ends where it is near; after a goal that moves it has to go on.
        tolerance = 0.0 if scene.speed else scene.tolerance
        make = program["robot.servoing.report_servo"].ReportServo
        return make(told.joints, tolerance, rows, robust=method != "report"), None
    make = program["robot.servoing.runs"].make_servo
    return make(told, method, scene.mode, scene.tolerance, setting.seed, case.rows)


def _rms(
    brick: EmulatedBrick, cameras: Cameras, goal: Callable[[float], Pixels], began: float
) -> float:
    squares = [
        apart(cameras(sample.q), goal(sample.t)) ** 2
        for sample in brick.record[::8]
        if FOLLOWED[0] <= sample.t - began <= FOLLOWED[1]
    ]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.inf


def run_case(case: Case) -> list[Result]:
    """All methods on one set-up."""
    return [run_one(case, method) for method in case.methods]


# ---- all of it


def cases(
    seeds: range,
    name: str,
    arms: Sequence[str] = ARMS,
    methods: Sequence[str] = (),
    rendered: bool = False,
    rows: str = "stereo",
    cpu: float = CPU,
) -> list[Case]:
    """One for every seed, arm and condition of a scene; the scene's own methods if none is said."""
    methods = tuple(methods) or methods_of(name, rendered)
    kinds = "rendered" if rendered else "", rows if rows != "stereo" else ""
    return [
        Case(
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
        for label, scene in SCENES[name]
        for seed in seeds
    ]


def run(todo: Sequence[Case], executor: Executor | None = None) -> Iterator[list[Result]]:
    """Yield the results of all set-ups in their order.

    Args:
        todo: the cases.
        executor: does the work; None for all cores of this machine.
    """
    return workers.map_cases(run_case, todo, executor=executor)


def wilson(successes: int, n: int) -> tuple[float, float]:
    """95 % interval of a share, 0 .. 1 (E. B. Wilson 1927)."""
    z = 1.959964
    share, spread = successes / n, z * z / n
    middle = (share + spread / 2) / (1 + spread)
    half = math.sqrt(spread * (share * (1 - share) + spread / 4)) / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


Row = tuple[str, ...]

HEADINGS: Row = (
    "arm", "scene", "method", "success %", "Wilson 95 %", "false", "moves", "looks", "frames",
    "time s", "error px", "mm", "x moves", "x time", "x error",
)  # fmt: skip

MOVING_HEADINGS: Row = (
    "arm", "scene", "method", "to the end %", "Wilson 95 %", "rms px", "frames", "x rms",
)  # fmt: skip

LEGEND = (
    "p50/p95 (or p50) of all runs, failures at the full budget; mm: true distance of those that"
    " say converged; x: times the oracle's"
)


def _grouped(results: Sequence[Result]) -> dict[tuple[str, str, str], list[Result]]:
    groups: dict[tuple[str, str, str], list[Result]] = {}
    for r in results:
        groups.setdefault((r.arm, r.scene, r.method), []).append(r)
    # A condition's methods stand together.
    seen = {key[:2]: k for k, key in enumerate(groups)}
    return dict(sorted(groups.items(), key=lambda item: seen[item[0][:2]]))


def _at(values: Sequence[float | None], q: int) -> float:
    """Percentile, of those that happened."""
    return float(np.percentile([x for x in values if x is not None], q, method="higher"))


def table(results: Sequence[Result]) -> list[Row]:
    """One row per arm, condition and method; figures of failures are those of the budget."""
    groups = _grouped(results)
    moving = any(r.rms is not None for r in results)
    rows: list[Row] = []
    for key, group in groups.items():
        bound = groups.get((*key[:2], "oracle"))
        good = sum(r.success for r in group)
        low, high = wilson(good, len(group))
        share = f"{100 * good / len(group):.1f}", f"{100 * low:.1f}..{100 * high:.1f}"

        def both(field: str, digits: int, group: list[Result] = group) -> str:
            values = [getattr(r, field) for r in group]
            return "/".join(f"{_at(values, q):.{digits}f}" for q in (50, 95))

        def ratio(
            field: str,
            *quantiles: int,
            group: list[Result] = group,
            bound: list[Result] | None = bound,
        ) -> str:
            if not bound:
                return "-"
            ours, best = ([getattr(r, field) for r in some] for some in (group, bound))
            pairs = ((_at(ours, q), _at(best, q)) for q in quantiles)
            return "/".join(f"{a / b:.2f}" if b else "-" for a, b in pairs)

        frames_used = f"{_at([r.frames for r in group], 50):.0f}"
        if moving:
            rows.append((*key, *share, both("rms", 1), frames_used, ratio("rms", 50, 95)))
            continue
        looks = f"{_at([r.measurements for r in group], 50):.0f}"
        claimed = [r for r in group if r.claimed]
        missed = [r for r in claimed if r.miss is not None]
        miss = both("miss", 1, missed) if missed else "-"
        false = f"{sum(not r.success for r in claimed)}"
        rows.append(
            (
                *key, *share, false, both("moves", 0), looks, frames_used, both("seconds", 1),
                both("error", 1), miss, ratio("moves", 50, 95), ratio("seconds", 50, 95),
                ratio("error", 50),
            )
        )  # fmt: skip
    return rows


def failures(results: Sequence[Result]) -> list[str]:
    """One line per row that has failures: the verdicts, numbers aside, and how often each."""
    lines = []
    for key, group in _grouped(results).items():
        words = Counter(
            "false claim" if r.claimed else re.sub(r"-?\d[\d.]*", "N", r.verdict)
            for r in group
            if not r.success
        )
        if words:
            reasons = ", ".join(f"{n} x {word}" for word, n in words.most_common())
            lines.append(f"{'; '.join(key)}: {reasons}")
    return lines


def step_cost(arm_name: str = "planar", keys: int = 24) -> str:
    """What one decision of the default method costs, with so many key-frames held, as a line.

    The unit is the interpreter's own `a*d-b*c` on four floats, measured in the same moment: what
    the decision costs on another machine can be told from what that costs there.  Both as `timeit`
    measures: the fastest of several, without garbage collection; some decisions weigh the
    key-frames anew, and the mean is over as many as have one of these among them.
    """
    arm = read_arm(find_arm(arm_name))
    draw = random.Random(1)
    axes = {"A": (0, 1), "B": (0, 2)}  # of space, that a camera sees
    cameras = sorted(axes)[: len(arm.joints) - 1]

    def seen(q: Sequence[float], camera: str) -> Pixel:
        across, along = (kinematics.forward(arm, tuple(q))[k] for k in axes[camera])
        return 320 + 12 * across, 400 - 12 * along

    start, goal = ((0.2, 0.9), (0.6, 0.5)) if len(cameras) == 1 else ((0.2, 0.9, -1), (0.6, 1, -1))

    def measured(q: Sequence[float]) -> list[Measurement]:
        return [Measurement(name, seen(q, name), seen(goal, name), 0.1, 6) for name in cameras]

    def prepared(fits: int) -> Servo:
        servo, _ = make_servo(arm, DEFAULT, "look", 5.0)
        here: Sequence[float] = start
        for _ in arm.joints:  # all are explored
            here = servo.decide(here, measured(here)).q
        for _ in range(6 * keys):
            around = [a + draw.uniform(-0.8, 0.8) for a in start]
            for name in cameras:
                for _ in range(3):  # a frame waits for its neighbours
                    servo.observe_in_motion(name, around, seen(around, name))
        for _ in range(fits):
            for name in cameras:
                servo.models.of("chain", name).seen_from(here, seen(here, name))
        return servo

    fastest = [math.inf] * ROUND
    for fits in 10 * list(range(ROUND)):
        servo = prepared(fits)
        gc.disable()
        began = time.perf_counter()
        decision = servo.decide(start, measured(start))
        fastest[fits] = min(fastest[fits], time.perf_counter() - began)
        gc.enable()
        if decision.action != "move":
            raise AssertionError(f"a move was to be measured, not {decision.action}")
    loops = 200_000
    names = "a, b, c, d = 1.1, 2.2, 3.3, 4.4"
    unit = min(timeit.repeat("a*d-b*c", names, number=loops, repeat=5)) / loops
    step, worst = sum(fastest) / ROUND, max(fastest)
    return (
        f"one decision of {DEFAULT}, {arm_name}, with {keys} key-frames of every camera: "
        f"{1e6 * step:.0f} us (at most {1e6 * worst:.0f}), {step / unit:.0f} x a*d-b*c on four "
        f"floats ({1e9 * unit:.0f} ns)"
    )
