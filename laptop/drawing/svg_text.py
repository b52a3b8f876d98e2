"""Texts in fonts as outlines.

matplotlib finds the fonts of this computer, and brings one with it; HarfBuzz sets the letters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
import uharfbuzz

from laptop.drawing.svg_css import Style
from laptop.drawing.svg_path import PiecePen, Subpaths
from laptop.drawing.svg_units import compose

GENERIC = {
    **{"serif": "DejaVu Serif", "sans-serif": "DejaVu Sans", "monospace": "DejaVu Sans Mono"},
    **{"system-ui": "DejaVu Sans", "ui-sans-serif": "DejaVu Sans", "ui-serif": "DejaVu Serif"},
    **{"ui-monospace": "DejaVu Sans Mono", "cursive": "DejaVu Serif", "fantasy": "DejaVu Serif"},
}
"""Fonts of matplotlib that stand for the generic families."""

METRIC_COMPATIBLE = {
    **{"arial": "Liberation Sans", "helvetica": "Liberation Sans"},
    **{"times new roman": "Liberation Serif", "times": "Liberation Serif"},
    **{"courier new": "Liberation Mono", "courier": "Liberation Mono"},
}
"""Metric-compatible fonts that systems show instead."""

MIDDLE, CENTRAL, HANGING = 0.26, 0.30, 0.73
"""Heights of other lines over the baseline, in font sizes, as in most Latin fonts."""
SUPER, SUB = 0.33, -0.20
"""Baseline shifts of superscripts and subscripts, in font sizes."""


class NoFont(Exception):
    """None of the fonts that a text names is on this computer."""


class FontFile(NamedTuple):
    """A font that is there, and whether it is one that was asked for."""

    path: str
    name: str
    is_asked_for: bool


@dataclass(frozen=True)
class Letter:
    """A character of a text.

    x, y, dx, dy  where it is put, or moved to from where the one before ends, px; None: there
    turn          of it, degrees
    style         with a `font-size` in px
    size          of it, px
    """

    text: str
    style: Style
    size: float
    x: float | None = None
    y: float | None = None
    dx: float = 0.0
    dy: float = 0.0
    turn: float = 0.0

    def is_alone(self) -> bool:
        """Return whether it has a place of its own."""
        return not (self.x is self.y is None and self.dx == self.dy == self.turn == 0)


class Outlined(NamedTuple):
    """Letters in one style as outlines, in the text's own coordinates."""

    shapes: Subpaths
    style: Style


class Layout:
    """Typesetter of texts in fonts.

    instead  fonts that were taken for others: (what was asked for, what was taken)
    lacking  letters that a font does not have
    """

    def __init__(self) -> None:
        self.instead: list[tuple[str, str]] = []
        self.lacking: list[str] = []

    def outlines(self, letters: Sequence[Letter]) -> list[Outlined]:
        """Return a text's letters, px, y downwards.

        Raises:
            NoFont: See there.
        """
        found: list[Outlined] = []
        x = y = 0.0
        for chunk in _chunks(letters):
            x = x if chunk[0].x is None else chunk[0].x
            y = y if chunk[0].y is None else chunk[0].y
            begin, set_letters = x, []
            for run in _runs(chunk):
                x, y = x + run[0].dx, y + run[0].dy
                shapes, advance = self._run(run)
                set_letters.append((shapes, run[0], x, y))
                x += advance
            share = {"middle": 0.5, "end": 1.0}.get(chunk[0].style["text-anchor"], 0.0)
            back = share * (x - begin)
            for shapes, first, at, down in set_letters:
                place = np.array([[1.0, 0.0, at - back], [0.0, 1.0, down]])
                if first.turn:
                    c, s = math.cos(math.radians(first.turn)), math.sin(math.radians(first.turn))
                    place = compose(place, np.array([[c, -s, 0.0], [s, c, 0.0]]))
                found.append(
                    Outlined([[p.mapped(place) for p in line] for line in shapes], first.style)
                )
            x -= back
        return found

    def _run(self, run: Sequence[Letter]) -> tuple[Subpaths, float]:
        """Return letters of one style, set from the origin, and their advance, px."""
        style, size = run[0].style, run[0].size
        text = "".join(letter.text for letter in run)
        file = find_font(style["font-family"], style["font-style"], style["font-weight"])
        if not file.is_asked_for:
            asked = style["font-family"].split(",")[0].strip(" \"'")
            if (asked, file.name) not in self.instead:
                self.instead.append((asked, file.name))
        font = _font(file.path)
        scale = size / font.face.upem
        buffer = uharfbuzz.Buffer()
        buffer.add_str(text)
        buffer.guess_segment_properties()
        uharfbuzz.shape(font, buffer)
        spacing = _spacing(style["letter-spacing"], size)
        raised = _raised(style, size)
        shapes: Subpaths = []
        x = 0.0
        for glyph, place in zip(buffer.glyph_infos, buffer.glyph_positions, strict=True):
            if glyph.codepoint == 0:
                self.lacking.append(text[glyph.cluster : glyph.cluster + 1])
            else:
                at = x + place.x_offset * scale
                up = raised + place.y_offset * scale
                affine = np.array([[scale, 0.0, at], [0.0, -scale, -up]])
                shapes += [
                    [p.mapped(affine) for p in line] for line in _glyph(file.path, glyph.codepoint)
                ]
            x += place.x_advance * scale + spacing
        return shapes, x


def _chunks(letters: Iterable[Letter]) -> list[list[Letter]]:
    """Return the groups of letters between positions that are given."""
    found: list[list[Letter]] = []
    for letter in letters:
        if not found or letter.x is not None or letter.y is not None:
            found.append([])
        found[-1].append(letter)
    return found


def _runs(letters: Sequence[Letter]) -> list[list[Letter]]:
    """Return letters grouped for shaping: one style, a given place only at the first."""
    found: list[list[Letter]] = []
    for letter in letters:
        last = found[-1][-1] if found else None
        if last is None or letter.is_alone() or letter.style is not last.style or last.turn:
            found.append([])
        found[-1].append(letter)
    return found


def _spacing(text: str, size: float) -> float:
    value = text.strip().lower()
    try:
        if value.endswith("em"):
            return float(value[:-2]) * size
        return float(value.removesuffix("px"))
    except ValueError:
        return 0.0


def _raised(style: Style, size: float) -> float:
    """Return the baseline shift of letters, px, upwards."""
    line = style["dominant-baseline"]
    lower = {"middle": MIDDLE, "central": CENTRAL, "hanging": HANGING}.get(line, 0.0)
    if line in ("text-before-edge", "text-top"):
        lower = 0.93
    shift = style["baseline-shift"]
    raised = {"super": SUPER, "sub": SUB}.get(shift)
    if raised is None:
        raised = _spacing(shift, size) / size if not shift.endswith("%") else 0.0
        if shift.endswith("%"):
            raised = _spacing(shift[:-1], size) / 100
    return (raised - lower) * size


@lru_cache(maxsize=256)
def find_font(families: str, style: str, weight: str) -> FontFile:
    """Return the first of the fonts named by CSS that is on this computer.

    Raises:
        NoFont: None is, and no kind of font is named.
    """
    from matplotlib.font_manager import FontProperties, findfont  # it takes half a second to load

    names = [name.strip(" \"'") for name in families.split(",")]
    slope: Literal["normal", "italic", "oblique"] = "normal"
    if style in ("italic", "oblique"):
        slope = style  # type: ignore[assignment]
    heavy: str | int = "normal"
    if weight in ("bold", "bolder"):
        heavy = "bold"
    elif weight.isdigit():
        heavy = min(int(weight), 1000)
    for name in names:
        kind = GENERIC.get(name.lower())
        for asked in (kind,) if kind else (name, METRIC_COMPATIBLE.get(name.lower())):
            if not asked:
                continue
            properties = FontProperties(family=[asked], style=slope, weight=heavy)
            try:
                path = str(findfont(properties, fallback_to_default=False))
            except ValueError:
                continue
            return FontFile(path, asked, name == names[0] and asked in (name, kind))
    raise NoFont(families)


@lru_cache(maxsize=16)
def _font(path: str) -> uharfbuzz.Font:
    return uharfbuzz.Font(uharfbuzz.Face(uharfbuzz.Blob.from_file_path(path)))


@lru_cache(maxsize=4096)
def _glyph(path: str, number: int) -> Subpaths:
    """Return the outlines of a glyph, in units of its font, y upwards."""
    pen = PiecePen()
    _font(path).draw_glyph_with_pen(number, pen)
    return pen.subpaths()
