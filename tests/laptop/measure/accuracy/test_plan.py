"""The test's cube and its poses, and the jobs that lead there."""

import numpy as np
import pytest
from arms import ARMS

from laptop.measure.accuracy.plan import BadAccuracyPlan, plan_accuracy
from robot.motion import kinematics
from shared.job import Job

CENTRES = {"planar": (14.0, 0.0), "geared": (14.0, 0.0), "spatial": (14.0, 0.0, 11.0)}
"""Where they have room."""


def test_in_the_plane_the_poses_are_the_middle_and_four_corners_of_the_square():
    plan = plan_accuracy(ARMS["planar"], 5, 10.0, (14.0, 0.5))
    assert plan.poses == pytest.approx(
        np.array([(14, 0.5), (10, -3.5), (18, -3.5), (18, 4.5), (10, 4.5)])
    )


def test_in_space_the_poses_lie_on_two_diagonals_of_the_cube():
    plan = plan_accuracy(ARMS["spatial"], 5, 8.0, CENTRES["spatial"])
    off = plan.poses - plan.centre
    assert off[0] == pytest.approx(np.zeros(3))
    assert np.abs(off[1:]) == pytest.approx(np.full((4, 3), 3.2)), "a tenth from the corners"
    assert off[1] == pytest.approx(-off[3])
    assert off[2] == pytest.approx(-off[4])
    normal = np.cross(off[1], off[2])
    assert off @ normal == pytest.approx(np.zeros(5)), "in one plane"


@pytest.mark.parametrize("name", ARMS)
def test_each_pose_is_approached_from_directions_that_leave_out_no_side(name):
    plan = plan_accuracy(ARMS[name], 3, None, CENTRES[name])
    assert np.linalg.norm(plan.directions, axis=1) == pytest.approx(np.ones(len(plan.directions)))
    assert plan.directions.sum(axis=0) == pytest.approx(np.zeros(len(plan.centre)), abs=1e-12)
    assert np.linalg.matrix_rank(plan.directions) == len(plan.centre)


@pytest.mark.parametrize("name", ARMS)
def test_jobs_lead_to_the_poses_in_order_and_can_be_done(name, tmp_path):
    arm = ARMS[name]
    plan = plan_accuracy(arm, 3, None, CENTRES[name])
    parts = plan.parts()
    assert list(parts) == ["poses", "directions", *(f"paths at {n} %" for n in (100, 50, 10))]
    file = tmp_path / "a.job"
    header = plan.write_job(file, "poses", parts["poses"])
    assert (header.strokes, header.rest) == (15, 1.0)
    job = Job(str(file), arm)
    ends = [kinematics.forward(arm, job.stroke(k).pieces[-1][2]) for k in range(1, 16)]
    order = [plan.pose(number) for number in (5, 4, 3, 2, 1)] * 3
    assert np.array(ends) == pytest.approx(np.array(order), abs=1e-4)
    header = plan.write_job(file, "directions", parts["directions"])
    assert header.strokes == 3 * 3 * (len(plan.centre) + 1)
    for k in range(1, header.strokes + 1):
        Job(str(file), arm).stroke(k)  # within limits
    slow = plan.write_job(file, "paths", parts["paths at 10 %"])
    assert (slow.strokes, slow.rest, slow.log) == (6, 0.3, 0.1)
    assert slow.seconds > plan.write_job(file, "paths", parts["paths at 100 %"]).seconds


def test_thirty_cycles_of_poses_are_ten_of_paths():
    assert [plan_accuracy(ARMS["planar"], n).path_cycles for n in (3, 12, 30)] == [3, 4, 10]


@pytest.mark.long
def test_room_is_found_in_space():
    plan = plan_accuracy(ARMS["spatial"], 3)
    assert plan.side >= 9.0
    assert plan.centre[2] > plan.side / 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"cycles": 2}, "2 cycles: give 3 to 100"),
        ({"side": 1.0}, "a cube of 1 cm: give 2 to 60 cm"),
        ({"side": 30.0}, "no room for a test square of 30 cm anywhere: its largest there is 11"),
        ({"centre": (30.0, 0.0)}, r"no room for a test square at 30,0 cm: .* give another --at"),
        ({"centre": (14.0, 0.0, 3.0)}, "centre 14,0,3: give 2 numbers, x,y in cm"),
        ({"centre": (float("nan"), 0.0)}, "centre nan,0: give 2 numbers"),
    ],
)
def test_what_the_arm_cannot_do_is_refused(options, said):
    with pytest.raises(BadAccuracyPlan, match=said):
        plan_accuracy(ARMS["planar"], **options)
