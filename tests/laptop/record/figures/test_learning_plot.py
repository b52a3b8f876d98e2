"""The picture of what was learned: every drawing over what was wished, and its figures."""

from types import SimpleNamespace

import numpy as np
import pytest

from laptop.record.figures.learning_plot import write_learning_plot


def record(off):
    """Two strokes, cm, each beside what was wished by so much."""
    rows, t = [], 0.0
    for y in (0.0, 4.0):
        for x in np.linspace(5.0, 10.0, 30):
            rows.append(SimpleNamespace(t=t, x=x, y=y + off, z=None, pen=True))
            t += 0.05
        rows += [SimpleNamespace(t=t + 0.1 * k, x=10.0, y=y, z=None, pen=False) for k in range(9)]
        t += 1.0
    return rows


CHAINS = [[np.array([[5.0, y], [10.0, y]])] for y in (0.0, 4.0)]


def test_the_drawings_lie_over_one_another_with_their_figures(tmp_path, saved):
    drawings = [("at first", record(0.5)), ("after 1", record(0.2)), ("after 3", record(0.05))]
    write_learning_plot(tmp_path / "learning.png", drawings, CHAINS, "two lines")
    (figure,) = saved
    title, notes = (text.get_text() for text in figure.texts)
    assert title == "two lines"
    assert notes == "off at most: 5.0 mm at first, 2.0 mm after 1, 0.5 mm after 3"
    sheet, graph = figure.axes
    handles, labels = sheet.get_legend_handles_labels()
    assert labels == ["at first", "after 1", "after 3", "wished"]
    to_the_right = [np.nanmax(line.get_xdata()) for line in handles]
    assert to_the_right == pytest.approx([-0.5, -0.2, -0.05, 0.0])
    assert [max(line.get_ydata()) for line in graph.lines] == pytest.approx([5.0, 2.0, 0.5])
