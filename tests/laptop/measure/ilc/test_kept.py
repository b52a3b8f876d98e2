"""What was learned is kept by path and arm, and offered again to both alone."""

import json
from dataclasses import replace

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.drawing.lines import in_place, line_through
from laptop.drawing.options import DrawingOptions
from laptop.drawing.preparing import prepare
from laptop.measure.ilc import kept
from laptop.measure.ilc.learning import Offsets, none
from laptop.measure.ilc.rehearsal import Learned, Lessons, Step


def plan_of(points, arm=ARM):
    artwork = line_through(points)
    return prepare(artwork, arm, in_place(artwork, DrawingOptions()))


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    return plan_of([(10, 0), (8, 4)])


@pytest.fixture
def learned(plan):
    ((way,),) = Lessons(plan).paths
    blank = none(way)
    offsets = Offsets(blank.s, blank.q + np.outer(np.sin(blank.s), [0.01, -0.02]))
    return Learned([[offsets]], [Step(1, 3.0, 5.0), Step(2, 0.5, 0.9)], 0.3, "", False)


def test_what_was_kept_is_found_again(plan, learned):
    assert kept.find(plan) is None
    kept.keep(plan, learned)
    found = kept.find(plan)
    assert (found.rehearsals, found.without_mm, found.left_mm) == (2, 3.0, 0.5)
    ((offsets,),), ((own,),) = found.offsets, learned.offsets
    assert offsets.q == pytest.approx(own.q, abs=1e-6)


def test_another_path_and_another_arm_have_learned_nothing(plan, learned):
    kept.keep(plan, learned)
    assert kept.find(plan_of([(10, 0), (8, 5)])) is None
    assert kept.find(plan_of([(10, 0), (8, 4)], ARM._replace(name="mine"))) is None


def test_of_the_emulated_arm_a_real_one_learns_nothing(plan, learned):
    kept.keep(plan, learned, emulated="backlash=3")
    assert kept.find(plan) is None
    assert kept.find(plan, emulated="backlash=1") is None
    assert kept.find(plan, emulated="backlash=3")


def test_an_arm_with_other_numbers_begins_anew_and_can_compare(plan, learned):
    kept.keep(plan, learned)
    joints = (ARM.joints[0]._replace(backlash=0.0), ARM.joints[1])
    found = kept.find(plan_of([(10, 0), (8, 4)], ARM._replace(joints=joints)))
    assert found.offsets is None
    assert found.without_mm == 3.0


def test_who_goes_on_remembers_how_it_began(plan, learned):
    kept.keep(plan, learned)
    again = replace(learned, steps=[Step(1, 0.4, 0.8)])
    kept.keep(plan, again, before=kept.find(plan))
    found = kept.find(plan)
    assert (found.rehearsals, found.without_mm, found.left_mm) == (3, 3.0, 0.4)


@pytest.mark.parametrize("spoil", ["", "[1, 2", "[]", '{"format": 1}', '{"format": 99}'])
def test_a_spoilt_file_is_told_and_is_no_error(plan, learned, spoil):
    kept.keep(plan, learned).write_text(spoil)
    notes = []
    assert kept.find(plan, notes=notes) is None
    assert len(notes) == 1
    assert "is spoilt" in notes[0]


@pytest.mark.parametrize(
    "change",
    [
        lambda told: told["offsets"][0][0][1][0].__setitem__(3, float("nan")),
        lambda told: told.update(offsets=[[[[], [[], []]]]]),
        lambda told: told.update(rehearsals=float("inf")),
    ],
    ids=["no number", "no places", "endless rehearsals"],
)
def test_numbers_that_cannot_be_are_spoilt(plan, learned, change):
    file = kept.keep(plan, learned)
    told = json.loads(file.read_text())
    change(told)
    file.write_text(json.dumps(told))
    notes = []
    assert kept.find(plan, notes=notes) is None
    (note,) = notes
    assert "is spoilt" in note
