"""The data of SVG paths as pieces of strokes.  Pure.

What stands before a fault is drawn (SVG 1.1, appendix F.2), so the text is checked here; what its
commands mean, fontTools knows.
"""

from __future__ import annotations

import math
import re
from itertools import islice

import numpy as np
from fontTools.svgLib.path import parse_path

from laptop.drawing.curves import Bezier, Elliptic, Piece, Straight

Subpaths = list[list[Piece]]
Point = tuple[float, float]

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
NUMBERS = re.compile(NUMBER)
BETWEEN = r"[\s,]*"
NUMBERS_PER_SEGMENT = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2}
"""Numbers per segment, by command."""
COMMANDS = re.compile(r"\s*([MmLlHhVvCcSsQqTtAaZz])([^MmLlHhVvCcSsQqTtAaZz]*)")
ARGUMENT = re.compile(rf"{BETWEEN}({NUMBER})")
_COORDINATE, _FLAG = rf"{BETWEEN}({NUMBER})", rf"{BETWEEN}([01])"
ARC = re.compile(3 * _COORDINATE + 2 * _FLAG + 2 * _COORDINATE)
"""Pattern of an arc's numbers; the flags may be glued to what follows."""
ODD_NUMBERS = re.compile(r"(?<![\d.])0\d+\.?\d*(?:[eE][-+]?\d+)?|\d+\.(?!\d)(?:[eE][-+]?\d+)?")
"""Pattern of numbers with a leading zero, or without a digit behind the point: fontTools reads them
as two."""
PLAIN = {ord(c): None for c in " ,\t\r\n\f"}


class BadShape(Exception):
    """A shape that cannot be read.

    text         what it says, for people
    before       what comes before the fault
    is_too_long  whether it has more points than allowed
    """

    def __init__(self, text: str, before: Subpaths, is_too_long: bool = False) -> None:
        super().__init__(text)
        self.text, self.before, self.is_too_long = text, before, is_too_long


def path_pieces(text: str, most: int) -> Subpaths:
    """Return the strokes of a path's data, in its own coordinates.

    Args:
        text: the path's data, as in the attribute `d`.
        most: greatest number of segments.

    Raises:
        BadShape: It is broken, or too long.
    """
    sound: list[str] = []
    is_complete = True
    count = at = 0
    for match in COMMANDS.finditer(text):
        if match.start() != at:
            is_complete = False
            break
        at = match.end()
        numbers, is_sound, segments = _arguments(match[1], match[2], most - count)
        count += segments
        if count > most:
            raise BadShape("", [], is_too_long=True)
        if segments:
            sound.append(f"{match[1]} {' '.join(numbers)}")
        if not is_sound:
            is_complete = False
            break
    else:
        is_complete = not text[at:].strip()
    if sound and sound[0][0] not in "Mm":
        sound, is_complete = [], False
    pen = PiecePen()
    try:
        parse_path(ODD_NUMBERS.sub(lambda number: repr(float(number[0])), " ".join(sound)), pen)
    except (ValueError, OverflowError):
        is_complete = False
    found = pen.subpaths()
    if not is_complete:
        raise BadShape(text, found)
    return found


def _arguments(command: str, text: str, most: int) -> tuple[list[str], bool, int]:
    """Return a command's sound numbers, whether these are all, and the number of segments.

    Args:
        command: letter of the command.
        text: what stands behind it.
        most: greatest number of segments; of more none is returned.
    """
    if command in "Zz":
        return [], not text.translate(PLAIN), 1
    if command in "Aa":
        return _arcs(text, most)
    takes = NUMBERS_PER_SEGMENT[command.lower()]
    numbers = list(islice((n.group() for n in NUMBERS.finditer(text)), takes * (most + 1)))
    is_sound = not NUMBERS.sub("", text).translate(PLAIN)
    if not is_sound:
        numbers = _before_fault(text)
    segments, rest = divmod(len(numbers), takes)
    return numbers[: segments * takes], is_sound and bool(segments) and not rest, segments


def _before_fault(text: str) -> list[str]:
    """Return the numbers before the first syntax error."""
    numbers, at = [], 0
    while match := ARGUMENT.match(text, at):
        numbers.append(match[1])
        at = match.end()
    return numbers


def _arcs(text: str, most: int) -> tuple[list[str], bool, int]:
    numbers: list[str] = []
    at = segments = 0
    while segments <= most and (match := ARC.match(text, at)):
        numbers += match.groups()
        at, segments = match.end(), segments + 1
    return numbers, bool(segments) and not text[at:].translate(PLAIN), segments


class PiecePen:
    """Recorder of a font pen's calls; straight lines are joined to one piece."""

    def __init__(self) -> None:
        self._found: Subpaths = []
        self._pieces: list[Piece] = []
        self._corners: list[Point] = []

    def moveTo(self, to: Point) -> None:  # noqa: N802
        """Begin a line."""
        self._end()
        self._corners = [to]

    def lineTo(self, to: Point) -> None:  # noqa: N802
        """Go on straight."""
        self._corners.append(to)

    def curveTo(self, *points: Point) -> None:  # noqa: N802
        """Go on along a Bezier curve."""
        self._curve(Bezier(np.array([self._corners[-1], *points])), points[-1])

    qCurveTo = curveTo  # noqa: N815

    def arcTo(  # noqa: N802
        self, rx: float, ry: float, turn: float, is_large: bool, is_swept: bool, to: Point
    ) -> None:
        """Go on along an arc of an ellipse."""
        arc = arc_piece(self._corners[-1], rx, ry, turn, is_large, is_swept, to)
        if isinstance(arc, Elliptic):
            self._curve(arc, to)
        elif arc is not None:
            self.lineTo(to)

    def closePath(self) -> None:  # noqa: N802
        """End a closed line."""
        # A path without length that is closed is a dot
        if len(self._corners) == 1 and not self._pieces:
            self._corners *= 2
        self._end()

    def endPath(self) -> None:  # noqa: N802
        """End a line."""
        self._end()

    def subpaths(self) -> Subpaths:
        """Return all lines."""
        self._end()
        return self._found

    def _curve(self, piece: Piece, to: Point) -> None:
        self._line()
        self._pieces.append(piece)
        self._corners = [to]

    def _line(self) -> None:
        if len(self._corners) > 1:
            self._pieces.append(Straight(np.array(self._corners, float)))

    def _end(self) -> None:
        self._line()
        if self._pieces:
            self._found.append(self._pieces)
        self._pieces, self._corners = [], []


def arc_piece(
    begin: Point, rx: float, ry: float, turn: float, is_large: bool, is_swept: bool, end: Point
) -> Elliptic | Straight | None:
    """Return an elliptical arc (SVG 1.1, appendix F.6.5); None where both ends coincide.

    Args:
        begin: first point, (x, y).
        rx: first half axis; both grow where they are too short for the chord.
        ry: second half axis.
        turn: of the first half axis from x, degrees.
        is_large: whether the arc is the larger of two (large-arc-flag).
        is_swept: whether the angle grows along the arc (sweep-flag).
        end: last point, (x, y).
    """
    p, q = np.array(begin, float), np.array(end, float)
    if (p == q).all():
        return None
    rx, ry = abs(rx), abs(ry)
    if not (rx > 0 and ry > 0 and math.isfinite(rx) and math.isfinite(ry)):
        return Straight(np.array([p, q]))
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    turned = np.array([[c, s], [-s, c]])
    # Where the ellipse is a circle of radius 1 about the middle of the chord
    half = turned @ ((p - q) / 2) / [rx, ry]
    far = float(half @ half)
    if far > 1:
        rx, ry, half = rx * math.sqrt(far), ry * math.sqrt(far), half / math.sqrt(far)
        far = 1.0
    beside = math.sqrt(max(0.0, 1.0 / far - 1.0)) * (-1.0 if is_large == is_swept else 1.0)
    centre = beside * np.array([half[1], -half[0]])
    first, last = half - centre, -half - centre
    start = math.atan2(first[1], first[0])
    sweep = math.atan2(last[1], last[0]) - start
    if is_swept and sweep < 0:
        sweep += 2 * math.pi
    elif not is_swept and sweep > 0:
        sweep -= 2 * math.pi
    axes = turned.T * [rx, ry]
    return Elliptic((p + q) / 2 + axes @ centre, axes[:, 0], axes[:, 1], start, sweep)


def polyline_pieces(text: str, is_closed: bool, most: int) -> Subpaths:
    """Return the stroke of a list of points.

    Raises:
        BadShape: It is broken, or too long.
    """
    values = [float(n.group()) for n in islice(NUMBERS.finditer(text), 2 * most + 1)]
    if len(values) > 2 * most:
        raise BadShape("", [], is_too_long=True)
    fault = len(values) % 2 != 0
    if NUMBERS.sub("", text).translate(PLAIN):
        values, fault = [float(number) for number in _before_fault(text)], True
    points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
    if is_closed and len(points):
        points = np.vstack([points, points[:1]])
    found: Subpaths = [[Straight(points)]] if len(points) else []
    if fault:
        raise BadShape(text, found)
    return found
