"""What is made of a disturbed run: by motions written by hand."""

import pytest

from laptop.emulator.faults import Fault
from tests.claims import faults
from tests.claims.fault_tasks import Motion, task

DRAWING = task(0, 0.0)
STEP = 0.005


def motion(speed, until, after=0.0, then=None):
    """The shoulder turns at `speed` (deg/s) until a time, from then on to `then` at `after`."""
    made = Motion()
    made.t = [k * STEP for k in range(401)]
    made.speeds = [
        [speed if t < until else after if t < (then or 0.0) else 0.0, 0.0] for t in made.t
    ]
    angle, made.q = 0.0, []
    for speeds in made.speeds:
        made.q.append([angle, 20.0])
        angle += speeds[0] * STEP
    made.counted["A"] = [(0.0, 0)]
    made.counted["A"] += [(n / speed, n) for n in range(1, int(speed * until))]
    made.counted["B"] = [(0.0, 0)]
    return made


HEALTHY = motion(30.0, 1.5)


def judged(disturbed, *struck, status=1):
    return faults.judge(DRAWING, struck, HEALTHY, status, disturbed, "draw: says so")


def test_a_dead_encoder_is_late_from_its_second_missing_count_on():
    result = judged(motion(30.0, 1.01, 100.0, 1.51), Fault("dead-encoder", "A", 1.0))
    second = 32 / 30.0  # at 1.0 it has counted 30 times
    assert result.rest == pytest.approx(1.505 - second, abs=STEP)
    assert result.late == pytest.approx(result.rest - 0.3)
    assert result.speed == 100.0
    assert result.allowed == 50.0
    most = 30.0 * 1.5  # as far as the plan goes
    assert result.beyond == pytest.approx(30 * 1.01 + 100 * 0.5 - most, abs=1)
    assert result.misses == ("time", "angle", "speed")


def test_a_joint_that_would_not_have_counted_is_not_late():
    result = judged(motion(30.0, 1.9), Fault("dead-encoder", "B", 1.0))
    assert (result.rest, result.late) == (None, 0.0)
    assert "time" not in result.misses


def test_what_ends_well_misses_nothing():
    assert judged(motion(90.0, 1.9), Fault("stall", "A", 1.0), status=0).misses == ()


def test_of_a_pair_that_counts_which_is_due_first():
    blind, killed = Fault("dead-encoder", "A", 1.0), Fault("kill", None, 1.1)
    soon = judged(motion(30.0, 1.3), blind, killed)
    assert soon.kind == "dead-encoder + kill"
    assert soon.misses == ()
    late = judged(motion(30.0, 1.45), blind, killed)  # in time for the second only
    assert late.misses == ("time",)
    idle = judged(motion(30.0, 1.45), blind._replace(what="B"), killed)
    assert idle.misses == ()


def test_pairs_come_in_motion_the_second_soon_after_the_first():
    pairs = faults.drawn_pairs(DRAWING, HEALTHY)
    assert len(pairs) == faults.FAULTS_PER_SEED
    for first, second in pairs:
        assert first.kind in faults.KINDS
        assert first.t < 1.52
        assert 0 <= second.t - first.t <= faults.PAIR_TIME
        assert second.kind != "frozen-picture"  # nothing watches a drawing
    assert pairs == faults.drawn_pairs(DRAWING, HEALTHY)


def test_a_named_fault_strikes_and_is_told():
    result = faults.run_named((0, "unplug", "A", 0.0))
    assert (result.command, result.fault, result.status) == ("draw", "unplug:A", 1)
    assert result.rest < 0.5
    assert "port A no longer answers" in result.text


def test_the_table_counts_what_missed_by_kind():
    late = judged(motion(30.0, 1.45), Fault("dead-encoder", "A", 1.0))
    well = judged(motion(30.0, 1.1), Fault("dead-encoder", "A", 1.0))
    rows = faults.table([late, well])
    assert [row[:6] for row in rows] == [
        ("all", "all", "dead-encoder", "2", "0", f"{late.rest:.2f}/{late.rest:.2f}"),
        ("planar", "draw", "dead-encoder", "2", "0", f"{late.rest:.2f}/{late.rest:.2f}"),
    ]
    assert [row[6] for row in rows] == ["1", "1"]
    assert [row[-2:] for row in rows] == [("0", "0")] * 2


def test_what_the_camera_told_is_counted_and_held_against_the_truth():
    seen = "does not count, though camera A sees it turn by about 9 deg: its encoder is dead"
    runs = [
        faults.judge(DRAWING, [Fault(kind, "A", 1.0)], HEALTHY, 1, motion(30.0, 1.1), text)
        for kind, text in (("dead-encoder", seen), ("stall", seen), ("stall", "blocked or dead"))
    ]
    rows = {row[2]: row[-2:] for row in faults.table(runs)}
    assert rows == {"dead-encoder": ("1", "0"), "stall": ("1", "1")}
