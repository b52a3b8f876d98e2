"""Figures in a tenth of the pixels, and few formulas: both are slow to draw."""

import pytest

# (What is drawn with is imported late: an old Python, which leaves these tests out, reads this.)


@pytest.fixture(autouse=True)
def small_figures(monkeypatch):
    from small_figures import png_of

    from laptop.record.report import raw_figures
    from laptop.record.servo import figures

    for module in (raw_figures, figures):
        monkeypatch.setattr(module, "png_of", png_of)


@pytest.fixture
def no_servo_figures(monkeypatch):
    """For tests that look at other things of a log."""
    from laptop.record.report import lone_files

    monkeypatch.setattr(lone_files, "draw", lambda *words: [])
