"""Wish and truth: distances by an independent measure, numbers that can be known by hand."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from laptop.drawing import overlay, preparing
from laptop.drawing.artwork import Artwork
from laptop.drawing.options import DrawingOptions
from laptop.reporting import line_accuracy
from shared.arm_description import find_arm, read_arm


@pytest.fixture(scope="module")
def plan():
    lines = tuple(np.array([(0.0, k), (4.0, k)]) for k in range(2))
    options = DrawingOptions(at=(12, 0), size=(4, None), order=False)
    arm = read_arm(find_arm("planar"))
    return preparing.prepare(Artwork("two lines", lines, ("", "")), arm, options)


def rows_along(lines, shift=(0.0, 0.0)):
    """A run that draws these lines, shifted, at 4 cm/s, the pen up for a second between them."""
    rows, t = [], 0.0
    for line in lines:
        for share in np.linspace(0, 1, 101):
            x, y = line[0] + share * (line[-1] - line[0]) + shift
            rows.append(SimpleNamespace(t=t, x=x, y=y, z=None, pen=1))
            t += 0.01
        t += 1.0
        rows.append(SimpleNamespace(t=t, x=x, y=y, z=None, pen=0))
    return rows


def test_distances_are_those_of_the_line_report():
    dice = np.random.default_rng(4)
    lines = [dice.uniform(0, 9, (6, 2)) for _ in range(5)]
    points = dice.uniform(-1, 10, (300, 2))
    expected = np.min([line_accuracy._distances(points, line) for line in lines], axis=0)
    assert overlay.distances(points, lines) == pytest.approx(expected, abs=0.002)


def test_ink_on_the_wish_is_off_by_nothing(plan, tmp_path):
    truth = overlay.overlay(plan, rows_along(plan.placement.strokes), tmp_path / "o.png")
    assert truth.greatest_mm == pytest.approx(0, abs=1e-6)
    assert truth.missed_mm == pytest.approx(0, abs=0.3)
    assert truth.ink_cm == pytest.approx(8)
    assert truth.pen_up_cm == pytest.approx(np.hypot(4, 1))
    assert truth.strokes == 2
    assert truth.drawn_s == pytest.approx(3.01, abs=0.01)
    assert truth.as_dict()["estimated_s"] == pytest.approx(plan.estimate.seconds, abs=1e-3)


def test_ink_beside_the_wish_is_off_by_so_much(plan):
    rows = rows_along(plan.placement.strokes, (0.1, 0.0))  # across the lines, which lie along y
    truth, _ = overlay.measure(plan, rows, overlay.ink_lines(rows))
    assert truth.greatest_mm == pytest.approx(1)
    assert truth.rms_mm == pytest.approx(1)
    assert truth.missed_mm == pytest.approx(1)


def test_a_line_left_out_is_missed(plan):
    rows = rows_along(plan.placement.strokes[:1])
    truth, _ = overlay.measure(plan, rows, overlay.ink_lines(rows))
    assert truth.missed_mm == pytest.approx(10, abs=0.01)


def test_the_picture_shows_both(plan, tmp_path):
    overlay.overlay(plan, rows_along(plan.placement.strokes, (0.1, 0.0)), tmp_path / "o.png")
    image = cv2.imread(str(tmp_path / "o.png")).astype(int)
    wish = np.abs(image - (0xD9, 0xB3, 0x7F)).sum(axis=2) < 20
    assert wish.sum() > 1000


def test_a_run_without_ink_is_said_to_have_none(plan, tmp_path):
    rows = [SimpleNamespace(t=0.0, x=1, y=1, z=None, pen=0)]
    with pytest.raises(overlay.NoInk):
        overlay.overlay(plan, rows, tmp_path / "o.png")
    assert list(tmp_path.iterdir()) == []
