"""Films with circles marked by hand: as they are, and with what may happen to a marker.

A folder of films holds `truth.json`: {"annotations": {FILE: [{"frame", "x", "y", "r"}, ...]}}, px,
frames counted from 0.  It may hold "empty": {FILE: [[first, last], ...]}, frames without a ball.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from laptop.emulator.scene.optics import Box, coverage
from shared.arm_description import ArmError
from tests.claims.covers import fingers, half_plane
from tests.claims.position_claims import Circle, Claim, Shot, claims_of

APPROACH = 4
"""Frames before one with truth through which the ball is followed as it is."""
FPS = 25.0

Harm = Callable[[np.ndarray, Circle, np.random.Generator], np.ndarray]
"""Makes of a picture, a circle in it and luck a picture in which that is harder to see."""


class BadFilms(ArmError):
    """A folder without films, or without their truth."""


def _hidden(image: np.ndarray, circle: Circle, luck: np.random.Generator) -> np.ndarray:
    share, direction = luck.uniform(0.15, 0.75), luck.uniform(0, 2 * math.pi)
    return _covered(image, [half_plane(share, circle, direction)], luck)


def _fingered(image: np.ndarray, circle: Circle, luck: np.random.Generator) -> np.ndarray:
    share, direction = luck.uniform(0.3, 1.2), luck.uniform(0, 2 * math.pi)
    return _covered(image, fingers(share, circle, direction), luck)


def _covered(image: np.ndarray, rings: list[np.ndarray], luck: np.random.Generator) -> np.ndarray:
    tone = luck.choice([(107, 143, 201), (128, 128, 128), (32, 32, 32), (224, 230, 232)])
    height, width = image.shape[:2]
    share = cv2.GaussianBlur(coverage(rings, Box(0, 0, width, height)), (0, 0), 0.8)[..., None]
    return np.round(image + share * (tone - image.astype(float))).astype(np.uint8)


def _unsharp(image: np.ndarray, circle: Circle, luck: np.random.Generator) -> np.ndarray:
    return cv2.GaussianBlur(image, (0, 0), circle[2] * luck.uniform(0.05, 0.4))


def _smeared(image: np.ndarray, circle: Circle, luck: np.random.Generator) -> np.ndarray:
    length, turn = luck.uniform(5, 40), luck.uniform(0, math.pi)
    half = math.ceil(length / 2) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    for along in np.linspace(-length / 2, length / 2, 2 * math.ceil(length)):
        x, y = half + along * math.cos(turn), half + along * math.sin(turn)
        left, top = math.floor(x), math.floor(y)
        for du, dv in ((0, 0), (0, 1), (1, 0), (1, 1)):
            kernel[top + dv, left + du] += (1 - abs(x - left - du)) * (1 - abs(y - top - dv))
    return cv2.filter2D(image, -1, kernel / kernel.sum())


HARMS: dict[str, Harm] = {
    "half hidden by an edge": _hidden,
    "in fingers": _fingered,
    "out of focus": _unsharp,
    "motion blur": _smeared,
}
"""What is done to a frame with truth."""

_PLAIN, LARGE = "as it is", "twice as large"
VIEWS: dict[str, tuple[float, tuple[float, float, float]]] = {
    _PLAIN: (1.0, (1.0, 1.0, 1.0)),
    LARGE: (2.0, (1.0, 1.0, 1.0)),
    "exposure 0.3": (1.0, (0.3, 0.3, 0.3)),
    "exposure 1.8": (1.0, (1.8, 1.8, 1.8)),
    "40 % warmer": (1.0, (0.7, 1.0, 1.4)),
    "40 % cooler": (1.0, (1.4, 1.0, 0.7)),
}
"""How the whole film is seen: how many times larger; factors of blue, green and red."""


@dataclass(frozen=True)
class FilmCase:
    """A film, seen in one way, and in one way made harder to see where its truth is known."""

    folder: str
    film: str
    view: str
    harm: str | None
    seed: int

    def run(self) -> list[Claim]:
        """What the tracker says of all frames with truth but the first, where it learns."""
        return claims_of(self.clip(), "ball", "films")

    def clip(self) -> Iterator[Shot]:
        """Yield the frames with truth, and those through which it is followed."""
        circles, empty = truth_of(self.folder, self.film)
        scale, light = VIEWS[self.view]
        near = {k - d for k in circles for d in range(APPROACH + 1)}
        first = min(circles)
        luck = np.random.default_rng([self.seed, 12])
        wanted = {k for k in near | empty if k > first}
        name = " ".join(filter(None, (self.film.split("_")[0] + ":", self.view, self.harm)))
        for index, image in _frames(Path(self.folder, self.film), {first, *wanted}):
            image = cv2.LUT(image, _levels(light))
            image = cv2.resize(image, None, fx=scale, fy=scale) if scale != 1 else image
            circle: Circle | None = None
            if index in circles:  # pixel centres have integer coordinates
                u, v, radius = circles[index]
                circle = (u + 0.5) * scale - 0.5, (v + 0.5) * scale - 0.5, radius * scale
            if circle and self.harm and index > first:
                image = HARMS[self.harm](image, circle, luck)
            counts = bool(circle) or index in empty
            yield Shot(image, circle, index / FPS, name, self.harm is None, counts)


def film_cases(folder: str, seeds: range) -> list[FilmCase]:
    """All films of a folder, in all ways.

    Raises:
        BadFilms: there are none.
    """
    cases = []
    for film in _read_truth(folder)["annotations"]:
        cases += [FilmCase(folder, film, view, None, 0) for view in VIEWS]
        cases += [
            FilmCase(folder, film, view, harm, seed)
            for view in (_PLAIN, LARGE)
            for harm in HARMS
            for seed in seeds
        ]
    return cases


def truth_of(folder: str, film: str) -> tuple[dict[int, Circle], set[int]]:
    """The circles (px) by frame, and the frames without any."""
    truth = _read_truth(folder)
    circles = {c["frame"]: (c["x"], c["y"], c["r"]) for c in truth["annotations"][film]}
    spans = truth.get("empty", {}).get(film, ())
    return circles, {k for first, last in spans for k in range(first, last + 1)}


def _read_truth(folder: str) -> Any:
    file = Path(folder, "truth.json")
    try:
        truth = json.loads(file.read_text(encoding="utf-8"))
        films = [Path(folder, film) for film in truth["annotations"]]
    except (OSError, ValueError, TypeError, KeyError):
        raise BadFilms(
            f"{file}: no truth is there; give a folder of films with circles marked by hand"
        ) from None
    for film in films:
        if not film.is_file():
            raise BadFilms(f"{film} is missing, which {file.name} speaks of; put it there")
    return truth


def _levels(light: tuple[float, float, float]) -> np.ndarray:
    levels = np.arange(256)[:, None] * light
    return np.clip(np.round(levels), 0, 255).astype(np.uint8)[None]


def _frames(film: Path, wanted: set[int]) -> Iterator[tuple[int, np.ndarray]]:
    capture = cv2.VideoCapture(str(film))
    for index in range(max(wanted) + 1):
        if not capture.grab():
            break
        if index in wanted:
            yield index, capture.retrieve()[1]
    capture.release()
