"""What the emulated brick's computing costs is what was counted on the brick's own Python."""

import pytest

from tests.claims import brick

BUDGETS = {
    "planar: tick, line": 350,
    "spatial: tick, line": 502,
    "planar: tick, moving": 310,
    "spatial: tick, moving": 445,
    "planar, look: tick": 640,
    "spatial, look: tick": 950,
    "planar, look: decision, move": 2100,  # one of three seeks another posture
    "spatial, look: decision, move": 2500,
    "spatial, look: decision, end": 9000,
    "planar: planning a line": 10000,
    "spatial: planning a line": 15000,
    "start: driver.py where": 164100,
    "start: tracking_client.py --seconds none": 135000,
}
"""Thousand instructions, as the emulator counts them (a few per cent more than CPython 3.5.3 does):
a control tick has 20 ms, which are 880 of them, sysfs and all."""


# python-ev3dev2 leaves its files open, and here they are real ones.
@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_every_piece_costs_what_was_counted():
    rows = list(brick.run())
    assert len(rows) == brick.count() > 35
    off = [row for row in rows if row.ratio and not 0.75 <= row.ratio <= 1.25]
    assert not off
    emulated = {row.what: row.emulated for row in rows}
    assert not {what: emulated[what] for what, most in BUDGETS.items() if emulated[what] > most}


def test_figures_for_people():
    row = brick.InstructionCount("a tick", 800.0, 1000.0)
    assert brick.table([row]) == [("a tick", "800", "1,000", "1.25", "18.1")]
