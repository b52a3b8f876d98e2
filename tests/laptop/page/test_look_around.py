"""Looking around brings the tip to where a picture's table can be learned from."""

import math

import numpy as np
import pytest

from laptop.page.look_around import survey_job
from laptop.page.table_mapping import TableMapping
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm
from shared.job import Job


def tips(job, arm):
    """Where the tip is at every knot of a job, cm."""
    found = []
    for k in range(1, job.header.strokes + 1):
        for _, segments, end in job.stroke(k).pieces:
            found += [[cubic[0] for cubic in segment[2]] for segment in segments] + [list(end)]
    return np.array([kinematics.forward(arm, q) for q in found])


@pytest.mark.parametrize("name", ["planar", "geared", "spatial"])
def test_what_it_visits_tells_where_the_table_is(name, tmp_path):
    arm = read_arm(find_arm(name))
    header = survey_job(arm, tmp_path / "look.job")
    places = tips(Job(str(tmp_path / "look.job"), arm), arm)
    assert header.seconds < 60
    _, reach = kinematics.reach(arm)
    assert np.hypot(*places[:, :2].T).max() < reach
    if places.shape[1] == 3:
        assert places[:, 2].min() > 1.5, "it keeps off the table"
    mapping = TableMapping(reach)
    for x, y, *z in places:
        depth = 60 - (z[0] if z else 0.0) + 0.2 * x
        mapping.add((x, y, *z), (320 + 600 * x / depth, 240 - 600 * y / depth), 10.0)
    assert mapping.view is not None, mapping.why
    asked = np.array([[12.0, 5.0], [15.0, -5.0]])
    wanted = [(320 + 600 * x / (60 + 0.2 * x), 240 - 600 * y / (60 + 0.2 * x)) for x, y in asked]
    assert mapping.view.to_picture(asked) == pytest.approx(np.array(wanted), abs=0.01)


def test_an_arm_that_turns_little_looks_around_within_what_it_can(tmp_path):
    arm = read_arm(find_arm("planar"))
    first = arm.joints[0]._replace(lower=math.radians(20), upper=math.radians(70))
    arm = arm._replace(joints=(first, *arm.joints[1:]))
    survey_job(arm, tmp_path / "look.job")
    Job(str(tmp_path / "look.job"), arm).stroke(1)  # within its limits
