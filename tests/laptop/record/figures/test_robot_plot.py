"""The picture of a robot's way."""

import math
from types import SimpleNamespace

import pytest
from matplotlib.image import imread

from laptop.record.figures.robot_plot import write_robot_plot


@pytest.fixture
def rows():
    """A quarter of a circle of 30 cm, from the right to the top."""
    angles = [math.radians(k) for k in range(0, 91, 5)]
    return [
        SimpleNamespace(
            t=k, x=30 * math.cos(a), y=30 * math.sin(a), z=None, pen=1, q=(a + math.pi / 2,)
        )
        for k, a in enumerate(angles)
    ]


def test_a_way_is_a_picture_of_its_own(tmp_path, rows):
    write_robot_plot(tmp_path / "a.png", rows, "my_robot.py")
    write_robot_plot(tmp_path / "b.png", rows[:-3], "my_robot.py")
    assert imread(tmp_path / "a.png").shape[:2] == (1000, 1600)
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


def test_who_stays_where_he_is_is_shown_too(tmp_path, rows):
    write_robot_plot(tmp_path / "a.png", rows[:1], "still.py")
    assert (tmp_path / "a.png").stat().st_size > 1000
