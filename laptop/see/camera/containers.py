"""Inspection of video files: their number of frames, and what is left of damaged ones."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from shared.message_fields import printable

VIDEO_CHUNKS = b"dc", b"db"
"""Endings of an AVI's chunk names that hold a frame, compressed or not."""
OTHER_CHUNKS = b"wb", b"tx", b"pc"
"""Endings of the other chunk names: sound, text, palettes."""
EBML, SEGMENT = bytes.fromhex("1a45dfa3"), bytes.fromhex("18538067")
"""First bytes of a Matroska or WebM file, and of its part that holds the film."""
BARE_STARTS = b"\xff\xd8\xff", b"\0\0\1", b"\0\0\0\1"
"""First bytes of pictures without a container."""
PROGRAM_STREAM = b"\0\0\1\xba"
"""First bytes of an MPEG program stream, which is a container."""
MIN_TRIM = 0.02
"""Time by which a film must be shown shorter than it is to count as trimmed, s."""
MAX_EDITS = 1000


def frame_numbers(path: Path) -> Sequence[int] | None:
    """Return the numbers of the frames that an AVI with an index still holds; None: unknown.

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
    # An index with wrong places is no evidence.
    return found if 2 * len(found) > len(entries) else None


def _in_turn(file: BinaryIO, at: int, size: int) -> Sequence[int] | None:
    """Return the frames up to where the file breaks off; None where something lies between them."""
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


def states_count(path: Path) -> bool:
    """Return whether a video file states its number of frames: an AVI, and most mp4.

    Of others, as Matroska and WebM, a decoder only knows how long they last and how fast; so it
    does of an mp4 in fragments, or of which an edit shows less than it holds.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            begin = file.read(12)
            if begin[4:8] == b"ftyp":
                fragments = any(name == b"moof" for name, _, _ in _boxes(file, 0, size))
                return not fragments and not _is_trimmed(file, size)
    except (OSError, struct.error, StopIteration):
        return False
    return begin[:4] == b"RIFF"


def _is_trimmed(file: BinaryIO, size: int) -> bool:
    """Return whether an mp4's film is shown for less time than its frames last."""
    unit = 0
    for movie in _inside(file, 0, size, b"moov"):
        for header in _inside(file, *movie, b"mvhd"):
            unit = _time(file, *header)[0]
        for track in _inside(file, *movie, b"trak"):
            media = next(_inside(file, *track, b"mdia"))
            file.seek(next(_inside(file, *media, b"hdlr"))[0] + 8)
            if file.read(4) != b"vide" or not unit:
                continue
            ticks, lasts = _time(file, *next(_inside(file, *media, b"mdhd")))
            for edits in _inside(file, *track, b"edts"):
                for begin, _ in _inside(file, *edits, b"elst"):
                    shown = sum(_edits(file, begin)) / unit
                    return bool(ticks) and shown < lasts / ticks - MIN_TRIM
    return False


def _edits(file: BinaryIO, at: int) -> Iterator[int]:
    """Return the duration of each edit, in the film's units."""
    file.seek(at)
    version, count = struct.unpack(">B3xI", file.read(8))
    for _ in range(min(count, MAX_EDITS)):
        lasts, begin = struct.unpack(
            *((">qq", file.read(16)) if version else (">Ii", file.read(8)))
        )
        file.read(4)  # how fast
        if begin >= 0:  # else nothing is shown
            yield lasts


def _time(file: BinaryIO, at: int, end: int) -> tuple[int, int]:
    """Return units per second, and duration in these, from the header of a film or a track."""
    file.seek(at)
    (version,) = struct.unpack(">B3x", file.read(4))
    form = ">16xIQ" if version else ">8xII"
    unit, length = struct.unpack(form, file.read(struct.calcsize(form)))
    return unit, length


def _inside(file: BinaryIO, at: int, end: int, wanted: bytes) -> Iterator[tuple[int, int]]:
    """Yield begin and end of what is in the boxes of one name."""
    for name, begin, over in _boxes(file, at, end):
        if name == wanted:
            yield begin, min(over, end)


def is_bare(path: Path) -> bool:
    """Return whether data is pictures without a container: JPEG, H.264 or H.265."""
    try:
        with path.open("rb") as file:
            begin = file.read(4)
    except OSError:
        return False
    return begin.startswith(BARE_STARTS) and begin != PROGRAM_STREAM


def how_cut_off(path: Path) -> str:
    """Return how a video file ends before its container's stated end; "" if it is complete.

    A text such as "cut off (it ends after 100 of at least 200 bytes)".
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            stated = _stated_size(file, size)
    except (OSError, struct.error):
        return ""
    return f"cut off (it ends after {size} of at least {stated} bytes)" if stated > size else ""


def _stated_size(file: BinaryIO, size: int) -> int:
    """Return the size that an AVI, mp4 or Matroska file states, bytes; 0 if none."""
    begin = file.read(12)
    if begin[:4] == b"RIFF":
        return 8 + int.from_bytes(begin[4:8], "little")
    if begin[4:8] == b"ftyp":
        return max(end for _, _, end in _boxes(file, 0, size))
    if begin[:4] != EBML:
        return 0
    header, at = _number(file, 4)
    file.seek(at + header)
    if file.read(4) != SEGMENT:
        return 0
    length, at = _number(file, at + header + 4)
    return at + length


def _number(file: BinaryIO, at: int) -> tuple[int, int]:
    """Return a Matroska number and the place behind it; 0 where it is not known.

    Its length, 1 to 8 bytes, follows from how many bits at the beginning are 0.
    """
    file.seek(at)
    (first,) = struct.unpack("B", file.read(1))
    length = 9 - first.bit_length()
    bits = 7 * length
    number = int.from_bytes(bytes([first]) + file.read(length - 1), "big") & ((1 << bits) - 1)
    return (0 if number == (1 << bits) - 1 else number), at + length


def why_unreadable(path: Path) -> str:
    """Return why a video file cannot be read, and what to do, as far as its contents tell."""
    size = path.stat().st_size
    if size == 0:
        return "is empty; record or copy it again"
    with path.open("rb") as file:
        boxes = {name: end for name, _, end in _boxes(file, 0, size)}
    if b"ftyp" in boxes:
        stated = max(boxes.values())
        if b"moov" not in boxes or stated > size:
            missing = f" (it ends after {size} of at least {stated} bytes)" if stated > size else ""
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


def _boxes(file: BinaryIO, at: int, size: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield name, begin and end of what is in each box of an mp4, from a place on."""
    while at + 8 <= size:
        file.seek(at)
        length, name = struct.unpack(">I4s", file.read(8))
        begin = at + 8
        if length == 1 and at + 16 <= size:
            (length,) = struct.unpack(">Q", file.read(8))
            begin += 8
        if length == 0:
            length = size - at
        if length < 8 or not name.isalnum():
            return
        yield name, begin, at + length
        at += length
