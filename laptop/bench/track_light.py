"""Tracking under changing light, in clips of the swinging arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.bench.track_methods import (
    LARGEST,
    OURS,
    Method,
    hsv_contours,
    ours,
    sighting_of_moments,
)
from laptop.bench.track_score import Point, Score, TrackResult, judge, unlearned
from laptop.emulator.scene.optics import circle
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.sensor import through_jpeg
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker, Marker
from laptop.see.markers.tracks import Sighting
from shared.arm_description import find_arm, read_arm

Light = Callable[[float, float], tuple[float, float, float]]
"""Light: share of the clip that is over (0 to 1), time (s) -> factors of blue, green and red."""


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
"""Lights by name, as factors of the picture's values: 0.3 of the value is 0.07 of the light."""

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
"""Constants that differ in the scene, by condition."""

CLIP_FRAMES = 150
"""Number of frames of a clip."""
METHODS_IN_LIGHT = (OURS, LARGEST)
"""Names of the methods that are compared."""

OUTLINE = "outline"
"""Name of the outline's centre: from the side it is not the picture of the disc's centre."""


def swing(seed: int) -> Callable[[float], tuple[float, float]]:
    """Return joint angles (rad) over time (s) of a planar arm that swings to and fro."""
    rng = np.random.default_rng([seed, 9])
    first, second = rng.uniform(0, 2 * math.pi, 2)
    return lambda t: (
        0.35 + 0.55 * math.sin(2 * math.pi * 0.23 * t + first),
        -0.8 + 0.6 * math.sin(2 * math.pi * 0.31 * t + second),
    )


def filmed(text: str, seed: int) -> tuple[SyntheticCamera, Callable[[float], tuple[float, float]]]:
    """Return a camera over the swinging arm, and its motion; all markers are in sight at first."""
    arm = read_arm(find_arm("planar"))
    constants = read_scene(f"{text},seed={seed}")
    scene = Scene(arm, constants)
    angles = next(
        angles
        for angles in (swing(seed + 10_000 * k) for k in range(1000))
        if min(scene.visible(angles(0.0)).values()) > 0.99
    )
    return SyntheticCamera(scene, ScriptedPoses(arm, angles), start=0.0), angles


class ClipSensor:
    """The sensor of a clip, which adds other light, noise of 2 DN and JPEG 90 to a clean picture.

    Args:
        seed: of the noise.
        size: (width, height) of the pictures, px.
    """

    def __init__(self, seed: int, size: tuple[int, int]) -> None:
        self._rng = np.random.default_rng([seed, 10])
        # Drawn once, and taken from another place for every picture: drawing is slow.
        shape = size[1] + 64, size[0] + 64, 3
        self._noise = 2 * self._rng.standard_normal(shape, np.float32)

    def read_out(self, image: np.ndarray, gains: tuple[float, float, float]) -> np.ndarray:
        """Return the picture (BGR, uint8), its blue, green, red multiplied by gains."""
        height, width = image.shape[:2]
        top, left = self._rng.integers(64, size=2)
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
    frames: int = CLIP_FRAMES

    def run(self) -> list[TrackResult]:
        """Run ours and the fixed gate over the whole picture, on both markers."""
        camera, angles = filmed(f"{self.text},noise=0,jpeg=0", self.seed)
        clip = [camera.capture(k) for k in range(self.frames)]
        truths = [camera.truth(k) for k in range(self.frames)]
        shown = [camera.scene.visible(angles(frame.t), frame.t) for frame in clip]
        results = []
        for condition, light in self.lights:
            sensor = ClipSensor(self.seed, camera.scene.camera.size)
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
                        unlearned("light", condition, name, method, self.frames - 1, problem)
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
                    TrackResult("light", condition, name, method, score)
                    for method, score in scores.items()
                ]
        return results


def _tried(name: str, kind: str, truth: Point, image: np.ndarray) -> dict[str, Method]:
    """Return the methods for a marker that is learned at its true place in the first picture."""
    marker = learn(name, image, (round(truth[0]), round(truth[1])), kind)
    return {OURS: ours(marker), LARGEST: _fixed(marker)}


def _fixed(marker: Marker) -> Method:
    """Return the largest contour in the learned gate, at least half as wide as at first."""
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
    """Return the centre of a flat marker's outline, and its (longer) radius, px."""
    centre, size = scene.centres(q)[name], scene.constants["marker_radius"]
    flat = np.append(circle(size, 128), np.zeros((128, 1)), axis=1)
    m = cv2.moments(scene.project(centre + flat).astype(np.float32))
    depth = scene.camera.seen(centre[None])[0, 2]
    return sighting_of_moments(m), float(scene.camera.focal * size / depth)
