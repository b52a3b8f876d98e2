"""Figures in a tenth of the pixels, and few formulas: both are slow to draw."""

import io

import pytest

# (What is drawn with is imported late: an old Python, which leaves these tests out, reads this.)


@pytest.fixture(autouse=True)
def small_figures(monkeypatch):
    """Drawn as ever, in a tenth of the pixels each way."""
    from laptop.record.figures.sheet import DPI
    from laptop.record.report import raw_figures
    from laptop.record.servo import figures

    def png_of(figure):
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=DPI / 10)
        return file.getvalue()

    for module in (raw_figures, figures):
        monkeypatch.setattr(module, "png_of", png_of)


@pytest.fixture
def no_servo_figures(monkeypatch):
    """For tests that look at other things of a log."""
    from laptop.record.report import lone_files

    monkeypatch.setattr(lone_files, "draw", lambda *words: [])
