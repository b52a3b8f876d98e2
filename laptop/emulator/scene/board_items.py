"""The printed board on the table, as items to paint."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from laptop.emulator.scene.items import Item, place_outline
from laptop.emulator.scene.optics import bit_rings, light_of, rectangle
from laptop.see.markers.board import BAR, BAR_AT, BOARDS, CROSS_ARM, CROSSES, MARKER

LINE_WIDTH = 0.02
"""Width of the board's lines, cm."""
PAPER, INK, GREY = light_of("white"), light_of("black"), light_of("#808080")
"""Light (3,), B, G, R, of the board's paper, of its print, and of its crosses."""


def board_place(constants: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """Return points (n, 2) of the board, cm, on the table: (n, 3)."""
    middle = constants["board_x"], constants["board_y"]
    turn = math.radians(constants["board_turn"])
    return place_outline(constants["board_scale"] * points, middle, turn, 0.0)


def board_items(constants: dict[str, Any]) -> list[Item]:
    """Return the board's items: sheet, markers, crosses and bar; none if there is no board."""
    if constants["board"] == "none":
        return []
    board = BOARDS[constants["board"]]

    def placed(rings: list[np.ndarray]) -> list[np.ndarray]:
        return [board_place(constants, ring) for ring in rings]

    x, y, half = board.width / 2, board.height / 2, MARKER / 2
    squares, cells = [], []
    for number, centre in zip(board.numbers, board.centres):
        squares.append(rectangle(-half, -half, half, half, 3) + centre)
        cells += [half * ring + centre for ring in bit_rings(number)]
    arm, thin = CROSS_ARM, LINE_WIDTH / 2
    crosses = [
        ring + cross
        for cross in CROSSES
        for ring in (rectangle(-arm, -thin, arm, thin, 1), rectangle(-thin, -arm, thin, arm, 1))
    ]
    bar = [rectangle(-BAR / 2, BAR_AT - thin, BAR / 2, BAR_AT + thin, 4)]
    return [
        Item(placed([rectangle(-x, -y, x, y, 12)]), PAPER),
        Item(placed(squares), INK),
        Item(placed(cells), PAPER),
        Item(placed(crosses), GREY),
        Item(placed(bar), INK),
    ]
