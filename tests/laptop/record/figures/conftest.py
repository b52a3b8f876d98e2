"""What was drawn, since a picture that merely exists shows nothing."""

import pytest

# (What is drawn with is imported late: an old Python, which leaves these tests out, reads this.)


@pytest.fixture
def saved(monkeypatch):
    """The figures that were saved, in their order; none of them was painted."""
    from matplotlib.figure import Figure

    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    return figures
