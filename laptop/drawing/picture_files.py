"""PNG and JPEG that are drawn: their brightness, as small as a pen can follow."""

from __future__ import annotations

import cv2
import numpy as np

from laptop.drawing.artwork import BadArtwork
from laptop.picture_heads import JPEG, SpoiltPicture, picture_size
from laptop.vision.frames import quiet_decoders

WORKING_SIDE = 640
"""Pictures are made smaller until their longer side is this, px: a pen draws nothing finer."""

STRIP = 256
"""So many rows are made grey at once."""


def read_grey(data: bytes, name: str) -> np.ndarray:
    """The picture's brightness from 0 (black) to 255, (height, width) uint8, as small as is used.

    Paper shows through what is transparent.

    Raises:
        BadArtwork: It is no PNG or JPEG, damaged, or beyond a limit.
    """
    try:
        width, height = picture_size(data)
    except SpoiltPicture as error:
        raise BadArtwork(f"{name}: {error}") from None
    how = cv2.IMREAD_UNCHANGED  # with the transparency that a PNG may have
    if data.startswith(JPEG):
        # By powers of two while it is decoded, and turned as the camera was held
        how = cv2.IMREAD_GRAYSCALE
        for share, reduced in (
            (8, cv2.IMREAD_REDUCED_GRAYSCALE_8),
            (4, cv2.IMREAD_REDUCED_GRAYSCALE_4),
            (2, cv2.IMREAD_REDUCED_GRAYSCALE_2),
        ):
            if max(width, height) >= 2 * share * WORKING_SIDE:
                how = reduced
                break
    try:
        with quiet_decoders():  # what they print is in part the picture's own, whatever it is
            image = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        image = None
    if image is None:
        raise BadArtwork(f"{name}: is a damaged picture; copy it again, or save it anew")
    return _working_size(_grey(image))


def _grey(image: np.ndarray) -> np.ndarray:
    """Brightness on white paper, uint8."""
    if image.ndim == 2 and image.dtype == np.uint8:
        return image
    # By strips: with all that it takes on the way, a whole one is held three times.
    strips = [_grey_strip(image[row : row + STRIP]) for row in range(0, len(image), STRIP)]
    return np.concatenate(strips)


def _grey_strip(image: np.ndarray) -> np.ndarray:
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
    if image.ndim == 2:
        return image
    if image.shape[2] == 3:
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    if image.shape[2] == 4:
        grey, alpha = cv2.cvtColor(image[:, :, :3], cv2.COLOR_BGR2GRAY), image[:, :, 3]
    else:
        grey, alpha = image[:, :, 0], image[:, :, -1]
    share = alpha.astype(np.float32) / 255
    return (255 - share * (255 - grey.astype(np.float32))).astype(np.uint8)


def _working_size(grey: np.ndarray) -> np.ndarray:
    scale = WORKING_SIDE / max(grey.shape)
    if scale >= 1:
        return grey
    size = [max(1, round(side * scale)) for side in grey.shape[::-1]]
    return cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
