"""The picture of a robot's way."""

import math
from types import SimpleNamespace

import pytest

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


def test_the_way_is_shown_with_the_heading_at_its_end(tmp_path, rows, saved):
    write_robot_plot(tmp_path / "a.png", rows, "my_robot.py", [(0, 0), (5, 60)])
    sheet, places, headings = saved[0].axes
    floor, way, start, _ = sheet.lines
    assert floor.get_xydata().tolist() == [[0, 0], [5, 60]]
    assert way.get_xydata().tolist() == [[row.x, row.y] for row in rows]
    assert start.get_xydata().tolist() == [[30, 0]]
    (arrow,) = sheet.texts
    assert arrow.xyann == pytest.approx((0, 30))
    assert arrow.xy == pytest.approx((-3.6, 30))  # to the left
    assert sheet.viewLim.contains(5, 60)
    assert [line.get_label() for line in places.lines] == ["x", "y"]
    assert headings.lines[0].get_ydata()[-1] == pytest.approx(180)


def test_who_stays_where_he_is_is_shown_too(tmp_path, rows, saved):
    write_robot_plot(tmp_path / "a.png", rows[:1], "still.py")
    assert saved[0].axes[0].viewLim.contains(30, 0)
