"""Kinematics against hand-computed poses, numerical differences and numpy."""

import itertools
import math

import pytest

from robot.motion.kinematics import (
    Unreachable,
    branches,
    forward,
    inverse,
    jacobian,
    joint_positions,
    singularity,
)
from shared.arm_description import ArmError, find_arm, read_arm

ARM = read_arm(find_arm("planar"))


def with_limits(*limits, **changes):
    """The planar arm with other limits, deg, and other fields."""
    joints = tuple(
        joint._replace(lower=math.radians(lower), upper=math.radians(upper))
        for joint, (lower, upper) in zip(ARM.joints, limits)
    )
    return ARM._replace(joints=joints, **changes)


FREE = with_limits((-180, 180), (-180, 180))


def radians(*angles):
    return tuple(map(math.radians, angles))


def degrees(q):
    return tuple(map(math.degrees, q))


# By hand, with the cosine rule, links 11.3 and 9.5 cm: point, elbow up, deg; down is its mirror
# image at the line from the shoulder to the point.
POSES = [
    ((10, 0), (-52.5448, 123.3207)),
    ((15, 0), (-39.2711, 88.1156)),
    ((0, 15), (50.7289, 88.1156)),
    ((5, 10), (13.4418, 115.6507)),
    ((12, 15), (30.7653, 45.2845)),
    ((20.8, 0), (0, 0)),
]
POSE_IDS = ["{},{}".format(*point) for point, _ in POSES]


@pytest.mark.parametrize(("point", "q"), POSES, ids=POSE_IDS)
def test_forward_and_inverse_by_hand(point, q):
    assert forward(ARM, radians(*q)) == pytest.approx(point, abs=1e-4)
    assert degrees(inverse(ARM, point, elbow="up")) == pytest.approx(q, abs=1e-4)
    mirrored = 2 * math.degrees(math.atan2(point[1], point[0])) - q[0]
    assert degrees(inverse(ARM, point, elbow="down")) == pytest.approx((mirrored, -q[1]), abs=1e-4)


def test_joint_positions_run_from_the_shoulder_to_the_tip():
    shoulder, elbow, tip = joint_positions(ARM, radians(90, -90))
    assert shoulder == (0, 0)
    assert elbow == pytest.approx((0, 11.3))
    assert tip == pytest.approx((9.5, 11.3))
    assert tip == forward(ARM, radians(90, -90))


GRID = list(itertools.product(range(-90, 171, 20), range(-150, 151, 20)))


def test_inverse_comes_back_to_every_pose():
    for pose in GRID:
        q = radians(*pose)
        elbow = "up" if q[1] > 0 else "down"
        assert inverse(ARM, forward(ARM, q), elbow=elbow) == pytest.approx(q, abs=1e-9)


def test_every_branch_leads_to_the_point_within_the_limits():
    both = 0
    for pose in GRID:
        point = forward(ARM, radians(*pose))
        found = branches(ARM, point)
        both += len(found) == 2
        for q in found:
            assert forward(ARM, q) == pytest.approx(point, abs=1e-9)
            assert all(j.lower <= a <= j.upper for j, a in zip(ARM.joints, q))
    assert both > len(GRID) / 2


def test_branches_start_with_the_preferred_elbow():
    up, down = branches(ARM, (10, 0))
    assert up[1] > 0 > down[1]
    assert branches(ARM._replace(elbow="down"), (10, 0)) == [down, up]


def test_branches_are_none_where_only_limits_forbid():
    assert branches(ARM, (3, 3)) == []


def test_stretched_is_one_pose_not_two():
    assert branches(ARM, (20.8, 0)) == [(0, 0)]


@pytest.mark.parametrize("angle", range(-90, 171, 10))
def test_full_reach_is_reachable_despite_rounding(angle):
    point = (20.8 * math.cos(math.radians(angle)), 20.8 * math.sin(math.radians(angle)))
    assert forward(ARM, inverse(ARM, point)) == pytest.approx(point, abs=1e-8)
    a_hair_farther = [c * (1 + 2e-11) for c in point]
    assert forward(ARM, inverse(ARM, a_hair_farther)) == pytest.approx(point, abs=1e-8)


@pytest.mark.parametrize("angle", range(-170, 180, 30))
def test_the_rim_of_the_hole_is_reachable_despite_rounding(angle):
    point = (1.8 * math.cos(math.radians(angle)), 1.8 * math.sin(math.radians(angle)))
    wide = with_limits((-360, 360), (-180, 180))
    for nudge in (1 - 1e-11, 1, 1 + 1e-11):
        q = inverse(wide, [c * nudge for c in point])
        assert forward(wide, q) == pytest.approx(point, abs=1e-8)


@pytest.mark.parametrize("q", list(itertools.product((-90, 170), (-150, 150))))
def test_a_pose_on_its_limits_is_within_them(q):
    found = inverse(ARM, forward(ARM, radians(*q)), near=radians(*q))
    assert degrees(found) == pytest.approx(q, abs=1e-4)
    assert all(joint.lower <= angle <= joint.upper for joint, angle in zip(ARM.joints, found))


# ---- which branch, which turn


def test_without_elbow_the_preferred_one_goes_first():
    assert inverse(ARM, (10, 0))[1] > 0
    assert inverse(ARM._replace(elbow="down"), (10, 0))[1] < 0


def test_without_elbow_the_other_one_is_taken_where_limits_demand():
    point = forward(ARM, radians(-80, 60))
    arm = with_limits((-90, 170), (-150, 0))
    assert arm.elbow == "up"
    with pytest.raises(Unreachable):
        inverse(arm, point, elbow="up")
    assert inverse(with_limits((-90, 170), (-150, 0)), (10, 0))[1] < 0


@pytest.mark.parametrize(
    ("near", "expected"),
    [
        ((52, -123), "down"),
        ((-52, 123), "up"),
        ((0, 1), "up"),
        ((-80, -10), "down"),  # 132.5 deg at most, up 133.3; by the sum it were up
    ],
    ids=["at down", "at up", "just up", "greatest travel decides"],
)
@pytest.mark.parametrize("preferred", ["up", "down"])
def test_near_takes_the_least_joint_travel(near, expected, preferred):
    q = inverse(ARM._replace(elbow=preferred), (10, 0), near=radians(*near))
    assert q == inverse(ARM, (10, 0), elbow=expected)


def test_a_full_turn_is_added_where_it_meets_the_limits():
    arm = with_limits((180, 400), (-150, 150))
    q = inverse(arm, (10, 0), elbow="up")
    assert degrees(q) == pytest.approx((307.4552, 123.3207), abs=1e-4)


def test_of_two_turns_the_one_nearest_to_home_or_near():
    arm = with_limits((-360, 360), (-150, 150))
    up = "up"
    assert len(branches(arm, (10, 0))) == 4
    assert math.degrees(inverse(arm, (10, 0), elbow=up)[0]) == pytest.approx(-52.5448, abs=1e-4)
    at_300 = arm._replace(joints=(arm.joints[0]._replace(home=math.radians(300)), arm.joints[1]))
    assert math.degrees(inverse(at_300, (10, 0), elbow=up)[0]) == pytest.approx(307.4552, abs=1e-4)
    near = inverse(arm, (10, 0), elbow=up, near=radians(300, 123))
    assert math.degrees(near[0]) == pytest.approx(307.4552, abs=1e-4)


@pytest.mark.parametrize(
    ("elbow", "near"),
    [("left", None), (None, (0,)), (None, (0, math.nan))],
    ids=["elbow", "angles too few", "NaN"],
)
def test_inverse_refuses_what_it_does_not_understand(elbow, near):
    with pytest.raises(ArmError):
        inverse(ARM, (10, 0), elbow=elbow, near=near)


# ---- what cannot be reached

UNREACHABLE = [
    (
        "too far",
        (25, 0),
        None,
        "(25, 0) cm is 25 cm from the shoulder, out of reach: the links reach from 1.8 to 20.8 cm;"
        " choose a point nearer",
    ),
    ("as good as 0", (25, -2.6e-15), None, "(25, 0) cm is 25 cm from the shoulder"),
    (
        "in the hole",
        (0, 1),
        None,
        "(0, 1) cm is 1 cm from the shoulder, in the hole in the middle: the links reach from 1.8"
        " to 20.8 cm; choose a point farther out",
    ),
    ("at the shoulder", (0, 0), None, "is 0 cm from the shoulder, in the hole in the middle"),
    (
        "elbow limit",
        (3, 3),
        None,
        "elbow up needs elbow at 158.63 deg, limit upper = 150.00 deg;"
        " elbow down needs elbow at -158.63 deg, limit lower = -150.00 deg); choose another point",
    ),
    (
        "only the elbow asked for",
        (-15, -8),
        "down",
        "limits (elbow down needs shoulder at -120.10 deg, limit lower = -90.00 deg); choose",
    ),
    (
        "shoulder limit, a turn on",
        (-15, -8),
        "up",
        "limits (elbow up needs shoulder at 176.25 deg, limit upper = 170.00 deg); choose",
    ),
    ("NaN", (math.nan, 0), None, "(nan, 0) cm: a point is 2 finite numbers"),
    ("infinity", (0, math.inf), None, "(0, inf) cm: a point is 2 finite numbers"),
    ("minus infinity", (0, -math.inf), None, "a point is 2 finite numbers"),
    ("three coordinates", (1, 2, 3), None, "(1, 2, 3) cm: a point is 2 finite numbers"),
]


@pytest.mark.parametrize(
    ("point", "elbow", "expected"),
    [case[1:] for case in UNREACHABLE],
    ids=[case[0] for case in UNREACHABLE],
)
def test_unreachable_names_the_value_the_bounds_and_the_next_step(point, elbow, expected):
    with pytest.raises(Unreachable) as caught:
        inverse(ARM, point, elbow=elbow)
    assert expected in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert isinstance(caught.value, ArmError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize(
    "call",
    [
        lambda arm: forward(arm, (0, 0)),
        lambda arm: jacobian(arm, (0, 0)),
        lambda arm: inverse(arm, (10, 0)),
        lambda arm: singularity(arm, (0, 0)),
    ],
    ids=["forward", "jacobian", "inverse", "singularity"],
)
def test_an_unknown_chain_is_refused(call):
    with pytest.raises(ArmError, match="no kinematics for chain = snake; use one of planar"):
        call(ARM._replace(chain="snake"))


# ---- Jacobian and singularity


def test_jacobian_by_hand():
    # Upper arm along x, forearm along y: the elbow moves the tip along -x, the shoulder along y too
    (a, b), (c, d) = jacobian(ARM, radians(0, 90))
    assert (a, b, c, d) == pytest.approx((-9.5, -9.5, 11.3, 0))


def test_jacobian_is_the_numerical_difference():
    step = 1e-5
    for pose in GRID:
        q = radians(*pose)
        rows = jacobian(ARM, q)
        for i in range(2):
            ahead = forward(ARM, [a + step * (i == k) for k, a in enumerate(q)])
            behind = forward(ARM, [a - step * (i == k) for k, a in enumerate(q)])
            difference = [(x - y) / (2 * step) for x, y in zip(ahead, behind)]
            assert [row[i] for row in rows] == pytest.approx(difference, abs=1e-7)


@pytest.mark.parametrize(("elbow", "expected"), [(0, 0), (90, 1), (-90, 1), (30, 0.5), (-150, 0.5)])
def test_singularity(elbow, expected):
    q = radians(37, elbow)
    assert singularity(ARM, q) == pytest.approx(expected)
    (a, b), (c, d) = jacobian(ARM, q)
    assert singularity(ARM, q) == pytest.approx(abs(a * d - b * c) / (11.3 * 9.5))
