"""Reader of all that can be drawn: files, bytes, and the bundled drawings.

What a file is, its contents decide, not its name. Nothing but the file itself is opened.
"""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.gallery_files import GALLERY, gallery
from laptop.drawing.lettering import Lettering, write_text
from laptop.drawing.pictures import Tracing, read_picture
from laptop.drawing.svg import read_svg
from laptop.drawing.xml_guard import is_svg
from laptop.system.picture_heads import MAX_PICTURE_BYTES, is_picture
from shared.config_files import InvalidFile, open_file

OTHER_FORMATS = (
    (b"%PDF", "a PDF", "save it as SVG, for instance with Inkscape"),
    (b"%!PS", "PostScript", "save it as SVG, for instance with Inkscape"),
    (b"GIF8", "a GIF", "save it as PNG"),
    (b"BM", "a BMP", "save it as PNG"),
    (b"II*\x00", "a TIFF", "save it as PNG"),
    (b"MM\x00*", "a TIFF", "save it as PNG"),
    (b"RIFF", "a WebP, or a sound or a film", "save the picture as PNG"),
    (b"PK\x03\x04", "a ZIP archive, or an office document", "save the drawing as SVG"),
    (b"AC10", "a DWG", "save it as SVG"),
)
"""Other formats that people try: their first bytes, their names, and what to do."""

ISO_BRANDS = (
    (b"avi", "an AVIF", "save the picture as JPEG"),
    (b"he", "a HEIC, as phones take pictures", "save or send it as JPEG"),
    (b"mif1", "a HEIC, as phones take pictures", "save or send it as JPEG"),
    (b"", "a film", "save one of its pictures as PNG"),
)
"""Other formats by the brand of an ISO container, which begins at its ninth byte."""

_GAP, _WORD = r"[ \t\r]*", r"[A-Z][-+]?\d+(?:\.\d*)?"
_REMARK = rf"{_GAP}(?:[;(%][^\n]*)?\n"
PLOTTER_FILES = (
    (
        rf"(?:{_REMARK})*{_GAP}(?:N\d+{_GAP})?[GM]\d{{1,3}}(?:{_GAP}{_WORD})*(?:{_REMARK}|$)",
        "G-code",
    ),
    (rf"{_GAP}(?:IN|DF|SP\d?|P[UDA][-\d., ]*){_GAP};", "HPGL"),
    (rf"(?:{_GAP}999[^\n]*\n[^\n]*\n)*{_GAP}0{_GAP}\n{_GAP}SECTION{_GAP}\n", "a DXF"),
)
"""Patterns of texts for other machines, and the formats' names."""
HEAD_LENGTH = 5000
"""Number of characters by which the format of a text is recognised."""

DRAWING_ENDINGS = (".svg", ".svgz", ".png", ".jpg", ".jpeg")
"""Endings of names by which a file of text was meant as a drawing."""


def read_source(
    source: str | Path | bytes,
    name: str = "",
    lettering: Lettering | None = None,
    tracing: Tracing | None = None,
    is_hatched: bool = False,
) -> Artwork:
    """Return the Artwork of a file, of a file's bytes, or of the gallery.

    Args:
        source: path of an SVG, packed or not, a PNG, a JPEG or a text; or all of its bytes; or the
            name of a drawing in the gallery, where there is no file of that name.
        name: for people; the file's name where it is "".
        lettering: how a text is written.
        tracing: how a picture is drawn.
        is_hatched: whether areas of an SVG are hatched.

    Raises:
        BadArtwork: Nothing can be drawn of it, or it is beyond a limit; in one sentence.
    """
    data, name = _contents(source, name)
    if not data.strip():
        raise BadArtwork(f"{name}: is empty; give an SVG, a PNG, a JPEG or a text")
    if is_picture(data):
        return read_picture(data, name, tracing)
    if is_svg(data):
        return read_svg(data, name, is_hatched)
    _refuse_other_formats(data, name)
    text = _readable_text(data, name)
    _refuse_other_texts(text, name)
    return write_text(text, lettering, name)


def _contents(source: str | Path | bytes, name: str) -> tuple[bytes, str]:
    """Return the bytes of a source, and its name for people in one line."""
    if source == "":
        raise BadArtwork(f"no file is named; give one, or a drawing: {', '.join(gallery())}")
    if isinstance(source, bytes):
        return source, _one_line(name or "drawing")
    data, path = _read(Path(source))
    return data, _one_line(
        name or (path.stem if path.parent == GALLERY else path.name) or str(path)
    )


def _refuse_other_formats(data: bytes, name: str) -> None:
    """Refuse formats that people try, known by their first bytes, with what to do instead."""
    found = [refusal for begin, *refusal in OTHER_FORMATS if data.startswith(begin)]
    if data[4:8] == b"ftyp":
        found = [refusal for brand, *refusal in ISO_BRANDS if brand in data[8:64]]
    if found:
        what, advice = found[0]
        raise BadArtwork(f"{name}: is {what}, which is not read; {advice}")


def _readable_text(data: bytes, name: str) -> str:
    """Return a text in UTF-8; refuse what is none, or has control characters."""
    text = _text(data)
    if text is None and b"\0" not in data and name.lower().endswith(".txt"):
        raise BadArtwork(f"{name}: is no text in UTF-8; save it so")
    control = _control(text or "\0")
    if control and name.lower().endswith(".txt"):
        raise BadArtwork(
            f"{name}: has a control character in it (U+{ord(control):04X}), as no text has; save "
            "the text anew"
        )
    if text is None or control:
        raise BadArtwork(f"{name}: is no drawing that is known here; give an SVG, a PNG or a JPEG")
    return text


def _refuse_other_texts(text: str, name: str) -> None:
    """Refuse texts for other machines, and those whose name says that they are a drawing."""
    for pattern, what in PLOTTER_FILES:
        if re.match(pattern, text[:HEAD_LENGTH]):
            raise BadArtwork(
                f"{name}: is {what}, which is for a machine of its own; give the drawing that it "
                "was made of, as SVG"
            )
    if name.lower().endswith(DRAWING_ENDINGS):
        raise BadArtwork(
            f"{name}: is a text, whatever its name says; "
            "name it .txt to write it in letters, or give a drawing"
        )


def _read(path: Path) -> tuple[bytes, Path]:
    """Return the bytes of a file or a bundled drawing, and its path."""
    here = _one_line(str(path))
    if path.parts[:1] in (("http:",), ("https:",)) and not path.exists():
        raise BadArtwork(f"{here}: nothing is fetched from addresses; save it, and give the file")
    is_bundled = GALLERY / f"{path.name.removesuffix('.svg')}.svg"
    try:
        if not path.exists() and path.parent == Path() and is_bundled.exists():
            path = is_bundled
        with open(open_file(str(path)), "rb") as file:
            data = file.read(MAX_PICTURE_BYTES + 1)
    except InvalidFile as error:
        raise BadArtwork(f"{here}: {error}; give an SVG, a PNG, a JPEG or a text") from None
    except FileNotFoundError:
        raise BadArtwork(
            f"{here}: there is no such file; give one, or a drawing that comes along: "
            f"{', '.join(gallery())}"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a null character in a path
        reason = getattr(error, "strerror", None) or str(error)
        raise BadArtwork(f"{here}: cannot be read ({reason}); choose another file") from None
    if len(data) > MAX_PICTURE_BYTES:
        raise BadArtwork(
            f"{here}: is longer than {MAX_PICTURE_BYTES // 1_000_000} MB; "
            "make it smaller, or draw a part of it"
        )
    return data, path


def _text(data: bytes) -> str | None:
    """Return a text decoded from UTF-8; None where it is no text."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None


def _control(text: str) -> str:
    """Return the first control character of a text, or ""."""
    steering = (c for c in text if unicodedata.category(c) == "Cc" and c not in "\t\r\n\f\v")
    return next(steering, "")


def _one_line(name: str) -> str:
    shown = "".join(c if c.isprintable() else "?" for c in name)
    return shown if len(shown) <= 200 else shown[:200] + "..."
