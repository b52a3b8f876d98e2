"""Letters of Hershey's fonts by character: their own, those of other alphabets, and made ones.

In the units of the fonts, in which capitals are 21 high; y upwards from the baseline.
"""

from __future__ import annotations

import unicodedata
from functools import cache

import numpy as np
from HersheyFonts import HersheyFonts

from laptop.drawing.accents import ring

CAPITALS = 21.0
"""Height of capitals, in the font's units."""
BASE_LINE = 9.0
"""Baseline of the fonts' own letters, whose y goes down."""

Glyph = tuple[list[np.ndarray], float]
"""Strokes (n, 2), and the advance to the next letter."""

PLAIN = "futural"
GREEK = "greeks"
"""Font of the Greek letters, for all fonts, in place of A to X and a to x."""
CYRILLIC, CYRILLIC_TOO = "cyrilc_1", "cyrillic"
"""Fonts of the Cyrillic letters: the alphabet in order from A and a on; the last letters."""
LAST_CYRILLIC = dict(zip("ЪЫЬЭЮЯъыьюя", "]$_CU^|&~u}", strict=True))
"""Characters that hold the last Cyrillic letters."""
AS_LATIN = {"І": "I", "і": "i", "Ј": "J", "ј": "j", "Ѕ": "S", "ѕ": "s"}
MATHEMATICS, SIGNS = "mathupp", "symbolic"
OF_MATHEMATICS = {
    **dict(zip("→↑←↓±∓×÷≤≥≠≡", "ijkl!\"#x&'?@", strict=True)),
    **dict(zip("∞∝√∫∂∇∈⊂∪⊃∩∠⊥∥∴∏∑", "_^bpmnhdefg|zy~:;", strict=True)),
}
OF_SIGNS = dict(zip("§†‡♠♥♦♣☆○□△◇", "ijkmnopLHIJK", strict=True))

Stroke = tuple[tuple[float, float, float], ...]
COMPOSED: dict[str, tuple[str, tuple[Stroke, ...]]] = {
    "ø": ("o", (((-1, -1, -0.12), (1, 1, 1.12)),)),
    "Ø": ("O", (((-1, -1, -0.08), (1, 1, 1.08)),)),
    "ł": ("l", (((0, -3, 0.40), (0, 3, 0.62)),)),
    "Ł": ("L", (((-1, -2.5, 0.32), (-1, 5, 0.60)),)),
    "đ": ("d", (((1, -6, 0.82), (1, 2.5, 0.82)),)),
    "Đ": ("D", (((-1, -2.5, 0.52), (-1, 5.5, 0.52)),)),
    "Ð": ("D", (((-1, -2.5, 0.52), (-1, 5.5, 0.52)),)),
    "ð": ("o", (((1, 0, 0.50), (0.8, 0, 1.00), (0, 0, 1.35), (-0.6, 0, 1.5)),
                ((-0.5, 0, 1.15), (0.6, 0, 1.5)))),
    "ħ": ("h", (((-1, -2.5, 0.82), (-1, 6, 0.82)),)),
    "ŧ": ("t", (((-0.8, 0, 0.35), (0.8, 0, 0.35)),)),
    "ı": ("i", ()),
    "þ": ("p", (((-1, 0, 0.9), (-1, 0, 4 / 3)),)),
    "Þ": ("P", (((-1, 0, 1.0), (-1, 0, 0.0)),)),
    "€": ("C", (((-1, -3, 0.60), (0.3, 0, 0.60)), ((-1, -3, 0.42), (0.2, 0, 0.42)))),
    "¥": ("Y", (((-0.7, 0, 0.36), (0.7, 0, 0.36)), ((-0.7, 0, 0.18), (0.7, 0, 0.18)))),
    "¢": ("c", (((0, 0, -0.3), (0, 0, 1.3)),)),
    "£": ("L", ()),
}  # fmt: skip
"""Letters composed of another one and of strokes: x = a half of its width + b, y in its heights."""

POUND = (
    ((11, 16), (10, 19), (8, 21), (6, 20), (5, 17), (5, 13), (6, 9), (6, 5), (5, 2), (3, 0)),
    ((3, 0), (13, 0)),
    ((3, 11), (10, 11)),
)
THORN_DROP = 4.0
"""Distance by which the bow of a thorn is lower than that of a P."""

SCRIPT_SIZE, SUPERSCRIPT, SUBSCRIPT = 0.58, 0.42 * CAPITALS, -0.2 * CAPITALS
"""Size of superscripts and subscripts, as a factor, and their baselines."""


@cache
def font(name: str) -> dict[str, Glyph]:
    """Return all letters of one of the library's fonts."""
    library = HersheyFonts()
    library.load_default_font(name)
    found = {}
    for character, glyph in library.all_glyphs.items():
        strokes = [np.array(stroke, float) for stroke in glyph.strokes if len(stroke) > 1]
        place = [-glyph.left_offset, BASE_LINE]
        found[character] = ([stroke * [1, -1] + place for stroke in strokes], glyph.char_width)
    found.pop("\x7f", None)  # what that is differs from font to font
    found["\u00b0"] = ([np.array(ring(5.0, CAPITALS - 3.0, 3.0, 16))], 10.0)
    return found


def glyph(name: str, character: str) -> Glyph | None:
    """Return a letter without accents; None where no font has it.

    Args:
        name: of the library's font.
        character: one.
    """
    own = font(name).get(character)
    if own is not None:
        return own
    if character in COMPOSED:
        return _made(name, character)
    return _other(character) or _small(name, character)


def _made(name: str, character: str) -> Glyph:
    base, added = COMPOSED[character]
    if character == "Þ":
        name = PLAIN  # others have serifs at the foot of a P, or no stem
    strokes, width = font(name)[base]
    if character == "£":
        return [np.array(line, float) for line in POUND], 16.0
    if character == "ı":
        return undotted(strokes), width
    points = np.concatenate(strokes)
    (left, low), (right, high) = points.min(axis=0), points.max(axis=0)
    if character == "Þ":
        stem = [line for line in strokes if np.ptp(line[:, 0]) < 1e-9]
        strokes = [
            *stem,
            *(line - [0, THORN_DROP] for line in strokes if np.ptp(line[:, 0]) >= 1e-9),
        ]
    middle, half = (left + right) / 2, (right - left) / 2
    new = [
        np.array([(middle + a * half + b, low + y * (high - low)) for a, b, y in line])
        for line in added
    ]
    return [*strokes, *new], width


def undotted(strokes: list[np.ndarray]) -> list[np.ndarray]:
    """Return an i or j without its dot."""
    return [stroke for stroke in strokes if stroke[:, 1].min() < 0.72 * CAPITALS]


def _other(character: str) -> Glyph | None:
    """Return a letter that is the same in all fonts; None where there is none."""
    for first, last, begin in (("Α", "Ω", "A"), ("α", "ω", "a")):
        if first <= character <= last:
            place = ord(character) - ord(first)
            # Between rho and sigma Unicode has a final sigma, which is written as the other one
            return font(GREEK)[chr(ord(begin) + place - (place > 17))]
    for first, last, begin in (("А", "Щ", "A"), ("а", "щ", "a")):
        if first <= character <= last:
            return font(CYRILLIC)[chr(ord(begin) + ord(character) - ord(first))]
    if character in LAST_CYRILLIC:
        return font(CYRILLIC_TOO)[LAST_CYRILLIC[character]]
    if character == "э":
        strokes, width = font(CYRILLIC_TOO)["C"]
        return [stroke * 2 / 3 for stroke in strokes], width * 2 / 3
    if character in "Єє":
        strokes, width = _other("Э" if character == "Є" else "э") or ([], 0.0)
        return [stroke * [-1, 1] + [width, 0.0] for stroke in strokes], width
    if character in AS_LATIN:
        return font("timesr")[AS_LATIN[character]]
    for where, name in ((OF_MATHEMATICS, MATHEMATICS), (OF_SIGNS, SIGNS)):
        if character in where:
            return font(name)[where[character]]
    return None


def _small(name: str, character: str) -> Glyph | None:
    """Return a fraction, superscript or subscript, in small letters of the font."""
    kind, *codes = unicodedata.decomposition(character).split() or [""]
    text = "".join(chr(int(code, 16)) for code in codes) if kind.startswith("<") else ""
    above, slash, below = text.partition("\u2044")
    if kind == "<fraction>" and below:
        parts = [_row(name, above, SUPERSCRIPT), font(name).get("/"), _row(name, below, 0.0)]
        return _side_by_side(parts, -0.12 * CAPITALS)
    if kind in ("<super>", "<sub>"):
        return _row(name, text, SUPERSCRIPT if kind == "<super>" else SUBSCRIPT)
    return None


def _row(name: str, text: str, y: float) -> Glyph | None:
    """Return small letters side by side."""
    found: list[Glyph | None] = []
    for character in text:
        one = glyph(name, character)
        found.append(
            one and ([stroke * SCRIPT_SIZE + [0.0, y] for stroke in one[0]], one[1] * SCRIPT_SIZE)
        )
    return _side_by_side(found, 0.0)


def _side_by_side(parts: list[Glyph | None], gap: float) -> Glyph | None:
    strokes, at = [], 0.0
    for part in parts:
        if part is None:
            return None
        strokes += [stroke + [at, 0.0] for stroke in part[0]]
        at += part[1] + gap
    return strokes, at - gap
