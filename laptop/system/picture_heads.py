"""Headers of untrusted PNG and JPEG files, checked before anything is decoded.

A decoder allocates what a head claims, and paints grey what is missing. So both are looked up
first: the size in the head, and, where it matters, whether the file goes on to its end.
"""

from __future__ import annotations

import struct
import zlib
from typing import NoReturn

from shared.arm_description import ArmError

MAX_PICTURE_BYTES = 40_000_000
"""Longest file of a picture."""

MAX_PIXELS = 50_000_000
"""Most pixels of a picture; decoded, they take 400 MB at worst."""

PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8\xff"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Numbers a pixel, by a PNG's kind of colour."""
ORIENTATION_TAG = 274
STANDALONE = (0x01, *range(0xD0, 0xD9))
"""Markers of a JPEG that bear no length."""
FRAMES = tuple(code for code in range(0xC0, 0xD0) if code not in (0xC4, 0xC8, 0xCC))
"""Those that begin a frame, and hold its size."""


class InvalidPicture(ArmError, ValueError):
    """Error: no picture, or none that is decoded; the message follows the file's name."""


def is_picture(data: bytes) -> bool:
    """Return whether this begins as a PNG or JPEG does."""
    return data.startswith((PNG, JPEG))


def picture_size(data: bytes, to_end: bool = True) -> tuple[int, int]:
    """Width and height of a PNG or JPEG, px, once it is known that it may be decoded.

    Args:
        data: all of the file, or one byte more than `MAX_PICTURE_BYTES` of it.
        to_end: whether the data must be complete and sound to the end; else the head is enough.

    Raises:
        SpoiltPicture: It is no PNG or JPEG, damaged, or beyond a limit.
    """
    if not data:
        raise InvalidPicture("is empty; copy it again, or save it anew")
    if len(data) > MAX_PICTURE_BYTES:
        raise InvalidPicture(
            f"is longer than {MAX_PICTURE_BYTES // 1_000_000} MB; make the picture smaller"
        )
    if not is_picture(data):
        raise InvalidPicture("is neither PNG nor JPEG; save the picture as one of these")
    try:
        size = _png_size(data, to_end) if data.startswith(PNG) else _jpeg_size(data, to_end)
    except (struct.error, IndexError):
        _refuse_cut_off()
    if not _in_limits(size):
        raise InvalidPicture(
            f"claims {size[0]} x {size[1]} pixels; it may have up to "
            f"{MAX_PIXELS // 1_000_000} million: make the picture smaller"
        )
    return size


def _in_limits(size: tuple[int, int]) -> bool:
    return 0 < size[0] * size[1] <= MAX_PIXELS


def _png_size(data: bytes, to_end: bool) -> tuple[int, int]:
    """Width and height, once all chunks up to the end are there and sound, or the head is."""
    size, row, at = (0, 0), 0, len(PNG)
    packed = []
    while True:
        length, kind = struct.unpack_from(">I4s", data, at)
        begin, end = at + 8, at + 12 + length
        (check,) = struct.unpack_from(">I", data, end - 4)
        if zlib.crc32(data[at + 4 : end - 4]) != check:
            raise InvalidPicture("is a damaged PNG; copy it again, or save it anew")
        if kind == b"IHDR":
            *size_, depth, colour, _, _, interlaced = struct.unpack_from(">IIBBBBB", data, begin)
            size = size_[0], size_[1]
            if not (to_end and _in_limits(size)):
                return size
            row = 0 if interlaced else 1 + (size[0] * depth * CHANNELS.get(colour, 1) + 7) // 8
        elif kind == b"IDAT":
            packed.append(memoryview(data)[begin : end - 4])
        elif kind == b"IEND":
            if not _holds(packed, row * size[1]):
                _refuse_cut_off()
            return size
        at = end


def png_orientation(data: bytes) -> int:
    """Return the turn of a PNG that picture_size has passed, as EXIF counts it, 1 to 8.

    1, as it is, where nothing says it.
    """
    at = len(PNG)
    while True:
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"eXIf":
            return _orientation(data[at + 8 : at + 8 + length])
        if kind == b"IEND":
            return 1
        at += 12 + length


def _orientation(exif: bytes) -> int:
    """Return the tag 274 in the first directory of EXIF (TIFF 6.0, section 2)."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(exif[:4])
    try:
        (at,) = struct.unpack_from(f"{order}I", exif, 4)
        (count,) = struct.unpack_from(f"{order}H", exif, at)
        for k in range(count):
            tag, _, _, value = struct.unpack_from(f"{order}HHIH", exif, at + 2 + 12 * k)
            if tag == ORIENTATION_TAG:
                return value if 1 <= value <= 8 else 1
    except struct.error:
        return 1  # none, or none that is sound
    return 1


def _holds(packed: list[memoryview], wanted: int) -> bool:
    """Return whether packed data hold so many bytes, without keeping them."""
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


def _jpeg_size(data: bytes, to_end: bool) -> tuple[int, int]:
    """Width and height, where the end is there, too, or need not be."""
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
            raise InvalidPicture("is a damaged JPEG; copy it again, or save it anew")
    if to_end and b"\xff\xd9" not in data[at:]:
        _refuse_cut_off()
    return width, height


def _refuse_cut_off() -> NoReturn:
    raise InvalidPicture("is a picture that is cut off; copy it again, or save it anew")
