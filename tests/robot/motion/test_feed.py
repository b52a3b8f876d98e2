"""A plan at another rate goes the same way, and what is left of it is the same way, too."""

import math

import pytest

from robot.motion import kinematics, paths, trajectory
from robot.motion.backlash import BacklashCompensation
from robot.motion.feed import (
    HOLD_TIME,
    MAX_RAMP_TIME,
    MIN_RAMP_TIME,
    RATE_PERIOD,
    FeedOverride,
    remaining,
    time_at_same_place,
    with_speed_limit,
)
from robot.motion.online_trajectory import STOP
from shared.arm_description import JOINT_ACCELERATION, find_arm, joint_accelerations, read_arm

ARM = read_arm(find_arm("planar"))
LINE = [(10.0, 0.0), (5.0, 10.0)]
CURVE = [(11 + 3 * math.cos(k / 10), 4 + 3 * math.sin(k / 10)) for k in range(50)]


def planned(points):
    """(its pieces' numbers, a plan of the first) of a stroke."""
    (motion,) = trajectory.plan(ARM, paths.pieces_of(points))
    piece = motion.numbers()
    return piece, BacklashCompensation(ARM.joints, trajectory.Trajectory(*piece), (1, -1))


def fed(plan, rate=1.0, look=lambda now: 1.0):
    feed = FeedOverride(look)
    feed.begin_at(rate)
    assert next(feed.each([plan])) is feed
    return feed


def test_at_full_rate_nothing_changes():
    _, plan = planned(LINE)
    feed = fed(plan)
    assert feed.duration == pytest.approx(plan.duration)
    assert feed.before == plan.before
    for k in range(-10, 101):
        t = k / 100 * plan.duration
        assert feed.at(t)[0] == pytest.approx(plan.at(t)[0])
        assert feed.speeds(t) == pytest.approx(plan.speeds(t), abs=1e-5)  # rounded at the end
        assert feed.sides_at(t) == plan.sides_at(t)


@pytest.mark.parametrize("rates", [[0.4], [0.0], [0.0, 1.0], [0.3, 0.9, 0.1]])
def test_speeds_are_how_fast_the_place_changes_whatever_is_ordered(rates):
    _, plan = planned(CURVE)
    feed = fed(plan)
    for k, rate in enumerate(rates):
        begin = 0.3 * plan.duration + 0.11 * k
        feed.order(begin, rate)
        for n in range(1, 100):  # not where the law changes
            t = begin + 0.0011 * n + 1e-5
            h = 1e-6
            slope = [(b - a) / (2 * h) for a, b in zip(feed.at(t - h)[0], feed.at(t + h)[0])]
            assert feed.speeds(t) == pytest.approx(slope, abs=2e-3)


def test_a_slower_plan_takes_as_much_longer():
    _, plan = planned(LINE)
    feed = fed(plan, rate=0.5)
    assert feed.duration + feed.before == pytest.approx(2 * (plan.duration + plan.before))
    assert feed.rests_from == [feed.duration] * 2
    feed.order(0.0, 1.0)
    assert 1.0 < feed.duration / plan.duration < 2.0
    assert feed.at(feed.duration)[0] == pytest.approx(plan.at(plan.duration)[0])
    assert feed.speeds(feed.duration + 1e-9) == [0.0, 0.0]


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.97])
def test_a_hold_comes_to_rest_on_the_path_and_ends_the_motion(share):
    _, plan = planned(LINE)
    feed = fed(plan, look=lambda now: 0.0)
    t = share * plan.duration
    assert feed.tick(t, 100.0, None) is None
    assert feed.held
    ramp = feed.duration - t
    assert ramp <= MAX_RAMP_TIME + 1e-9
    if 0.1 < share < 0.9:
        assert ramp >= MIN_RAMP_TIME
    assert feed.at(feed.duration)[0] == pytest.approx(plan.at(feed.tau)[0])
    assert share * plan.duration < feed.tau < share * plan.duration + ramp
    assert feed.speeds(feed.duration + 0.01) == [0.0, 0.0]
    assert feed.tick(feed.duration + HOLD_TIME / 2, 200.0, None) is None
    assert feed.tick(feed.duration + 1.1 * HOLD_TIME, 201.0, None) is STOP


def test_no_joint_slows_down_harder_than_a_plan_does_unless_that_took_too_long():
    _, plan = planned(LINE)
    for share in (0.2, 0.5, 0.8):
        feed = fed(plan)
        t = share * plan.duration
        feed.order(t, 0.0)
        ramp = feed.duration - t
        hardest = max(map(abs, plan.speeds(t))) / ramp
        soft = hardest <= JOINT_ACCELERATION * 1.001
        assert soft or ramp == pytest.approx(MAX_RAMP_TIME)


def test_the_rate_is_asked_for_now_and_then_only():
    _, plan = planned(LINE)
    asked = []
    feed = fed(plan, look=lambda now: asked.append(now) or 1.0)
    for k in range(50):
        feed.tick(0.02 * k, 7 + 0.02 * k, None)
    assert 1.0 / RATE_PERIOD * 0.6 < len(asked) <= 1.0 / RATE_PERIOD + 1
    assert feed.reached == pytest.approx(asked[-1] - 7)


def test_after_a_hold_no_further_plan_is_taken():
    (_, first), (_, second) = planned(LINE), planned(CURVE)
    feed = FeedOverride(lambda now: 1.0)
    seen = []
    for one in feed.each([first, second]):
        seen.append(one.index)
        one.order(0.5, 0.0)
    assert seen == [0]
    assert feed.held
    feed.begin_at(1.0)
    assert [one.index for one in feed.each([first, second])] == [0, 1]
    assert feed.index == 2


# What is left


def length(piece, n=400):
    """Places of the tip, cm, at equal times."""
    motion = trajectory.Trajectory(*piece)
    return [kinematics.forward(ARM, motion.at(k / n * motion.duration)[0]) for k in range(n + 1)]


def off(p, points):
    """Distance of a point from the nearest of some, cm."""
    return min(math.hypot(p[0] - x, p[1] - y) for x, y in points)


@pytest.mark.parametrize("points", [LINE, CURVE], ids=["line", "curve"])
@pytest.mark.parametrize("share", [0.03, 0.31, 0.5, 0.77, 0.93, 0.975])
def test_what_is_left_is_the_same_way_begun_at_rest(points, share):
    piece, _ = planned(points)
    full = trajectory.Trajectory(*piece)
    tau = share * full.duration
    rest = trajectory.Trajectory(*remaining(piece, tau))
    # (Where next to nothing is left before a knot, it begins there.)
    begin = kinematics.forward(ARM, rest.start), kinematics.forward(ARM, full.at(tau)[0])
    assert kinematics.distance(*begin) <= 0.0051
    assert rest.end == full.end
    assert max(map(abs, rest.speeds(1e-4))) < math.radians(0.2)
    fine = [q for t, q in zip(range(4001), length(piece, 4000)) if t / 4000 >= share - 0.001]
    for p in length(rest.numbers(), 60):
        assert off(p, fine) < 0.012
    # No faster than it was anywhere, but that it speeds up where it did not.
    fastest = max(max(map(abs, full.speeds(k / 200 * full.duration))) for k in range(200))
    for k in range(1, 300):
        t = k / 300 * rest.duration
        assert max(map(abs, rest.speeds(t))) <= fastest * 1.001
        h = 1e-4
        hard = [abs(b - a) / h for a, b in zip(rest.speeds(t), rest.speeds(t + h))]
        for harder, most in zip(hard, joint_accelerations(ARM.joints)):
            assert harder < most * 1.6


def test_before_the_start_all_is_left_and_at_the_end_nothing():
    piece, plan = planned(LINE)
    assert remaining(piece, -0.1) == piece
    assert remaining(piece, plan.duration) is None
    assert remaining(piece, plan.duration - 1e-3) is None


def test_a_piece_whose_speeds_do_not_fit_is_slowed_all_the_same():
    still = [(0.0, 0.0, 0.0, 0.0)] * 2
    ends = [(1.0, -1.0, still, None), (1.0, -1.0, still, None)]  # it stands where the next begins
    for piece in (([0.0, 1.0], [(0.0, 1.0, still, None)], (0, 0)), ([0.0, 1.0, 2.0], ends, (0, 0))):
        times = with_speed_limit(piece, 0.25)[0]
        assert all(b > a for a, b in zip(times, times[1:]))


@pytest.mark.parametrize("points", [LINE, CURVE], ids=["line", "curve"])
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_a_slowed_piece_is_the_same_way_and_speeds_up_as_hard(points, share):
    piece, _ = planned(points)
    slow = with_speed_limit(piece, share)
    full, motion = trajectory.Trajectory(*piece), trajectory.Trajectory(*slow)
    assert motion.start == full.start
    assert motion.end == full.end
    assert full.duration < motion.duration < full.duration / share + 1e-9
    top = max(v for v, _, _, _ in piece[1])
    for k in range(1, 200):
        t = k / 200 * motion.duration
        raw = time_at_same_place(piece, slow, t)
        assert motion.at(t)[0] == pytest.approx(full.at(raw)[0], abs=1e-6)
        h = 1e-3
        tip = [kinematics.forward(ARM, motion.at(x)[0]) for x in (t - h, t + h)]
        assert kinematics.distance(*tip) / (2 * h) < share * top * 1.02
    assert time_at_same_place(piece, slow, motion.duration) == pytest.approx(full.duration)
    assert time_at_same_place(piece, slow, -0.1) == -0.1
    assert with_speed_limit(piece, 1.0)[0] == pytest.approx(piece[0], rel=1e-4)
