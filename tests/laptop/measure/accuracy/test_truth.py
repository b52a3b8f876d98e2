"""The truth by an emulated arm's record."""

from collections import namedtuple

import numpy as np
import pytest

from laptop.measure.accuracy.plan import PlannedMotion
from laptop.measure.accuracy.truth import in_nearest_frame, true_places
from laptop.measure.run_data import RunData
from laptop.see.table.plane_motion import rotation
from shared.job_log import LogRow

Sample = namedtuple("Sample", ["t", "x", "y", "z"])
PATH = np.array([(0.0, 0.0), (1.0, 0.0)])
RUN = RunData(
    [
        LogRow(1, 0.0, 1.0, False, (0.0, 0.0)),
        LogRow(1, 0.0, 3.0, True, (0.0, 0.0)),
        LogRow(2, 0.0, 3.2, False, (0.0, 0.0)),
        LogRow(2, 0.0, 5.0, True, (0.0, 0.0)),
    ],
    1.0,
    {},
)


def true_motions(motions, z=None):
    record = [Sample(t, t, 10 * t, z) for t in np.arange(0.0, 6.0, 0.125)]
    return list(true_places(record, motions, RUN))


def test_a_pose_is_where_the_tip_was_in_the_second_half_of_its_rest():
    (_, places), _ = true_motions([PlannedMotion("pose", k, 0, 1.0, PATH) for k in (1, 2)])
    # 2.625, 2.75, 2.875, 3.0 s
    assert places.points == pytest.approx(np.array([(2.8125, 28.125)]))
    assert not places.noise.any()
    assert places.common.shape == (1, 2, 0)


def test_a_path_is_where_the_tip_was_from_its_beginning_to_its_rest():
    motions = [PlannedMotion("path", k, 0, 1.0, PATH) for k in (0, 0)]
    (_, first), (_, second) = true_motions(motions, z=4.0)
    assert first.points[:, 0] == pytest.approx(np.arange(1.0, 2.01, 0.125))
    assert second.points[:, 0] == pytest.approx(np.arange(3.25, 4.01, 0.125))
    assert (first.points[:, 2] == 4.0).all()


def test_in_the_nearest_frame_an_arm_that_is_turned_as_a_whole_is_right():
    commanded = np.array([(10.0, 0.0), (14.0, 3.0), (12.0, -4.0)])
    motions = [
        PlannedMotion("pose", k, 0, 1.0, np.array([(0, 0), p])) for k, p in enumerate(commanded)
    ]
    attained = commanded @ rotation(0.02, 2).T + (0.1, -0.2)
    truth = list(true_places([], [], RUN))
    _, like = true_motions([PlannedMotion("pose", k, 0, 1.0, PATH) for k in (1, 2)])[0]
    truth = [
        (motion, like._replace(points=point[None]))
        for motion, point in zip(motions, attained, strict=True)
    ]
    found = np.concatenate([places.points for _, places in in_nearest_frame(truth)])
    assert found == pytest.approx(commanded)
