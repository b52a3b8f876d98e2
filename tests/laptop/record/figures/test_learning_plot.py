"""The picture of what was learned: every drawing over what was wished, and its figures."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from laptop.record.figures import learning_plot


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


@pytest.fixture
def shown(monkeypatch):
    """Notes of the picture."""
    notes = []
    title = learning_plot.write_title
    monkeypatch.setattr(
        learning_plot, "write_title", lambda f, t, n: notes.append(n) or title(f, t, n)
    )
    return notes


def test_the_drawings_lie_over_one_another_with_their_figures(tmp_path, shown):
    file = tmp_path / "learning.png"
    drawings = [("at first", record(0.5)), ("after 1", record(0.2)), ("after 3", record(0.05))]
    learning_plot.write_learning_plot(file, drawings, CHAINS, "two lines")
    assert shown == ["off at most: 5.0 mm at first, 2.0 mm after 1, 0.5 mm after 3"]
    picture = cv2.imread(str(file)).astype(int)
    for colour in ("#c9463d", "#1f6f54"):
        bgr = [int(colour[k : k + 2], 16) for k in (5, 3, 1)]
        assert (np.abs(picture - bgr).max(axis=2) < 12).sum() > 500
