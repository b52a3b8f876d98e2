"""Codes in sight that cannot be the ArUco marker that is looked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache

import cv2
import numpy as np

from laptop.see.markers.board import BOARDS

OURS = "4x4"
FAMILIES = {
    "7x7": cv2.aruco.DICT_7X7_1000,
    "AprilTag 36h11": cv2.aruco.DICT_APRILTAG_36h11,
    "ArUco MIP 36h12": cv2.aruco.DICT_ARUCO_MIP_36h12,
    "6x6": cv2.aruco.DICT_6X6_1000,
    "original ArUco": cv2.aruco.DICT_ARUCO_ORIGINAL,
    "5x5": cv2.aruco.DICT_5X5_1000,
    OURS: cv2.aruco.DICT_4X4_1000,
}
"""OpenCV's numbers of the code families that people print; those of most bits are read first. The
shorter lists of a family are parts of these. Left out is AprilTag 16h5: some of its codes are
others in 4x4."""
CELL, INNER = 8, slice(2, 6)
"""Number of samples along a cell of a square that is read, and those of them off its edges."""
MIN_CONTRAST = 15.0
"""Least standard deviation of a code's grey values, 0 to 255."""
MIN_BIT_MARGIN = 0.08
"""Least distance of each quarter of a cell from half-way between black and white, as a share of
that range."""
MIN_BOARD_MARKERS = 4
"""Least number of markers that are a board, if most of them are set like one."""
MAX_NEIGHBOUR_DISTANCE, MIN_TURN_COSINE = 3.0, 0.95
"""Limits on a board: greatest distance to the nearest other marker, in sides, and least cosine of
the angle between the two."""
MAX_NAMED = 3
PRINT = "brickservo markers prints some"


def other_codes(grey: np.ndarray) -> dict[str, dict[int, np.ndarray]]:
    """Return all clearly readable codes: corners (4, 2), px, by family and number.

    Args:
        grey: uint8, (height, width).
    """
    read, _, refused = _square_finder().detectMarkers(grey)
    found: dict[str, dict[int, np.ndarray]] = {}
    for square in (*read, *refused):
        corners = square.reshape(4, 2).astype(np.float32)
        if code := _code_in(grey, corners):
            found.setdefault(code[0], {})[code[1]] = corners
    return found


def only(found: Mapping[str, Mapping[int, np.ndarray]]) -> str:
    """Return the codes in sight instead, as the end of a sentence; "" if there are none.

    Args:
        found: as `other_codes` gives them.
    """
    family = max(found, key=lambda family: len(found[family]), default=OURS)
    codes = found.get(family)
    if not codes:
        return ""
    ours = family == OURS
    if _is_board(codes.values()):
        if ours and any(codes.keys() <= set(board.numbers) for board in BOARDS.values()):
            return ", only the printed board"
        kind = "" if ours else f"{family} "
        return f", only a board of {kind}markers; it takes a single 4x4 one: {PRINT}"
    numbers = sorted(codes)
    named = ", ".join(map(str, numbers[:MAX_NAMED]))
    more = f" and {len(numbers) - MAX_NAMED} more" if len(numbers) > MAX_NAMED else ""
    if ours:
        return f", only {named}{more}"
    plural = "s" if len(numbers) > 1 else ""
    return f", only {family} marker{plural} {named}{more}; it takes a 4x4 one: {PRINT}"


def _is_board(squares: Collection[np.ndarray]) -> bool:
    """Return whether most squares have one nearby of equal size and turn, as on a board."""
    if len(squares) < MIN_BOARD_MARKERS:
        return False
    quads = np.array(list(squares), float)
    middles, edges = quads.mean(axis=1), quads[:, 1] - quads[:, 0]
    sides = np.sqrt([cv2.contourArea(quad.astype(np.float32)) for quad in quads])
    away = np.linalg.norm(middles[:, None] - middles, axis=2) + np.diag(np.full(len(quads), np.inf))
    nearest = away.argmin(axis=1)
    turned = (edges * edges[nearest]).sum(axis=1)
    turned /= np.linalg.norm(edges, axis=1) * np.linalg.norm(edges[nearest], axis=1)
    set_alike = (away.min(axis=1) < MAX_NEIGHBOUR_DISTANCE * sides) & (turned > MIN_TURN_COSINE)
    return bool(set_alike.mean() > 0.5)


@lru_cache(maxsize=1)
def _square_finder() -> cv2.aruco.ArucoDetector:
    """Return OpenCV's detector for squares; it gives both a paper's and the marker's on it."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerDistanceRate = 0.01
    few = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_16h5)
    return cv2.aruco.ArucoDetector(few, parameters)


def _code_in(grey: np.ndarray, corners: np.ndarray) -> tuple[str, int] | None:
    """Return the family and number of the code in a square: black border, no wrong bits."""
    for bits, numbers in _codes().items():
        cells = bits + 2
        side = cells * CELL
        square = np.array([(0, 0), (side, 0), (side, side), (0, side)], np.float32) - 0.5
        seen = cv2.warpPerspective(grey, cv2.getPerspectiveTransform(corners, square), (side, side))
        if cv2.meanStdDev(seen)[1][0, 0] < MIN_CONTRAST:
            return None
        _, white = cv2.threshold(seen, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        high, low = cv2.mean(seen, white)[0], cv2.mean(seen, 255 - white)[0]
        middles = seen.reshape(cells, CELL, cells, CELL)[:, INNER, :, INNER]
        quarters = middles.reshape(cells, 2, -1, cells, 2, CELL // 4).mean(axis=(2, 5))
        shares = (quarters - low) / (high - low) - 0.5
        code = (shares.min(axis=(1, 3)) > MIN_BIT_MARGIN).astype(np.uint8)
        black = shares.max(axis=(1, 3)) < -MIN_BIT_MARGIN
        if not (code | black).all() or code.sum() != code[1:-1, 1:-1].sum():
            continue
        if found := numbers.get(_packed(code[1:-1, 1:-1])):
            return found
    return None


def _packed(bits: np.ndarray) -> bytes:
    """Return a code as OpenCV packs it, not turned."""
    turns = cv2.aruco.Dictionary.getByteListFromBits(np.ascontiguousarray(bits))
    return np.asarray(turns).reshape(4, -1)[0].tobytes()


@lru_cache(maxsize=1)
def _codes() -> dict[int, dict[bytes, tuple[str, int]]]:
    """Return the family and number of each packed code in all four turns, by bits per side."""
    codes: dict[int, dict[bytes, tuple[str, int]]] = {}
    for family, number in FAMILIES.items():
        dictionary = cv2.aruco.getPredefinedDictionary(number)
        known = codes.setdefault(dictionary.markerSize, {})
        for k, turns in enumerate(dictionary.bytesList):
            for turn in turns.reshape(4, -1):
                known.setdefault(turn.tobytes(), (family, k))
    return codes
