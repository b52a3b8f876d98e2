"""Lengths, view boxes and transforms of SVG as numbers.  Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

PX = 2.54 / 96
"""Length of SVG's px, cm (CSS: 96 to the inch)."""

FONT_SIZE = 16.0
"""Default size of letters, px."""

UNITS = {
    **{"": 1.0, "px": 1.0, "pt": 96 / 72, "pc": 16.0, "in": 96.0},
    **{"mm": 96 / 25.4, "cm": 96 / 2.54, "q": 96 / 101.6, "rem": FONT_SIZE},
}
"""Units of length, px."""
FONT_UNITS = {"em": 1.0, "ex": 0.5, "ch": 0.5}
"""Units relative to the size of letters, as shares of it, for fonts that say nothing else."""
ANGLES = {"": 1.0, "deg": 1.0, "grad": 0.9, "rad": 180 / math.pi, "turn": 360.0}
"""Units of angles, degrees."""

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LENGTH = re.compile(rf"\s*({NUMBER})\s*([a-zA-Z]*|%)\s*")
NUMBERS = re.compile(NUMBER)
FUNCTION = re.compile(r"[\s,]*([a-zA-Z0-9]+)\s*\(([^()]*)\)[\s,]*")
ARGUMENT = re.compile(rf"[\s,]*({NUMBER})([a-zA-Z]*|%)")
TRANSFORM_NUMBERS = {
    **{"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skew": (1, 2)},
    **{"skewX": (1,), "skewY": (1,), "translateX": (1,), "translateY": (1,), "rotateZ": (1,)},
    **{"scaleX": (1,), "scaleY": (1,), "translate3d": (3,), "scale3d": (3,)},
}
"""Numbers that each function of a transform takes."""
MAX_FUNCTIONS = 10_000
"""Greatest number of functions of a transform."""

IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
SIDES = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}


class UnreadableValue(ValueError):
    """Error: a length or a transform cannot be read."""


def length(
    text: str | None, full: float, default: float | None = 0.0, font: float = FONT_SIZE
) -> float | None:
    """Return a length, px.

    Args:
        text: such as `3`, `21cm` or `50%`.
        full: what 100 % are, px.
        default: where there is no text.
        font: size of the letters, px.

    Raises:
        UnreadableValue: It is no length, or not finite.
    """
    if text is None:
        return default
    match = LENGTH.fullmatch(text)
    if match is None:
        raise UnreadableValue(text)
    value = float(match[1]) * _unit(match[2].lower(), full, font, text)
    if not math.isfinite(value):
        raise UnreadableValue(text)
    return value


def _unit(unit: str, full: float, font: float, text: str) -> float:
    if unit == "%":
        return full / 100
    if unit in FONT_UNITS:
        return FONT_UNITS[unit] * font
    if unit not in UNITS:
        raise UnreadableValue(text)
    return UNITS[unit]


def transform(
    text: str, box: tuple[float, float] = (100.0, 100.0), font: float = FONT_SIZE
) -> np.ndarray:
    """Return a transform, of an attribute or of CSS, as an affine map (2, 3).

    Args:
        text: the attribute's or property's value.
        box: width and height that per cent are of, px.
        font: size of the letters, px.

    Raises:
        UnreadableValue: It is none, or is not finite.
    """
    affine, at, count = IDENTITY, 0, 0
    text = text.strip()
    while at < len(text):
        match = FUNCTION.match(text, at)
        count += 1
        if match is None or match[1] not in TRANSFORM_NUMBERS or count > MAX_FUNCTIONS:
            raise UnreadableValue(text)
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                affine = compose(affine, _function(match[1], match[2], box, font))
        except UnreadableValue:
            raise UnreadableValue(text) from None  # the text says it all
        at = match.end()
    if not np.isfinite(affine).all():
        raise UnreadableValue(text)
    return affine


def _function(name: str, text: str, box: tuple[float, float], font: float) -> np.ndarray:
    found, at = [], 0
    while match := ARGUMENT.match(text, at):
        found.append((float(match[1]), match[2].lower()))
        at = match.end()
    if text[at:].strip() or len(found) not in TRANSFORM_NUMBERS[name]:
        raise UnreadableValue(text)
    if name.startswith("translate"):
        fulls = (box[1],) if name == "translateY" else box
        moves = [
            n * _unit(unit, full, font, text) for (n, unit), full in zip(found, fulls, strict=False)
        ]
        x, y = (0.0, moves[0]) if name == "translateY" else (moves[0], [*moves, 0.0][1])
        return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
    if name.startswith(("rotate", "skew")):
        return _turned(name, found, font, text)
    values = [n / 100 if unit == "%" else n for n, unit in found]
    if name == "matrix":
        return np.array(values).reshape(3, 2).T
    x, y = values[0], values[-1 if name != "scale3d" else 1]
    x, y = (x, 1.0) if name == "scaleX" else (1.0, y) if name == "scaleY" else (x, y)
    return np.array([[x, 0.0, 0.0], [0.0, y, 0.0]])


def _turned(name: str, found: list[tuple[float, str]], font: float, text: str) -> np.ndarray:
    if any(unit not in ANGLES for _, unit in found[: 1 if name == "rotate" else 2]):
        raise UnreadableValue(text)
    angles = [math.radians(n * ANGLES.get(unit, 1.0)) for n, unit in found]
    if name.startswith("rotate"):
        c, s = math.cos(angles[0]), math.sin(angles[0])
        turned = np.array([[c, -s, 0.0], [s, c, 0.0]])
        if len(found) < 3:
            return turned
        return about(turned, (length_of(found[1], font, text), length_of(found[2], font, text)))
    x, y = (0.0, angles[0]) if name == "skewY" else (angles[0], [*angles, 0.0][1])
    return np.array([[1.0, math.tan(x), 0.0], [math.tan(y), 1.0, 0.0]])


def length_of(part: tuple[float, str], font: float, text: str) -> float:
    """Return a length that is a number and a unit, px."""
    return part[0] * _unit(part[1], 0.0, font, text)


def css_angle(text: str) -> float:
    """Return an angle of CSS, degrees.

    Raises:
        UnreadableValue: It is none.
    """
    match = ARGUMENT.fullmatch(text.strip())
    if match is None or match[2].lower() not in ANGLES:
        raise UnreadableValue(text)
    return float(match[1]) * ANGLES[match[2].lower()]


def origin(text: str, box: Sequence[float], font: float) -> tuple[float, float]:
    """Return the point of a `transform-origin`.

    Args:
        text: such as `50 50`, `center` or `50% 1em`; "" is the box's corner.
        box: x, y, width and height of what per cent are of.
        font: size of the letters, px.

    Raises:
        UnreadableValue: It is none.
    """
    words = text.split()[:2]
    if words and (words[0] in ("top", "bottom") or words[-1:] in (["left"], ["right"])):
        words.reverse()
    words = [SIDES.get(word, word) for word in words] + ["50%"] * (len(words) == 1)
    if not words:
        return box[0], box[1]
    x, y = (length(w, full, 0.0, font) for w, full in zip(words, box[2:], strict=True))
    return box[0] + (x or 0.0), box[1] + (y or 0.0)


def about(affine: np.ndarray, point: tuple[float, float]) -> np.ndarray:
    """Return an affine map (2, 3) applied about a point instead of the origin."""
    to_point = np.array([[1.0, 0.0, point[0]], [0.0, 1.0, point[1]]])
    to_origin = np.array([[1.0, 0.0, -point[0]], [0.0, 1.0, -point[1]]])
    return compose(to_point, compose(affine, to_origin))


def numbers(text: str) -> list[float]:
    """Return all numbers in a text."""
    return [float(found) for found in NUMBERS.findall(text)]


def compose(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Return the affine map (2, 3) that applies `inner` first, then `outer`."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def view_box(
    box: tuple[float, float, float, float],
    place: tuple[float, float, float, float],
    align: str | None,
) -> np.ndarray:
    """Return the affine map (2, 3) of a view box into its viewport (SVG 1.1, section 7.8).

    Args:
        box: x, y, width, height, in the drawing's unit; width and height above 0.
        place: x, y, width, height of the viewport, px; width and height above 0.
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
