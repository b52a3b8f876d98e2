"""What was learned is kept by path and arm, and offered again to both alone."""

import json
from dataclasses import replace

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.drawing.lines import in_place, line_through
from laptop.drawing.options import DrawingOptions
from laptop.drawing.preparing import prepare
from laptop.measure.ilc import stored_offsets
from laptop.measure.ilc.learning import Offsets, none
from laptop.measure.ilc.trials import DrawingLearner, LearningResult, TrialResult


def plan_of(points, arm=ARM):
    artwork = line_through(points)
    return prepare(artwork, arm, in_place(artwork, DrawingOptions()))


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    return plan_of([(10, 0), (8, 4)])


@pytest.fixture
def learned(plan):
    ((path,),) = DrawingLearner(plan).paths
    blank = none(path)
    offsets = Offsets(blank.s, blank.q + np.outer(np.sin(blank.s), [0.01, -0.02]))
    return LearningResult(
        [[offsets]], [TrialResult(1, 3.0, 5.0), TrialResult(2, 0.5, 0.9)], 0.3, "", False
    )


def test_what_was_kept_is_found_again(plan, learned):
    assert stored_offsets.find(plan) is None
    stored_offsets.store(plan, learned)
    found = stored_offsets.find(plan)
    assert (found.trials, found.without_mm, found.left_mm) == (2, 3.0, 0.5)
    ((offsets,),), ((own,),) = found.offsets, learned.offsets
    assert offsets.q == pytest.approx(own.q, abs=1e-6)


def test_another_path_and_another_arm_have_learned_nothing(plan, learned):
    stored_offsets.store(plan, learned)
    assert stored_offsets.find(plan_of([(10, 0), (8, 5)])) is None
    assert stored_offsets.find(plan_of([(10, 0), (8, 4)], ARM._replace(name="mine"))) is None


def test_of_the_emulated_arm_a_real_one_learns_nothing(plan, learned):
    stored_offsets.store(plan, learned, emulated="backlash=3")
    assert stored_offsets.find(plan) is None
    assert stored_offsets.find(plan, emulated="backlash=1") is None
    assert stored_offsets.find(plan, emulated="backlash=3")


def test_an_arm_with_other_numbers_begins_anew_and_can_compare(plan, learned):
    stored_offsets.store(plan, learned)
    joints = (ARM.joints[0]._replace(backlash=0.0), ARM.joints[1])
    found = stored_offsets.find(plan_of([(10, 0), (8, 4)], ARM._replace(joints=joints)))
    assert found.offsets is None
    assert found.without_mm == 3.0


def test_who_goes_on_remembers_how_it_began(plan, learned):
    stored_offsets.store(plan, learned)
    again = replace(learned, steps=[TrialResult(1, 0.4, 0.8)])
    stored_offsets.store(plan, again, before=stored_offsets.find(plan))
    found = stored_offsets.find(plan)
    assert (found.trials, found.without_mm, found.left_mm) == (3, 3.0, 0.4)


@pytest.mark.parametrize("spoil", ["", "[1, 2", "[]", '{"format": 1}', '{"format": 99}'])
def test_a_spoilt_file_is_told_and_is_no_error(plan, learned, spoil):
    stored_offsets.store(plan, learned).write_text(spoil)
    notes = []
    assert stored_offsets.find(plan, notes=notes) is None
    assert len(notes) == 1
    assert "is spoilt" in notes[0]


@pytest.mark.parametrize(
    "change",
    [
        lambda stored: stored["offsets"][0][0][1][0].__setitem__(3, float("nan")),
        lambda stored: stored.update(offsets=[[[[], [[], []]]]]),
        lambda stored: stored.update(rehearsals=float("inf")),
    ],
    ids=["no number", "no places", "endless rehearsals"],
)
def test_numbers_that_cannot_be_are_spoilt(plan, learned, change):
    file = stored_offsets.store(plan, learned)
    stored = json.loads(file.read_text())
    change(stored)
    file.write_text(json.dumps(stored))
    notes = []
    assert stored_offsets.find(plan, notes=notes) is None
    (note,) = notes
    assert "is spoilt" in note
