"""Text becomes an Artwork, in letters of single strokes as a pen writes them (Hershey's fonts)."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from laptop.drawing.accents import ACCENTS, accent_strokes
from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.curves import rounded
from laptop.drawing.glyphs import CAPITALS, glyph, undotted

FONTS = {
    "plain": "futural",
    "roman": "rowmans",
    "script": "scripts",
    "cursive": "cursive",
    "times": "timesr",
    "gothic": "gothiceng",
}
"""Fonts of the library by their names for people; all but the last two are of single strokes."""

MAX_CHARACTERS = 2000
"""Longest text, characters: an A4 page, written closely."""

CORNER_ANGLE = math.radians(55)
"""Turn above which a font's point is a corner, rad: its curves turn by up to 50 degrees a point,
its corners by 60 and more."""

REPLACEMENTS = str.maketrans(
    {
        **dict.fromkeys("\u2018\u2019\u201a\u2032\u00b4", "'"),
        **dict.fromkeys("\u201c\u201d\u201e\u2033\u00ab\u00bb", '"'),
        **dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212", "-"),
        **{"\u2026": "...", "\t": "    ", "\u00b5": "\u03bc"},
        **{"\u00b7": ".", "\u2022": "*", "\u2044": "/"},
        **{"\u00df": "ss", "\u1e9e": "SS", "\u00e6": "ae", "\u00c6": "AE"},
        **{"\u0153": "oe", "\u0152": "OE", "\ufb01": "fi", "\ufb02": "fl"},
    }
)
"""Replacements for characters that the fonts lack."""

IGNORED = re.compile("[\u034f\u115f\u1160\u3164\ufe00-\ufe0f\U000e0100-\U000e01ef]")
"""Characters that have neither ink nor width, besides those of category Cf."""


@dataclass(frozen=True)
class Lettering:
    """Style and layout of a text.

    font     a key of FONTS
    size     height of capitals, cm
    slant    lean to the right, rad
    spacing  distance from letter to letter, 1 as the font has it
    leading  from one baseline to the next, in heights of capitals
    align    "left" | "centre" | "right": where lines of different length meet
    """

    font: str = "plain"
    size: float = 1.0
    slant: float = 0.0
    spacing: float = 1.0
    leading: float = 1.8
    align: str = "left"

    def check(self) -> None:
        """Refuse (BadArtwork) what cannot be written so."""
        for name, value, least, most, unit in (
            ("letters", self.size, 0.1, 100.0, " cm"),
            ("slant", math.degrees(self.slant), -45.0, 45.0, " degrees"),
            ("spacing", self.spacing, 0.5, 5.0, ""),
            ("leading", self.leading, 1.0, 10.0, ""),
        ):
            if not least <= value <= most:
                raise BadArtwork(
                    f"{name} = {value:g}{unit}: it must be from {least:g} to {most:g}{unit}"
                )
        for name, word, known in (
            ("font", self.font, tuple(FONTS)),
            ("align", self.align, ("left", "centre", "right")),
        ):
            if word not in known:
                raise BadArtwork(f"{name} = {word[:30]}: it must be one of {', '.join(known)}")


@dataclass(frozen=True)
class _Letter:
    """Strokes (n, 2) in the font's units, y upwards from the baseline, and the advance width."""

    strokes: list[np.ndarray]
    width: float


@dataclass
class _Line:
    strokes: list[np.ndarray] = field(default_factory=list)
    width: float = 0.0


def write_text(text: str, how: Lettering | None = None, name: str = "") -> Artwork:
    """Return the Artwork of a text: last baseline at y = 0, left edge of its box at x = 0.

    Args:
        text: its lines are ended by newlines.
        how: font, size and the like; as a Lettering is by itself where it is None.
        name: for people; the text's first words where it is "".

    Raises:
        BadArtwork: Nothing is to be written, too much is, or it cannot be written so.
    """
    how = how or Lettering()
    how.check()
    name = name or _first_words(text)
    if len(text) > MAX_CHARACTERS:
        raise BadArtwork(
            f"{name}: is a text of {len(text)} characters; at most {MAX_CHARACTERS} are written: "
            "write a part of it"
        )
    lacking: list[str] = []
    lines = [_line(line, how, lacking) for line in text.strip("\r\n").splitlines()]
    if not any(line.strokes for line in lines):
        raise BadArtwork(
            f"{name or 'text'}: nothing in it can be written"
            f"{_listed(lacking)}; give letters of the Latin, Greek or Cyrillic alphabet"
        )
    scale = how.size / CAPITALS
    widest = max(line.width for line in lines)
    share = {"left": 0.0, "centre": 0.5, "right": 1.0}[how.align]
    shear = np.array([[1.0, 0.0], [math.tan(how.slant), 1.0]])
    strokes = []
    for row, line in enumerate(reversed(lines)):
        place = [share * (widest - line.width), row * how.leading * CAPITALS]
        for stroke in line.strokes:
            # Leaning about its own baseline, so that lines stay below each other
            strokes.append((stroke @ shear + place) * scale)
    notes = (f"The font lacks{_listed(lacking, brackets=False)}.",) if lacking else ()
    return Artwork(name, tuple(strokes), ("",) * len(strokes), None, notes, "text")


def _line(text: str, how: Lettering, lacking: list[str]) -> _Line:
    line = _Line()
    for character in _characters(_shown(text).translate(REPLACEMENTS)):
        found = _letters(how.font, character)
        if not found and character not in lacking:
            lacking.append(character)
        for letter in found:
            line.strokes += [stroke + [line.width, 0.0] for stroke in letter.strokes]
            line.width += letter.width * how.spacing
    return line


def _shown(text: str) -> str:
    """Return a text with plain spaces, and without characters that have neither ink nor width."""
    kinds = ((c, unicodedata.category(c)) for c in text if not IGNORED.match(c))
    return "".join(" " if kind == "Zs" else c for c, kind in kinds if kind != "Cf")


def _characters(text: str) -> list[str]:
    """Return the letters of a text, each with the accents that follow it."""
    found: list[str] = []
    for character in unicodedata.normalize("NFC", text):
        if found and unicodedata.combining(character):
            found[-1] += character
        else:
            found.append(character)
    return found


def _letters(font: str, character: str) -> list[_Letter]:
    """Return a letter, or its Unicode compatibility equivalents; none that a font lacks."""
    own = _letter(font, character)
    if own is not None:
        return [own]
    plain = unicodedata.normalize("NFKC", character)
    found = [_letter(font, c) for c in _characters(plain)] if plain != character else []
    return [] if None in found else [letter for letter in found if letter]


@cache
def _letter(font: str, character: str) -> _Letter | None:
    """Return one letter with its accents; None where the font lacks it."""
    base, marks = character, ""
    drawn = glyph(FONTS[font], character) if len(character) == 1 else None
    if drawn is None:
        decomposed = unicodedata.normalize("NFD", character)
        base, marks = decomposed[:1], decomposed[1:]
        if not all(mark in ACCENTS for mark in marks):
            return None
        drawn = glyph(FONTS[font], base)
    if drawn is None:
        return None
    strokes, width = drawn
    if marks and base in "ij\u0456\u0458" and any(ACCENTS[mark].is_above for mark in marks):
        # The dot gives way to what comes above
        strokes = undotted(strokes)
    for mark in marks:
        strokes = strokes + accent_strokes(mark, strokes)
    return _Letter([rounded(stroke, CORNER_ANGLE, CAPITALS / 1000) for stroke in strokes], width)


def _listed(characters: list[str], brackets: bool = True) -> str:
    if not characters:
        return ""
    shown = " ".join(
        character if character.isprintable() else f"U+{ord(character[0]):04X}"
        for character in characters[:10]
    ) + (" ..." if len(characters) > 10 else "")
    return f" (not {shown})" if brackets else f" {shown}"


def _first_words(text: str) -> str:
    words = " ".join(text[:200].split())
    shown = "".join(character for character in words if character.isprintable())
    return shown if len(shown) <= 30 else shown[:30] + "..."
