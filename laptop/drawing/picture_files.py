"""PNG and JPEG that are drawn: their brightness, as small as a pen can follow."""

from __future__ import annotations

import cv2
import numpy as np

from laptop.drawing.artwork import BadArtwork
from laptop.system.decoders import quiet_decoders
from laptop.system.picture_heads import JPEG, InvalidPicture, picture_size, png_orientation

WORKING_SIDE = 640
"""Longer side to which a photo is reduced, px: a pen draws nothing finer of it."""
LINES_SIDE = 1280
"""Longer side to which a line drawing is reduced, px: its lines may be close together."""

PAPER_BRIGHTNESS = 0.9
"""Brightness, 0 to 1, from which a pixel is as bright as paper."""

STRIP_ROWS = 256
"""Number of rows converted to grey at once."""


def read_grey(data: bytes, name: str, side: int = WORKING_SIDE) -> np.ndarray:
    """Return a picture's brightness, 0 (black) to 255, (height, width) uint8, reduced in size.

    Paper shows through what is transparent.

    Args:
        data: all of the file.
        name: of the file, for people.
        side: pictures are made smaller until their longer side is this, px.

    Raises:
        BadArtwork: It is no PNG or JPEG, damaged, or beyond a limit.
    """
    try:
        width, height = picture_size(data)
    except InvalidPicture as error:
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
            if max(width, height) >= 2 * share * side:
                how = reduced
                break
    try:
        with quiet_decoders():  # what they print is in part the picture's own, whatever it is
            image = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        image = None
    if image is None:
        raise BadArtwork(f"{name}: is a damaged picture; copy it again, or save it anew")
    if not data.startswith(JPEG):
        image = _turned(image, png_orientation(data))
    return _no_larger(_grey(image), side)


def _turned(image: np.ndarray, orientation: int) -> np.ndarray:
    """Return a picture turned upright by its EXIF orientation, 1 to 8."""
    if orientation > 4:  # rows and columns are exchanged
        image = image.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        image = image[::-1]
    if orientation in (2, 3, 6, 7):
        image = image[:, ::-1]
    return np.ascontiguousarray(image)


def _grey(image: np.ndarray) -> np.ndarray:
    """Return the brightness on white paper, uint8; white on transparent becomes black on white."""
    if image.ndim == 2 and image.dtype == np.uint8:
        return image
    is_light = _is_white_on_nothing(image)
    # By strips: with all that it takes on the way, a whole one is held three times.
    strips = [
        _grey_strip(image[row : row + STRIP_ROWS], is_light)
        for row in range(0, len(image), STRIP_ROWS)
    ]
    return np.concatenate(strips)


def _is_white_on_nothing(image: np.ndarray) -> bool:
    """Return whether all opaque pixels are as light as paper and the rest is transparent."""
    if image.ndim == 2 or image.shape[2] not in (2, 4):
        return False
    most = np.iinfo(image.dtype).max
    *colours, alpha = np.moveaxis(image, 2, 0)
    opaque = alpha > most // 2
    if opaque.all() or not opaque.any():
        return False
    return all(colour[opaque].min() >= PAPER_BRIGHTNESS * most for colour in colours)


def _grey_strip(image: np.ndarray, is_light: bool) -> np.ndarray:
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
    if is_light:
        return 255 - alpha
    share = alpha.astype(np.float32) / 255
    return (255 - share * (255 - grey.astype(np.float32))).astype(np.uint8)


def _no_larger(grey: np.ndarray, side: int) -> np.ndarray:
    scale = side / max(grey.shape)
    if scale >= 1:
        return grey
    size = [max(1, round(side * scale)) for side in grey.shape[::-1]]
    return cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
