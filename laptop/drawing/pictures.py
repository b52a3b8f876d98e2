"""A picture becomes an Artwork: outlines where its brightness steps, hatching by its tone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.drawing.artwork import Artwork, BadArtwork, stroke_length
from laptop.drawing.curves import rounded
from laptop.drawing.line_drawings import centre_lines, is_line_drawing
from laptop.drawing.picture_files import LINES_SIDE, read_grey
from laptop.drawing.pixel_walks import Pixels

MAX_STROKES = 3000
"""Most strokes of a picture; the shortest of more are left out. Each costs the pen two seconds."""

HATCH_ANGLES = tuple(math.radians(angle) for angle in (45, 135, 0, 90))
"""Directions of the hatching, rad, from the lightest tone to the darkest."""

HATCH_LINES = 60
"""Number of hatching lines side by side across the longer side."""

SHORTEST_HATCH = 0.6
"""Least length of a hatching line, in distances between two lines."""

CORNER_ANGLE = math.radians(50)
"""Turn above which a point of an outline is a corner, rad."""

SMOOTHING_REACH = 3
"""Number of pixels on either side over which lines are smoothed."""

MIN_TONE_RANGE = 24
"""Least range of a picture's tones, of 255; below, it shows nothing."""


DETAILS, SHADES, SMOOTHINGS = (0, 100), (0, len(HATCH_ANGLES)), (0, 100)
"""Least and greatest values of the options of tracing: detail, shades, smoothing."""

STYLES = ("auto", "photo", "lines")


class ShowsNothing(BadArtwork):
    """Error: a sound picture shows nothing in the style in which it was to be drawn."""


@dataclass(frozen=True)
class Tracing:
    """Options of the tracing of a picture.

    detail     0 to 100: how weak a step of brightness still gets an outline; 0 draws none
    shades     0 to 4: tones that are hatched, each in a direction of its own; 0 hatches none
    smoothing  0 to 100: how much of what is fine in the picture is blurred away
    width      of the sheet, cm; its height follows
    style      "photo": so; "lines": the lines of a drawing along their middles; "auto": as it looks
    """

    detail: float = 50.0
    shades: int = 3
    smoothing: float = 30.0
    width: float = 10.0
    style: str = "auto"

    def check(self) -> None:
        """Raise BadArtwork for a value out of range."""
        for name, value, least, most in (
            ("detail", self.detail, *DETAILS),
            ("shades", self.shades, *SHADES),
            ("smoothing", self.smoothing, *SMOOTHINGS),
            ("width", self.width, 0.1, 1000),
        ):
            if not least <= value <= most or (name == "shades" and value != int(value)):
                integer = " a whole number" if name == "shades" else ""
                raise BadArtwork(f"{name} = {value:g}: it must be{integer} from {least} to {most}")
        if self.style not in STYLES:
            raise BadArtwork(f"style = {self.style[:30]}: it must be one of {', '.join(STYLES)}")
        if not self.detail and not self.shades:
            raise BadArtwork("detail = 0 and shades = 0: nothing would be drawn; raise one of them")


def read_picture(data: bytes, name: str = "picture", how: Tracing | None = None) -> Artwork:
    """Return the Artwork of a PNG or JPEG, on a sheet that it fills.

    Args:
        data: all of the file.
        name: of the file, for people.
        how: as a Tracing is by itself where it is None.

    Raises:
        BadArtwork: It is no picture, or beyond a limit.
        ShowsNothing: There is no line in it.
    """
    how = how or Tracing()
    how.check()
    grey, notes = read_grey(data, name), []
    is_lines = how.style == "lines" or (how.style == "auto" and is_line_drawing(grey))
    if is_lines:
        grey = read_grey(data, name, LINES_SIDE)
        lines, more = _longest_smooth(centre_lines(grey))
        if how.style == "auto":
            notes.append(
                "It is a drawing of lines, and they are followed along their middles; "
                'the style "photo" has edges and tones.'
            )
    else:
        grey = _prepared(grey, how.smoothing)
        outlines, more = _outlines(grey, how.detail) if how.detail else ([], 0)
        lines = outlines + _hatching(grey, how.shades)
    if not lines:
        raise ShowsNothing(
            f"{name}: shows no lines on paper; take it closer, or with more light"
            if is_lines
            else f"{name}: shows nothing to draw at detail = {how.detail:g} and shades = "
            f"{how.shades}; raise them, or take a picture with more contrast"
        )
    rows, columns = grey.shape
    scale = how.width / columns
    size = (how.width, rows * scale)
    strokes_px, left_out = _longest(lines)
    left_out += more
    strokes = [(stroke * [1, -1] + [0, rows]) * scale for stroke in strokes_px]
    if left_out:
        notes.append(f"The {left_out} shortest lines are not drawn: {MAX_STROKES} are the most.")
    return Artwork(name, tuple(strokes), ("",) * len(strokes), size, tuple(notes), "picture")


def _prepared(grey: np.ndarray, smoothing: float) -> np.ndarray:
    """Return the picture smoothed and stretched to the full range of tones, uint8."""
    if smoothing:
        grey = cv2.GaussianBlur(grey, (0, 0), max(grey.shape) / 640 * (0.3 + smoothing / 15))
    dark, light = np.percentile(grey, (1, 99))
    if light - dark < MIN_TONE_RANGE:
        return grey
    return np.clip((grey - dark) * (255 / (light - dark)), 0, 255).astype(np.uint8)


def _longest(strokes: list[np.ndarray]) -> tuple[list[np.ndarray], int]:
    """Return the longest lines, in their order, and the number of lines left out."""
    spare = max(0, len(strokes) - MAX_STROKES)
    dropped = set(sorted(range(len(strokes)), key=lambda k: stroke_length(strokes[k]))[:spare])
    return [stroke for k, stroke in enumerate(strokes) if k not in dropped], spare


# ---- outlines


def _outlines(grey: np.ndarray, detail: float) -> tuple[list[np.ndarray], int]:
    """Return smooth lines (n, 2), px, along edges of brightness, and how many were left out.

    The steps are found by Canny's detector; the longest lines come first.
    """
    high = 20 + 280 * (1 - detail / 100) ** 2
    edges = cv2.Canny(grey, 0.4 * high, high, apertureSize=3, L2gradient=True)
    least = max(8.0, max(grey.shape) / (20 + detail))
    chains = [chain for chain in _chains(edges > 0) if len(chain) >= least]
    return _longest_smooth(chains)


def _longest_smooth(chains: list[np.ndarray]) -> tuple[list[np.ndarray], int]:
    """Return smooth lines (n, 2), px, through chains of pixels, longest first; how many more."""
    chains = sorted(chains, key=len, reverse=True)
    lines = []
    for chain in chains[:MAX_STROKES]:
        points = _without_steps(chain) if len(chain) > SMOOTHING_REACH else chain
        # OpenCV leaves out the end of a line that comes back to where it began
        line = cv2.approxPolyDP(points.astype(np.float32).reshape(-1, 1, 2), 0.45, False)
        points = np.vstack([line.reshape(-1, 2), points[-1:].astype(np.float32)]).astype(float)
        lines.append(rounded(points + 0.5, CORNER_ANGLE, 0.1))  # pixels' centres
    return [line for line in lines if len(line) > 1], len(chains) - len(lines)


def _chains(edges: np.ndarray) -> list[np.ndarray]:
    """Return chains (n, 2) of touching edge pixels, x, y; each pixel is in one chain only."""
    pixels = Pixels(edges)
    found = []
    for start in sorted(pixels.left):
        if start not in pixels.left:
            continue
        pixels.left.remove(start)
        chain = [*reversed(pixels.walk(start)), start]
        chain += pixels.walk(start)  # what the first walk left on the other side
        (x, y), (last_x, last_y) = chain[0], chain[-1]
        if len(chain) > 8 and max(abs(last_x - x), abs(last_y - y)) <= 2:
            chain.append(chain[0])
        found.append(np.array(chain, float))
    return found


def _without_steps(chain: np.ndarray) -> np.ndarray:
    """Return a chain of pixels (n, 2) without its staircase; the ends stay."""
    weights = np.exp(-0.5 * (np.arange(-SMOOTHING_REACH, SMOOTHING_REACH + 1) / 1.2) ** 2)
    weights /= weights.sum()
    if np.array_equal(chain[0], chain[-1]):
        padded = np.vstack(
            [chain[-1 - SMOOTHING_REACH : -1], chain, chain[1 : 1 + SMOOTHING_REACH]]
        )
    else:  # mirrored in its ends, which stay so
        padded = np.vstack(
            [
                2 * chain[0] - chain[SMOOTHING_REACH:0:-1],
                chain,
                2 * chain[-1] - chain[-2 : -2 - SMOOTHING_REACH : -1],
            ]
        )
    return np.column_stack([np.convolve(column, weights, "valid") for column in padded.T])


# ---- hatching


def _hatching(grey: np.ndarray, shades: int) -> list[np.ndarray]:
    """Return hatching lines (2, 2), px: the darker the tone, the more directions cross."""
    found = []
    distance = max(grey.shape) / HATCH_LINES
    for shade in range(shades):
        darker = 255 * (shades - shade) / (shades + 1)
        found += _hatch(grey < darker, HATCH_ANGLES[shade], distance)
    return found


def _hatch(dark: np.ndarray, angle: float, distance: float) -> list[np.ndarray]:
    """Return lines (2, 2), px, at an angle across dark areas; y goes down."""
    rows, columns = dark.shape
    along = np.array([math.cos(angle), -math.sin(angle)])
    across = np.array([-along[1], along[0]])
    corners = np.array([[0, 0], [columns, 0], [0, rows], [columns, rows]])
    low, high = np.sort(corners @ across)[[0, -1]]
    begin, end = np.sort(corners @ along)[[0, -1]]
    steps = np.arange(begin, end, 0.5)
    shortest, found = SHORTEST_HATCH * distance, []
    for number, place in enumerate(np.arange(low + distance / 2, high, distance)):
        points = place * across + steps[:, None] * along
        x, y = np.floor(points).astype(int).T
        inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
        is_dark = np.zeros(len(steps) + 2, int)
        is_dark[1:-1][inside] = dark[y[inside], x[inside]]
        changes = np.flatnonzero(np.diff(is_dark))
        for first, last in changes.reshape(-1, 2):
            if steps[last - 1] - steps[first] >= shortest:
                ends = points[[first, last - 1]]
                found.append(ends[::-1] if number % 2 else ends)  # to and fro
    return found
