"""Finder of the printed board in a picture: every marker of it that is seen, to the cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.see.markers.board import BOARDS, DICTIONARY, Board
from laptop.see.markers.finders.aruco import detector
from laptop.see.markers.finders.code_alignment import SQUARE, align, edge_blur, project

INNER_SHARE = 0.5
"""Share of a marker's square whose corners stand for it. An error of the sensor model shows at the
outline, where a black square looks a little too large or too small, and less nearer to the middle.
"""


@dataclass(frozen=True)
class BoardView:
    """Markers of a board seen in one picture.

    board    which one
    numbers  of its markers that are seen, (n,)
    points   of each the corners of its inner square, on the board, (4 n, 3), cm
    pixels   the same in the picture, (4 n, 2), px
    size     of the picture, (width, height), px
    side     median side of a marker, px
    blur     sigma of the edges' blur, px
    """

    board: Board
    numbers: np.ndarray
    points: np.ndarray
    pixels: np.ndarray
    size: tuple[int, int]
    side: float
    blur: float


def find_board(image: np.ndarray) -> BoardView | None:
    """Return the board in a picture (BGR or grey, uint8); None if no marker of one is seen.

    Where markers of two boards are seen, it is the one with more of them.
    """
    grey = _grey(image)
    seen, _ = find_markers(grey)
    board = max(BOARDS.values(), key=lambda b: len(seen.keys() & set(b.numbers)))
    numbers = sorted(seen.keys() & set(board.numbers))
    return _placed(grey, board, {number: seen[number] for number in numbers})


def find_markers(image: np.ndarray) -> tuple[dict[int, np.ndarray], set[int]]:
    """Return rough marker corners (4, 2), px, by number, in a picture (BGR or grey, uint8).

    Those that are seen twice are left out; the set has their numbers.
    """
    quads, found, _ = detector(DICTIONARY).detectMarkers(_grey(image))
    seen: dict[int, np.ndarray] = {}
    doubled: set[int] = set()
    numbers = [] if found is None else [int(number) for number in found.flatten()]
    for quad, number in zip(quads, numbers, strict=True):
        doubled |= {number} & seen.keys()
        seen[number] = quad.reshape(4, 2).astype(float)
    for number in doubled:  # another sheet, or a reflection: which one is the board's?
        del seen[number]
    return seen, doubled


def _grey(image: np.ndarray) -> np.ndarray:
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def find_again(
    image: np.ndarray, board: Board, corners: Mapping[int, np.ndarray]
) -> BoardView | None:
    """Return the board's markers that are still about in place, at a fraction of a search's time.

    Args:
        image: BGR or grey, uint8.
        board: that was seen.
        corners: of some of its markers, where they would be, px: (4, 2) by number.

    Returns:
        None if none of them is there, to a tenth of its side.
    """
    grey = _grey(image)
    height, width = grey.shape
    inside = {
        number: quad
        for number, quad in corners.items()
        if quad.min() >= 0 and (quad < (width, height)).all()
    }
    return _placed(grey, board, inside)


def _placed(grey: np.ndarray, board: Board, quads: Mapping[int, np.ndarray]) -> BoardView | None:
    """Place a board's markers by all of their cells, beginning at corners (4, 2), px, by number."""
    corners, pixels, found = [], [], []
    for number, quad in quads.items():
        homography, fits = align(grey, quad, number, DICTIONARY)
        if fits:
            corners.append(project(homography, SQUARE))
            pixels.append(project(homography, INNER_SHARE * SQUARE))
            found.append(number)
    if not found:
        return None
    sides = [np.linalg.norm(np.diff(quad, axis=0), axis=1).mean() for quad in corners]
    sharpest = np.argsort(sides)[-5:]
    blurs = [edge_blur(grey, corners[k]) for k in sharpest]
    return BoardView(
        board,
        np.array(found),
        np.concatenate([board.square(number, INNER_SHARE) for number in found]),
        np.concatenate(pixels),
        (grey.shape[1], grey.shape[0]),
        float(np.median(sides)),
        float(np.median(blurs)),
    )
