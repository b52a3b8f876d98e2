"""The scene of a demo and its goals: what can be seen and reached, far from each other."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from laptop.emulator.scene.camera_rig import CameraRig, Vector, slope, solve
from laptop.measure.demo.processes import DemoFailed
from shared.arm_description import Arm

GOALS = 3
MIN_GOAL_DISTANCE = 150.0
"""Least distance of a goal from the others, and from where the driver leaves the tip, px; of two
cameras as one distance in four rows."""
MIN_POSTURE_DISTANCE = 0.7
"""Least distance between the goals' postures, rad."""
EDGE_MARGIN = 45.0
"""Least distance of goals from the picture's edge, px."""
LIMIT_SHARE = 0.85
"""Share of the joint limits that postures are drawn from."""
MAX_CONDITION = 5.0
"""Greatest condition number of the true image Jacobian at a goal: no singular posture is near."""
MIN_VISIBLE = 0.9
"""Share to be seen of a marker that nothing hides but its holder."""
MIN_VISIBLE_AT_ENDS = 0.85
"""The same where the tip stands to be looked at: the post of a goal before it hides more."""
MIN_VISIBLE_BETWEEN, PATH_SAMPLES = 0.6, 7
"""Least share of the tip's marker that is seen, and number of places where that is checked, on the
path to each goal."""
EXPLORATION_STEP = 0.2
"""Turn of each joint around a start at which the marker is seen, too, rad: the servo explores."""
MIN_TIP_HEIGHT = 2.5
"""Least height of the tip, where it has a choice, cm."""
MAX_POSTURES, MAX_GOAL_SETS = 300, 20
"""Greatest number of postures that are drawn for one set of goals, and of sets."""


class DemoSetup(NamedTuple):
    """Cameras and postures for the demo of one kind of arm.

    settings         of every scene's text
    default_cameras  of seed 0
    camera_ranges    of other seeds: tilt, azimuth and roll, deg, by a camera's prefix
    end_of_lines     where the driver's lines end, cm
    elbow_bend       a posture that is bent one way, rad; the other way it is its negative
    """

    settings: dict[str, str]
    default_cameras: dict[str, str]
    camera_ranges: dict[str, tuple[tuple[float, float], ...]]
    end_of_lines: tuple[float, ...]
    elbow_bend: tuple[float, ...]


DEMO_SETUPS = {
    "planar": DemoSetup({}, {}, {"": ((10, 40), (-60, 60), (-15, 15))}, (0.0, 15.0), (1.0, 1.0)),
    "spatial": DemoSetup(
        # Two pictures at once are more work than one: fewer, and quicker to paint.
        {"fps": "20", "exposure": "0.004", "jpeg": "0"},
        # From above in front, where no link hides the tip, and from the side.
        {"A.tilt": "40", "A.azimuth": "90", "B.tilt": "85", "B.azimuth": "10"},
        {"A.": ((32, 48), (60, 110), (-10, 10)), "B.": ((75, 88), (-10, 35), (-5, 5))},
        (9.0, 4.0, 12.6),
        (0.0, 1.2, -2.0),
    ),
}
"""Setups by the arm's chain."""


class Goal(NamedTuple):
    """Place for the tip, and the servo's option for it.

    name    for people
    pixels  u and v in the picture of each camera, one after the other, px
    place   of the tip's marker there, cm
    args    what --goal is given, once or camera by camera
    """

    name: str
    pixels: Vector
    place: Vector
    args: tuple[str, ...]


def postures_at(rig: CameraRig, place: Sequence[float]) -> list[Vector]:
    """Postures (rad) that have the tip at a place, cm: bent one way and the other."""
    bent = DEMO_SETUPS[rig.arm.chain].elbow_bend
    bends = [tuple(sign * angle for angle in bent) for sign in (1.0, -1.0)]
    return [solve(lambda q: rig.centre("effector", q)[: len(place)], q, place) for q in bends]


def path_is_seen(rig: CameraRig, start: Sequence[float], end: Sequence[float]) -> bool:
    """Return True if the tip is in sight above the table from one posture to another."""
    path = np.linspace(start, end, PATH_SAMPLES)
    steps = EXPLORATION_STEP * np.eye(len(path[0]))
    between = *path[1:-1], *(path[0] + steps), *(path[0] - steps)
    return all(
        rig.centre("effector", q)[2] >= MIN_TIP_HEIGHT and rig.visible(q) > least
        for least, places in (
            (MIN_VISIBLE_AT_ENDS, (path[0], path[-1])),
            (MIN_VISIBLE_BETWEEN, between),
        )
        for q in places
    )


def scene_text(chain: str, seed: int, place: Sequence[float] = ()) -> str:
    """Cameras somewhere around the table, drawn from the seed; 0 is the usual ones."""
    draw = random.Random(f"camera {seed}")
    setup = DEMO_SETUPS[chain]
    settings = {"seed": f"{seed}", **setup.settings, **({} if seed else setup.default_cameras)}
    for camera, ranges in setup.camera_ranges.items() if seed else ():
        for key, bounds in zip(("tilt", "azimuth", "roll"), ranges, strict=True):
            settings[camera + key] = f"{draw.uniform(*bounds):.0f}"
    settings.update(
        (key, f"{value:.2f}")
        for key, value in zip(("goal_x", "goal_y", "goal_z"), place, strict=False)
    )
    return ",".join(f"{key}={value}" for key, value in settings.items())


def choose_goals(arm: Arm, seed: int) -> tuple[str, list[Goal]]:
    """Return the scene's text, and the goals: its marker, and pixels of every camera.

    They are where the tip is seen in postures inside the joint limits, away from singular ones, and
    apart from one another and from where the driver leaves the tip: all can be reached, and the tip
    is seen on a way there.

    Raises:
        DemoFailed: this arm has no such postures.
    """
    bare = CameraRig(arm, scene_text(arm.chain, seed))
    resting = postures_at(bare, DEMO_SETUPS[arm.chain].end_of_lines)
    draw = random.Random(f"goals {seed}")
    for _ in range(MAX_GOAL_SETS):
        chosen = _choose_postures(bare, resting, draw)
        if len(chosen) < GOALS:
            continue
        pixels = [bare.truth(q) for q in chosen]
        size = len(DEMO_SETUPS[arm.chain].end_of_lines)
        text = scene_text(arm.chain, seed, bare.place_at(pixels[0], "goal")[:size])
        rig = CameraRig(arm, text)
        paths = zip([resting[0], *chosen], chosen, strict=False)
        if all(rig.visible(q, "goal") > MIN_VISIBLE for q in resting) and all(
            path_is_seen(rig, *path) for path in paths
        ):
            marker = rig.truth(resting[0], "goal")
            goal_args = [("marker",), *(_goal_args(rig, pixel) for pixel in pixels[1:])]
            ends = [marker, *(_read(args) for args in goal_args[1:])]
            return text, [
                Goal(f"goal {number}", end, rig.place_at(end, "effector"), args)
                for number, (end, args) in enumerate(zip(ends, goal_args, strict=True), 1)
            ]
    raise DemoFailed(
        f"seed {seed} gives no {GOALS} goals that this arm can reach; try another --seed"
    )


def _goal_args(rig: CameraRig, pixels: Vector) -> tuple[str, ...]:
    """Return a goal as arguments of --goal: a pixel, or one of each camera."""
    pairs = zip(rig, pixels[::2], pixels[1::2], strict=True)
    return tuple(f"{f'{name}:' * (len(rig) > 1)}{u:.1f},{v:.1f}" for name, u, v in pairs)


def _read(args: Sequence[str]) -> Vector:
    """Return the pixels of such arguments."""
    return tuple(float(part) for arg in args for part in arg.split(":")[-1].split(","))


def _choose_postures(
    rig: CameraRig, resting: Sequence[Vector], draw: random.Random
) -> list[Vector]:
    """Postures (rad) for the goals; fewer than GOALS if it found no more."""
    chosen: list[Vector] = []
    taken = [rig.truth(q) for q in resting[:1]]
    for _ in range(MAX_POSTURES):
        q = tuple(
            draw.uniform(LIMIT_SHARE * j.lower, LIMIT_SHARE * j.upper) for j in rig.arm.joints
        )
        seen = rig.truth(q)
        if (
            _inside(rig, seen)
            and rig.centre("effector", q)[2] >= MIN_TIP_HEIGHT
            and all(math.dist(seen, other) >= MIN_GOAL_DISTANCE for other in taken)
            and all(math.dist(q, other) >= MIN_POSTURE_DISTANCE for other in chosen)
            and np.linalg.cond(slope(rig.truth, q)) <= MAX_CONDITION
            and rig.visible(q) > MIN_VISIBLE
            and path_is_seen(rig, [*resting[:1], *chosen][-1], q)
        ):
            chosen.append(q)
            taken.append(seen)
            if len(chosen) == GOALS:
                break
    return chosen


def _inside(rig: CameraRig, pixels: Vector) -> bool:
    """Return True if pixels are in their pictures, away from the edges."""
    sizes = [size for scene in rig.values() for size in scene.camera.size]
    return all(EDGE_MARGIN < x < size - EDGE_MARGIN for x, size in zip(pixels, sizes, strict=True))


def servo_args(goal: Goal) -> list[str]:
    """Return the servo's options for a goal."""
    return [f"--goal={arg}" for arg in goal.args]
