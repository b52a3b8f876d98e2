"""Precision: one marker alone in the picture, and the limit of any estimator.

The *limit* is the bound of H. Cramer (1946) and C. R. Rao (1945) for the place (u, v) of exactly
this picture under this pixel noise, rounding to 8 bits included (variance 1/12 DN^2): no unbiased
estimator is better, though it may know everything but the place.  The loss by JPEG is not in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.bench import track_dot2
from laptop.bench.track_methods import DOT2, LIMIT, OURS, methods
from laptop.bench.track_score import Point, Score, TrackResult, judge, unlearned
from laptop.emulator.scene.marker_pictures import LoneMarker, marker_frame, marker_light
from laptop.emulator.scene.optics import light_of, to_linear, to_srgb
from laptop.emulator.scene.sensor import Development, blurred
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker, Marker
from laptop.see.markers.tracks import Sighting

FPS = 30.0
"""Rate of the pictures, Hz."""


@dataclass(frozen=True)
class Appearance:
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


APPEARANCES = (
    Appearance("disc r 12, raw", jpeg=0),
    Appearance("disc r 12, JPEG 90", jpeg=90),
    Appearance("disc r 12, noise 8, JPEG 70", noise=8.0, jpeg=70),
    Appearance("disc r 12, noise 8, JPEG 60", noise=8.0, jpeg=60),
    Appearance("disc r 6, JPEG 90", radius=6.0),
    Appearance("disc r 6, on white, JPEG 90", radius=6.0, background="white"),
    Appearance("disc r 20, JPEG 90", radius=20.0),
    Appearance("disc r 12, dark background", background="#202020"),
    Appearance("disc r 12, edge in the background", background="edge"),
    Appearance("disc r 12, orange wood", background="wood"),
    Appearance("disc r 12, 8 px motion blur", motion=(6.4, 4.8)),
    Appearance("disc r 12, smeared by 30 px", motion=(24.0, 18.0)),
    Appearance("disc r 20, smeared by 30 px", radius=20.0, motion=(24.0, 18.0)),
    Appearance("ball r 12, grey background", "ball"),
    Appearance("ball r 20, dark background", "ball", 20.0, "#202020"),
    Appearance("ArUco, side 32", "aruco", 16.0, "#c0c0c0"),
    Appearance("ArUco, side 48", "aruco", 24.0, "#c0c0c0"),
)
"""Appearances that are compared."""
SIZE = (320, 240)
"""Width and height of the pictures, px."""
FRAMES = 60
"""Number of frames of a case."""

LENS_BLUR = 0.7
"""Sigma of the lens's point spread, px, the default of `marker_frame`."""


def places(seed: int, count: int) -> list[Point]:
    """Return places of the marker in `count` frames, px: on a long ellipse, with random phase."""
    rng = np.random.default_rng([seed, 7])
    phase = rng.uniform(0, 2 * math.pi) + np.arange(count) * (2 * math.pi / 60)
    stray = rng.uniform(-0.5, 0.5, (count, 2))
    return [
        (160 + 8 * math.sin(a) + du, 120 + 50 * math.cos(a) + dv)
        for a, (du, dv) in zip(phase, stray, strict=True)
    ]


def ground(appearance: Appearance, seed: int) -> str | np.ndarray:
    """Return the background for `marker_frame`."""
    width, height = SIZE
    if appearance.background == "edge":
        image = np.full((height, width, 3), 0xD0, np.uint8)
        image[:, : width // 2] = 0x30
        return image
    if appearance.background == "wood":
        light = wood(np.random.default_rng([seed, 8]), SIZE)
        return np.round(to_srgb(light)).astype(np.uint8)
    return appearance.background


def wood(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Return the light (height, width, 3) of grained wood."""
    grain = cv2.GaussianBlur(rng.standard_normal(size[::-1]), (0, 0), 20, sigmaY=1.5)
    return light_of("#c8823c") * np.exp(0.25 * grain / grain.std())[..., None]


def values(appearance: Appearance, u: float, v: float, background: str | np.ndarray) -> np.ndarray:
    """Return the picture before noise, rounding and JPEG, DN; float (height, width, 3)."""
    if isinstance(background, str):
        behind = np.broadcast_to(light_of(background), (SIZE[1], SIZE[0], 3))
    else:
        behind = to_linear(background)
    marker = LoneMarker(appearance.kind, appearance.radius)
    light = marker_light(marker, (u, v), behind, appearance.motion)
    return to_srgb(blurred(light, LENS_BLUR))


def bound(render: Callable[[float, float], np.ndarray], u: float, v: float, noise: float) -> Point:
    """Return the least variance (px^2) in u and in v of any unbiased estimate of a place.

    It is the inverse of Fisher's information J^T J / (noise^2 + 1/12), where J holds the
    derivatives of all pixels with respect to u and v.

    Args:
        render: u, v -> the picture without noise, DN.
        u: place of the marker, px.
        v: the same, downwards.
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
    """An appearance to be measured in a number of frames."""

    appearance: Appearance
    seed: int
    frames: int = FRAMES

    def run(self) -> list[TrackResult]:
        """Run all methods and the limit; the frame of learning does not count."""
        appearance, behind = self.appearance, ground(self.appearance, self.seed)
        smeared = math.hypot(*appearance.motion) > appearance.radius  # too much to be learned from
        clip = [
            (
                marker_frame(
                    LoneMarker(appearance.kind, appearance.radius),
                    (u, v),
                    behind,
                    SIZE,
                    (0.0, 0.0) if smeared and not k else appearance.motion,
                    Development(LENS_BLUR, appearance.noise, appearance.jpeg),
                    [self.seed, k],
                ),
                (u, v),
            )
            for k, (u, v) in enumerate(places(self.seed, self.frames + 1))
        ]
        image, (u, v) = clip[0]
        name = "marker"
        try:
            if appearance.kind == "aruco":
                marker = Marker(name, "aruco", id=0)
            else:
                marker = learn(name, image, (round(u), round(v)), appearance.kind)
        except BadMarker as problem:
            return [unlearned("precision", appearance.name, name, OURS, self.frames, problem)]
        results = []
        for method, find in methods(marker, appearance.radius).items():
            score = Score()
            for k, (image, truth) in enumerate(clip):
                found = find(image, k / FPS)
                if k:
                    score += judge(found, truth, 1.0, appearance.radius)
            results.append(TrackResult("precision", appearance.name, name, method, score))
        if marker.color is not None:
            results.append(self._dot2(name, clip[1:]))
        limit = Score()
        for _, (u, v) in clip[1::15]:
            best = bound(lambda a, b: values(appearance, a, b, behind), u, v, appearance.noise)
            limit += Score(1, 1, 0, 0, 1, sum(best))
        return [*results, TrackResult("precision", appearance.name, name, LIMIT, limit)]

    def _dot2(self, name: str, clip: list[tuple[np.ndarray, Point]]) -> TrackResult:
        """Run ViSP's vpDot2; without it no frame counts, and the error says so."""
        appearance, score = self.appearance, Score()
        truths = [truth for _, truth in clip]
        try:
            shares = track_dot2.shares_of(clip, appearance.radius, appearance.motion)
            places = track_dot2.follow(shares, truths)
        except track_dot2.NoDot2 as problem:
            return TrackResult("precision", appearance.name, name, DOT2, error=str(problem))
        for place, truth in zip(places, truths, strict=True):
            found = Sighting(*place, 1.0, appearance.radius) if place else None
            score += judge(found, truth, 1.0, appearance.radius)
        return TrackResult("precision", appearance.name, name, DOT2, score)
