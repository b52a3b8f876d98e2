"""Views of the board as a lens would show them, by formulas of their own."""

import numpy as np

from laptop.see.markers.board import BOARDS
from laptop.see.markers.finders.board import INNER_SHARE, BoardView

LENS = (610.0, 325.0, 233.0, -0.28, 0.09, 0.001, -0.0008)
SIZE = (640, 480)


def stand(distance, tilt, azimuth=0.0, roll=0.0, at=(0.0, 0.0)):
    """Rotation and shift from the board to a camera that looks at a place of it; cm, degrees."""
    tilt, azimuth, roll = np.radians((tilt, azimuth, roll))
    axis = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    down = np.cross(-axis, right)
    turned = np.array(
        [
            np.cos(roll) * right + np.sin(roll) * down,
            np.cos(roll) * down - np.sin(roll) * right,
            -axis,
        ]
    )
    return turned, -turned @ (np.array([*at, 0]) + distance * axis)


def turned(angle, vector):
    """A vector, turned in the plane."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def pixels(where, points, lens=LENS):
    """Pixels of points (n, 3), cm: Brown's formula, written out."""
    turned, shift = where
    x, y, z = (np.asarray(points, float) @ turned.T + shift).T
    f, cx, cy, k1, k2, p1, p2 = lens
    a, b = x / z, y / z
    rr = a**2 + b**2
    bent = 1 + k1 * rr + k2 * rr**2
    u = a * bent + 2 * p1 * a * b + p2 * (rr + 2 * a**2)
    v = b * bent + p1 * (rr + 2 * b**2) + 2 * p2 * a * b
    return np.column_stack([f * u + cx, f * v + cy])


def view(where, rng=None, noise=0.03, lens=LENS, paper="a4", keep=None, scale=1.0, **others):
    """What is seen of a board.

    keep  the markers that are seen: a function of their centres (x, y), cm
    scale of the print
    """
    board = BOARDS[paper]
    numbers = [
        number
        for number, centre in zip(board.numbers, board.centres)
        if keep is None or keep(*centre)
    ]
    points = np.concatenate(
        [board.square(number, INNER_SHARE) for number in numbers] or [np.empty((0, 3))]
    )
    seen = pixels(where, scale * points, lens)
    if rng is not None:
        seen = seen + noise * rng.standard_normal(seen.shape)
    reported = {"size": SIZE, "side": 30.0, "blur": 0.8, **others}
    return BoardView(board, np.array(numbers), points, seen, **reported)
