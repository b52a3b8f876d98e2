"""Drawings of what a camera sees: the way to a goal, and the pixels of a marker."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from laptop.bench.servo import MAX_MOVES, TIME_BUDGET, ServoCase, points, servo_loop
from laptop.bench.servo_scenarios import BASELINE, DEFAULT, ServoScenario
from laptop.bench.servo_setups import HEIGHT, WIDTH, PinholeCameras, SetUp, set_up
from laptop.bench.track_methods import ours
from laptop.bench.track_precision import Appearance, bound, places, values
from laptop.bench.track_score import Score, judge
from laptop.docs.drawings.picture import arrow, label, picture
from laptop.emulator.rig import Rig
from laptop.emulator.scene.camera_placement import place_camera
from laptop.emulator.scene.marker_pictures import LoneMarker, marker_frame
from laptop.emulator.scene.sensor import Development
from laptop.emulator.virtual_tracker import FrameChain, Markers, VirtualTracker
from laptop.record.figures.sheet import INK, JOINTS, PEAK, REACH, REACH_EDGE, TRAVEL, WANTED
from laptop.see.markers.discriminant import FULL_SHARE, disc_share, fit_discriminant
from laptop.see.markers.learning import learn
from robot.motion import kinematics

SEED = 1006
"""One of the servo bench's set-ups."""

ARROW_DEGREES = 30
"""Turn of a joint that a column of the image Jacobian is drawn for."""

NOISES, FRAMES = (1.0, 2.0, 4.0, 8.0), 40
"""Noises of a pixel, DN, and number of pictures of each."""


class ServoPath(NamedTuple):
    """A servo run: set-up, cameras, goal, the tip's true path, px, its duration, s, and record."""

    setting: SetUp
    cameras: PinholeCameras
    goal: tuple[float, float]
    path: np.ndarray
    seconds: float
    record: Sequence[Any]


def servo_run(
    method: str,
    scenario: ServoScenario,
    hidden_from: float = math.inf,
    budget: float = TIME_BUDGET,
) -> ServoPath:
    """Run a method on an emulated arm; the tip is hidden from a time on, s."""
    case = ServoCase("", scenario, "planar", SEED, (method,))
    setting, cameras = set_up(case.arm, SEED, scenario)
    goal = cameras(setting.goal)
    chain = FrameChain(30.0, scenario.latency, scenario.jitter, scenario.drops)
    terms = {"budget": budget, "most_moves": MAX_MOVES, "follow": None}
    with Rig(setting.configured, setting.arm, setting.plant, start=setting.start) as rig:
        shown = points(cameras, rig.brick, lambda t: goal, scenario, SEED)

        def see(name: str, index: int, t: float) -> Markers | None:
            seen = shown(name, index, t)
            return seen if t < hidden_from or seen is None else {**seen, "effector": None}

        with (
            VirtualTracker(rig.world, see, chain, tuple(cameras), SEED) as tracker,
            servo_loop(case, method, setting, cameras, tracker, rig, **terms) as loop,
        ):
            loop.servoing.run()
            path = np.array([cameras(sample.q)["A"] for sample in rig.record[::4]])
            return ServoPath(setting, cameras, goal["A"], path, rig.world.now(), rig.record)


def servoing_drawing(file: Path) -> None:
    """Draw the camera's picture with the image Jacobian, and the ways of two methods."""
    run, lab = (servo_run(method, ServoScenario()) for method in (DEFAULT, BASELINE))
    setting, tip = run.setting, run.path[0]
    camera = place_camera(setting.arm, setting.scenes["A"])
    joints = np.array(kinematics.joint_positions(setting.arm, setting.start))
    height = np.full((len(joints), 1), setting.scenes["A"]["marker_height"])
    with picture(file, 680) as figure:
        axes = figure.add_axes((0.005, 0.005, 0.99, 0.99))
        axes.set(xlim=(0, WIDTH), ylim=(HEIGHT, 0), xticks=[], yticks=[], facecolor=REACH)
        axes.spines[:].set(visible=True)
        arm = camera.project(np.hstack([joints, height]))
        axes.plot(*arm.T, color=REACH_EDGE, lw=16, marker="o", ms=20, mfc=TRAVEL, zorder=1)
        axes.plot(*lab.path.T, color=PEAK, zorder=3)
        axes.plot(*run.path.T, color=WANTED, lw=5, zorder=4)
        columns = math.radians(ARROW_DEGREES) * np.array(run.cameras["A"].jacobian(setting.start)).T
        for k, column in enumerate(columns, 1):
            arrow(axes, tip, tip + column, JOINTS[2])
            away = 22 * column / np.hypot(*column)
            label(axes, tip + column + away, f"J{k}", JOINTS[2])
        axes.plot(*tip, "o", color=INK, ms=13, zorder=7)
        axes.plot(*run.goal, "o", mfc="white", mec=INK, mew=4, ms=20, zorder=7)
        label(axes, tip + (20, 0), "tip", INK, ha="left")
        label(axes, np.add(run.goal, (-22, 4)), "goal", INK, ha="right")
        label(axes, (20, 34), f"{DEFAULT}: {run.seconds:.0f} s", WANTED, ha="left")
        label(axes, (20, 76), f"lab report: {lab.seconds:.0f} s", PEAK, ha="left")


def tracking_drawing(file: Path) -> None:
    """Draw a disc's pixels with the place that is found, and errors beside the limit."""
    found, limit = 1000 * np.array([_errors(noise) for noise in NOISES]).T
    with picture(file, 500) as figure:
        _draw_pixels(figure.add_axes((0.01, 0.13, 0.46, 0.83)))
        axes = figure.add_axes((0.6, 0.19, 0.38, 0.77))
        axes.plot(NOISES, found, "o-", color=PEAK, ms=11)
        axes.plot(NOISES, limit, color=WANTED, ls=(0, (3, 2)))
        label(axes, (4.4, found[2] + 2.5), "tracker", PEAK, ha="right")
        label(axes, (5.4, limit[2] - 1.5), "limit", WANTED, ha="left")
        axes.set(xlabel="pixel noise, of 255", ylabel="error, 1/1000 px")
        axes.set(xlim=(0, 8.4), ylim=(0, None), xticks=[0, 2, 4, 6, 8], yticks=[0, 5, 10, 15])


def _frames(appearance: Appearance, count: int) -> list[tuple[np.ndarray, tuple[float, float]]]:
    """Return pictures of an appearance, each with the marker's true place, px."""
    marker = LoneMarker(appearance.kind, appearance.radius)
    development = Development(noise=appearance.noise, jpeg=appearance.jpeg)
    return [
        (marker_frame(marker, place, size=(320, 240), development=development, seed=[1, k]), place)
        for k, place in enumerate(places(1, count))
    ]


def _errors(noise: float) -> tuple[float, float]:
    """Return the tracker's error and the limit of a disc under a noise, px per axis."""
    appearance = Appearance("", noise=noise, jpeg=0)
    (image, (u, v)), *frames = _frames(appearance, FRAMES + 1)
    find = ours(learn("disc", image, (round(u), round(v))))
    find(image, 0.0)
    score = Score()
    for k, (image, truth) in enumerate(frames, 1):
        score += judge(find(image, k / 30), truth, 1.0, appearance.radius)
    least = bound(lambda a, b: values(appearance, a, b, appearance.background), u, v, noise)
    return score.rms, math.sqrt(sum(least) / 2)


def _draw_pixels(axes: Axes) -> None:
    """Draw a small disc enlarged, the pixels that count in part, and the place found."""
    ((image, (u, v)),) = _frames(Appearance("", radius=6.0), 1)
    found = ours(learn("disc", image, (round(u), round(v))))(image, 0.0)
    assert found is not None
    moment = found.radius**2 / 4
    model = fit_discriminant(image, found.u, found.v, found.radius, (moment, moment, 0.0))
    assert model is not None
    share = disc_share(image, model)
    axes.imshow(image[..., ::-1])
    for row, column in np.argwhere((share > 0) & (share < FULL_SHARE)):
        if math.hypot(column - u, row - v) < 1.5 * found.radius:
            axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, ec=INK, lw=1.5))
    axes.plot(found.u, found.v, "+", color="white", ms=40, mew=4)
    axes.set(xlim=(u - 9, u + 9), ylim=(v + 9, v - 9), xticks=[], yticks=[])
    axes.set_xlabel("rim pixels count in part", color=INK)
