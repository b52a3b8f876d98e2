"""Tracking, measured: the tracker beside the usual OpenCV recipes, and the limit of any estimator.

Every picture comes from the emulator's sensor, so the true place of every marker is known.  All
methods get the same colour, learned in the first picture of their clip; the circle search gets the
marker's radius instead.

The *limit* is the bound of H. Cramer (1946) and C. R. Rao (1945) for the place (u, v) of exactly
this picture under this pixel noise, rounding to 8 bits included (variance 1/12 DN^2): no unbiased
estimator is better, though it may know everything but the place.  What a JPEG does is not in it.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import cv2
import numpy as np

from laptop.bench import workers
from laptop.simulator.scene.optics import circle, light_of, marker_light, to_linear, to_srgb
from laptop.simulator.scene.scene import ARUCO_IDS, Scene, read_scene
from laptop.simulator.scene.synthetic_camera import (
    ScriptedPoses,
    SyntheticCamera,
    blurred,
    marker_frame,
    through_jpeg,
)
from laptop.tracking.server import TrackingServer
from laptop.vision.learning import learn
from laptop.vision.markers import BadMarker, Color, Marker, gate
from laptop.vision.tracker import Sighting, Tracker
from robot import tracking_client
from shared.arm_description import find_arm, read_arm
from shared.messages import Observation
from shared.pairing import new_code

Point = tuple[float, float]

FPS = 30.0
SURE = 0.5
"""Confidence from which on a sighting is a claim."""


# ---- what counts


@dataclass(frozen=True)
class Score:
    """Frames counted, and errors (px) summed, of one method under one condition.

    frames    all of them
    clear     with at least 90 % of the marker to be seen
    lost      clear, but nothing claimed
    false     claimed more than two radii off, or while all of the marker was hidden
    measured  clear and claimed, not false; the sums are over these
    squares   sum of du^2 + dv^2, px^2
    du, dv    sums of the errors, px
    """

    frames: int = 0
    clear: int = 0
    lost: int = 0
    false: int = 0
    measured: int = 0
    squares: float = 0.0
    du: float = 0.0
    dv: float = 0.0

    def __add__(self, other: Score) -> Score:
        return Score(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(Score)))

    @property
    def rms(self) -> float:
        """Root mean square error per axis, px."""
        return math.sqrt(self.squares / (2 * self.measured)) if self.measured else math.nan

    @property
    def bias(self) -> Point:
        """Mean error (u, v), px."""
        if not self.measured:
            return math.nan, math.nan
        return self.du / self.measured, self.dv / self.measured

    @property
    def lost_percent(self) -> float:
        """Of the clear frames."""
        return 100 * self.lost / self.clear if self.clear else math.nan

    @property
    def false_percent(self) -> float:
        """Of all frames."""
        return 100 * self.false / self.frames if self.frames else math.nan


def judge(found: Sighting | None, truth: Point, shown: float, radius: float) -> Score:
    """One frame.

    Args:
        found: what the method says.
        truth: where the marker's centre is, px.
        shown: which part of the marker can be seen, 0 to 1.
        radius: of the marker, px.
    """
    clear = shown >= 0.9
    if found is None or found.confidence < SURE:
        return Score(1, int(clear), int(clear))
    du, dv = found.u - truth[0], found.v - truth[1]
    false = shown < 0.005 or math.hypot(du, dv) > 2 * radius
    if false or not clear:
        return Score(1, int(clear), 0, int(false))
    return Score(1, 1, 0, 0, 1, du * du + dv * dv, du, dv)


@dataclass(frozen=True)
class Result:
    """One method under one condition; `error` says why the marker could not be learned."""

    part: str
    condition: str
    marker: str
    method: str
    score: Score = Score()
    error: str = ""


def _unlearned(
    part: str, condition: str, marker: str, method: str, frames: int, problem: BadMarker
) -> Result:
    """What cannot be learned is lost from the first frame to the last."""
    score = Score(frames, frames, frames)
    return Result(part, condition, marker, method, score, str(problem))


# ---- the methods

Method = Callable[[np.ndarray, float], "Sighting | None"]
"""A picture (BGR, uint8) and its time (s) -> where the marker is."""


def ours(marker: Marker) -> Method:
    """The tracker as it is, fed frame after frame."""
    tracker = Tracker([marker])
    return lambda image, t: tracker.find(image, t)[marker.name]


def mask_of(image: np.ndarray, color: Color) -> np.ndarray:
    """The whole picture to HSV and through the gate (two `inRange` for a red one)."""
    return gate(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), color)


def hsv_moments(image: np.ndarray, color: Color) -> Sighting | None:
    """The centre of gravity of all pixels in the gate."""
    m = cv2.moments(mask_of(image, color), True)
    return _of_moments(m) if m["m00"] else None


def hsv_contours(image: np.ndarray, color: Color) -> Sighting | None:
    """The centre of gravity of the largest contour in the gate."""
    blob = _largest(mask_of(image, color))
    if blob is None:
        return None
    m = cv2.moments(blob)
    return _of_moments(m) if m["m00"] else None


def _of_moments(m: Any) -> Sighting:
    area = m["m00"]
    return Sighting(m["m10"] / area, m["m01"] / area, 1.0, math.sqrt(area / math.pi))


def _largest(mask: np.ndarray) -> np.ndarray | None:
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return max(blobs, key=cv2.contourArea, default=None)


def blur_and_enclose(image: np.ndarray, color: Color) -> Sighting | None:
    """Blur, gate, erode, dilate, the circle around the largest contour: as tutorials have it."""
    mask = mask_of(cv2.GaussianBlur(image, (11, 11), 0), color)
    square = np.ones((3, 3), np.uint8)
    mask = cv2.dilate(cv2.erode(mask, square, iterations=2), square, iterations=2)
    blob = _largest(mask)
    if blob is None:
        return None
    (u, v), radius = cv2.minEnclosingCircle(blob)
    return Sighting(u, v, 1.0, radius)


def hough(image: np.ndarray, radius: float) -> Sighting | None:
    """The circle with most votes among those of about this radius (px)."""
    grey = cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (5, 5), 0)
    low, high = math.floor(0.7 * radius), math.ceil(1.4 * radius)
    circles = cv2.HoughCircles(
        grey, cv2.HOUGH_GRADIENT, 1, 20, param1=100, param2=15, minRadius=low, maxRadius=high
    )
    if circles is None:
        return None
    u, v, r = circles.reshape(-1, 3)[0]
    return Sighting(float(u), float(v), 1.0, float(r))


OURS, MOMENTS, ENCLOSING, HOUGH = "ours", "HSV moments", "PyImageSearch", "HoughCircles"
LARGEST, LIMIT = "HSV contour", "limit"


def methods(marker: Marker, radius: float) -> dict[str, Method]:
    """All that can find this marker; radius in px."""
    color = marker.color
    if color is None:
        return {OURS: ours(marker)}
    return {
        OURS: ours(marker),
        MOMENTS: lambda image, t: hsv_moments(image, color),
        ENCLOSING: lambda image, t: blur_and_enclose(image, color),
        HOUGH: lambda image, t: hough(image, radius),
    }


# ---- precision


@dataclass(frozen=True)
class Look:
    """One marker alone in the picture; the arguments of `marker_frame`, px and DN.

    background  a word, #rrggbb, "edge" (dark on the left, light on the right) or "wood"
    """

    name: str
    kind: str = "disc"
    radius: float = 12.0
    background: str = "#808080"
    noise: float = 3.0
    jpeg: int = 90
    motion: Point = (0.0, 0.0)


LOOKS = (
    Look("disc r 12, raw", jpeg=0),
    Look("disc r 12, JPEG 90", jpeg=90),
    Look("disc r 12, noise 8, JPEG 70", noise=8.0, jpeg=70),
    Look("disc r 6, JPEG 90", radius=6.0),
    Look("disc r 20, JPEG 90", radius=20.0),
    Look("disc r 12, dark background", background="#202020"),
    Look("disc r 12, edge in the background", background="edge"),
    Look("disc r 12, orange wood", background="wood"),
    Look("disc r 12, 8 px motion blur", motion=(6.4, 4.8)),
    Look("ball r 12, grey background", "ball"),
    Look("ball r 20, dark background", "ball", 20.0, "#202020"),
    Look("ArUco, side 32", "aruco", 16.0, "#c0c0c0"),
    Look("ArUco, side 48", "aruco", 24.0, "#c0c0c0"),
)
SIZE = (320, 240)
FRAMES = 60
LENS = 0.7
"""Sigma of the point spread, px, where `marker_frame` has it."""


def places(seed: int, count: int) -> list[Point]:
    """Where the marker is in `count` frames, px: on a long ellipse, anywhere within a pixel."""
    luck = np.random.default_rng([seed, 7])
    phase = luck.uniform(0, 2 * math.pi) + np.arange(count) * (2 * math.pi / 60)
    stray = luck.uniform(-0.5, 0.5, (count, 2))
    return [
        (160 + 8 * math.sin(a) + du, 120 + 50 * math.cos(a) + dv)
        for a, (du, dv) in zip(phase, stray, strict=True)
    ]


def ground(look: Look, seed: int) -> str | np.ndarray:
    """The background as `marker_frame` wants it."""
    width, height = SIZE
    if look.background == "edge":
        image = np.full((height, width, 3), 0xD0, np.uint8)
        image[:, : width // 2] = 0x30
        return image
    if look.background == "wood":
        grain = np.random.default_rng([seed, 8]).standard_normal((height, width))
        streaks = cv2.GaussianBlur(grain, (0, 0), 20, sigmaY=1.5)
        light = light_of("#c8823c") * np.exp(0.25 * streaks / streaks.std())[..., None]
        return np.round(to_srgb(light)).astype(np.uint8)
    return look.background


def values(look: Look, u: float, v: float, background: str | np.ndarray) -> np.ndarray:
    """The picture before noise, rounding and JPEG, DN; float (height, width, 3)."""
    if isinstance(background, str):
        behind = np.broadcast_to(light_of(background), (SIZE[1], SIZE[0], 3))
    else:
        behind = to_linear(background)
    red = light_of("red")
    light = marker_light(look.kind, u, v, look.radius, red, behind, look.motion)
    return to_srgb(blurred(light, LENS))


def bound(render: Callable[[float, float], np.ndarray], u: float, v: float, noise: float) -> Point:
    """The least variance (px^2) in u and in v with which a place can be told.

    The inverse of Fisher's information J^T J / (noise^2 + 1/12), where J holds the derivatives of
    all pixels with respect to u and v.

    Args:
        render: u, v -> the picture without noise, DN.
        noise: sigma of a pixel, DN.
    """
    step = 0.05
    slopes = [
        (render(u + a, v + b) - render(u - a, v - b)).ravel() / (2 * step)
        for a, b in ((step, 0.0), (0.0, step))
    ]
    jacobian = np.stack(slopes, axis=1).astype(float)
    covariance = np.linalg.inv(jacobian.T @ jacobian / (noise**2 + 1 / 12))
    return float(covariance[0, 0]), float(covariance[1, 1])


@dataclass(frozen=True)
class PrecisionCase:
    """A look to be measured in so many frames."""

    look: Look
    seed: int
    frames: int = FRAMES

    def run(self) -> list[Result]:
        """All methods and the limit; the frame of learning does not count."""
        look, behind = self.look, ground(self.look, self.seed)
        clip = [
            (
                marker_frame(
                    look.kind,
                    u,
                    v,
                    look.radius,
                    background=behind,
                    size=SIZE,
                    motion=look.motion,
                    blur=LENS,
                    noise=look.noise,
                    jpeg=look.jpeg,
                    seed=[self.seed, k],
                ),
                (u, v),
            )
            for k, (u, v) in enumerate(places(self.seed, self.frames + 1))
        ]
        image, (u, v) = clip[0]
        name = "marker"
        try:
            if look.kind == "aruco":
                marker = Marker(name, "aruco", id=0)
            else:
                marker = learn(name, image, (round(u), round(v)), look.kind)
        except BadMarker as problem:
            return [_unlearned("precision", look.name, name, OURS, self.frames, problem)]
        results = []
        for method, find in methods(marker, look.radius).items():
            score = Score()
            for k, (image, truth) in enumerate(clip):
                found = find(image, k / FPS)
                if k:
                    score += judge(found, truth, 1.0, look.radius)
            results.append(Result("precision", look.name, name, method, score))
        limit = Score()
        for _, (u, v) in clip[1::15]:
            best = bound(lambda a, b: values(look, a, b, behind), u, v, look.noise)
            limit += Score(1, 1, 0, 0, 1, sum(best))
        return [*results, Result("precision", look.name, name, LIMIT, limit)]


# ---- light

Light = Callable[[float, float], tuple[float, float, float]]
"""Share of the clip that is over (0 to 1), time (s) -> factors of blue, green and red."""


def _grey(gain: float) -> tuple[float, float, float]:
    return gain, gain, gain


def _warm(share: float) -> tuple[float, float, float]:
    return 1 - share, 1.0, 1 + share


LIGHTS: dict[str, Light] = {
    "none": lambda share, t: _grey(1.0),
    "exposure 1 to 0.3": lambda share, t: _grey(0.3**share),
    "exposure 1 to 1.8": lambda share, t: _grey(1.8**share),
    "white balance 40 % warm": lambda share, t: _warm(0.4 * share),
    "white balance 40 % cool": lambda share, t: _warm(-0.4 * share),
    "flicker +-35 %": lambda share, t: _grey(1 + 0.35 * math.cos(200 * math.pi * t)),
    "step to 0.4": lambda share, t: _grey(0.4 if share >= 1 / 3 else 1.0),
}
"""On the values of the picture, as software does it: 0.3 of the value is 0.07 of the light."""

SCENES = {
    "camera tilted by 30 deg": "tilt=30",
    "camera tilted by 50 deg": "tilt=50",
    "8 bricks of like colours": "decoys=8,distance=66",
    "30 bricks of like colours": "decoys=30,distance=66",
    "a hand over the markers": "occlusion=2.5",
    "hand, 8 bricks": "occlusion=2.5,decoys=8,distance=66",
    "deep shadow of the arm": "shadow=0.8",
    "balls": "marker=ball",
}
"""Condition -> what is not as usual in the scene."""
CLIP = 150
METHODS_IN_LIGHT = (OURS, LARGEST)
OUTLINE = "outline"
"""Not a method: from the side, the centre of a disc's picture is not the picture of its centre."""


def swing(seed: int) -> Callable[[float], tuple[float, float]]:
    """Joint angles (rad) over time (s) of a planar arm that swings to and fro."""
    luck = np.random.default_rng([seed, 9])
    first, second = luck.uniform(0, 2 * math.pi, 2)
    return lambda t: (
        0.35 + 0.55 * math.sin(2 * math.pi * 0.23 * t + first),
        -0.8 + 0.6 * math.sin(2 * math.pi * 0.31 * t + second),
    )


def filmed(text: str, seed: int) -> tuple[SyntheticCamera, Callable[[float], tuple[float, float]]]:
    """A camera over the swinging arm, and how it swings; all markers are in sight at first."""
    arm = read_arm(find_arm("planar"))
    constants = read_scene(f"{text},seed={seed}")
    scene = Scene(arm, constants)
    angles = next(
        angles
        for angles in (swing(seed + 10_000 * k) for k in range(1000))
        if min(scene.visible(angles(0.0)).values()) > 0.99
    )
    return SyntheticCamera(scene, ScriptedPoses(arm, angles), start=0.0), angles


class Sensor:
    """What a camera hands over of a clean picture: other light, noise of 2 DN, JPEG 90."""

    def __init__(self, seed: int, size: tuple[int, int]) -> None:
        self._luck = np.random.default_rng([seed, 10])
        # Drawn once, and taken from another place for every picture: drawing is slow.
        shape = size[1] + 64, size[0] + 64, 3
        self._noise = 2 * self._luck.standard_normal(shape, np.float32)

    def read_out(self, image: np.ndarray, gains: tuple[float, float, float]) -> np.ndarray:
        """The picture (BGR, uint8), its blue, green, red multiplied by gains."""
        height, width = image.shape[:2]
        top, left = self._luck.integers(64, size=2)
        noise = self._noise[top : top + height, left : left + width]
        return through_jpeg(
            cv2.add(image * np.array(gains, np.float32), noise, dtype=cv2.CV_8U), 90
        )


@dataclass(frozen=True)
class LightCase:
    """A clip of a scene, to be tracked under several lights (names of LIGHTS)."""

    text: str
    lights: tuple[tuple[str, str], ...]
    seed: int
    frames: int = CLIP

    def run(self) -> list[Result]:
        """Ours and the fixed gate over the whole picture, both markers."""
        camera, angles = filmed(f"{self.text},noise=0,jpeg=0", self.seed)
        clip = [camera.capture(k) for k in range(self.frames)]
        truths = [camera.truth(k) for k in range(self.frames)]
        shown = [camera.scene.visible(angles(frame.t), frame.t) for frame in clip]
        results = []
        for condition, light in self.lights:
            sensor = Sensor(self.seed, camera.scene.camera.size)
            images = [
                sensor.read_out(frame.image, LIGHTS[light](k / self.frames, frame.t))
                for k, frame in enumerate(clip)
            ]
            for name in truths[0]:
                scores: dict[str, Score] = {}
                try:
                    found = _tried(name, camera.constants["marker"], truths[0][name], images[0])
                except BadMarker as problem:
                    results += [
                        _unlearned("light", condition, name, method, self.frames - 1, problem)
                        for method in METHODS_IN_LIGHT
                    ]
                    continue
                for frame, image in zip(clip, images, strict=True):
                    k, q = frame.index, angles(frame.t)
                    truth, part = truths[k][name], shown[k][name]
                    outline, radius = outline_of(camera.scene, q, name)
                    sightings = {method: find(image, frame.t) for method, find in found.items()}
                    for method, sighting in (*sightings.items(), (OUTLINE, outline)):
                        if k:
                            score = judge(sighting, truth, part, radius)
                            scores[method] = scores.get(method, Score()) + score
                results += [
                    Result("light", condition, name, method, score)
                    for method, score in scores.items()
                ]
        return results


def _tried(name: str, kind: str, truth: Point, image: np.ndarray) -> dict[str, Method]:
    """The methods for a marker that is learned where it truly is in the first picture."""
    marker = learn(name, image, (round(truth[0]), round(truth[1])), kind)
    return {OURS: ours(marker), LARGEST: _fixed(marker)}


def _fixed(marker: Marker) -> Method:
    """The largest contour in the learned gate, at least half as wide as at first."""
    color = marker.color
    assert color is not None
    least: list[float] = []

    def find(image: np.ndarray, t: float) -> Sighting | None:
        found = hsv_contours(image, color)
        if found and not least:
            least.append(found.radius / 2)
        return found if found and found.radius >= least[0] else None

    return find


def outline_of(scene: Scene, q: Sequence[float], name: str) -> tuple[Sighting, float]:
    """Centre of a flat marker's outline, and its radius (px; the longer one of an ellipse)."""
    centre, size = scene.centres(q)[name], scene.constants["marker_radius"]
    flat = np.append(circle(size, 128), np.zeros((128, 1)), axis=1)
    m = cv2.moments(scene.project(centre + flat).astype(np.float32))
    depth = scene.camera.seen(centre[None])[0, 2]
    return _of_moments(m), float(scene.camera.focal * size / depth)


# ---- cost

TURNS = 40
LAP = 8
FULL = ("HSV, gate, moments", "HSV, gate, contours")
ABSENT = "ours, searching the whole frame"


@dataclass(frozen=True)
class Cost:
    """Microseconds per frame (median, 95th percentile) and in which part of them it was seen."""

    method: str
    median: float
    p95: float
    seen: float


def lap(text: str) -> list[np.ndarray]:
    """Pictures (640x480) of an arm whose marker goes round in a small circle, which closes."""
    arm = read_arm(find_arm("planar"))

    def angles(t: float) -> tuple[float, float]:
        phase = 2 * math.pi * FPS * t / LAP
        return 0.3 + 0.015 * math.cos(phase), -0.8 + 0.03 * math.sin(phase)

    scene = Scene(arm, read_scene(f"{text},fps_wander=0,seed=5"))
    camera = SyntheticCamera(scene, ScriptedPoses(arm, angles), start=0.0)
    return [camera.capture(k).image for k in range(LAP)]


def contenders() -> dict[str, tuple[list[np.ndarray], Callable[[np.ndarray, float], Any]]]:
    """What is timed: its pictures, and what is done with each of them."""
    discs, balls, arucos = (lap(f"marker={kind}") for kind in ("disc", "ball", "aruco"))
    nothing = lap("effector=blue,goal=none")

    def learned(name: str, kind: str, image: np.ndarray) -> Marker:
        arm = read_arm(find_arm("planar"))
        scene = Scene(arm, read_scene(f"marker={kind},seed=5"))
        u, v = scene.truth((0.315, -0.8))[name]
        return learn(name, image, (round(u), round(v)), kind)

    red, green = (learned(name, "disc", discs[0]) for name in ("effector", "goal"))
    ball = learned("effector", "ball", balls[0])
    aruco = Marker("effector", "aruco", id=ARUCO_IDS["effector"])
    color = red.color
    assert color is not None
    copy = np.empty_like(discs[0])
    radius = 13.0

    def tracking(*markers: Marker) -> Callable[[np.ndarray, float], Any]:
        tracker = Tracker(markers)
        return lambda image, t: all(tracker.find(image, t).values()) or None

    def copying(image: np.ndarray, t: float) -> bool:
        np.copyto(copy, image)
        return True

    return {
        "np.copyto of the frame": (discs, copying),
        "ours, one disc": (discs, tracking(red)),
        "ours, two discs": (discs, tracking(red, green)),
        "ours, one ball": (balls, tracking(ball)),
        "ours, one ArUco marker": (arucos, tracking(aruco)),
        ABSENT: (nothing, tracking(red)),
        FULL[0]: (discs, lambda image, t: hsv_moments(image, color)),
        FULL[1]: (discs, lambda image, t: hsv_contours(image, color)),
        ENCLOSING: (discs, lambda image, t: blur_and_enclose(image, color)),
        HOUGH: (discs, lambda image, t: hough(image, radius)),
    }


def costs(turns: Iterable[int], clock: Callable[[], int] = time.perf_counter_ns) -> list[Cost]:
    """Time all of them in turn, on one thread: what disturbs one disturbs all.

    A turn is two laps, of which the second counts: in the first one the marker is searched for, and
    what the others left in the caches is replaced.

    Args:
        turns: their numbers, from 0.
        clock: ns.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        timed = contenders()
        spent: dict[str, list[int]] = {name: [] for name in timed}
        seen = dict.fromkeys(timed, 0)
        for turn in turns:
            for name, (images, work) in timed.items():
                for k, image in enumerate([*images, *images]):
                    t = (2 * turn * LAP + k) / FPS
                    begin = clock()
                    found = work(image, t)
                    end = clock()
                    if k >= len(images):
                        spent[name].append(end - begin)
                        seen[name] += found is not None
    finally:
        cv2.setNumThreads(threads)
    return [
        Cost(
            name,
            float(np.median(times)) / 1000,
            float(np.percentile(times, 95)) / 1000,
            seen[name] / len(times),
        )
        for name, times in spent.items()
    ]


# ---- serving


def serving(fps: float = 60.0, seconds: float = 5.0) -> float:
    """Part of a core that it costs to serve a brick with `fps` observations a second.

    The brick's own client runs in another process, over TCP; what the bare loop costs is taken off.

    Raises:
        RuntimeError: the client did not come.
    """
    seen = {"effector": (311.27, 208.41, 0.97), "goal": (400.12, 96.35, 1.0)}

    def spent(publish: Callable[[Observation], None]) -> float:
        begin, start = time.process_time(), time.monotonic()
        for k in range(round(fps * seconds)):
            time.sleep(max(0.0, start + k / fps - time.monotonic()))
            publish(Observation(k, "A", time.monotonic(), seen))
        return (time.process_time() - begin) / (time.monotonic() - start)

    bare = spent(lambda observation: None)
    code = new_code()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        server = TrackingServer("127.0.0.1", 0, code)
        stack.callback(server.close)
        client = subprocess.Popen(
            [sys.executable, tracking_client.__file__, f"127.0.0.1:{server.port}", "--code", code],
            env={**os.environ, "BRICKSERVO_STATE": folder},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(client.wait)
        stack.callback(client.terminate)
        deadline = time.monotonic() + 10
        while server.state().client is None:
            if time.monotonic() > deadline:
                raise RuntimeError("the client did not connect within 10 s")
            time.sleep(0.01)
        return spent(server.publish) - bare


# ---- all of it


Case = PrecisionCase | LightCase


def cases(seeds: range) -> list[Case]:
    """Everything but the cost, the longest first."""
    lights = tuple((name, name) for name in LIGHTS)
    scenes = [(text, ((name, "none"),)) for name, text in SCENES.items()]
    clips = [("", lights[:4]), ("", lights[4:]), *scenes]
    filmed = [LightCase(text, lights, seed) for text, lights in clips for seed in seeds]
    return [*filmed, *(PrecisionCase(look, seed) for look in LOOKS for seed in seeds)]


def _run(case: Case) -> list[Result]:
    return case.run()


def run(todo: Sequence[Case], executor: Executor | None = None) -> Iterator[list[Result]]:
    """Yield the results of all cases in their order.

    Args:
        todo: the cases.
        executor: does the work; None for all cores of this machine.
    """
    return workers.map_cases(_run, todo, executor=executor)


def gathered(results: Iterable[Result]) -> list[Result]:
    """One result per condition, marker and method: the seeds' scores added, the last error kept."""
    sums: dict[tuple[str, str, str, str], Result] = {}
    for r in results:
        key = r.part, r.condition, r.marker, r.method
        if key in sums:
            before = sums[key]
            r = replace(r, score=before.score + r.score, error=r.error or before.error)
        sums[key] = r
    return list(sums.values())


Row = tuple[str, ...]

PRECISION_HEADINGS: Row = (
    "marker", "limit", "ours", "x limit", "bias u", "bias v", MOMENTS, ENCLOSING, HOUGH,
)  # fmt: skip


def _found(results: Iterable[Result], part: str) -> dict[tuple[str, str], dict[str, Score]]:
    """Scores by condition and marker, then by method."""
    found: dict[tuple[str, str], dict[str, Score]] = {}
    for r in results:
        if r.part == part:
            found.setdefault((r.condition, r.marker), {})[r.method] = r.score
    return found


def _px(score: Score | None) -> str:
    """RMS px, beside it how many of how many frames were missed."""
    if score is None:
        return "-"
    missed = score.clear - score.measured
    share = f" ({100 * missed / score.clear:.0f} % missed)" if missed else ""
    return f"{score.rms:.3f}{share}" if score.measured else "never found"


def precision_table(results: Sequence[Result]) -> list[Row]:
    """One row per look."""
    rows = []
    for (look, _), scores in _found(results, "precision").items():
        ours, limit = scores[OURS], scores.get(LIMIT, Score())
        u, v = ours.bias
        rest = (_px(scores.get(method)) for method in (MOMENTS, ENCLOSING, HOUGH))
        rows.append(
            (
                look,
                f"{limit.rms:.4f}",
                _px(ours),
                f"{ours.rms / limit.rms:.1f}",
                f"{u:+.3f}",
                f"{v:+.3f}",
                *rest,
            )
        )
    return rows


LIGHT_HEADINGS: Row = (
    "what changes", "marker", "ours lost %", "ours false %", "ours rms",
    "HSV lost %", "HSV false %", "HSV rms", "outline rms",
)  # fmt: skip


def light_table(results: Sequence[Result]) -> list[Row]:
    """One row per condition and marker."""
    rows = []
    for (condition, marker), scores in _found(results, "light").items():
        row = [condition, marker]
        for method in METHODS_IN_LIGHT:
            score = scores.get(method, Score())
            rms = f"{score.rms:.3f}" if score.measured else "-"
            row += [f"{score.lost_percent:.1f}", f"{score.false_percent:.1f}", rms]
        rows.append((*row, f"{scores[OUTLINE].rms:.3f}" if OUTLINE in scores else "-"))
    return rows


COST_HEADINGS: Row = ("640x480, one thread", "us", "p95", "of the full-frame recipe", "seen %")


def full(timed: Iterable[Cost]) -> float:
    """Microseconds of the usual full-frame recipe: the quicker one of the two ways to end it."""
    return min(cost.median for cost in timed if cost.method in FULL)


def cost_table(timed: Sequence[Cost]) -> list[Row]:
    """One row per contender."""
    usual = full(timed)
    return [
        (
            cost.method,
            f"{cost.median:.0f}",
            f"{cost.p95:.0f}",
            f"1/{usual / cost.median:.1f}" if cost.median < usual else f"{cost.median / usual:.1f}",
            f"{100 * cost.seen:.0f}",
        )
        for cost in timed
    ]


def errors(results: Iterable[Result]) -> list[str]:
    """What could not be tried, and why."""
    return [f"{r.condition}: {r.error}" for r in results if r.error and r.method == OURS]


def figures(results: Iterable[Result], timed: Iterable[Cost]) -> dict[str, Any]:
    """Everything, for `--json`; what was not measured is null."""

    def number(x: float) -> float | None:
        return None if math.isnan(x) else x

    return {
        "results": [
            {
                **asdict(r),
                "rms": number(r.score.rms),
                "bias": [number(x) for x in r.score.bias],
                "lost_percent": number(r.score.lost_percent),
                "false_percent": number(r.score.false_percent),
            }
            for r in results
        ],
        "costs": [asdict(cost) for cost in timed],
    }
