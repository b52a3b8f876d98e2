"""Balls by another renderer than the scene's: rays, one by one, at random, through a raw sensor.

The scene computes how much of a pixel a ball covers.  Here each pixel is the mean of rays, each at
a moment of the exposure and a place in the pixel, that meet the ball or the ground.  The ball is
rough, shines, mirrors the ground from below and shades it.  The sensor has one colour in each
pixel, the noise of photons, a white balance and a sharpening; the picture goes through WebP.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from tests.claims.position_claims import Circle, Claim, Shot, claims_of

SIZE = (320, 240)
FPS = 30.0
FRAMES = 12
STILL_FRAMES = 3
"""Frames at the beginning in which the ball is at rest."""
MAX_WAY = 34.0
"""Way during the exposure in the last frame, px."""
_RAYS = 64
_GAMMA = 1 / 2.2
_TONES = {
    "red": (0.55, 0.03, 0.03), "green": (0.05, 0.35, 0.08), "blue": (0.03, 0.12, 0.45),
    "orange": (0.75, 0.22, 0.02), "yellow": (0.7, 0.5, 0.04), "pink": (0.7, 0.12, 0.3),
}  # fmt: skip
"""Reflectance of balls: red, green, blue."""
_GROUNDS = {
    "grey": (0.21, 0.21, 0.21), "black": (0.02, 0.02, 0.02), "paper": (0.75, 0.74, 0.7),
    "wood": (0.42, 0.26, 0.12), "steel": (0.1, 0.14, 0.19), "felt": (0.09, 0.05, 0.03),
}  # fmt: skip
_PHOTONS = 4000.0
"""Electrons of white in a pixel."""
_READ_NOISE = 6.0


@dataclass(frozen=True)
class RayCase:
    """A ball at rest, which is learned, and then smeared more from frame to frame."""

    seed: int

    def run(self) -> list[Claim]:
        """What the tracker says of every frame but the first."""
        clip = (
            Shot(image, circle, k / FPS, _condition(way), not way)
            for k, (image, circle, way) in enumerate(self.pictures())
        )
        return claims_of(clip, "ball", "rays")

    def pictures(self) -> Iterator[tuple[np.ndarray, Circle, float]]:
        """Yield image (BGR, uint8), circle in the middle of the exposure, and its way, px."""
        luck = np.random.default_rng([self.seed, 36])
        ball = _Ball(luck)
        ground = _ground(luck)
        at = np.array(SIZE) / 2 + luck.uniform(-15, 15, 2)
        turn = luck.uniform(0, 2 * math.pi)
        along = np.array([math.cos(turn), math.sin(turn)])
        for k in range(FRAMES):
            share = max(0.0, (k - STILL_FRAMES + 1) / (FRAMES - STILL_FRAMES))
            way = MAX_WAY * share
            light = ball.exposed(ground, at, way * along, luck)
            yield _developed(light, luck), (float(at[0]), float(at[1]), ball.radius), way
            at = at + luck.uniform(-2, 2, 2) + 0.15 * way * along


def ray_cases(seeds: range) -> list[RayCase]:
    """A few balls of each seed."""
    return [RayCase(10 * seed + k) for seed in seeds for k in range(10)]


def _condition(way: float) -> str:
    if not way:
        return "at rest"
    return "smeared by " + ("less than 8 px" if way < 8 else "8 to 20 px" if way < 20 else "20 up")


class _Ball:
    """A ball of random size, colour and gloss, under a lamp at random."""

    def __init__(self, luck: np.random.Generator) -> None:
        self.radius = float(luck.uniform(9, 40))
        self._tone = np.array(_TONES[str(luck.choice(list(_TONES)))]) * luck.uniform(0.8, 1.2, 3)
        lamp = np.array([luck.uniform(-0.7, 0.7), luck.uniform(-0.9, 0.2), 1.0])
        self._lamp = lamp / np.linalg.norm(lamp)
        halfway = self._lamp + (0, 0, 1)
        self._halfway = halfway / np.linalg.norm(halfway)
        self._lamp_share = luck.uniform(0.4, 0.8)
        self._gloss, self._shine = luck.uniform(8, 80), luck.uniform(0, 0.6)
        self._defocus = luck.uniform(0.4, 1.1)

    def exposed(
        self, ground: np.ndarray, at: np.ndarray, way: np.ndarray, luck: np.random.Generator
    ) -> np.ndarray:
        """Light, red, green, blue, float, shape (h, w, 3), mean over the exposure."""
        light = ground.copy()
        u, v = at.tolist()
        reach = self.radius * 1.9 + np.abs(way).max() / 2 + 3
        left, top = max(0, int(u - reach)), max(0, int(v - reach))
        right, bottom = min(SIZE[0], int(u + reach) + 2), min(SIZE[1], int(v + reach) + 2)
        us, vs = np.meshgrid(np.arange(left, right), np.arange(top, bottom))
        under = ground[top:bottom, left:right]
        total = np.zeros_like(under)
        for k in range(_RAYS):
            moment = (k + luck.random(us.shape)) / _RAYS - 0.5
            # A place in the pixel and in the lens's disc of confusion.
            angle, out = luck.uniform(0, 2 * math.pi, us.shape), np.sqrt(luck.random(us.shape))
            x = us + luck.uniform(-0.5, 0.5, us.shape) + self._defocus * out * np.cos(angle)
            y = vs + luck.uniform(-0.5, 0.5, us.shape) + self._defocus * out * np.sin(angle)
            total += self._seen(x - u - way[0] * moment, y - v - way[1] * moment, under)
        light[top:bottom, left:right] = total / _RAYS
        return light

    def _seen(self, x: np.ndarray, y: np.ndarray, under: np.ndarray) -> np.ndarray:
        """What rays see that pass the ball's centre by x, y (px) above some ground."""
        x, y = x / self.radius, y / self.radius
        r2 = x * x + y * y
        z = np.sqrt(np.maximum(0, 1 - r2))
        normal = np.stack([x, y, z], -1)
        # The rough surface of M. Oren and S. K. Nayar (1994) is flatter than J. H. Lambert's.
        direct = np.maximum(0, normal @ self._lamp) ** 0.8
        sky = 0.5 * (1 + z)
        diffuse = self._lamp_share * direct + (1 - self._lamp_share) * sky
        mirrored = 0.35 * (1 - sky)[..., None] * under
        shine = self._shine * np.maximum(0, normal @ self._halfway) ** self._gloss
        ball = self._tone * (diffuse[..., None] + mirrored) + shine[..., None]
        # The ball takes light from the ground, most on the side away from the lamp.
        off = np.hypot(x + 0.5 * self._lamp[0], y + 0.5 * self._lamp[1])
        shade = 1 - 0.55 * np.exp(-((off / 1.15) ** 4))
        return np.where((r2 < 1)[..., None], ball, under * shade[..., None])


def _ground(luck: np.random.Generator) -> np.ndarray:
    tone = np.array(_GROUNDS[str(luck.choice(list(_GROUNDS)))])
    coarse = cv2.resize(luck.standard_normal((12, 16)), SIZE, interpolation=cv2.INTER_CUBIC)
    fine = cv2.GaussianBlur(luck.standard_normal(SIZE[::-1]), (0, 0), 1.5)
    rough = luck.uniform(0, 0.15) * coarse + luck.uniform(0, 0.3) * fine
    return tone * np.exp(rough)[..., None]


def _developed(light: np.ndarray, luck: np.random.Generator) -> np.ndarray:
    """A picture (BGR, uint8) of light (red, green, blue): mosaic, noise, balance, WebP."""
    cast = np.array([0.6, 1.0, 0.75])
    raw = np.empty(light.shape[:2])
    for row, column, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        raw[row::2, column::2] = (light * cast)[row::2, column::2, channel]
    electrons = luck.poisson(np.maximum(0, raw) * _PHOTONS) + luck.normal(0, _READ_NOISE, raw.shape)
    codes = np.clip(electrons / _PHOTONS * 65535 / 1.2, 0, 65535).astype(np.uint16)
    # OpenCV names a mosaic by the second row and column.
    full = cv2.cvtColor(codes, cv2.COLOR_BayerBG2RGB_EA).astype(np.float32) / 65535 * 1.2 / cast
    image = 255 * np.clip(full, 0, 1) ** _GAMMA
    image += 0.5 * (image - cv2.GaussianBlur(image, (0, 0), 1.2))
    values = np.clip(np.round(image[..., ::-1]), 0, 255).astype(np.uint8)
    quality = [cv2.IMWRITE_WEBP_QUALITY, 75]
    return np.asarray(cv2.imdecode(cv2.imencode(".webp", values, quality)[1], cv2.IMREAD_COLOR))
