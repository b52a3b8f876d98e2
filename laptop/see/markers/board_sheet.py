"""The page of the board to print, true to size."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from laptop.see.markers.board import (
    BAR,
    BAR_AT,
    BOARDS,
    CROSS_ARM,
    CROSSES,
    DICTIONARY,
    MARKER,
    Board,
)
from laptop.see.markers.marker_sheet import BadSheet, check_file

INK = "0.45"
"""Grey of crosses and words: a pen's line over them is still seen."""
LINE = 0.5
"""Width of the lines, points."""


def write_board(file: Path, paper: str = "a4") -> Board:
    """Write the page, in the format that the file's ending says (pdf, svg, png).

    Args:
        file: to be written; no other kind of file may be there.
        paper: "a4" or "letter".

    Raises:
        BadSheet: a wrong paper or ending, or no room.
    """
    if paper not in BOARDS:
        raise BadSheet(f"paper '{paper}': there is a board for {' and for '.join(BOARDS)}")
    check_file(file)
    board = BOARDS[paper]
    x, y = board.width / 2, board.height / 2
    # A margin for rounding: a size just below an integer number of pixels would lose one.
    figure = Figure(figsize=(board.width / 2.54 + 1e-6, board.height / 2.54 + 1e-6))
    page = figure.add_axes((0, 0, 1, 1))
    page.axis("off")
    _draw_markers(page, board)
    _draw_crosses(page)
    _draw_words(page, board)
    # Last: showing an image changes them.
    page.set(xlim=(-x, x), ylim=(-y, y), aspect="auto")
    try:
        figure.savefig(file, dpi=254)
    except OSError as error:
        raise BadSheet(f"cannot write {file}: {error.strerror}; choose another file") from None
    return board


def _draw_markers(page: Axes, board: Board) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    half = MARKER / 2
    for number, (x, y) in zip(board.numbers, board.centres, strict=True):
        code = cv2.aruco.generateImageMarker(dictionary, number, 6, borderBits=1)
        # Rectangles, and not an image: a printer's driver smooths those.
        cell = MARKER / 6
        page.fill(*_square(x - half, y - half, MARKER), color="0", lw=0, snap=False)
        for row, column in zip(*np.nonzero(code), strict=True):
            left, bottom = x - half + column * cell, y + half - (row + 1) * cell
            page.fill(*_square(left, bottom, cell), color="1", lw=0.2, snap=False)


def _square(left: float, bottom: float, side: float) -> tuple[list[float], list[float]]:
    right, top = left + side, bottom + side
    return [left, right, right, left], [bottom, bottom, top, top]


def _draw_crosses(page: Axes) -> None:
    for number, (x, y) in enumerate(CROSSES, 1):
        for dx, dy in ((CROSS_ARM, 0), (0, CROSS_ARM)):
            page.plot((x - dx, x + dx), (y - dy, y + dy), color=INK, lw=LINE, snap=False)
        page.text(x + 0.2, y + 0.2, str(number), fontsize=7, color=INK)


def _draw_words(page: Axes, board: Board) -> None:
    for dx, dy, name in ((1.6, 0, "x"), (0, 1.6, "y")):
        page.annotate(
            "",
            (dx, dy),
            (0.6 * dx / 1.6, 0.6 * dy / 1.6),
            arrowprops={"arrowstyle": "->", "color": INK, "lw": LINE},
        )
        page.text(dx * 1.08, dy * 1.08, name, fontsize=7, color=INK, ha="center", va="center")
    ends = -BAR / 2, BAR / 2
    page.plot(ends, (BAR_AT, BAR_AT), color="0", lw=LINE, snap=False)
    for x in ends:
        page.plot((x, x), (BAR_AT - 0.2, BAR_AT + 0.2), color="0", lw=LINE, snap=False)
    page.text(
        0,
        BAR_AT + 0.35,
        "100 mm, measured from tick to tick.  If it is not, say so: --bar 97",
        fontsize=6,
        color=INK,
        ha="center",
    )
    page.text(
        0,
        -BAR_AT,
        f"BrickServo board, {board.paper}: print on matte paper at 100 %, lay it flat.",
        fontsize=6,
        color=INK,
        ha="center",
        va="bottom",
    )
