"""Which cameras a servo goes by: a table of what each has seen."""

import pytest

from robot.servoing.camera_selection import CameraSelection
from robot.servoing.measurement import MIN_SIGMA
from robot.servoing.rows import Rows

NOISE = {"A": 1.0, "B": 4.0, "C": 0.01}


def selection(joints, looks, explored=True):
    """A CameraSelection of cameras that were looked through so often."""
    chosen = CameraSelection(Rows("stereo", joints), joints)
    for camera, times in sorted(looks.items()):
        for _ in range(times):
            chosen.sample([camera], joints)
    while explored and not chosen.explored:
        chosen.next_joint()
    return chosen


@pytest.mark.parametrize(
    ("joints", "looks", "seeing", "used", "explored"),
    [
        (2, {"A": 2}, "A", "A", True),  # with this look it is known
        (2, {"A": 2, "B": 0}, "AB", "A", True),  # B has not seen the joints move yet
        (2, {"A": 2, "B": 2}, "AB", "AB", True),
        (2, {"A": 2, "B": 0}, "B", "B", False),  # nobody else: explore before its eyes
        (3, {"A": 3, "B": 0}, "AB", "AB", False),  # A alone tells too little of three joints
        (3, {"A": 3, "B": 3, "C": 1}, "ABC", "AB", True),
    ],
)
def test_it_goes_by_cameras_that_have_seen_every_joint_move(joints, looks, seeing, used, explored):
    chosen = selection(joints, looks)
    known = chosen.sample(list(seeing), joints)
    chosen.choose(list(seeing), known, NOISE.get)
    assert chosen.used == list(used)
    assert chosen.explored is explored


def test_it_tells_when_none_of_the_cameras_was_in_use():
    chosen = selection(2, {"A": 3, "B": 3})
    assert not chosen.choose(["A"], ["A"], NOISE.get)
    assert not chosen.choose(["A", "B"], ["A", "B"], NOISE.get)
    assert not chosen.choose(["B"], ["B"], NOISE.get)
    assert chosen.choose(["A"], ["A"], NOISE.get)


def test_each_camera_counts_by_its_noise_as_far_as_that_is_believed():
    chosen = selection(2, {"A": 3, "B": 3, "C": 3})
    chosen.choose(list("ABC"), list("ABC"), NOISE.get)
    assert chosen.weights == pytest.approx({"A": MIN_SIGMA, "B": MIN_SIGMA / 4, "C": 1.0})
    assert chosen.together({"A": (10.0, 20.0), "C": (1.0, 2.0)}) == pytest.approx([2, 4, 1, 2])


def test_joints_are_explored_one_after_the_other_and_forgotten():
    chosen = CameraSelection(Rows("stereo", 3), 3)
    assert [chosen.next_joint() for _ in range(3)] == [
        (0, [False, False, False]),
        (1, [True, False, False]),
        (2, [True, True, False]),
    ]
    assert chosen.explored
    assert chosen.sample(["A"], 3) == []
    chosen.forget()
    assert not chosen.explored
    assert CameraSelection(Rows("stereo", 3), 3, known=True).sample(["A"], 3) == ["A"]


def test_in_one_motion_every_joint_is_explored():
    chosen = CameraSelection(Rows("stereo", 2), 2)
    chosen.explored_all()
    assert chosen.explored
    assert [chosen.sample(["A"], 1) for _ in range(2)] == [[], ["A"]]
