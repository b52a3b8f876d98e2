"""Frames, with the time they were taken, and the captures of OpenCV that give them."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np

from shared.arm_description import ArmError

if os.environ.get("OPENCV_LOG_LEVEL") == "SILENT":
    # (Imported before, it has not read the variable. Where this lives depends on its version.)
    (cv2.setLogLevel if hasattr(cv2, "setLogLevel") else cv2.utils.logging.setLogLevel)(0)


class NoCamera(ArmError):
    """A camera, file, folder or stream that gives no pictures."""


class Frame(NamedTuple):
    """One picture.

    index  counts the camera's frames from 0; a frame that nobody took in time leaves a gap
    t      capture time, s
    image  BGR, uint8, shape (height, width, 3)
    """

    index: int  # type: ignore[assignment]  # hides tuple.index, which no frame needs
    t: float
    image: np.ndarray


class Capture(Protocol):
    """The part of cv2.VideoCapture that is used."""

    def isOpened(self) -> bool: ...  # noqa: N802, D102
    def grab(self) -> bool: ...  # noqa: D102
    def retrieve(self) -> tuple[bool, Any]: ...  # noqa: D102
    def get(self, propId: int) -> float: ...  # noqa: N803, D102
    def set(self, propId: int, value: float) -> bool: ...  # noqa: N803, D102
    def release(self) -> None: ...  # noqa: D102


MakeCapture = Callable[..., Capture]


def size_of(capture: Capture) -> tuple[int, int]:
    """Return the width and height of a capture's pictures, px."""
    return (
        int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
    )


def bgr(image: np.ndarray) -> np.ndarray:
    """Return a decoded picture as BGR, uint8, shape (h, w, 3); grey, alpha and 16 bits convert."""
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
    if image.ndim == 2:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if image.shape[2] == 1:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if image.shape[2] == 4:
        return cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    return image
