"""Diagnosis of a picture without one proper board: there are two of them, or it is mirrored."""

from __future__ import annotations

import cv2
import numpy as np

from laptop.see.markers.finders.board import BoardView, find_board, find_markers

MIN_DOUBLED, MIN_DOUBLED_SHARE = 4, 1 / 3
"""Number of markers, and share of those seen, that must be seen twice for two boards."""
MIN_MIRRORED, MIN_MIRRORED_RATIO = 4, 2
"""Number of markers, and factor, by which the mirrored picture must show more for a mirrored board:
a few markers read as others in the mirror."""


def board_fault(image: np.ndarray, view: BoardView | None) -> str | None:
    """Return what is wrong with a picture, and the remedy; None if it shows one board, or none.

    Args:
        image: BGR or grey, uint8.
        view: what `find_board` has found in it.
    """
    seen = 0 if view is None else len(view.numbers)
    if view is not None and seen == len(view.board.numbers):
        return None
    found, doubled = find_markers(image)
    if len(doubled) >= max(MIN_DOUBLED, MIN_DOUBLED_SHARE * (len(found) + len(doubled))):
        return f"two boards are seen, {len(doubled)} markers twice: show one of them alone"
    mirrored = find_board(cv2.flip(image, 1))
    if mirrored and len(mirrored.numbers) > max(seen + MIN_MIRRORED, MIN_MIRRORED_RATIO * seen):
        return (
            f"the picture is mirrored: {len(mirrored.numbers)} markers are seen in its mirror, and "
            f"{seen} in it; turn mirroring off in the program that takes it"
        )
    return None
