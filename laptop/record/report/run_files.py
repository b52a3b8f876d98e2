"""Reading of the files that runs leave: the answer is values, or an error of one clear line."""

from __future__ import annotations

import csv
import io
import math
import struct
import zlib
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.image import imread

from laptop.record.run import MAX_NUMBER, DamagedRun
from shared.config_files import InvalidFile, open_file

MAX_PICTURE, MAX_CSV = 40_000_000, 20_000_000
"""Greatest size of a picture and of a CSV, bytes."""
MAX_COLUMNS, MAX_VALUES = 64, 3_000_000
"""Greatest number of columns and of values of a CSV."""
MAX_PIXELS, MAX_SIDE = 8_000_000, 10_000
"""Greatest size of a picture that is decoded, px, and of its sides, px."""
PICTURE_HEADS = {b"\x89PNG\r\n\x1a\n": "png", b"\xff\xd8\xff": "jpeg"}
"""Kinds of pictures by their first bytes."""
DECODE_ERRORS = (
    *(OSError, SyntaxError, ValueError, LookupError, TypeError, EOFError),
    *(struct.error, zlib.error, cv2.error),
)
"""Errors that decoding a damaged picture ends in."""


def is_plain(file: Path) -> bool:
    """Return whether a file is one of the folder's own: a link may lead to what is private."""
    return file.is_file() and not file.is_symlink()


def read_bytes(file: Path, most: int) -> bytes:
    """Return the content of a file.

    Raises:
        DamagedRun: it cannot be read, is no file, or is larger than `most` bytes.
    """
    try:
        if not is_plain(file):
            raise DamagedRun(f"{file.name} is not there, or no file")
        with open(open_file(str(file)), "rb") as opened:
            content = opened.read(most + 1)
    except OSError as error:
        raise DamagedRun(f"{file.name} cannot be read: {error.strerror}") from None
    except InvalidFile as error:
        raise DamagedRun(f"{file.name} {error}") from None
    if len(content) > most:
        raise DamagedRun(f"{file.name} is larger than {most // 1_000_000} MB")
    return content


def read_columns(file: Path) -> dict[str, np.ndarray]:
    """Return the columns of a CSV of numbers by their names; an empty cell is NaN.

    Raises:
        DamagedRun: it is none, a row is cut off, or it has no row.
    """
    heading, rows = read_rows(file)
    cells = array("d")
    for k, row in enumerate(rows):
        cells.extend(read_numbers(row, f"{file.name}: line {k + 2}"))
    table = np.array(cells).reshape(-1, len(heading))
    return {name: table[:, k] for k, name in enumerate(heading)}


def read_numbers(cells: Sequence[str], place: str) -> list[float]:
    """Return the numbers of some cells; an empty one is NaN.

    Args:
        cells: as they stand in the file.
        place: of them, for people.

    Raises:
        DamagedRun: one is none, or beyond all bounds.
    """
    try:
        numbers = [float(cell) if cell else math.nan for cell in cells]
    except ValueError:
        raise DamagedRun(f"{place} holds no numbers") from None
    for cell, number in zip(cells, numbers, strict=True):
        if abs(number) > MAX_NUMBER:
            raise DamagedRun(f"{place} holds {cell[:20]}, which is beyond all that a run measures")
    return numbers


def read_rows(file: Path) -> tuple[list[str], Iterator[list[str]]]:
    """Return heading and rows of a CSV, as many cells in each; rows are read as they are taken.

    Raises:
        DamagedRun: it is none, has too many values, a row is cut off, or it has no row; the last
            two, and what is no text, when the rows are taken.
    """
    content = read_bytes(file, MAX_CSV)
    text = io.TextIOWrapper(io.BytesIO(content), "utf-8-sig", newline="")
    rows = _filled_rows(csv.reader(text), file.name)
    heading = next(rows)
    if len(heading) > MAX_COLUMNS:
        raise DamagedRun(f"{file.name} has {len(heading)} columns, more than {MAX_COLUMNS}")
    if content.count(b"\n") * len(heading) > MAX_VALUES:  # before they are taken, which is slow
        raise _too_many(file.name)
    return heading, _even_rows(rows, len(heading), file.name)


def _filled_rows(reader: Iterator[list[str]], name: str) -> Iterator[list[str]]:
    """Yield all rows that hold something, and at least one."""
    try:
        found = False
        for row in reader:
            if row:
                found = True
                yield row
    except (ValueError, csv.Error):
        raise DamagedRun(f"{name} is no CSV") from None
    if not found:
        raise DamagedRun(f"{name} is no CSV")


def _even_rows(rows: Iterator[list[str]], width: int, name: str) -> Iterator[list[str]]:
    k = 0
    for k, row in enumerate(rows, 1):
        if len(row) != width:
            raise DamagedRun(f"{name}: row {k} has {len(row)} values, its heading has {width}")
        if k * width > MAX_VALUES:
            raise _too_many(name)
        yield row
    if not k:
        raise DamagedRun(f"{name} has no row")


def _too_many(name: str) -> DamagedRun:
    return DamagedRun(f"{name} has more than {MAX_VALUES} values; do this run again, and shorter")


def read_picture(file: Path) -> bytes:
    """Return a PNG or JPEG that really is one.

    Raises:
        DamagedRun: it is none.
    """
    content, name = read_bytes(file, MAX_PICTURE), file.name
    kinds = [kind for head, kind in PICTURE_HEADS.items() if content.startswith(head)]
    if not kinds:
        raise DamagedRun(f"{name} is neither PNG nor JPEG")
    wide, high = picture_size(content)
    if not wide * high:
        raise DamagedRun(f"{name} is a damaged picture")
    if wide * high > MAX_PIXELS or max(wide, high) > MAX_SIDE:
        raise DamagedRun(
            f"{name} has {wide} x {high} px, more than {MAX_PIXELS // 1_000_000} MP or {MAX_SIDE} "
            "px on a side"
        )
    if not _is_whole(content, kinds[0]):
        raise DamagedRun(f"{name} is a damaged picture")
    return content


def _is_whole(content: bytes, kind: str) -> bool:
    """Return whether both decoders take a picture: each lets pass what the other one refuses.

    OpenCV takes truncated files, Pillow those with unknown chunks; OpenCV may print.
    """
    try:
        imread(io.BytesIO(content), kind)
        return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR) is not None
    except DECODE_ERRORS:
        return False


def picture_size(content: bytes) -> tuple[int, int]:
    """Return width and height of a PNG or JPEG, px, by its head alone; 0, 0 if it has none."""
    if content.startswith(b"\x89PNG"):
        is_first = content[12:16] == b"IHDR"
        wide, high = (int.from_bytes(content[k : k + 4], "big") for k in (16, 20))
        return (wide, high) if is_first else (0, 0)
    place = 2
    while content[place : place + 1] == b"\xff" and place + 9 <= len(content):
        kind = content[place + 1]
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):  # a frame's head
            high, wide = (int.from_bytes(content[place + k : place + k + 2], "big") for k in (5, 7))
            return wide, high
        place += 2 + int.from_bytes(content[place + 2 : place + 4], "big")
    return 0, 0
