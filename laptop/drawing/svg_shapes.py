"""The shapes of SVG, and all commands of its paths, as pieces of strokes.  Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice

import numpy as np
from svgelements import (
    Arc,
    Close,
    CubicBezier,
    Line,
    Move,
    Path,
    PathSegment,
    QuadraticBezier,
    Rect,
)

from laptop.drawing.curves import Bezier, Elliptic, Piece, Straight
from laptop.drawing.svg_units import NUMBERS, length

Subpaths = list[list[Piece]]


class NoShape(Exception):
    """A shape without size, which SVG does not show."""


class BadShape(Exception):
    """A shape that cannot be read.

    text         what it says, for people
    before       what comes before the fault
    is_too_long  whether it has more points than allowed
    """

    def __init__(self, text: str, before: Subpaths, is_too_long: bool = False) -> None:
        super().__init__(text)
        self.text, self.before, self.is_too_long = text, before, is_too_long


def shape_pieces(
    tag: str, attributes: Mapping[str, str], viewport: tuple[float, float], most: int
) -> Subpaths:
    """The strokes of a shape, each as pieces that follow each other, in its own coordinates, px.

    Args:
        tag: one of svg.SHAPES.
        viewport: width and height that percentages are of.
        most: so many points it may have.

    Raises:
        NoShape: It has no size.
        BadShape: It is broken or too long.
        UnreadableValue: A length of it is none.
    """
    if tag == "path":
        return _path(attributes.get("d", ""), most)
    if tag in ("polyline", "polygon"):
        return _polyline(attributes.get("points", ""), tag == "polygon", most)
    across, down = viewport
    diagonal = math.hypot(across, down) / math.sqrt(2)  # SVG 1.1, section 7.10

    def get(key: str, whole: float) -> float:
        return length(attributes.get(key), whole) or 0.0

    if tag == "line":
        ends = [(get("x1", across), get("y1", down)), (get("x2", across), get("y2", down))]
        return [[Straight(np.array(ends))]]
    if tag == "rect":
        x, y, width, height = (
            get("x", across),
            get("y", down),
            get("width", across),
            get("height", down),
        )
        if width <= 0 or height <= 0:
            raise NoShape
        rx, ry = _radius(attributes, "rx", across), _radius(attributes, "ry", down)
        rx, ry = (ry if rx is None else rx), (rx if ry is None else ry)
        shape = Rect(x, y, width, height, min(rx or 0.0, width / 2), min(ry or 0.0, height / 2))
        return subpaths(shape.segments(False))
    if tag == "circle":
        rx = ry = get("r", diagonal)
    else:
        rx, ry = get("rx", across), get("ry", down)
    if rx <= 0 or ry <= 0:
        raise NoShape
    centre = np.array([get("cx", across), get("cy", down)])
    axes = np.array([rx, 0.0]), np.array([0.0, ry])
    return [[Elliptic(centre, *axes, 0.0, 2 * math.pi)]]


def _radius(attributes: Mapping[str, str], key: str, whole: float) -> float | None:
    text = attributes.get(key)
    found = None if text in (None, "auto") else length(text, whole)
    return found if found is None or found >= 0 else None


def _path(text: str, most: int) -> Subpaths:
    """The strokes of a path's data."""
    if _segments(text, most) > most:
        raise BadShape("", [], is_too_long=True)
    if text.strip() and text.lstrip()[0] not in "Mm":
        raise BadShape(text, [])
    path = Path()
    try:
        path.parse(text)
    except (ValueError, IndexError, TypeError, AttributeError, ZeroDivisionError, OverflowError):
        raise BadShape(text, subpaths(_up_to_fault(path))) from None
    sound = _up_to_fault(path)
    if len(sound) < len(path) or _leaves_a_rest(text):
        raise BadShape(text, subpaths(sound))
    return subpaths(sound)


LETTERS = "MmLlHhVvCcSsQqTtAaZz"
COMMANDS = re.compile(f"([{LETTERS}])([^{LETTERS}]*)")
TAKES = {"h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "a": 5}
"""How many numbers make a segment, if not two; an arc has seven, the flags glued to others."""


def _segments(text: str, most: int) -> int:
    """How many segments a path has, or a number above `most`; before any is made."""
    count = sum(text.count(letter) for letter in LETTERS)
    if count > most:
        return count
    count = 0
    for command in COMMANDS.finditer(text):
        takes = TAKES.get(command[1].lower(), 2)
        room = takes * (most - count + 1)
        count += max(1, sum(1 for _ in islice(NUMBERS.finditer(command[2]), room)) // takes)
        if count > most:
            break
    return count


def _leaves_a_rest(text: str) -> bool:
    """Whether there is something in a path's data that is neither command, number nor space."""
    return bool(text.translate(_PLAIN))


_PLAIN = {ord(c): None for c in "MmLlHhVvCcSsQqTtAaZz0123456789+-.eE, \t\r\n\f"}


def _up_to_fault(path: Path) -> list[PathSegment]:
    """The segments of a path before the first that lacks a number, or has no begin."""
    sound = []
    for segment in path:
        points = [segment.end, *([] if isinstance(segment, Move) else [segment.start])]
        if any(point is None or None in (point[0], point[1]) for point in points):
            break
        sound.append(segment)
    return sound


def _polyline(text: str, is_closed: bool, most: int) -> Subpaths:
    values = [float(n.group()) for n in islice(NUMBERS.finditer(text), 2 * most + 1)]
    if len(values) > 2 * most:
        raise BadShape("", [], is_too_long=True)
    points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
    if is_closed and len(points):
        points = np.vstack([points, points[:1]])
    found: Subpaths = [[Straight(points)]] if len(points) else []
    if len(values) % 2 or text.translate(_PLAIN):
        raise BadShape(text, found)
    return found


def subpaths(segments: Iterable[PathSegment]) -> Subpaths:
    """The strokes of segments: each `Move` begins one; after a `Close`, what follows does."""
    found: Subpaths = []
    pieces: list[Piece] = []
    corners: list[complex] = []  # the straight line that is under way
    first: complex | None = None

    def end_line() -> None:
        nonlocal corners
        if len(corners) > 1 or (corners and not pieces):
            pieces.append(Straight(_points(corners)))
        corners = corners[-1:]

    def end_stroke() -> None:
        nonlocal pieces, corners
        if len(corners) > 1 or pieces:
            end_line()
            found.append(pieces)
        pieces, corners = [], []

    for segment in segments:
        if isinstance(segment, Move):
            end_stroke()
            first = _complex(segment.end)
            corners = [first]
            continue
        if segment.end is None or segment.start is None:
            continue
        if not corners:  # after a Close
            corners = [_complex(segment.start)]
        if isinstance(segment, Close):
            corners.append(_complex(segment.end) if first is None else first)
            end_stroke()
        elif isinstance(segment, Line):
            corners.append(_complex(segment.end))
        else:
            curve = _curve(segment)
            if curve is None:
                corners.append(_complex(segment.end))
            else:
                end_line()
                pieces.append(curve)
                corners = [_complex(segment.end)]
    end_stroke()
    return found


def _curve(segment: PathSegment) -> Piece | None:
    """A curved segment; None for an arc that is a straight line."""
    control = []
    if isinstance(segment, CubicBezier):
        control = [segment.start, segment.control1, segment.control2, segment.end]
    elif isinstance(segment, QuadraticBezier):
        control = [segment.start, segment.control, segment.end]
    if control:
        return Bezier(_points([_complex(point) for point in control]))
    assert isinstance(segment, Arc), segment
    centre = _complex(segment.center)
    u, v = _complex(segment.prx) - centre, _complex(segment.pry) - centre
    if not (abs(u) > 0 and abs(v) > 0 and segment.sweep):
        return None
    c, axis, other, start = _points([centre, u, v, _complex(segment.start) - centre])
    # Where on it the arc begins: the axes are square to each other
    begin = math.atan2(start @ other / (other @ other), start @ axis / (axis @ axis))
    return Elliptic(c, axis, other, begin, float(segment.sweep))


def _complex(point: Sequence[float]) -> complex:
    return complex(point[0], point[1])


def _points(values: Sequence[complex]) -> np.ndarray:
    array = np.array(values, complex)
    return np.column_stack([array.real, array.imag])
