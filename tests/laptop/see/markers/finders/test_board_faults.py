"""Boards that are two, and pictures that are mirrored."""

import cv2
import numpy as np
import pytest

from laptop.see.markers.board import BOARDS, DICTIONARY
from laptop.see.markers.finders.board import find_board
from laptop.see.markers.finders.board_faults import board_fault


def sheet(paper="a4", keep=lambda x, y: True):
    """A board straight from above, 12 px/cm."""
    board = BOARDS[paper]
    image = np.full((int(12 * board.height), int(12 * board.width), 3), 255, np.uint8)
    for number, (x, y) in zip(board.numbers, board.centres, strict=True):
        if keep(x, y):
            code = cv2.aruco.generateImageMarker(
                cv2.aruco.getPredefinedDictionary(DICTIONARY), number, 30
            )
            left, top = int(12 * (board.width / 2 + x)) - 15, int(12 * (board.height / 2 - y)) - 15
            image[top : top + 30, left : left + 30] = code[..., None]
    return image


def table(*sheets):
    """Sheets side by side on a dark table."""
    height = max(len(one) for one in sheets) + 60
    rows = [
        cv2.copyMakeBorder(
            one, 30, height - 30 - len(one), 30, 30, cv2.BORDER_CONSTANT, value=(60, 60, 60)
        )
        for one in sheets
    ]
    return np.hstack(rows)


def fault(image):
    return board_fault(image, find_board(image))


@pytest.mark.parametrize(
    "image",
    [
        table(sheet()),
        table(sheet(keep=lambda x, y: x < 0)),
        table(sheet(keep=lambda x, y: y > 12 and x < -5)),
        table(sheet(), sheet("letter")),
        table(sheet(), sheet(keep=lambda x, y: x < -8)[:90]),
        np.full((200, 300, 3), 90, np.uint8),
        np.full((200, 300), 90, np.uint8),
    ],
)
def test_one_board_or_none_is_all_right(image):
    assert fault(image) is None


@pytest.mark.parametrize(
    ("image", "count"),
    [
        (table(sheet(), sheet()), 26),
        (table(sheet("letter"), sheet("letter")), 24),
        (table(sheet(), sheet(keep=lambda x, y: x < 0)), 13),
        (table(sheet(), sheet(), sheet()), 26),
    ],
)
def test_two_boards_are_told(image, count):
    assert fault(image) == f"two boards are seen, {count} markers twice: show one of them alone"


@pytest.mark.parametrize("keep", [lambda x, y: True, lambda x, y: x < 0])
@pytest.mark.parametrize("grey", [False, True])
def test_a_mirrored_picture_is_told(keep, grey):
    image = table(sheet(keep=keep))[:, ::-1].copy()
    if grey:
        image = image[:, :, 0].copy()
    reported = fault(image)
    assert reported.startswith("the picture is mirrored: ")
    assert reported.endswith("; turn mirroring off in the program that takes it")
    for upright in (image[::-1].copy(), image[:, ::-1].copy()):
        assert fault(upright) is None
