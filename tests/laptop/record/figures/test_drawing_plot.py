"""A drawing's ink against what was wished: figures by hand, and what the picture shows."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from laptop.record.figures.drawing_plot import compare, write_drawing_plot


def rows_of(*parts):
    """Samples every 10 ms along points (x, y, pen)."""
    points = [point for part in parts for point in part]
    return [
        SimpleNamespace(t=0.01 * k, q=(0.0, 0.0), x=x, y=y, z=None, pen=pen)
        for k, (x, y, pen) in enumerate(points)
    ]


def way(start, end, pen, steps=200):
    return [(*np.add(start, np.subtract(end, start) * k / steps), pen) for k in range(steps + 1)]


LINES = [[np.array([(10.0, 0.0), (10.0, 4.0)])], [np.array([(12.0, 4.0), (12.0, 0.0)])]]


def test_every_ink_belongs_to_its_line_and_is_measured_in_mm():
    rows = rows_of(
        way((10.1, 0), (10.1, 4), 1), way((10.1, 4), (12, 4), 0), way((12, 4), (12, 0), 1)
    )
    found = compare(rows, LINES)
    assert found.greatest_mm == pytest.approx(1.0, abs=1e-6)
    assert found.rms_mm == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert found.missed_mm == pytest.approx(1.0, abs=1e-6)
    assert found.ink_cm == pytest.approx(8.0, rel=1e-6)
    assert found.pen_up_cm == pytest.approx(1.9, rel=0.02)
    assert (found.chains, found.inks) == (2, 2)


def test_an_ink_near_another_line_is_measured_by_its_own():
    rows = rows_of(way((12, 0), (12, 4), 1), way((12, 4), (12, 4.2), 0), way((12, 4), (12, 0), 1))
    assert compare(rows, LINES).greatest_mm == pytest.approx(20.0)


def test_what_was_left_out_is_seen():
    found = compare(rows_of(way((10, 0), (10, 4), 1)), LINES)
    assert (found.chains, found.inks) == (2, 1)
    assert found.greatest_mm == pytest.approx(0.0, abs=1e-6)
    assert found.missed_mm == pytest.approx(20.0, abs=0.1)


def test_a_pen_that_stands_on_the_paper_is_noticed():
    rows = rows_of(way((10, 0), (10, 2), 1), [(10.0, 2.0, 1)] * 60, way((10, 2), (10, 4), 1))
    assert compare(rows, LINES[:1]).standing_s == pytest.approx(0.61, abs=0.02)


def test_nothing_drawn_is_no_number():
    found = compare(rows_of(way((10, 0), (10, 4), 0)), LINES)
    assert np.isnan(found.greatest_mm)
    assert found.ink_cm == 0
    told = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert (told["greatest_mm"], told["rms_mm"], told["missed_mm"]) == (None, None, None)
    assert told["ink_cm"] == 0.0


def test_the_picture_shows_x_upwards_and_y_to_the_left(tmp_path, saved):
    rows = rows_of(way((10.1, 0), (10.1, 4), 1), way((10.1, 4), (12, 4), 0))
    chains = [[np.array([(10.0, 0.0), (10.0, 4.0), (14.0, 4.0)])]]
    write_drawing_plot(tmp_path / "a.png", rows, chains, compare(rows, chains), "a corner", "notes")
    (figure,) = saved
    sheet, scale = figure.axes
    (ink,) = sheet.collections
    points = np.concatenate(ink.get_segments())
    assert np.ptp(points, axis=0) == pytest.approx([4.0, 0.0])
    assert points.min(axis=0) == pytest.approx([-4.0, 10.1])
    assert ink.get_array().max() == pytest.approx(1.0)  # mm
    wished, travel = sheet.lines
    assert wished.get_xydata().tolist() == [[0, 10], [-4, 10], [-4, 14]]
    assert np.nanmax(travel.get_xydata(), axis=0) == pytest.approx([-4.0, 12.0])
    assert scale.get_ylabel().endswith("mm")
