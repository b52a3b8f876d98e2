"""Set-ups of the servoing bench: arms, cameras, starts and goals, drawn from seeds.

One seed is one set-up: arm, errors of its description, camera, start and goal.  All methods run on
it.
"""

from __future__ import annotations

import functools
import itertools
import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.bench.servo_scenarios import ServoScenario
from laptop.emulator.rendered_tracker import rendered
from laptop.emulator.rig import Rig
from laptop.emulator.scene import scene as pictured
from laptop.emulator.scene.camera_placement import place_camera
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.workcell import workcell
from robot.motion import kinematics
from robot.servoing.rows import Rows
from shared.arm_description import Arm, find_arm, read_arm
from shared.messages import LEAST_CONFIDENCE

Pose = tuple[float, ...]
Pixel = tuple[float, float]

Pixels = dict[str, Pixel]
"""Places by camera, px."""

LEAST_WAY = 80
"""Least distance of a goal from where the tip comes from, all cameras' together, px."""

MOVED_BY = 10.0, 60.0
"""Range of the angles by which a moved camera is turned round the table and its line of sight, deg,
either way."""

MAX_DRAWN_POSES = 1000
"""Number of poses that are drawn for one camera; after them another camera is drawn."""

WIDTH, HEIGHT = 640, 480
"""Size of every picture, px."""

LINK_LENGTHS = {
    "planar": ((10, 16), (8, 14)),
    "spatial": ((11, 14), (10, 13), (8, 11)),
}
"""Ranges of the links' lengths by kind of chain, cm."""

MIN_TIP_HEIGHT, MIN_AXIS_DISTANCE = 2.0, 5.0
"""Least height of start and goal above the table, and distance from the base's axis, in space, cm.

On the axis the base would move nothing."""

LIMIT_MARGIN = math.radians(10)
"""Least distance of joints from their limits at start and goal, rad."""

TILT_FROM_ABOVE, TILT_FROM_ASIDE = (0.0, 20.0), (75.0, 90.0)
"""Ranges of the tilt of the first camera of an arm in space, and of the second, deg."""

CAMERA_DISTANCE, FOCAL_LENGTH = (55.0, 65.0), (420.0, 520.0)
"""Ranges of their distance from the middle of the workspace, cm, and of their focal length, px."""


@dataclass(frozen=True)
class SetUp:
    """One arm, its cameras, one task.

    Attributes:
        seed: of the set-up.
        arm: the true one.
        configured: the brick's description: its links are off by up to 5 %.
        plant: text for read_plant: the zero is off by up to 1.5 degrees.
        scenes: constants of the synthetic camera, by camera.
        start, goal: joint angles, rad.
    """

    seed: int
    arm: Arm
    configured: Arm
    plant: str
    scenes: dict[str, dict[str, Any]]
    start: Pose
    goal: Pose


class PinholeCamera:
    """An ideal camera: the place of the tip's marker in its picture, px, without noise.

    Args:
        arm: that it sees.
        constants: of the scene.
    """

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self._workcell = workcell(arm, constants)
        self._pinhole = place_camera(arm, constants)
        self._last: tuple[Pose, Pixel] | None = None  # mostly the arm stands

    def __call__(self, q: Sequence[float]) -> Pixel:
        """Return (u, v), px, with the joints at q, rad."""
        q = tuple(q)
        if self._last is None or self._last[0] != q:
            u, v = self._pinhole.project(self._workcell.tip_marker(q)[None])[0]
            self._last = q, (float(u), float(v))
        return self._last[1]

    def jacobian(self, q: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """Return ds/dq at q by central differences, px/rad."""
        h = 1e-5
        columns = []
        for k in range(len(q)):
            ahead, behind = (
                self([a + sign * h * (i == k) for i, a in enumerate(q)]) for sign in (1, -1)
            )
            columns.append([(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)])
        return tuple(zip(*columns, strict=True))


class PinholeCameras(dict[str, PinholeCamera]):
    """The cameras of a set-up, by name."""

    def __call__(self, q: Sequence[float]) -> Pixels:
        """Return the place of the tip in each picture, px, with the joints at q, rad."""
        return {name: camera(q) for name, camera in self.items()}

    def shows(self, q: Sequence[float]) -> bool:
        """Return True if the tip is in every picture."""
        return all(map(is_in_image, self(q).values()))


def is_in_image(place: Pixel) -> bool:
    """Return True if a place, px, is inside the picture."""
    return 0 <= place[0] <= WIDTH - 1 and 0 <= place[1] <= HEIGHT - 1


def image_distance(one: Pixels, other: Pixels, rows: Rows | None = None) -> float:
    """Return the distance in the image, px, over the given rows (all if None) of all cameras."""
    rows = rows or Rows("stereo", 0)
    return math.dist(rows.values(one), rows.values(other))


def _drawn_arm(name: str, draw: random.Random) -> Arm:
    arm = read_arm(find_arm(name))
    lengths = [draw.uniform(*bounds) for bounds in LINK_LENGTHS[arm.chain]]
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


def _drawn_scenes(
    arm: Arm, seed: int, scenario: ServoScenario, draw: random.Random
) -> dict[str, dict[str, Any]]:
    """Draw a camera; for an arm in space, one from above and one from some side."""

    def turned() -> str:
        return f"azimuth={draw.uniform(-180, 180):.3f},roll={draw.uniform(-180, 180):.3f}"

    if arm.chain == "planar":
        texts = {
            "A": f"tilt={draw.uniform(0, scenario.tilt):.3f},{turned()},"
            f"focal={draw.uniform(500, 900):.1f}"
        }
    else:
        texts = {
            name: f"tilt={draw.uniform(*tilts):.3f},{turned()},"
            f"distance={draw.uniform(*CAMERA_DISTANCE):.2f},focal={draw.uniform(*FOCAL_LENGTH):.1f}"
            for name, tilts in (("A", TILT_FROM_ABOVE), ("B", TILT_FROM_ASIDE))
        }
    return {name: read_scene(f"{text},seed={seed}", name) for name, text in texts.items()}


def _drawn_poses(
    arm: Arm, scenario: ServoScenario, side: int, draw: random.Random
) -> Iterator[Pose]:
    """Yield poses of one elbow branch."""
    while True:
        turn = math.radians(draw.uniform(-scenario.turn, scenario.turn))
        if arm.chain == "planar":
            yield turn, side * math.radians(draw.uniform(*scenario.bend))
            continue
        shoulder, elbow = arm.joints[1:]
        pitch = draw.uniform(shoulder.lower + LIMIT_MARGIN, shoulder.upper - LIMIT_MARGIN)
        pose = turn, pitch, -math.radians(draw.uniform(*scenario.bend))
        x, y, z = kinematics.forward(arm, pose)
        if (
            pose[2] > elbow.lower + LIMIT_MARGIN
            and z > MIN_TIP_HEIGHT
            and math.hypot(x, y) > MIN_AXIS_DISTANCE
        ):
            yield pose


@functools.lru_cache(maxsize=8)
def set_up(arm_name: str, seed: int, scenario: ServoScenario) -> tuple[SetUp, PinholeCameras]:
    """Return the set-up of a seed, the same for all methods."""
    draw = random.Random(f"{seed}/{scenario.tilt}/{scenario.bend}/{scenario.turn}")
    arm = _drawn_arm(arm_name, draw)
    described = arm._replace(
        joints=tuple(j._replace(link=j.link * (1 + draw.uniform(-0.05, 0.05))) for j in arm.joints)
    )
    while True:
        scenes = _drawn_scenes(arm, seed, scenario, draw)
        cameras = PinholeCameras(
            {name: PinholeCamera(arm, constants) for name, constants in scenes.items()}
        )
        poses = _drawn_poses(arm, scenario, draw.choice((-1, 1)), draw)
        for _ in range(MAX_DRAWN_POSES):
            start, goal = next(poses), next(poses)
            seen = cameras.shows(start) and cameras.shows(goal)
            if seen and image_distance(cameras(start), cameras(goal)) >= LEAST_WAY:
                plant = f"zero_error={draw.uniform(-1.5, 1.5):.3f}"
                return SetUp(seed, arm, described, plant, scenes, start, goal), cameras


def moved_cameras(set_up: SetUp, cameras: PinholeCameras) -> PinholeCameras:
    """Return the cameras after somebody has moved them; they see what they saw of the arm."""
    draw = random.Random(f"{set_up.seed}/moved")

    def moved(constants: dict[str, Any]) -> PinholeCamera:
        turns = {key: draw.choice((-1, 1)) * draw.uniform(*MOVED_BY) for key in ("azimuth", "roll")}
        return PinholeCamera(
            set_up.arm, {**constants, **{key: constants[key] + turns[key] for key in turns}}
        )

    for _ in range(MAX_DRAWN_POSES):
        found = PinholeCameras({name: moved(set_up.scenes[name]) for name in cameras})
        if found.shows(set_up.start) and found.shows(set_up.goal):
            return found
    return cameras


def further_goals(set_up: SetUp, cameras: PinholeCameras, scenario: ServoScenario) -> list[Pose]:
    """Return the goals of a scenario after the first, drawn as that: each in every picture.

    Each is LEAST_WAY or more from the one before, and on its elbow branch; where none is found, it
    is the place before that.
    """
    draw = random.Random(f"{set_up.seed}/goals")
    drawn = _drawn_poses(set_up.arm, scenario, 1 if set_up.goal[-1] > 0 else -1, draw)
    places = [set_up.start, set_up.goal]
    for _ in range(scenario.goals - 1):
        here = cameras(places[-1])
        fit = (
            pose
            for pose in itertools.islice(drawn, MAX_DRAWN_POSES)
            if cameras.shows(pose) and image_distance(here, cameras(pose)) >= LEAST_WAY
        )
        places.append(next(fit, places[-2]))
    return places[2:]


def goal_circle(set_up: SetUp) -> list[Pose]:
    """Return the poses of a goal that goes round on a circle on the table, once."""
    draw = random.Random(f"{set_up.seed}/path")
    radius = draw.uniform(2.5, 5)
    side = math.copysign(1, set_up.goal[-1])

    def pose(p: np.ndarray) -> Pose | None:
        """Return the posture there, on the goal's side, away from stretched and folded."""
        try:
            q = kinematics.inverse(set_up.arm, tuple(p), "up" if side > 0 else "down")
        except kinematics.Unreachable:
            return None
        return q if math.radians(25) < abs(q[-1]) < math.radians(125) else None

    angle = np.linspace(0, draw.choice((-1, 1)) * 2 * math.pi, 200)
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    poses: list[Pose | None] = [None]
    while None in poses:
        turn, bend = math.radians(draw.uniform(-70, 70)), side * math.radians(draw.uniform(40, 110))
        middle = np.array(kinematics.forward(set_up.arm, (turn, bend)))
        poses = [pose(middle + p) for p in ring]
        radius *= 0.99
        ring *= 0.99
    return [q for q in poses if q]


def moving_goal(cameras: PinholeCameras, set_up: SetUp, speed: float) -> Callable[[float], Pixels]:
    """Return the path of a goal on a set-up's circle, at a steady `speed`, px/s."""
    poses = goal_circle(set_up)
    path = np.array([[x for place in cameras(q).values() for x in place] for q in poses])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])

    def at(t: float) -> Pixels:
        row = [float(np.interp((speed * t) % along[-1], along, column)) for column in path.T]
        return dict(zip(cameras, zip(row[::2], row[1::2], strict=True), strict=True))

    return at


def under_the_tip(arm: Arm, constants: dict[str, Any], q: Pose) -> tuple[float, float]:
    """Return the place on the paper, cm, of a marker that the tip's marker covers at q.

    It lies where the camera's ray through the tip's marker meets the paper.
    """
    eye = place_camera(arm, constants).position
    x, y = kinematics.forward(arm, q)
    height = constants["marker_height"]
    share = eye[2] / (eye[2] - height)
    return float(eye[0] + share * (x - eye[0])), float(eye[1] + share * (y - eye[1]))


PAPER_AREA = (-0.3, 1.0), (-0.7, 1.1)
"""Area of goal markers, x and y in reaches of the arm: on the paper."""


@functools.lru_cache(maxsize=4)
def rendered_set_up(
    arm_name: str, seed: int, scenario: ServoScenario
) -> tuple[SetUp, PinholeCameras, dict[str, pictured.Scene]]:
    """Return a set-up whose goal is a marker; both markers are seen at the start.

    In space, where the arm may stand before it, the tip is seen at the goal, too.  The first of the
    seed's own, then of those far behind it, for which that is so.
    """
    for turn in itertools.count():
        setting, cameras = set_up(arm_name, seed + turn * 1_000_000, scenario)
        arm = setting.arm
        if kinematics.coordinates(arm) == 2:
            x, y = under_the_tip(arm, setting.scenes["A"], setting.goal)
            reach = kinematics.reach(arm)[1]
            if not all(a < z / reach < b for z, (a, b) in zip((x, y), PAPER_AREA, strict=True)):
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
    """Return True if the tracker is sure of both markers in every camera's first frame."""
    with Rig(setting.arm, plant=setting.plant, start=setting.start) as rig:
        see = rendered(shown, rig.brick)
        seen = [marker for name in shown for marker in (see(name, 0, 0.0) or {}).values()]
    return all(marker is not None and marker[2] >= LEAST_CONFIDENCE for marker in seen)
