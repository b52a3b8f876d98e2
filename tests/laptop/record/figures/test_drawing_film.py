"""The film of a drawing: the ink grows with time, and the arm is where it was."""

from types import SimpleNamespace

import numpy as np
from PIL import Image

from laptop.record.figures import drawing_film

LINE = [[np.array([(8.0, 0.0), (14.0, 0.0)])]]


def rows(x_of):
    """A line along x in two seconds, pen down; both joints are in the middle."""
    return [
        SimpleNamespace(t=0.01 * k, q=(0.0, 0.0), x=x_of(k / 200), y=0.0, z=None, pen=1)
        for k in range(201)
    ]


def dark(picture):
    """How many of a picture's pixels are ink."""
    return int((np.asarray(picture.convert("L")) < 60).sum())


def test_the_ink_grows_evenly_and_equal_rows_give_equal_bytes(tmp_path):
    drawn = rows(lambda share: 8 + 6 * share)
    for name in ("one.gif", "two.gif"):
        drawing_film.write_drawing_film(
            tmp_path / name, drawn, LINE, lambda q: [(0, 0), (-5, 0)], 11
        )
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()
    with Image.open(tmp_path / "one.gif") as film:
        ink = []
        for k in range(film.n_frames):
            film.seek(k)
            ink.append(dark(film))
    assert len(ink) == 11
    steps = np.diff(ink[1:])
    assert steps.min() > 0.8 * steps.max() > 0


def test_the_arm_is_where_it_was(tmp_path):
    drawn = [SimpleNamespace(**{**vars(row), "q": (row.t / 2,)}) for row in rows(lambda share: 8)]
    file = tmp_path / "arm.gif"
    drawing_film.write_drawing_film(
        file, drawn, LINE, lambda q: [(0, 0), (6 * np.cos(q[0]), 6 * np.sin(q[0]))], 2
    )
    with Image.open(file) as film:
        beams = []
        for k in (0, film.n_frames - 1):
            film.seek(k)
            red, green, blue = np.moveaxis(np.asarray(film.convert("RGB"), float), 2, 0)
            yellow = (red > 200) & (blue < 160) & (green > 150)
            beams.append(np.argwhere(yellow).mean(axis=0))
    (row_before, column_before), (row_after, column_after) = beams
    assert column_after < column_before - 20  # towards y, which is on the left
    assert row_after > row_before
