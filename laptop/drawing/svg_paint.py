"""Colours of SVG: what shows on white paper, and what does not.  Pure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from tinycss2 import color4

LEAST_OPACITY = 1 / 255
"""Opacity up to which nothing is visible."""

WHITE = 254.5 / 255
"""Least red, green and blue of a colour that is the paper's."""

REFERENCE = re.compile(r"""url\(\s*["']?\s*([^"')]*?)\s*["']?\s*\)\s*(.*)""", re.DOTALL)
LIGHT_DARK = re.compile(r"light-dark\((.*)\)", re.DOTALL)


def is_paint(value: str) -> bool:
    """Return whether CSS takes this for a fill or a stroke."""
    return (
        value in ("none", "context-fill", "context-stroke")
        or bool(REFERENCE.fullmatch(value))
        or _colour(value) is not None
    )


def is_number(value: str) -> bool:
    """Return whether this is a number, or so many per cent."""
    return share(value) is not None


def share(value: str) -> float | None:
    """Return an opacity, 0 to 1, None where it is none."""
    text, percent = value.strip(), 1.0
    if text.endswith("%"):
        text, percent = text[:-1], 0.01
    try:
        number = float(text) * percent
    except ValueError:
        return None
    return min(max(number, 0.0), 1.0) if number == number else None


def reference(value: str) -> tuple[str, str] | None:
    """Return the target of `url(...)` and the text behind it; None for another value."""
    match = REFERENCE.fullmatch(value.strip())
    return (match[1], match[2].strip()) if match else None


@lru_cache(maxsize=4096)
def _colour(value: str) -> tuple[float, float, float, float] | str | None:
    """Return red, green, blue and opacity, 0 to 1; or "currentcolor"; None if it is no colour."""
    match = LIGHT_DARK.fullmatch(value.strip())
    if match:
        parts = _halves(match[1])
        return _colour(parts[0]) if len(parts) == 2 else None
    colour = color4.parse_color(value)
    if colour is None or isinstance(colour, str):
        return colour
    red, green, blue = (float(part or 0.0) for part in colour.to("srgb").coordinates)
    return red, green, blue, float(colour.alpha)


def _halves(text: str) -> list[str]:
    """Return the parts of a text between commas outside of brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


class Paint(NamedTuple):
    """Visible effect of a fill or a stroke: darkness and opacity, each 0 to 1, and its name."""

    darkness: float
    opacity: float
    colour: str = ""

    @property
    def is_paper(self) -> bool:
        """True if it looks as the paper does."""
        return self.darkness == 0.0

    @property
    def tone(self) -> float:
        """Darkness of white paper under it, 0 to 1."""
        return self.darkness * self.opacity


def colour_paint(value: str, current: str, opacity: float) -> Paint | None:
    """Return the visible effect of a colour; None if there is none.

    Args:
        value: a colour.
        current: what `currentColor` is.
        opacity: of all around it, 0 to 1.
    """
    colour = _colour(value)
    if colour == "currentcolor":
        colour = _colour(current)
    if colour is None or isinstance(colour, str):
        colour = (0.0, 0.0, 0.0, 1.0)
    *parts, alpha = colour
    opacity *= alpha
    if opacity < LEAST_OPACITY:
        return None
    if min(parts) >= WHITE:
        return Paint(0.0, opacity)
    # Luma of Rec. 601, as a photo is turned grey
    light = 0.299 * parts[0] + 0.587 * parts[1] + 0.114 * parts[2]
    return Paint(min(max(1.0 - light, 1e-3), 1.0), opacity, _name(parts))


PENS = (
    *("black", "grey", "silver", "red", "maroon", "orange", "gold", "yellow", "brown", "pink"),
    *("magenta", "purple", "blue", "navy", "cyan", "teal", "green", "lime", "olive"),
)
"""Colours of pens that are reported by name."""


@lru_cache(maxsize=4096)
def _name_of(code: str) -> str:
    return next((name for name in PENS if _code(_colour(name)) == code), code)


def _name(parts: Sequence[float]) -> str:
    """Return a colour's name for people: a word, or #rrggbb."""
    return _name_of(_code(parts))


def _code(parts: Any) -> str:
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in parts[:3])
