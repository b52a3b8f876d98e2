"""The camera's sensor: light becomes the bytes of a picture."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from laptop.emulator.scene.optics import Box, to_srgb
from laptop.emulator.scene.scene import Patch, Scene

LEVELS = 64
"""Number of levels per DN before noise and rounding."""

ENCODED = np.round(LEVELS * to_srgb(np.arange(65536) / 65535)).astype(np.int16)
"""Encoded value (in LEVELS per DN) of light in 65535ths."""

CHROMA = {
    "420": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420,
    "422": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422,
    "444": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
}
"""Chroma subsampling of a JPEG, as OpenCV has it."""


def through_jpeg(image: np.ndarray, quality: int, chroma: str = "420") -> np.ndarray:
    """Return the image after a JPEG of that quality (1 .. 100) and chroma subsampling."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, CHROMA[chroma]]
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", image, options)[1], cv2.IMREAD_COLOR))


def blurred(light: np.ndarray, sigma: float) -> np.ndarray:
    """Return the light after a lens of Gaussian point spread, sigma px."""
    if not sigma:
        return light
    size = 2 * math.ceil(3.5 * sigma) + 1
    return cv2.GaussianBlur(light, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)


@dataclass(frozen=True)
class Development:
    """The steps by which the light of a single picture becomes bytes.

    blur    sigma of the point spread, px
    noise   sigma, DN
    jpeg    quality; 0 for none
    chroma  of the JPEG, a key of CHROMA
    gain, warm  as in `scene_constants.CONSTANTS`
    """

    blur: float = 0.7
    noise: float = 3.0
    jpeg: int = 0
    chroma: str = "420"
    gain: float = 1.0
    warm: float = 0.0

    def picture(self, light: np.ndarray, seed: int | Sequence[int] = 0) -> np.ndarray:
        """Return the picture (BGR, uint8) of light (height, width, 3); `seed` draws its noise."""
        tint = self.gain * np.array([1 - self.warm, 1.0, 1 + self.warm], np.float32)
        values = to_srgb(blurred(light, self.blur) * tint)
        if self.noise:
            values = values + self.noise * np.random.default_rng(seed).standard_normal(values.shape)
        image = np.clip(np.round(values), 0, 255).astype(np.uint8)
        return through_jpeg(image, self.jpeg, self.chroma) if self.jpeg else image


class Sensor:
    """The sensor of one camera: lens blur, exposure, sRGB, noise, 8 bit, JPEG.

    The ground is developed once and again where it changes; per frame only the patch is.

    Args:
        constants: of the scene.
    """

    def __init__(self, constants: dict[str, Any]) -> None:
        self.constants = constants
        c = constants
        fall = np.linspace(1, 1 - c["gradient"], c["width"], dtype=np.float32)
        tint = np.array([1 - c["warm"], 1.0, 1 + c["warm"]], np.float32)
        light = (65535 * c["gain"] * fall)[:, None] * tint
        self._light = np.ascontiguousarray(
            np.broadcast_to(light, (c["height"], c["width"], 3)), np.float32
        )
        self._scene: Scene | None = None
        self._changes = 0
        self._lamp = 1.0
        self._blurred = np.zeros(0, np.float32)
        self._ground = np.zeros(0, np.int16)
        self._noise = np.zeros(0, np.int16)
        if c["noise"]:
            draw = np.random.default_rng([c["seed"], 3])
            shape = c["height"] + 67, c["width"] + 83, 3
            bank = draw.standard_normal(shape, np.float32) * (LEVELS * c["noise"])
            self._noise = np.round(bank).astype(np.int16)

    def develop(self, scene: Scene, patch: Patch, lamp: float, rng: random.Random) -> np.ndarray:
        """Return the picture (BGR, uint8) of a scene's ground with a patch on it.

        Args:
            scene: whose ground it is.
            patch: all that moves.
            lamp: brightness of the lamp during this exposure, 1 on average.
            rng: draws the noise of this picture.
        """
        self._refresh(scene, lamp)
        values = self._ground.copy()
        if not patch.inner.empty:
            soft = blurred(patch.pixels, self.constants["blur"])
            inside = patch.inner.seen_from(patch.outer).cut(soft)
            patch.inner.cut(values)[:] = self._encoded(inside, patch.inner, lamp)
        image = self._read_out(values, rng)
        quality = self.constants["jpeg"]
        return through_jpeg(image, quality) if quality else image

    def _refresh(self, scene: Scene, lamp: float) -> None:
        """Update the developed ground to the scene's, under this lamp."""
        if scene is not self._scene:
            self._scene, self._changes = scene, 0
            self._blurred = np.zeros_like(scene.ground)
            self._ground = np.zeros(scene.ground.shape, np.int16)
        margin = math.ceil(3.5 * self.constants["blur"]) + 1
        for box in scene.changes[self._changes :]:
            grown = box.grown(margin, scene.frame)
            wide = grown.grown(margin, scene.frame)
            soft = blurred(wide.cut(scene.ground), self.constants["blur"])
            grown.cut(self._blurred)[:] = grown.seen_from(wide).cut(soft)
            if lamp == self._lamp:
                grown.cut(self._ground)[:] = self._encoded(grown.cut(self._blurred), grown, lamp)
        self._changes = len(scene.changes)
        if lamp != self._lamp:
            self._lamp = lamp
            self._ground = self._encoded(self._blurred, scene.frame, lamp)

    def _encoded(self, light: np.ndarray, box: Box, lamp: float) -> np.ndarray:
        exposed = cv2.multiply(light, box.cut(self._light), scale=lamp, dtype=cv2.CV_16U)
        return np.asarray(ENCODED[exposed])

    def _read_out(self, values: np.ndarray, rng: random.Random) -> np.ndarray:
        if not len(self._noise):
            return cv2.convertScaleAbs(values, alpha=1 / LEVELS)
        height, width = values.shape[:2]
        top, left = rng.randrange(68), rng.randrange(84)
        noise = self._noise[top : top + height, left : left + width]
        sign = rng.choice((-1, 1)) / LEVELS
        return cv2.addWeighted(values, 1 / LEVELS, noise, sign, 0, dtype=cv2.CV_8U)
