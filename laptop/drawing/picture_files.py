"""PNG and JPEG from strangers: looked at before they are decoded, and bounded.

A decoder allocates what a header claims, and paints grey what is missing. So both are looked up
first: the size in the header, and whether the file goes on to its end.
"""

from __future__ import annotations

import struct
import zlib
from typing import NoReturn

import cv2
import numpy as np

from laptop.drawing.artwork import BadArtwork

MAX_PICTURE_BYTES = 40_000_000
"""Longest file of a picture."""

MAX_PIXELS = 50_000_000
"""Most pixels of a picture; decoded, they take 400 MB at worst."""

WORKING_SIDE = 640
"""Pictures are made smaller until their longer side is this, px: a pen draws nothing finer."""

PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8\xff"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Numbers a pixel, by a PNG's kind of colour."""
STANDALONE = (0x01, *range(0xD0, 0xD9))
"""Markers of a JPEG that bear no length."""
FRAMES = tuple(code for code in range(0xC0, 0xD0) if code not in (0xC4, 0xC8, 0xCC))
"""Those that begin a frame, and hold its size."""


def is_picture(data: bytes) -> bool:
    """Whether this begins as a PNG or JPEG does."""
    return data.startswith((PNG, JPEG))


def read_grey(data: bytes, name: str) -> np.ndarray:
    """The picture's brightness from 0 (black) to 255, (height, width) uint8, as small as is used.

    Paper shows through what is transparent.

    Raises:
        BadArtwork: It is no PNG or JPEG, damaged, or beyond a limit.
    """
    if len(data) > MAX_PICTURE_BYTES:
        raise BadArtwork(
            f"{name}: is longer than {MAX_PICTURE_BYTES // 1_000_000} MB; make the picture smaller"
        )
    if not is_picture(data):
        raise BadArtwork(f"{name}: is neither PNG nor JPEG; save the picture as one of these")
    try:
        width, height = _png_size(data, name) if data.startswith(PNG) else _jpeg_size(data, name)
    except (struct.error, IndexError):
        _refuse_cut_off(name)
    if not 0 < width * height <= MAX_PIXELS:
        raise BadArtwork(
            f"{name}: claims {width} x {height} pixels; it may have up to "
            f"{MAX_PIXELS // 1_000_000} million: make the picture smaller"
        )
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
        image = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        image = None
    if image is None:
        raise BadArtwork(f"{name}: is a damaged picture; copy it again, or save it anew")
    return _working_size(_grey(image))


def _grey(image: np.ndarray) -> np.ndarray:
    """Brightness on white paper, uint8."""
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


def _png_size(data: bytes, name: str) -> tuple[int, int]:
    """Width and height, once all chunks up to the end are there and sound."""
    size, row, at = (0, 0), 0, len(PNG)
    packed = []
    while True:
        length, kind = struct.unpack_from(">I4s", data, at)
        begin, end = at + 8, at + 12 + length
        (check,) = struct.unpack_from(">I", data, end - 4)
        if zlib.crc32(data[at + 4 : end - 4]) != check:
            raise BadArtwork(f"{name}: is a damaged PNG; copy it again, or save it anew")
        if kind == b"IHDR":
            *size_, depth, colour, _, _, interlaced = struct.unpack_from(">IIBBBBB", data, begin)
            size = size_[0], size_[1]
            if not 0 < size[0] * size[1] <= MAX_PIXELS:
                return size
            row = 0 if interlaced else 1 + (size[0] * depth * CHANNELS.get(colour, 1) + 7) // 8
        elif kind == b"IDAT":
            packed.append(memoryview(data)[begin : end - 4])
        elif kind == b"IEND":
            if not _holds(packed, row * size[1]):
                _refuse_cut_off(name)
            return size
        at = end


def _holds(packed: list[memoryview], wanted: int) -> bool:
    """Whether packed data hold so many bytes, without keeping them."""
    unpacker = zlib.decompressobj()
    try:
        for part in packed:
            rest: bytes | memoryview = part
            while wanted > 0 and len(rest):
                wanted -= len(unpacker.decompress(rest, 1_000_000))
                rest = unpacker.unconsumed_tail
    except zlib.error:
        return False
    return wanted <= 0


def _jpeg_size(data: bytes, name: str) -> tuple[int, int]:
    """Width and height, where the end is there, too."""
    at = 2
    while True:
        while data[at] == 0xFF:
            at += 1
        code, at = data[at], at + 1
        if code in STANDALONE:
            continue
        if code in FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 3)
            break
        (length,) = struct.unpack_from(">H", data, at)
        at += length
        if length < 2 or data[at] != 0xFF:
            raise BadArtwork(f"{name}: is a damaged JPEG; copy it again, or save it anew")
    if b"\xff\xd9" not in data[at:]:
        _refuse_cut_off(name)
    return width, height


def _refuse_cut_off(name: str) -> NoReturn:
    raise BadArtwork(f"{name}: is a picture that is cut off; copy it again, or save it anew")
