"""The tasks in which faults strike, and what truly happens meanwhile.

One seed is one task on one arm: a drawing, a servo run or homing, by the brick's own scripts on a
scattered plant.
"""

from __future__ import annotations

import bisect
import contextlib
import io
import math
import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from laptop.bench.draw import random_line
from laptop.bench.servo_setups import PinholeCamera, PinholeCameras, image_distance
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.faults import Fault
from laptop.emulator.rig import Rig
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.virtual_tracker import VirtualTracker
from robot import driver, visual_servoing
from robot.motion import kinematics, paths, trajectory
from shared.arm_description import Arm, find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
COMMANDS = ("draw", "servo", "home")
RESTING = 2.0
"""Speed below which a joint rests, deg/s."""

SPEED_TIME = 0.02
"""Speeds are means over this time, s."""

NOISE = 0.5
"""Of a marker's place, px."""


class Task(NamedTuple):
    """Task of one seed: an arm's name, a command, and the script with its words and start."""

    arm: str
    command: str
    script: str
    words: tuple[str, ...]
    start: str
    plant: str
    cameras: dict[str, str]
    seed: int


class Motion:
    """What truly happened in one run: angles and speeds of links every 5 ms, counts at ports."""

    def __init__(self) -> None:
        self.counted: dict[str, list[tuple[float, int]]] = defaultdict(list)
        self.brick: EmulatedBrick | None = None
        self._before: dict[str, int] = {}

    def watch(self, brick: EmulatedBrick) -> None:
        """Note when each encoder counts from now on."""
        self.brick = brick
        self._before = {port: motor.position for port, motor in brick.motors.items()}
        self.counted.update({port: [(0.0, counts)] for port, counts in self._before.items()})
        brick.world.bodies.append(self._note)

    def _note(self, t: float) -> None:
        assert self.brick is not None
        for port, motor in self.brick.motors.items():
            if motor.position != self._before[port]:
                self._before[port] = motor.position
                self.counted[port].append((t, motor.position))

    def finish(self) -> None:
        """Work out angles (deg) and speeds (deg/s) from the brick's record."""
        assert self.brick is not None
        record = self.brick.record
        self.t = [sample.t for sample in record]
        self.q = [[math.degrees(a) for a in sample.q] for sample in record]
        n = max(1, round(SPEED_TIME / (record[1].t - record[0].t)))
        self.speeds = [
            [abs(a - b) / SPEED_TIME for a, b in zip(q, before, strict=True)]
            for q, before in zip(self.q[n:], self.q, strict=False)
        ]
        self.speeds[:0] = [[0.0] * len(self.q[0])] * n
        self.record, self.brick = record, None

    def between(self, begin: float, end: float) -> slice:
        """Samples between two times, at least one."""
        first = min(bisect.bisect_left(self.t, begin), len(self.t) - 1)
        return slice(first, max(bisect.bisect_right(self.t, end), first + 1))

    def moving(self) -> list[float]:
        """Times at which the arm moves, s."""
        return [t for t, q in zip(self.t, self.speeds, strict=True) if max(q) > RESTING]

    def counts_twice(self, port: str, t: float) -> float | None:
        """When the encoder at a port has counted twice from time `t` on, s; None if never."""
        counted = self.counted[port]
        now = bisect.bisect_right(counted, (t, math.inf))
        before = counted[now - 1][1]
        return next((then for then, counts in counted[now:] if abs(counts - before) >= 2), None)

    def rests_from(self) -> float:
        """Time of the last motion."""
        for t, speeds in zip(reversed(self.t), reversed(self.speeds), strict=True):
            if max(speeds) > RESTING:
                return t
        return 0.0


def _pose(arm: Arm, draw: random.Random) -> tuple[float, ...]:
    """A pose well within the limits, bent, off the table."""
    while True:
        q = tuple(
            draw.uniform(
                0.8 * joint.lower + 0.2 * joint.upper, 0.2 * joint.lower + 0.8 * joint.upper
            )
            for joint in arm.joints
        )
        bent = 20 < abs(math.degrees(q[-1])) < 125
        if bent and (len(q) == 2 or min(p[-1] for p in kinematics.joint_positions(arm, q)[1:]) > 3):
            return q


def _written(points: Sequence[Sequence[float]]) -> tuple[str, ...]:
    return tuple(",".join(f"{x:.2f}" for x in point) for point in points)


def _drawing(arm: Arm, draw: random.Random) -> tuple[str, ...]:
    """Words of a drawing that can be reached: a line, or two of them."""
    while True:
        a, b = random_line(arm, draw.randrange(10**6))
        if draw.random() < 0.5:
            return ("line", *_written((a, b)))
        c = random_line(arm, draw.randrange(10**6))[0]
        try:
            trajectory.plan(arm, paths.polyline([a, b, c]), None, None)
        except kinematics.Unreachable:
            continue
        return ("polyline", *_written((a, b, c)))


def _servo(arm: Arm, draw: random.Random) -> tuple[tuple[str, ...], str, dict[str, str]]:
    """Words, start and cameras of a servo run whose goal can be reached."""
    while True:
        texts = {"A": f"tilt={draw.uniform(0, 30):.1f},azimuth={draw.uniform(-180, 180):.1f}"}
        if len(arm.joints) == 3:
            texts["B"] = f"tilt={draw.uniform(75, 90):.1f},azimuth={draw.uniform(-180, 180):.1f}"
        cameras = _cameras(arm, texts)
        start, goal = _pose(arm, draw), _pose(arm, draw)
        if not (cameras.shows(start) and cameras.shows(goal)):
            continue
        if image_distance(cameras(start), cameras(goal)) < 80:
            continue
        words = [f"--mode={draw.choice(('look', 'stream'))}"]
        for name, (u, v) in cameras(goal).items():
            words += ["--goal", f"{name}:{u:.0f},{v:.0f}"]
        return tuple(words), ",".join(f"{math.degrees(a):.2f}" for a in start), texts


def _cameras(arm: Arm, texts: dict[str, str]) -> PinholeCameras:
    return PinholeCameras(
        {name: PinholeCamera(arm, read_scene(text, name)) for name, text in texts.items()}
    )


def task(seed: int, cpu: float) -> Task:
    """The task of a seed."""
    draw = random.Random(f"faults/{seed}")
    name = ARMS[seed % len(ARMS)]
    command = COMMANDS[seed // len(ARMS) % len(COMMANDS)]
    arm = read_arm(find_arm(name))
    plant = f"seed={seed},cpu={cpu:g}"
    if command == "servo":
        words, start, cameras = _servo(arm, draw)
        return Task(name, command, visual_servoing.__file__, words, start, plant, cameras, seed)
    words = _drawing(arm, draw) if command == "draw" else ("home", "--seek")
    start = "lost" if command == "home" else "home"
    return Task(name, command, driver.__file__, words, start, plant, {}, seed)


def perform(it: Task, faults: Sequence[Fault] = ()) -> tuple[Motion, int, str]:
    """Run a task: what happened, exit status, last line on stderr."""
    arm = read_arm(find_arm(it.arm))
    motion = Motion()

    @contextlib.contextmanager
    def watched(brick: EmulatedBrick) -> Iterator[VirtualTracker | None]:
        motion.watch(brick)
        if not it.cameras:
            yield None
            return
        cameras = _cameras(arm, it.cameras)
        noise = random.Random(f"{it.seed}/noise")

        def see(name: str, index: int, t: float) -> dict[str, Any]:
            u, v = cameras[name](brick.plant.q)
            return {"effector": (u + noise.gauss(0, NOISE), v + noise.gauss(0, NOISE), 1.0)}

        with VirtualTracker(brick.world, see, cameras=tuple(cameras), seed=it.seed) as tracker:
            yield tracker

    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        Rig(arm, plant=it.plant, cameras=watched, start=it.start) as rig,
    ):
        result = rig.run(it.script, *it.words, faults=faults)
    motion.finish()
    lines = err.getvalue().strip().splitlines()
    return motion, result.outcome.status, lines[-1] if lines else ""
