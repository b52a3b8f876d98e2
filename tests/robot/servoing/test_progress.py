"""Whether moves lead to a goal, and what is done if not: the table of actions."""

import pytest

from robot.servoing import progress
from robot.servoing.progress import (
    DIVERGED_ERROR,
    DIVERGING_MOVES,
    EXPLORE_ANEW,
    GIVE_UP,
    GO_ON,
    IMPROVED_SHARE,
    MAX_RESTARTS,
    MAX_STALLS,
    STAGNANT_MOVES,
    STAGNANT_MOVES_NEAR,
    START_ELSEWHERE,
    TRY_POSTURE,
    Progress,
)

TOLERANCE = 5.0

ERRORS = [
    ("it gets nearer", [100, 80, 60, 40, 20], GO_ON),
    ("nearer by just too little", [100] + [91] * (STAGNANT_MOVES - 1), GO_ON),
    ("for so long", [100] + [91] * STAGNANT_MOVES, START_ELSEWHERE),
    ("nearer by just enough", [100] + [100 * 0.899] + [89] * (STAGNANT_MOVES - 1), GO_ON),
    ("near the goal it may take longer", [14] + [14] * (STAGNANT_MOVES_NEAR - 1), GO_ON),
    ("but not for ever", [14] + [14] * STAGNANT_MOVES_NEAR, START_ELSEWHERE),
    ("near is within three tolerances", [15.1] + [15.1] * STAGNANT_MOVES, START_ELSEWHERE),
    ("farther off, but not by much", [50] + [89.9] * DIVERGING_MOVES, GO_ON),
    ("farther and farther off", [50] + [90.1] * DIVERGING_MOVES, EXPLORE_ANEW),
    ("not so often in a row", [50, 90.1, 90.1, 60], GO_ON),
]


@pytest.mark.parametrize(
    ("errors", "action"), [row[1:] for row in ERRORS], ids=[r[0] for r in ERRORS]
)
def test_what_is_done_by_the_errors_of_a_course(errors, action):
    progress = Progress(TOLERANCE)
    for off in errors[:-1]:
        assert progress.assess(off) == GO_ON
    assert progress.assess(errors[-1]) == action


def test_who_knows_the_image_has_nothing_to_explore_anew():
    progress = Progress(TOLERANCE, known=True)
    assert [progress.assess(off) for off in [50] + [90.1] * DIVERGING_MOVES] == [GO_ON] * (
        1 + DIVERGING_MOVES
    )


def stuck(progress, off):
    """The action when a start has ended so far off, px."""
    for _ in range(STAGNANT_MOVES):
        assert progress.assess(off) == GO_ON
    action = progress.assess(off)
    progress.begin_elsewhere()
    return action


@pytest.mark.parametrize(
    ("ends", "actions"),
    [
        ([100, 104, 97], [START_ELSEWHERE, START_ELSEWHERE, GIVE_UP]),
        ([100, 120, 144], [START_ELSEWHERE] * 3),  # not alike
        ([29.9] * 4, [START_ELSEWHERE] * 4),  # not far
        ([30.1] * 3, [START_ELSEWHERE, START_ELSEWHERE, GIVE_UP]),
        ([100, 150, 225, 340, 510], [START_ELSEWHERE] * MAX_RESTARTS + [GIVE_UP]),
    ],
)
def test_when_starts_from_elsewhere_end(ends, actions):
    progress = Progress(TOLERANCE)
    assert [stuck(progress, off) for off in ends] == actions
    assert progress.nearest == min(ends)


def test_a_course_that_stalls_is_checked_by_exploring_before_another_posture_is_tried():
    progress = Progress(TOLERANCE)
    actions = [progress.assess_stall(40.0, 0.1) for _ in range(MAX_STALLS + 2)]
    assert actions == [GO_ON] * MAX_STALLS + [EXPLORE_ANEW, TRY_POSTURE]
    progress.begin_elsewhere()
    assert progress.assess_stall(40.0, 0.1) == GO_ON
    known = Progress(TOLERANCE, known=True)
    assert [known.assess_stall(40.0, 0.1) for _ in range(MAX_STALLS + 1)][-1] == TRY_POSTURE


@pytest.mark.parametrize(("left", "wrong"), [(TOLERANCE, 0.1), (40.0, progress.RIGHT_SHARE)])
def test_no_course_is_given_up_by_a_model_that_was_wrong_or_that_comes_near_enough(left, wrong):
    progress = Progress(TOLERANCE)
    assert {progress.assess_stall(left, wrong) for _ in range(20)} == {GO_ON}


@pytest.mark.parametrize(
    ("off", "left", "stalls"),
    [(100, 90.1, True), (100, 89.9, False), (4, 5.1, True), (4, 4.9, False), (100, 5.0, False)],
)
def test_when_a_course_is_none(off, left, stalls):
    assert Progress(TOLERANCE).stalls(off, left) is stalls


def test_near_the_goal_steps_get_shorter_if_they_lead_nowhere():
    progress = Progress(TOLERANCE)
    gains = []
    for _ in range(4):
        progress.assess(10.0)
        gains.append(progress.gain)
    assert gains == pytest.approx([1, 1 / 1.5, 1 / 2, 1 / 2.5])
    far = Progress(TOLERANCE)
    for _ in range(4):
        far.assess(100.0)
    assert far.gain == 1.0


def test_a_detour_and_exploring_begin_the_count_anew():
    progress = Progress(TOLERANCE)
    for off in [50] + [90.1] * (DIVERGING_MOVES - 1):
        progress.assess(off)
    progress.detour()
    assert progress.assess(300.0) == GO_ON
    progress.target_pose = (1.0, 2.0)
    progress.begin_exploring()
    assert progress.target_pose is None
    assert progress.assess(500.0 + DIVERGED_ERROR) == GO_ON
    assert IMPROVED_SHARE < 1
