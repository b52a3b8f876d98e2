"""What the emulated brick's computing costs is what was counted on the brick's own Python."""

import pytest

from laptop.bench import brick


# python-ev3dev2 leaves its files open, and here they are real ones.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_every_piece_costs_what_was_counted():
    rows = list(brick.run())
    assert len(rows) == brick.count() > 40
    off = [row for row in rows if not 0.75 <= row.ratio <= 1.25]
    assert not off


def test_figures_for_people():
    row = brick.Row("a tick", 800.0, 1000.0)
    assert brick.table([row]) == [("a tick", "800", "1,000", "1.25", "18.1")]
