"""Pixels of the marker become places of the pen, wherever the arm stands on the board."""

from dataclasses import replace

import numpy as np
import pytest

from laptop.measure.ilc.view import TipView


class FromAbove:
    """A camera straight above the board: 20 px to the cm, more to what is higher."""

    def to_table(self, pixels, height=0.0):
        return pixels / (20 * (1 + height / 50))


PLACES = np.array([[10.0, 0.0], [8.0, 5.0], [5.0, 10.0], [0.0, 12.0]])
HEADINGS = np.array([0.3, 0.9, 1.6, 2.2])
VIEW = TipView(FromAbove(), 2.5, (-1.5, 0.5), 0.4, (7.0, -3.0))


def pixels_of(places, headings, view):
    """Where the marker is seen, written out once more."""
    x, y = view.offset
    markers = [
        p + [x * np.cos(h) - y * np.sin(h), x * np.sin(h) + y * np.cos(h)]
        for p, h in zip(places, headings, strict=True)
    ]
    turn = np.array(
        [[np.cos(view.turn), -np.sin(view.turn)], [np.sin(view.turn), np.cos(view.turn)]]
    )
    return (np.array(markers) @ turn.T + view.base) * 20 * (1 + view.height / 50)


def test_the_pen_is_beside_the_marker_in_the_frame_of_the_arm():
    seen = VIEW.tips(pixels_of(PLACES, HEADINGS, VIEW), HEADINGS)
    assert seen == pytest.approx(PLACES)


def test_how_the_arm_stands_is_told_by_what_was_to_be_drawn():
    unknown = replace(VIEW, turn=0.0, base=(0.0, 0.0), to_align=True)
    pixels = pixels_of(PLACES, HEADINGS, VIEW)
    pixels[1] = np.nan  # it was not seen there
    laid = unknown.aligned(pixels, HEADINGS, PLACES)
    assert laid.turn == pytest.approx(VIEW.turn)
    assert laid.base == pytest.approx(VIEW.base)
    assert not laid.to_align
