"""Confidence against error: what a tracker's confidence says of how far off a position is.

Every clip begins with a marker that is sharp and in full view, which is learned.  Then it is
hidden, blurred or gone, more and more from frame to frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from operator import methodcaller
from typing import Any

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, flat, seeds_of
from laptop.bench.track_precision import wood
from laptop.emulator.scene.marker_pictures import LoneMarker, marker_light
from laptop.emulator.scene.optics import (
    LAMP,
    Box,
    box_of,
    coverage,
    light_of,
    to_srgb,
)
from laptop.emulator.scene.sensor import blurred, through_jpeg
from tests.claims import confidence_table
from tests.claims.position_claims import Circle, Claim, Shot, claims_of
from tests.claims.rays import ray_cases

SIZE = (400, 300)
FPS = 30.0
FRAMES = 16
WHOLE_FRAMES = 4
"""Frames at the beginning in which the marker is sharp and in full view."""
LENS_BLUR = 0.7
NOISE = 2.5

GROUNDS = ("#808080", "#202020", "#e8e6e0", "#a98358", "#5c6a78", "streaks", "leaves")
COVERS = ("#808080", "#c98f6b", "#202020", "#e8e6e0")
COLOURS = ("red", "green", "blue", "orange", "lime")

Picture = tuple[np.ndarray, "Circle | None", bool]
"""An image (BGR, uint8), the marker in it, if any, and whether that is sharp and in full view."""


@dataclass(frozen=True)
class Stress:
    """What is done to a marker of some kind, radii from, to (px)."""

    kind: str
    harm: str
    radii: tuple[float, float] = (10.0, 40.0)

    @property
    def name(self) -> str:
        """For tables."""
        return f"{self.kind} r {self.radii[0]:.0f} to {self.radii[1]:.0f}, {self.harm}"


WHOLE, EDGE, FINGERS = "sharp, in full view", "half hidden by an edge", "in fingers"
UNSHARP, MOTION = "out of focus", "motion blur up to 40 px"
BORDER, GONE = "cut by the picture's border", "gone, among leaves"
HARMS = (WHOLE, EDGE, FINGERS, UNSHARP, MOTION, BORDER, GONE)
STRESSES = tuple(
    Stress(kind, harm, radii)
    for kind in ("disc", "ball")
    for harm in HARMS
    for radii in ((10.0, 40.0), (50.0, 70.0))
    if radii[0] < 50 or harm in (WHOLE, EDGE, UNSHARP)
)


@dataclass(frozen=True)
class RenderCase:
    """A clip of one stress."""

    stress: Stress
    seed: int

    def run(self) -> list[Claim]:
        """What the tracker says of every frame but the first, in which the marker is learned."""
        clip = (
            Shot(image, circle, k / FPS, self.stress.name, clear)
            for k, (image, circle, clear) in enumerate(self.pictures())
        )
        return claims_of(clip, self.stress.kind, "renders")

    def pictures(self) -> Iterator[Picture]:
        """Yield the clip."""
        harm = self.stress.harm
        luck = np.random.default_rng([self.seed, STRESSES.index(self.stress), 11])
        radius = luck.uniform(*self.stress.radii)
        tone = light_of(str(luck.choice(COLOURS)))
        ground = _ground(luck)
        lamp = LAMP * (1, -1, -1) + luck.normal(0, 0.5, 3) * (1, 1, 0)
        lamp /= np.linalg.norm(lamp)
        cover = light_of(str(luck.choice(COVERS)))
        direction = luck.uniform(0, 2 * math.pi)
        along = np.array([math.cos(direction), math.sin(direction)])
        start, speed = np.array(SIZE) / 2 + luck.uniform(-20, 20, 2), luck.uniform(-2, 2, 2)
        for k in range(FRAMES):
            share = max(0.0, (k - WHOLE_FRAMES + 1) / (FRAMES - WHOLE_FRAMES))
            u, v = start + speed * k
            u += share * (SIZE[0] / 2 + radius) if harm == BORDER else 0
            motion = 40 * share * along if harm == MOTION else np.zeros(2)
            if harm == GONE and share:
                circle, light = None, leaves(luck, tone, SIZE)
            else:
                circle = u, v, radius
                marker = LoneMarker(self.stress.kind, radius, tone)
                light = marker_light(marker, (u, v), ground, (*motion,), lamp).astype(float)
                rings = []
                if harm == EDGE and share:
                    rings = [half_plane(0.8 * share, circle, direction)]
                elif harm == FINGERS and share:
                    rings = fingers(1.2 * share, circle, direction)
                if rings:
                    light += coverage(rings, Box(0, 0, *SIZE))[..., None] * (cover - light)
            blur = LENS_BLUR + (share * 0.5 * radius if harm == UNSHARP else 0)
            values = to_srgb(blurred(light, blur))
            values += NOISE * luck.standard_normal(values.shape)
            image = through_jpeg(np.clip(np.round(values), 0, 255).astype(np.uint8), 90)
            yield image, circle, harm == WHOLE or not share


def _ground(luck: np.random.Generator) -> np.ndarray:
    word = str(luck.choice(GROUNDS))
    if word == "streaks":
        return wood(luck, SIZE)
    if word == "leaves":  # of no marker's colour
        return leaves(luck, light_of("#8a8a80"), SIZE)
    return np.broadcast_to(light_of(word), (SIZE[1], SIZE[0], 3))


def half_plane(share: float, circle: Circle, direction: float) -> np.ndarray:
    """Corners of what comes from a direction (rad) and hides a share of the diameter."""
    u, v, radius = circle
    reach = radius * (1 - 2 * share)
    corners = np.array([(reach, -2e3), (reach + 4e3, -2e3), (reach + 4e3, 2e3), (reach, 2e3)])
    return _turned(corners, direction) + (u, v)


def fingers(share: float, circle: Circle, direction: float) -> list[np.ndarray]:
    """Corners of two fingers that reach a share of the radius over a marker from its rim."""
    u, v, radius = circle
    angle = np.linspace(-math.pi / 2, math.pi / 2, 20)
    width = 0.35 * radius
    tip = np.column_stack([-width * np.cos(angle), width * np.sin(angle)])
    finger = np.vstack([tip, [(2e3, width), (2e3, -width)]]) + (radius * (1 - share) + width, 0)
    return [_turned(finger, turn) + (u, v) for turn in (direction, direction + 2.4)]


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([(c, s), (-s, c)])


def leaves(luck: np.random.Generator, tone: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Light (height, width, 3) of sixty leaves of all shades of a tone (3,)."""
    width, height = size
    image = np.full((height, width, 3), light_of("#303428"))
    angle = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    for _ in range(60):
        long = luck.uniform(8, 50)
        short = long * luck.uniform(0.35, 1)
        leaf = np.column_stack(
            [long * np.cos(angle), short * np.sin(angle) * (1 - 0.5 * np.cos(angle) ** 3)]
        )
        leaf = _turned(leaf, luck.uniform(0, 2 * math.pi)) + luck.uniform((0, 0), size)
        shade = tone * luck.uniform(0.5, 1.3) * luck.uniform(0.75, 1.3, 3)
        box = box_of(leaf, Box(0, 0, width, height))
        if not box.empty:
            covered = box.cut(image)
            covered += coverage([leaf], box)[..., None] * (shade - covered)
    return image


def render_cases(seeds: range) -> list[RenderCase]:
    """All stresses with all seeds."""
    return [RenderCase(stress, seed) for stress in STRESSES for seed in seeds]


def _shown(claims: list[Claim], it: Any) -> Iterator[BenchTable]:
    title = f"Confidence against error; {seeds_of(it)}; {confidence_table.LEGEND}"
    rows, lies = confidence_table.table(claims), confidence_table.lies(claims)
    yield BenchTable(title, confidence_table.HEADINGS, rows, 1)
    yield BenchTable("Lies by confidence", confidence_table.LIES_HEADINGS, lies, 1)


BENCH = BenchRecord(
    "tracking",
    lambda it: [*render_cases(it.seeds), *ray_cases(it.seeds)],
    methodcaller("run"),
    _shown,
    figures=confidence_table.figures,
    gather=flat,
)
