"""Precision on the printed disc with its white rim, on grounds of all tones.

Concentric circles, drawn by their coverage of each pixel: ground, rim, colour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laptop.bench.track_methods import OURS
from laptop.bench.track_precision import FPS, LENS_BLUR
from laptop.bench.track_score import SURE_CONFIDENCE, Point, Score, TrackResult, judge, unlearned
from laptop.emulator.scene.optics import Box, circle, coverage, light_of, to_srgb
from laptop.emulator.scene.sensor import blurred, through_jpeg
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker
from laptop.see.markers.tracker import Tracker

COLOURS = ("red", "orange", "yellow", "green", "cyan", "blue", "purple")
GROUNDS = ("white", "#c0c0c0", "#808080", "#404040", "black", "#a98358", "#3c5a3c")
RADII = (8, 16, 32)
"""Radii of the disc, px."""
RIMS = (1.3, 1.5, 1.7, 2.2)
"""Radii of the white rim, in radii of the disc."""
FRAMES = 8
"""Number of frames after the one of learning."""
NOISE, JPEG = 3.0, 90
"""Sigma of the noise, DN, and quality of the JPEG."""
MAX_PRECISE_RMS = 0.05
"""Greatest root mean square error per axis of a precise disc, px."""


def rimmed(
    colour: str, ground: str, radius: float, rim: float, at: Point, seed: Sequence[int]
) -> tuple[np.ndarray, Point]:
    """Return a picture of one disc, BGR, uint8, and the place of its centre, px.

    Args:
        colour: a word or #rrggbb.
        ground: the same.
        radius: px.
        rim: radius of the white rim, in radii.
        at: of the disc, from the middle of the picture, px.
        seed: of the noise.
    """
    half = math.ceil(2.4 * radius) + 16
    box = Box(0, 0, 2 * half, 2 * half)
    light = np.broadcast_to(light_of(ground), (2 * half, 2 * half, 3)).astype(float)
    u, v = half + at[0], half + at[1]
    for size, tone in ((rim * radius, light_of("white")), (radius, light_of(colour))):
        share = coverage([np.array([u, v]) + circle(size, 256)], box)
        light = light + share[..., None] * (tone - light)
    values = to_srgb(blurred(light.astype(np.float32), LENS_BLUR))
    values = values + NOISE * np.random.default_rng(seed).standard_normal(values.shape)
    return through_jpeg(np.clip(np.round(values), 0, 255).astype(np.uint8), JPEG), (u, v)


@dataclass(frozen=True)
class RimCase:
    """Discs of all colours on all grounds, of one radius (px) and one rim (radii)."""

    radius: int
    rim: float
    seed: int

    def run(self) -> list[TrackResult]:
        """Learn each in one picture, and follow it through some more."""
        return [self.follow(colour, ground) for colour in COLOURS for ground in GROUNDS]

    def follow(self, colour: str, ground: str) -> TrackResult:
        """Follow one of them; a frame in which it is not sure counts as lost."""
        rng = np.random.default_rng([self.seed, self.radius, round(10 * self.rim)])
        places = [(float(u), float(v)) for u, v in rng.uniform(-3, 3, (FRAMES + 1, 2))]
        clip = [
            rimmed(colour, ground, self.radius, self.rim, at, (self.seed, k))
            for k, at in enumerate(places)
        ]
        name, disc = f"disc r {self.radius}, rim {self.rim:g} r", f"{colour} on {ground}"
        image, (u, v) = clip[0]
        try:
            tracker = Tracker([learn("disc", image, (round(u), round(v)), "disc")])
        except BadMarker as problem:
            return unlearned("rims", name, disc, OURS, FRAMES, problem)
        score = Score()
        for k, (image, truth) in enumerate(clip[1:]):
            found = tracker.find(image, k / FPS)["disc"]
            score += judge(found, truth, 1.0, self.radius, SURE_CONFIDENCE)
        return TrackResult("rims", name, disc, OURS, score)
