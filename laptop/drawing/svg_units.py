"""Lengths, view boxes and transforms of SVG as numbers.  Pure."""

from __future__ import annotations

import math
import re

import numpy as np
from svgelements import Matrix

PX = 2.54 / 96
"""A px of SVG, cm (CSS: 96 to the inch)."""

UNITS = {
    **{"": 1.0, "px": 1.0, "pt": 96 / 72, "pc": 16.0, "in": 96.0},
    **{"mm": 96 / 25.4, "cm": 96 / 2.54, "q": 96 / 101.6, "em": 16.0, "ex": 8.0, "rem": 16.0},
}
"""Units of length, px; em and ex as of letters of 16 px, which nothing else here knows."""

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LENGTH = re.compile(rf"\s*({NUMBER})\s*([a-zA-Z]*|%)\s*")
NUMBERS = re.compile(NUMBER)
LONGEST_TRANSFORM = 2000
FUNCTION = re.compile(r"([a-zA-Z]+)\s*\(([^()]*)\)[\s,]*")
BETWEEN = re.compile(r"(?:deg|px|[\s,])*")
ARGUMENTS = {
    **{"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3)},
    **{"skewX": (1,), "skewY": (1,), "translateX": (1,), "translateY": (1,)},
    **{"scaleX": (1,), "scaleY": (1,)},
}
"""How many numbers each function of a transform takes."""

IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class UnreadableValue(ValueError):
    """A length or a transform that says nothing."""


def length(text: str | None, whole: float, default: float | None = 0.0) -> float | None:
    """A length, px.

    Args:
        text: such as `3`, `21cm` or `50%`.
        whole: what 100 % are, px.
        default: where there is no text.

    Raises:
        UnreadableValue: It is no length, or not finite.
    """
    if text is None:
        return default
    match = LENGTH.fullmatch(text)
    unit = match[2].lower() if match else None
    if match is None or (unit != "%" and unit not in UNITS):
        raise UnreadableValue(text)
    value = float(match[1]) * (whole / 100 if unit == "%" else UNITS[unit or ""])
    if not math.isfinite(value):
        raise UnreadableValue(text)
    return value


def transform(text: str) -> np.ndarray:
    """A transform as an affine map (2, 3).

    Raises:
        UnreadableValue: It is none, is singular beyond use, or is not finite.
    """
    if len(text) > LONGEST_TRANSFORM:
        raise UnreadableValue(text)
    at = len(text) - len(text.lstrip())
    while at < len(text):
        match = FUNCTION.match(text, at)
        if (
            match is None
            or len(NUMBERS.findall(match[2])) not in ARGUMENTS.get(match[1], ())
            or not BETWEEN.fullmatch(NUMBERS.sub("", match[2]))
        ):
            raise UnreadableValue(text)
        at = match.end()
    try:
        found = Matrix(text)
        found.render(ppi=96, width=0, height=0)
        affine = np.array([[found.a, found.c, found.e], [found.b, found.d, found.f]], float)
    except (ValueError, IndexError, TypeError, OverflowError):
        raise UnreadableValue(text) from None
    if not np.isfinite(affine).all():
        raise UnreadableValue(text)
    return affine


def numbers(text: str) -> list[float]:
    """All numbers in a text."""
    return [float(found) for found in NUMBERS.findall(text)]


def compose(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """The affine map (2, 3) that does `inner` first, then `outer`."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def view_box(
    box: tuple[float, float, float, float],
    place: tuple[float, float, float, float],
    align: str | None,
) -> np.ndarray:
    """The affine map (2, 3) that puts a view box into its place (SVG 1.1, section 7.8).

    Args:
        box, place: x, y, width, height, all of them above 0 in size.
        align: the attribute `preserveAspectRatio`.
    """
    words = (align or "xMidYMid meet").split()
    scale = np.array([place[2] / box[2], place[3] / box[3]])
    share = np.zeros(2)
    if words and words[0] != "none":
        scale[:] = scale.max() if "slice" in words else scale.min()
        found = re.fullmatch(r"x(Min|Mid|Max)Y(Min|Mid|Max)", words[0])
        sides = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
        share[:] = [sides[side] for side in found.groups()] if found else 0.5
    spare = np.array(place[2:]) - scale * box[2:]
    return np.column_stack([np.diag(scale), np.array(place[:2]) + share * spare - scale * box[:2]])
