"""ArUco's middle, placed by where the diagonals cross and by all of the code's cells.

Beside them stands the bound of `track_precision`: what no unbiased estimator can beat.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.bench.track_precision import LENS_BLUR, Look, bound, places, values
from laptop.emulator.scene.sensor import marker_frame
from laptop.see.markers.finders.aruco import detector
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracker import Tracker

SIDES = (24, 32, 48, 64)
"""Sides of the black square, px."""
FRAMES = 40
BACKGROUND = "#c0c0c0"


@dataclass(frozen=True)
class CodeResult:
    """Precision at one size, px RMS per axis.

    side      px
    frames    number of them
    missed    by the detector, and so by both
    lost      by the tracker, though the detector had it
    crossing  where the diagonals cross
    cells     by all cells: what the tracker says
    limit     the bound
    """

    side: int
    frames: int
    missed: int
    lost: int
    crossing: float
    cells: float
    limit: float


def crossing(corners: np.ndarray) -> tuple[float, float]:
    """Place (u, v) where the diagonals of corners (4, 2) cross, px."""
    a, b, c, d = corners
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)[0]
    u, v = a + share * (c - a)
    return float(u), float(v)


def measure(side: int, seeds: range) -> CodeResult:
    """Photograph codes of this size, alone in the picture, and place them both ways."""
    old, new, limits = [], [], []
    missed = lost = 0
    look = Look("", "aruco", side / 2, BACKGROUND)
    for seed in seeds:
        numbers = np.random.default_rng([seed, side]).integers(50, size=FRAMES)
        for k, (u, v) in enumerate(places(seed, FRAMES)):
            number = int(numbers[k])
            image = marker_frame(
                "aruco", u, v, side / 2, background=BACKGROUND, size=(320, 240), jpeg=90,
                blur=LENS_BLUR, number=number, seed=[seed, side, k],
            )  # fmt: skip
            grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
            quads, found, _ = detector().detectMarkers(grey)
            at = [] if found is None else np.flatnonzero(found.ravel() == number)
            seen = Tracker([Marker("code", "aruco", id=number)]).find(image, 0.0)["code"]
            if not len(at):
                missed += 1
                continue
            if seen is None:
                lost += 1
                continue
            old.append(np.subtract(crossing(quads[at[0]].reshape(4, 2).astype(float)), (u, v)))
            new.append((seen.u - u, seen.v - v))
        u, v = places(seed, 1)[0]
        limits.append(bound(lambda a, b: values(look, a, b, BACKGROUND), u, v, look.noise))
    by_corners, by_cells = (
        math.sqrt(np.mean(np.square(errors))) if errors else math.nan for errors in (old, new)
    )
    best = math.sqrt(np.mean(limits))
    return CodeResult(side, FRAMES * len(seeds), missed, lost, by_corners, by_cells, best)


HEADINGS = ("ArUco, side", "diagonals cross", "all cells", "limit", "missed", "lost by cells")


def table(results: list[CodeResult]) -> list[list[str]]:
    """Rows under HEADINGS."""
    return [
        [
            f"{r.side} px",
            f"{r.crossing:.3f}",
            f"{r.cells:.3f}",
            f"{r.limit:.4f}",
            f"{r.missed} of {r.frames}",
            str(r.lost),
        ]
        for r in results
    ]
