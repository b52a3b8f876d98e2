"""The sheet: where points lie on it, what is in sight, and the words around it."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from laptop.record.figures.sheet import (
    ARM,
    DPI,
    FROM_BEHIND,
    SHEET,
    TALL_HEIGHT,
    WIDE,
    Sheet,
    new_figure,
    png_of,
    write_footnote,
    write_title,
)

VIEWS = {"xy": (1, 2), "xz": (1, 3), "yz": (2, 3), FROM_BEHIND: (-2, 1)}


@pytest.fixture(params=[(SHEET, 1000), (WIDE, TALL_HEIGHT), ((0.6, 0.5, 0.2, 0.3), 800)])
def figure_and_box(request):
    """Figures of any size, and a place in each."""
    box, height = request.param
    with new_figure(height) as figure:
        yield figure, box


@pytest.mark.parametrize("view", VIEWS)
def test_a_point_lies_where_the_view_has_it(view, figure_and_box):
    sheet = Sheet(*figure_and_box, view)
    assert sheet.seen([(1, 2, 3)]).tolist() == [list(VIEWS[view])]
    assert sheet.seen([]).shape == (0, 2)
    to_the_right = sheet.axes.xaxis.get_major_formatter()
    assert (to_the_right(-2, 0) == "2") == (view == FROM_BEHIND)
    assert sheet.axes.get_ylabel().startswith(view[-1])


@pytest.mark.parametrize("far", [(0, 0), (30, 1), (0.1, 7)])
def test_all_is_in_sight_at_one_scale_and_its_numbers_have_room(far, figure_and_box):
    figure, box = figure_and_box
    sheet = Sheet(figure, box)
    points = np.array([(4.0, -3.0), np.add(far, (4.0, -3.0))])
    sheet.show(points, ((1, 2), (3, 4)), 5.0)
    axes = sheet.axes
    (left, bottom), (right, top) = axes.viewLim.get_points()
    assert np.all(points >= np.array((left + 1, bottom + 2)) - 1e-9)
    assert np.all(points <= np.array((right - 3, top - 4)) + 1e-9)
    assert min(right - left, top - bottom) > 5 - 1e-9
    (a, b), (c, d) = axes.transData.transform([(0, 0), (1, 1)])
    assert c - a == pytest.approx(d - b)
    assert sheet.cm == pytest.approx((c - a) * 72 / DPI)
    steps = [np.diff(axis.get_majorticklocs()) for axis in (axes.xaxis, axes.yaxis)]
    assert np.ptp(np.concatenate(steps)) < 1e-9
    assert steps[0][0] * (c - a) > 35


def test_an_arm_is_as_wide_as_a_beam_and_a_pale_one_is_nearer_to_white(figure_and_box):
    sheet = Sheet(*figure_and_box)
    sheet.show(np.array([(0, 0), (20, 0)]))
    for pale in (0, 0.6):
        sheet.arm([(0, 0), (11, 0), (20, 0)], "the arm", pale)
    edge, beam, *_ = sheet.axes.lines
    assert edge.get_linewidth() == pytest.approx(0.8 * sheet.cm)
    assert beam.get_color() == pytest.approx(to_rgb(ARM))
    handles, labels = sheet.axes.get_legend_handles_labels()
    assert labels == ["the arm"] * 2
    assert sum(handles[1].get_color()) > sum(handles[0].get_color())


def test_the_legend_has_one_of_each_and_lies_below(figure_and_box):
    figure, _ = figure_and_box
    sheet = Sheet(*figure_and_box)
    sheet.lines([[(0, 0), (1, 1)], [(2, 2), (2, 2)]], "lines")
    sheet.lines([], "none of these")
    assert [line.get_marker() for line in sheet.axes.lines] == ["None", "."]
    sheet.reach([np.array([(0, 0), (1, 0), (1, 1)])], "reach")
    sheet.legend()
    png_of(figure)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["lines", "reach"]
    assert legend.get_window_extent().y1 < sheet.axes.get_window_extent().y0


TITLES = {
    "long": "a title of many words " * 12,
    "one long word": "x" * 400,
    "formula": r"$\frac{1}{2$ and no more",
    "unknown signs": "robot \U0001f916 \u6f22\u5b57 \udc80",
    "none": "",
    "lines": "one\ntwo\nthree\nfour",
}


@pytest.mark.short(every=3)
@pytest.mark.parametrize("title", TITLES.values(), ids=TITLES.keys())
def test_any_title_and_notes_find_room(title):
    with new_figure() as figure:
        sheet = Sheet(figure, SHEET)
        write_title(figure, title, title)
        write_footnote(figure, "at the bottom")
        png_of(figure)
        boxes = [text.get_window_extent() for text in figure.texts if text.get_text()]
        boxes.append(sheet.axes.get_window_extent())
        for k, box in enumerate(boxes):
            assert box.x1 <= figure.bbox.x1
            assert box.y1 <= figure.bbox.y1
            assert not any(box.overlaps(other) for other in boxes[k + 1 :])


def test_letters_that_no_font_has_are_boxes_without_a_warning(recwarn):
    with new_figure() as figure:
        figure.text(0.5, 0.5, "\x1b \U0010ffff")
        png_of(figure)
    assert [str(warning.message) for warning in recwarn] == []
