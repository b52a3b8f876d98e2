"""A board or camera that moves between two trials is reported; one that is covered is not."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from board_views import stand, view

from laptop.measure.ilc import still_table
from laptop.measure.ilc.still_table import StillTable
from laptop.measure.run_data import BadMeasurement
from laptop.see.table.camera_fit import calibrate

PLACE = stand(45.0, 25.0)


@pytest.fixture
def table(monkeypatch):
    rng = np.random.default_rng(1)
    done = []
    rig = SimpleNamespace(arm=None, measure=lambda job, dry: done.append(job) or "a run")
    known = calibrate([view(PLACE, rng)])
    shown = [view(PLACE, rng)]
    monkeypatch.setattr(still_table, "find_board", lambda image: shown[0])
    return StillTable(rig, known, lambda: None, "the first look"), shown, rng


def test_what_stands_lets_the_run_through(table):
    still, _, _ = table
    assert still.measure(Path("a.job")) == "a run"


def test_what_has_moved_is_told(table):
    still, shown, rng = table
    shown[0] = view(stand(45.0, 25.0, at=(0.5, 0.0)), rng)
    with pytest.raises(BadMeasurement, match=r"moved by [45]\.\d mm since the first look: lay"):
        still.measure(Path("a.job"))


def test_what_is_covered_is_not_said_to_have_moved(table):
    still, shown, rng = table
    shown[0] = None
    assert still.measure(Path("a.job")) == "a run"
    shown[0] = view(stand(45.0, 25.0, at=(0.5, 0.0)), rng, keep=lambda x, y: x == y)
    assert len(shown[0].numbers) < 2
    assert still.measure(Path("a.job")) == "a run"
