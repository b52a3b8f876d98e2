"""Looks into video files that are damaged: which frames an AVI still holds, why an mp4 has none."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from shared.message_fields import printable

VIDEO_CHUNKS = b"dc", b"db"
"""Endings of the names of an AVI's chunks that hold a frame, compressed or not."""
OTHER_CHUNKS = b"wb", b"tx", b"pc"
"""And of others beside them: sound, text, palettes."""


def frame_numbers(path: Path) -> Sequence[int] | None:
    """Return the numbers of the frames that an AVI with an index still holds; None: not told.

    The index lists every frame and its place.  What is no frame there is lost, and a decoder passes
    over it without a word.
    """
    try:
        with path.open("rb") as file:
            return _intact(file, path.stat().st_size)
    except (OSError, struct.error):
        return None


def _intact(file: BinaryIO, size: int) -> Sequence[int] | None:
    if file.read(4) != b"RIFF" or file.read(8)[4:] != b"AVI ":
        return None
    movi, index = None, None
    for name, at, length in _chunks(file, 12, size):
        if name == b"LIST" and file.read(4) == b"movi":
            movi = at + 8  # where the offsets of an index count from: its type
        elif name == b"idx1" and not length % 16:
            index = file.read(length)
    if movi is None:
        return None
    if index is None:
        return _in_turn(file, movi + 4, size)
    entries = [
        entry for entry in struct.iter_unpack("<4sIII", index) if entry[0][2:] in VIDEO_CHUNKS
    ]
    if not entries:
        return None
    found: list[int] = []
    for base in (movi, 0):  # some count from the beginning of the file
        here = [k for k, entry in enumerate(entries) if _is_there(file, size, base, *entry)]
        found = max(found, here, key=len)
    # An index whose places are wrong itself tells nothing.
    return found if 2 * len(found) > len(entries) else None


def _in_turn(file: BinaryIO, at: int, size: int) -> Sequence[int] | None:
    """The frames up to where the file breaks off; None where something lies between them."""
    count = 0
    for name, _, length in _chunks(file, at, size):
        if name[2:] in VIDEO_CHUNKS:
            count += length > 0  # the last one may be a part: the decoder tries it
        elif name[2:] not in OTHER_CHUNKS and name != b"JUNK":
            return None
    return range(count) if count else None


def _is_there(
    file: BinaryIO, size: int, base: int, name: bytes, flags: int, offset: int, length: int
) -> bool:
    """Return True if the frame of an entry of the index is where that says, and is not empty."""
    at = base + offset
    if not length or at + 8 + length > size:
        return False
    file.seek(at)
    return file.read(8) == name + struct.pack("<I", length)


def _chunks(file: BinaryIO, at: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield name, place and length of each chunk of a RIFF file; the file is at its contents."""
    while at + 8 <= end:
        file.seek(at)
        name, length = struct.unpack("<4sI", file.read(8))
        yield name, at, length
        at += 8 + length + length % 2


def why_unreadable(path: Path) -> str:
    """Return why a video file cannot be read, and what to do, as far as its contents tell."""
    size = path.stat().st_size
    if size == 0:
        return "is empty; record or copy it again"
    with path.open("rb") as file:
        boxes = dict(_boxes(file, size))
    if b"ftyp" in boxes:
        whole = max(boxes.values())
        if b"moov" not in boxes or whole > size:
            missing = f" (it ends after {size} of at least {whole} bytes)" if whole > size else ""
            return (
                f"is cut off{missing}: its table of frames, which an mp4 often has at its end, is "
                "missing; copy it again, or record it anew and let the recorder finish"
            )
    with path.open("rb") as file:
        begin = file.read(4096)
    if all(byte in b"\t\n\r" or 32 <= byte < 127 for byte in begin):
        return "cannot be read as a video: it is a text; give --camera a video file"
    return "cannot be read as a video; check that another player shows it, or convert it with one"


def why_undecoded(codec: int) -> str:
    """Return why a video that could be opened shows no frame, and what to do.

    Args:
        codec: its four characters as a number, little end first, as OpenCV has them.
    """
    word = printable(codec.to_bytes(4, "little", signed=codec < 0).decode("latin-1")).strip()
    convert = "convert it, for example: ffmpeg -i FILE -c:v libx264 NEW.mp4"
    if word.lower() == "av01":
        return f"is a film in AV1, which this OpenCV cannot decode; {convert}"
    named = f"of the codec {word} " if word.isalnum() else ""
    return (
        f"is a film {named}of which no frame can be decoded: it is damaged, or this OpenCV cannot "
        f"decode it; check that another player shows it, and {convert}"
    )


def _boxes(file: BinaryIO, size: int) -> Iterator[tuple[bytes, int]]:
    """Yield name and end of each box at the top of an mp4."""
    at = 0
    while at + 8 <= size:
        file.seek(at)
        length, name = struct.unpack(">I4s", file.read(8))
        if length == 1 and at + 16 <= size:
            (length,) = struct.unpack(">Q", file.read(8))
        if length == 0:
            length = size - at
        if length < 8 or not name.isalnum():
            return
        yield name, at + length
        at += length
