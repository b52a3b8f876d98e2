"""The tracker's view: a frame with its detections, for display."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.see.camera.frames import Frame
from laptop.see.markers.tracks import Sighting, Window
from shared.arm_description import ArmError
from shared.messages import LEAST_CONFIDENCE


class BadPicture(ArmError, OSError):
    """A picture that cannot be written."""


class BoardPlace(NamedTuple):
    """A place on the board, cm.

    x, y  on it
    z     over it; None: that was not measured
    arm   the same (x, y) in the arm's frame; None: how that stands on the board is not known
    """

    x: float
    y: float
    z: float | None = None
    arm: tuple[float, float] | None = None

    def __str__(self) -> str:
        numbers = [self.x, self.y, *([] if self.z is None else [self.z])]
        text = _centimetres(numbers)
        return f"{text} = arm {_centimetres(self.arm)}" if self.arm else text


def _centimetres(numbers: Sequence[float]) -> str:
    return ",".join(f"{round(number, 2) + 0.0:.2f}" for number in numbers) + " cm"


class AnnotatedFrame(NamedTuple):
    """A frame, and what a tracker found in it.

    windows  per marker where it was looked for first, see Tracker
    places   per marker where it is on the board, as far as that is known
    """

    frame: Frame
    found: dict[str, Sighting | None]
    why: dict[str, str]
    fixed: dict[str, tuple[float, float, float]]
    windows: Mapping[str, Window | None] = MappingProxyType({})
    places: Mapping[str, BoardPlace] = MappingProxyType({})


_INK = {"effector": (40, 240, 255), "goal": (255, 230, 60)}
_OTHER_INK = ((120, 255, 120), (255, 140, 255), (140, 190, 255))


def draw(view: AnnotatedFrame, width: int = 1280) -> np.ndarray:
    """Return the tracker's view: the frame, about this wide (px), with what was found."""
    height, wide = view.frame.image.shape[:2]
    k = max(1, round(width / wide))
    image = cv2.resize(view.frame.image, None, fx=k, fy=k, interpolation=cv2.INTER_CUBIC)
    places = [
        *((name, seen) for name, seen in view.found.items() if seen),
        *((name, Sighting(*place, math.nan)) for name, place in view.fixed.items()),
    ]
    inks = dict(_INK)
    for name in view.found:
        inks.setdefault(name, _OTHER_INK[len(inks) % len(_OTHER_INK)])
    for name, seen in places:
        # Pixel centres are at integers, before and after.
        u, v = (k * (seen.u + 0.5) - 0.5, k * (seen.v + 0.5) - 0.5)
        if not (abs(u) < 4 * image.shape[1] and abs(v) < 4 * image.shape[0]):
            continue  # somewhere beyond the picture
        text = f"{name} {seen.u:.1f}, {seen.v:.1f}"
        if math.isfinite(seen.radius):
            text += f"  {seen.confidence:.2f}{' doubtful' * (seen.confidence < LEAST_CONFIDENCE)}"
        for ink, thick in (((0, 0, 0), 5), (inks.get(name, _OTHER_INK[0]), 2)):
            _cross(image, u, v, 9, ink, thick)
            if math.isfinite(seen.radius):
                radius = round(16 * k * seen.radius)
                cv2.circle(
                    image, (round(16 * u), round(16 * v)), radius, ink, thick, cv2.LINE_AA, 4
                )
        reach = k * seen.radius if math.isfinite(seen.radius) else 12
        _label(image, text, u + 0.7 * reach + 8, v - reach - 12, inks.get(name, _OTHER_INK[0]))
    lost = [f"{name}: {why}" for name, why in view.why.items() if not view.found.get(name)]
    for line, text in enumerate(reversed(lost)):
        _label(image, text, 12, image.shape[0] - 14 - 34 * line, (90, 110, 255))
    _label(image, f"frame {view.frame.index}", image.shape[1], 46, (255, 255, 255))
    _rulers(image, k)
    return image


def _rulers(image: np.ndarray, k: int) -> None:
    """Draw the camera's pixel scale along the upper and left edges, at a magnification of k."""
    for along in (0, 1):
        for pixel in range(100, image.shape[1 - along] // k, 100):
            at = (k * pixel + k // 2, 0)[:: 1 - 2 * along]
            end = (at[0] + 12 * along, at[1] + 12 * (1 - along))
            where = (end[0] - 16 + 20 * along, end[1] + 16 - 11 * along)
            for ink, thick in (((0, 0, 0), 4), ((255, 255, 255), 1)):
                cv2.line(image, at, end, ink, thick)
                cv2.putText(
                    image, str(pixel), where, cv2.FONT_HERSHEY_SIMPLEX, 0.5, ink, thick, cv2.LINE_AA
                )


def _cross(image: np.ndarray, u: float, v: float, arm: int, ink: Any, thick: int) -> None:
    x, y, reach = round(16 * u), round(16 * v), 16 * arm
    cv2.line(image, (x - reach, y), (x + reach, y), ink, thick, cv2.LINE_AA, 4)
    cv2.line(image, (x, y - reach), (x, y + reach), ink, thick, cv2.LINE_AA, 4)


def _label(image: np.ndarray, text: str, u: float, v: float, ink: Any) -> None:
    """Draw text on black, moved so that all of it is inside the picture."""
    (w, h), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.7, 2)
    x = round(min(max(u, 6), max(6, image.shape[1] - w - 6)))
    y = round(min(max(v, h + 6), max(h + 6, image.shape[0] - below - 6)))
    cv2.rectangle(image, (x - 5, y - h - 5), (x + w + 5, y + below + 3), (0, 0, 0), -1)
    cv2.putText(image, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.7, ink, 2, cv2.LINE_AA)


def write_picture(file: Path, view: AnnotatedFrame) -> None:
    """Draw a view into a file.

    Raises:
        BadPicture: it cannot be written.
    """
    _, data = cv2.imencode(file.suffix, draw(view))
    try:
        file.write_bytes(data.tobytes())
    except OSError as error:
        raise BadPicture(
            f"cannot write {file}: {error.strerror}; choose another with --to"
        ) from None
