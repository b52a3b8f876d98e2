"""Servoing, measured: the report's method, ours, and an oracle that knows the true Jacobian.

One seed is one set-up: arm, errors of its description, camera, start, goal and noise; all methods
run on it.  Everything is real but the points: the servo loop, the arm's control on emulated motors,
the encoded messages on a socket, in virtual time.  With `rendered` the points are real, too: frames
are rendered and tracked.
"""

from __future__ import annotations

import functools
import math
import os
import random
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from laptop.simulator.brick import EmulatedBrick
from laptop.simulator.plant import read_plant
from laptop.simulator.scene import place_camera, read_scene
from laptop.simulator.session import park_on_file
from laptop.simulator.virtual_tracker import VirtualTracker
from laptop.simulator.world import World
from robot import kinematics
from robot.arm import RobotArm
from robot.image_jacobian import Picture
from robot.servo import ReportServo, Servo
from robot.visual_servoing import VisualServoing, make_servo
from shared.arm_description import Arm, find_arm, read_arm

Pose = tuple[float, ...]
Pixel = tuple[float, float]

ARMS = ("planar", "geared")
METHODS = ("report", "report, median", "broyden", "kalman", "chain", "oracle")
DEFAULT = "chain"

MOST_MOVES, BUDGET = 60, 180.0
"""Of every run; a failure counts as so many moves and seconds."""

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


@dataclass(frozen=True)
class SetUp:
    """One arm, one camera, one task.

    Attributes:
        arm: as it is.
        told: as the brick believes it to be: its links are off by up to 5 %.
        plant: as read_plant has it: the zero is off by up to 1.5 degrees.
        scene: constants of the synthetic camera.
        start, goal: joint angles, rad.
    """

    seed: int
    arm: Arm
    told: Arm
    plant: str
    scene: dict[str, Any]
    start: Pose
    goal: Pose


class Camera:
    """Where the marker on the tip is seen, px, without noise."""

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self._arm = arm
        self._pinhole = place_camera(arm, constants)
        self._height = constants["marker_height"]

    def __call__(self, q: Sequence[float]) -> Pixel:
        x, y = kinematics.forward(self._arm, tuple(q))
        u, v = self._pinhole.project(np.array([[x, y, self._height]]))[0]
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


@functools.lru_cache(maxsize=8)
def set_up(arm_name: str, seed: int, scene: Scene) -> tuple[SetUp, Camera]:
    """The set-up of a seed, after section 2.1 of the method's facts: the same for all methods."""
    draw = random.Random(f"{seed}/{scene.tilt}/{scene.bend}/{scene.turn}")
    arm = read_arm(find_arm(arm_name))
    links = draw.uniform(10, 16), draw.uniform(8, 14)
    joints = tuple(
        joint._replace(
            link=link,
            lower=-math.radians(limit),
            upper=math.radians(limit),
            stop_lower=-math.radians(limit + 10),
            stop_upper=math.radians(limit + 10),
            home=0.0,
        )
        for joint, link, limit in zip(arm.joints, links, (95, 140), strict=True)
    )
    arm = arm._replace(joints=joints)
    told = arm._replace(
        joints=tuple(j._replace(link=j.link * (1 + draw.uniform(-0.05, 0.05))) for j in joints)
    )
    constants = read_scene(
        f"tilt={draw.uniform(0, scene.tilt):.3f},azimuth={draw.uniform(-180, 180):.3f},"
        f"roll={draw.uniform(-180, 180):.3f},focal={draw.uniform(500, 900):.1f},seed={seed}"
    )
    camera = Camera(arm, constants)
    side = draw.choice((-1, 1))

    def pose() -> Pose:
        turn = math.radians(draw.uniform(-scene.turn, scene.turn))
        return turn, side * math.radians(draw.uniform(*scene.bend))

    start, goal = pose(), pose()
    while math.dist(camera(start), camera(goal)) < 80:
        start, goal = pose(), pose()
    plant = f"zero_error={draw.uniform(-1.5, 1.5):.3f}"
    return SetUp(seed, arm, told, plant, constants, start, goal), camera


class TrueJacobian:
    """What an oracle knows: J at the true pose; the door of robot.image_jacobian's models."""

    def __init__(self, camera: Camera, brick: EmulatedBrick) -> None:
        self._camera, self._brick = camera, brick

    def observe(self, q: Any, s: Any, variance: float, standing: bool = True) -> None:
        """Nothing is learned."""

    def seen_from(self, q: Sequence[float], s: Sequence[float]) -> Picture:
        """J is right here; elsewhere it is not."""
        J = self._camera.jacobian(self._brick.plant.q)

        def predict(there: Sequence[float]) -> list[float]:
            return [
                y + sum(a * (b - c) for a, b, c in zip(row, there, q, strict=True))
                for y, row in zip(s, J, strict=True)
            ]

        return Picture(predict, lambda there: J)

    def covariance(self, q: Sequence[float]) -> list[list[float]]:
        """There is no doubt."""
        return [[0.0] * len(q) for _ in q]

    def doubt_all(self) -> None:
        """There is no doubt."""


@dataclass(frozen=True)
class Result:
    """One run: px, s; `moves` and `seconds` of a failure are those of the budget."""

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
    rms: float


@dataclass(frozen=True)
class Case:
    """One seed under one scene on one arm; which methods."""

    name: str
    scene: Scene
    arm: str
    seed: int
    methods: tuple[str, ...]
    rendered: bool = False


def moving_goal(camera: Camera, set_up: SetUp, speed: float) -> Callable[[float], Pixel]:
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
    path = np.array([camera(q) for q in poses if q])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])

    def at(t: float) -> Pixel:
        place = (speed * t) % along[-1]
        return float(np.interp(place, along, path[:, 0])), float(np.interp(place, along, path[:, 1]))

    return at


def points(
    camera: Camera, brick: EmulatedBrick, goal: Callable[[float], Pixel], scene: Scene, seed: int
) -> Callable[[str, int, float], dict[str, tuple[float, float, float]]]:
    """What a tracker would say: the true places with noise, and outliers anywhere in the image."""
    draw = random.Random(f"{seed}/noise")

    def seen(place: Pixel) -> tuple[float, float, float]:
        noisy = [x + draw.gauss(0, scene.sigma) for x in place]
        astray = draw.uniform(0, 640), draw.uniform(0, 480)
        return (*(astray if draw.random() < scene.outliers else noisy), 1.0)  # type: ignore

    def see(name: str, index: int, t: float) -> dict[str, tuple[float, float, float]]:
        return {"effector": seen(camera(brick.plant.q)), "goal": seen(goal(t))}

    return see


def run_one(case: Case, method: str, log: Any = None, say: Any = None) -> Result:
    """One method on one set-up."""
    scene = case.scene
    setting, camera = set_up(case.arm, case.seed, scene)
    world = World()
    brick = EmulatedBrick(world, setting.arm, read_plant(setting.plant), setting.start)
    if scene.speed:
        goal = moving_goal(camera, setting, scene.speed)
    else:
        fixed = camera(setting.goal)

        def goal(t: float) -> Pixel:
            return fixed

    see = points(camera, brick, goal, scene, case.seed)
    if case.rendered:
        see, fixed = rendered(setting, brick)
    verdict, rms = None, math.nan
    with (
        tempfile.TemporaryDirectory() as folder,
        brick.sysfs.installed(),
        VirtualTracker(
            world, see, 30.0, scene.latency, scene.jitter, scene.drops, seed=case.seed
        ) as tracker,
    ):
        arm = RobotArm(setting.told, world, park_on_file(setting.told, setting.start, folder))
        arm.wake()
        servo, stream = _servo(method, setting, camera, brick, scene)
        loop = VisualServoing(
            arm,
            tracker.client(),
            world,
            servo,
            stream=stream,
            budget=FOLLOWED[1] if scene.speed else BUDGET,
            most_moves=None if scene.speed else MOST_MOVES,
            follow=bool(scene.speed),
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
        rms = _rms(brick, camera, goal, began)
    error = math.dist(camera(brick.plant.q), goal(world.now()))
    if case.rendered:
        error = math.dist(camera(brick.plant.q), fixed)
    claimed = word == "converged"
    success = claimed and error <= TRUE * scene.tolerance
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
        rms,
    )


def _servo(
    method: str, setting: SetUp, camera: Camera, brick: EmulatedBrick, scene: Scene
) -> tuple[Any, Any]:
    if method == "oracle":
        models = {"oracle": lambda: TrueJacobian(camera, brick)}
        return Servo(setting.told, models, scene.tolerance, known=True), None
    if method.startswith("report"):
        robust = method != "report"
        return ReportServo(setting.told.joints, scene.tolerance, robust), None
    return make_servo(setting.told, method, scene.mode, scene.tolerance, setting.seed)


def _rms(
    brick: EmulatedBrick, camera: Camera, goal: Callable[[float], Pixel], began: float
) -> float:
    squares = [
        math.dist(camera(sample.q), goal(sample.t)) ** 2
        for sample in brick.record[::8]
        if FOLLOWED[0] <= sample.t - began <= FOLLOWED[1]
    ]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.inf


def run_case(case: Case) -> list[Result]:
    """All methods on one set-up."""
    return [run_one(case, method) for method in case.methods]
