"""What was learned of a stroke becomes part of its plan, or is refused before anything moves."""

import math

import jobs
import pytest

from robot.jobs.learned import MAX_OFFSET, merged
from robot.motion.trajectory import Trajectory
from shared.arm_description import find_arm, read_arm
from shared.job import BadJob, Job

ARM = read_arm(find_arm("planar"))
LENGTH = math.sqrt(32)


@pytest.fixture
def stroke(tmp_path):
    return Job(jobs.write(tmp_path, [[(9.0, 2.0), (13.0, 6.0)]]), ARM).stroke(1)


def learned(stroke, shoulder, stations=(0.0, 2.0, 4.0, LENGTH)):
    return stroke._replace(offsets=[(list(stations), [list(shoulder), [0.0] * len(stations)])])


def test_a_stroke_without_offsets_stays_what_it_is(stroke):
    assert merged("job", 1, stroke, ARM.joints) is stroke.pieces


def test_each_joint_goes_by_its_offset_beside_its_plan(stroke):
    (piece,) = merged("job", 1, learned(stroke, (0.01, 0.02, 0.03, 0.03828427)), ARM.joints)
    (before,) = stroke.pieces
    plan, now = Trajectory(*before), Trajectory(*piece)
    assert now.start[0] - plan.start[0] == pytest.approx(0.01)
    assert now.end[0] - plan.end[0] == pytest.approx(0.03828427)
    times, segments, _ = before
    done = 0.0
    for t, t_end, (v, a, _, _) in zip(times, times[1:], segments):
        done += (t_end - t) * (v + 0.5 * a * (t_end - t))
        off = [y - x for x, y in zip(plan.at(t_end - 1e-9)[0], now.at(t_end - 1e-9)[0])]
        # The offsets are 0.01 and a two-hundredth a centimetre: a straight line stays one.
        assert off == pytest.approx([0.01 + 0.005 * done, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("shoulder", "stations", "what"),
    [
        ((0.0, 1.1 * MAX_OFFSET), (0.0, LENGTH), "a joint is moved by 22.0 deg"),
        ((0.0, 0.0), (0.0, 9.0), "they are of 9.00 cm, and a piece has 5.66"),
        ((0.0, 0.0, 0.0), (0.0, 3.0, 3.0), "their places do not go on"),
        ((0.0,), (0.0,), "1 offsets of a piece"),
        ((0.0, 0.0, 0.2, 0.0, 0.0), (0.0, 2.5, 2.8, 3.1, LENGTH), "deg/s.2 of a joint"),
    ],
)
def test_what_does_not_fit_is_refused(stroke, shoulder, stations, what):
    with pytest.raises(BadJob, match=what):
        merged("job", 1, learned(stroke, shoulder, stations), ARM.joints)


def test_limits_hold_for_what_is_learned(stroke):
    shoulder, elbow = ARM.joints
    joints = [shoulder._replace(upper=stroke.pieces[0][2][0] + 0.02), elbow]
    merged("job", 1, stroke, joints)
    with pytest.raises(BadJob, match="needs the shoulder at"):
        merged("job", 1, learned(stroke, (0.0, 0.05, 0.1, 0.15)), joints)
