"""What a job logs is where the motors truly were, and where the arm stood."""

import math
import os

import jobs
import pytest
from drawn_jobs import Drawn
from rig import described, switched_on

from robot.jobs.logbook import LogFile
from robot.motion.axis import SETTLING_TIME
from shared.job import Job
from shared.job_log import BadLog, LogRow, read_log

POSES = [[(9.0, 2.0), (12.0, 4.0)], [(12.0, 4.0), (14.0, -2.0)], [(14.0, -2.0), (9.0, 2.0)]]


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    monkeypatch.delenv("BRICKSERVO_PLAN", raising=False)


def logged(tmp_path, orders=(), **header):
    """The rig after a job that logs, its job, and what it logged."""
    arm = described("planar", backlash=0)
    path = jobs.write(tmp_path, POSES, arm, **header)
    file = str(tmp_path / "log.csv")
    with switched_on(tmp_path, arm) as rig:
        log = rig.its(LogFile)(file, 2)
        Drawn(rig, path, orders, log=log, dry=True).run()
        log.close()
    return rig, Job(path, arm), read_log(file)


def true_angles(rig, t):
    """Where the links truly were at a time, rad."""
    return min(rig.brick.record, key=lambda sample: abs(sample.t - t)).q


def test_where_the_motors_are_is_logged_by_the_jobs_own_time(tmp_path):
    rig, job, rows = logged(tmp_path, log=0.05)
    assert {row.stroke for row in rows} == {1, 2, 3}
    assert not any(row.rest for row in rows)
    for row in rows:
        assert max(abs(a - b) for a, b in zip(row.q, true_angles(rig, row.t))) < math.radians(1.5)
    for k in (1, 2, 3):
        stroke = job.stroke(k)
        plans = [row.plan for row in rows if row.stroke == k]
        assert plans == sorted(plans)
        assert plans[0] == pytest.approx(stroke.start_s, abs=0.1)
        seconds = sum(piece[0][-1] for piece in stroke.pieces)
        assert len(plans) > seconds / 0.06
        settling = stroke.start_s + seconds, stroke.start_s + seconds + SETTLING_TIME
        assert settling[0] - 0.1 < plans[-1] < settling[1]
    assert not rig.ink(), "the pen stays up"


def test_after_each_stroke_it_rests_and_logs_where(tmp_path):
    rig, _, rows = logged(tmp_path, rest=1.0)
    assert [(row.stroke, row.rest) for row in rows] == [(1, True), (2, True), (3, True)]
    for row in rows:
        there = true_angles(rig, row.t)
        assert max(abs(a - b) for a, b in zip(row.q, there)) < math.radians(0.6)
        before = true_angles(rig, row.t - 0.8)
        assert max(abs(a - b) for a, b in zip(before, there)) < math.radians(0.05)


def test_an_abort_in_a_rest_ends_it(tmp_path):
    _, _, rows = logged(tmp_path, orders=[(12.0, "abort")], rest=10.0)
    assert len(rows) <= 1


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here")
def test_a_log_that_has_no_room_is_told_by_its_name_before_anything_moves():
    with pytest.raises(BadLog, match="/dev/full: No space left on device; log to another file"):
        LogFile("/dev/full", 2)


def test_a_log_whose_room_is_used_up_is_told_by_its_name(tmp_path):
    log = LogFile(str(tmp_path / "a.csv"), 2)
    if os.path.exists("/dev/full"):
        full = os.open("/dev/full", os.O_WRONLY)
    else:
        full = os.open(str(tmp_path / "a.csv"), os.O_RDONLY)
    os.dup2(full, log._file.fileno())
    os.close(full)
    with pytest.raises(BadLog, match=r"a.csv: .*; log to another file"):
        log.add([LogRow(1, 0.0, 0.0, False, (0.0, 0.0))])
