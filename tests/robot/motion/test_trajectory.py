"""Paths become set-points: straight, within the limits, from rest to rest, play taken up."""

import math
import random

import pytest
from rig import REPORT_LINES, degrees, described, from_line

from robot.motion import backlash
from robot.motion.backlash import BacklashCompensation
from robot.motion.classic_steps import STEP_SIZE, has_arrived, jacobian_step
from robot.motion.kinematics import Unreachable, forward, jacobian
from robot.motion.paths import BadPath, arc, circle, line_from, polyline, rectangle, spread
from robot.motion.trajectory import JointMove, Trajectory, joint_path, plan
from shared.arm_description import ArmError, joint_accelerations

PLANAR = described("planar")
GEARED = described("geared")
ARMS = pytest.mark.parametrize("arm", [PLANAR, GEARED], ids=["planar", "geared"])

LINES = REPORT_LINES + [
    ((18, 4), (4, 18)),  # almost stretched on the way
    ((5.8, 0.5), (5.8, 9)),  # begins folded almost to the elbow's limit
    ((20.7, -1), (20.7, 1)),  # within a millimetre of full reach
    ((-10, 12), (12, 12)),
]
H = 1e-4


def angles(plan, t):
    """Joint angles at time `t`, rad."""
    return plan.at(t)[0]


def speeds_of(plan, t):
    """How fast it says that they change, rad/s."""
    return plan.speeds(t)


def place(motion, t):
    """Where the planar arm's tip is to be then, cm."""
    return forward(PLANAR, angles(motion, t))


def by_hand(*q):
    """A motion that is at the next of these poses (rad) each second, on an even way of 1 cm."""
    segments = [
        (1.0, 0.0, [(a, b - a, 0.0, 0.0) for a, b in zip(here, there)], None)
        for here, there in zip(q, q[1:])
    ]
    return Trajectory(list(range(len(q))), segments, q[-1])


def times(motion, step=0.003, begin=0.0):
    """Times from a little before the motion to a little after it."""
    n = int((motion.duration - begin) / step) + 20
    return [begin - 10 * step + k * step for k in range(n)]


def speed_at(motion, t):
    """Joint speeds by differences of the angles, rad/s."""
    before, after = angles(motion, t - H), angles(motion, t + H)
    return [(b - a) / (2 * H) for a, b in zip(before, after)]


def smoothest(values, step):
    """Mean rates of change over `step` of a list of samples."""
    return [(b - a) / step for a, b in zip(values, values[1:])]


# Lines


@pytest.mark.short(every=3)
@ARMS
@pytest.mark.parametrize("line", LINES)
def test_set_points_lie_on_the_line(arm, line):
    (motion,) = plan(arm, polyline(line), arm.speed)
    for t in times(motion):
        p = forward(arm, angles(motion, t))
        # Between knots joint angles are cubics: that costs micrometres.
        assert from_line(p, line) < 0.001


@ARMS
@pytest.mark.parametrize("line", LINES)
def test_from_rest_to_rest(arm, line):
    (motion,) = plan(arm, polyline(line), arm.speed)
    for t, p in ((0.0, line[0]), (motion.duration, line[1])):
        assert forward(arm, angles(motion, t)) == pytest.approx(p, abs=1e-6)
    near = 1e-6
    assert max(map(abs, speeds_of(motion, near))) < 0.01
    assert max(map(abs, speeds_of(motion, motion.duration - near))) < 0.01
    for t in (-1.0, 0.0, motion.duration, motion.duration + 1):
        assert speeds_of(motion, t) == [0.0, 0.0]
    assert tuple(angles(motion, -1)) == motion.start
    assert tuple(angles(motion, motion.duration + 1)) == motion.end


@pytest.mark.short(every=3)
@ARMS
@pytest.mark.parametrize("line", LINES)
def test_speeds_stay_within_the_limits(arm, line):
    """By differences of the set-points, which are not trusted to say how fast they are."""
    (motion,) = plan(arm, polyline(line), arm.speed)
    for t in times(motion):
        for speed, expected, joint in zip(speed_at(motion, t), speeds_of(motion, t), arm.joints):
            assert abs(speed) <= 1.001 * joint.max_speed
            assert speed == pytest.approx(expected, abs=0.05)
        a, b = forward(arm, angles(motion, t - H)), forward(arm, angles(motion, t + H))
        assert math.hypot(b[0] - a[0], b[1] - a[1]) / (2 * H) <= 1.01 * arm.speed


@ARMS
@pytest.mark.parametrize("line", LINES)
def test_joints_are_not_accelerated_harder_than_the_play_allows(arm, line):
    (motion,) = plan(arm, polyline(line), arm.speed)
    step = 0.02  # the control tick: what the motors see
    for k, most in enumerate(joint_accelerations(arm.joints)):
        speeds = [speeds_of(motion, t)[k] for t in times(motion, step)]
        assert max(map(abs, smoothest(speeds, step))) <= 1.1 * most


def test_the_tip_reaches_its_speed_and_keeps_it_where_the_joints_allow():
    (motion,) = plan(PLANAR, polyline(((14, 0), (6, 12))), 2.0)
    speeds = []
    for t in times(motion):
        a, b = place(motion, t - H), place(motion, t + H)
        speeds.append(math.hypot(b[0] - a[0], b[1] - a[1]) / (2 * H))
    assert max(speeds) == pytest.approx(2.0, rel=0.01)
    assert sum(speed > 1.9 for speed in speeds) > 0.8 * len(speeds)
    length = math.hypot(8, 12)
    assert length / 2.0 < motion.duration < length / 2.0 + 1.5


def test_slowed_near_a_singularity():
    """Past the base at 2 cm from the hole, the shoulder would have to spin."""
    near = ((8, -4.5), (8, 4.5))
    (motion,) = plan(described("planar", max_speed=math.radians(60)), polyline(near), 12)
    speeds = [
        math.hypot(*(b - a for a, b in zip(place(motion, t - H), place(motion, t + H)))) / (2 * H)
        for t in times(motion)
    ]
    assert max(speeds) < 11
    # The time-optimal way keeps one joint at its greatest speed for a good part.
    full = [t for t in times(motion) if max(map(abs, speeds_of(motion, t))) > math.radians(59)]
    assert len(full) > 0.15 * len(times(motion))


def test_a_slower_tip_takes_longer_on_the_same_way():
    (fast,), (slow,) = (plan(PLANAR, polyline(LINES[0]), speed) for speed in (12, 3))
    assert slow.duration > 2 * fast.duration
    assert slow.start == fast.start
    assert slow.end == fast.end


@pytest.mark.parametrize("elbow", ["up", "down"])
def test_the_elbow_asked_for_is_kept(elbow):
    (motion,) = plan(PLANAR, polyline(((12, 6), (15, -8))), 12, elbow)
    sign = 1 if elbow == "up" else -1
    assert all(sign * angles(motion, t)[1] > 0.1 for t in times(motion))


def test_without_a_wish_the_other_elbow_stands_in_where_the_arms_own_cannot():
    line = ((5, -15), (12, -14))
    with pytest.raises(Unreachable):
        plan(PLANAR, polyline(line), 12, "up")
    (motion,) = plan(PLANAR, polyline(line), 12)
    assert motion.start[1] < 0


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (((10, 0), (25, 0)), "out of reach"),
        (((1, 0), (5, 10)), "hole"),
        (((5, 10), (-5, -9)), "limit"),
        (((-10, -10), (-12, -5)), "limit"),
        (((math.nan, 0), (1, 10)), "finite"),
    ],
)
def test_a_line_that_cannot_be_had_is_refused_whole(line, says):
    with pytest.raises(ArmError, match=says) as caught:
        plan(PLANAR, polyline(line), 12)
    assert "\n" not in str(caught.value)


def test_a_leap_between_two_ways_to_the_same_tip_is_refused():
    with pytest.raises(Unreachable, match="swing"):
        joint_path(PLANAR, spread(((-10, 12), (-15, 5))), "down")


# Reversals, by hand: the elbow's angle depends on the distance from the base alone, so it turns
# round where the line comes nearest to the base, and nowhere else.


@ARMS
@pytest.mark.parametrize("line", LINES)
def test_the_elbow_turns_round_where_the_line_is_nearest_to_the_base(arm, line):
    (motion,) = plan(arm, polyline(line), arm.speed)
    (ax, ay), (bx, by) = line
    share = -(ax * (bx - ax) + ay * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2)
    turns = motion.reversals[1]
    if not 0.01 < share < 0.99:
        assert turns == ()
        return
    (turn,) = turns
    nearest = (ax + share * (bx - ax), ay + share * (by - ay))
    assert place(motion, turn) == pytest.approx(nearest, abs=0.051)
    assert motion.directions[1] == 1, "nearing the base, the elbow bends"


def test_directions_and_reversals_of_joint_angles_given_by_hand():
    q = [(0.0, 1.0), (0.1, 1.0), (0.2, 0.9), (0.1, 0.8), (0.1, 0.8), (0.0, 0.9)]
    motion = by_hand(*q)
    assert motion.directions == (1, -1)
    assert motion.reversals == ((2,), (4,))
    assert by_hand(*q[:2]).directions == (1, 0)
    # It turns round between two knots where the slope 1 - 2 s is 0.
    within = Trajectory([0, 1], [(1.0, 0.0, [(0.0, 1.0, -1.0, 0.0)], None)], [0.0])
    assert within.directions == (1,)
    assert within.reversals == ((0.5,),)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("turn", "other"), [(0.2, 3.0), (0.9, -0.3), (0.5, -40.0), (0.3, 1e6)])
def test_a_joint_turns_round_where_its_slope_is_zero(turn, other, sign):
    """The slope is the parabola sign (s - turn) (s - other), from 0 to 1 cm at 1 cm/s."""
    cubic = [sign * c for c in (0.0, turn * other, -(turn + other) / 2, 1 / 3)]
    motion = Trajectory([0, 1], [(1.0, 0.0, [cubic], None)], [sum(cubic)])
    assert motion.reversals[0] == pytest.approx((turn,), abs=1e-6)


def test_a_joint_that_stands_at_a_knot_and_goes_on_there_and_back_turns_where_it_does():
    # 1 - s, then -s + 1.5 s^2: from 0 down on, and up from 2/3 cm on.
    segments = [
        (1.0, 0.0, [(0.0, -1.0, 0.5, 0.0)], None),
        (1.0, 0.0, [(-0.5, 0.0, -0.5, 0.5)], None),
    ]
    motion = Trajectory([0, 1, 2], segments, [-0.5])
    assert motion.reversals[0] == pytest.approx((1 + 2 / 3,))


# Shapes


def test_an_arc_through_points_of_a_circle_is_that_circle():
    centre, radius = (9.0, 5.0), 4.0
    on_it = [
        (centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
        for a in degrees(10, 60, 75, 160, 250)
    ]
    (stroke,) = arc(on_it)
    for x, y in stroke:
        assert math.hypot(x - centre[0], y - centre[1]) == pytest.approx(radius, abs=1e-9)
    length = sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(stroke, stroke[1:]))
    assert length == pytest.approx(radius * math.radians(240), rel=1e-4)


@pytest.mark.parametrize("turn", [1, -1], ids=["counter-clockwise", "clockwise"])
def test_an_arc_goes_the_way_its_points_go(turn):
    points = [
        (10 + 3 * math.cos(turn * a), 3 * math.sin(turn * a)) for a in degrees(0, 100, 190, 300)
    ]
    (stroke,) = arc(points)
    swept = sum((a[0] - 10) * b[1] - a[1] * (b[0] - 10) for a, b in zip(stroke, stroke[1:]))
    assert swept == pytest.approx(turn * 9 * math.radians(300), rel=1e-3)


def test_an_arc_through_points_of_a_line_is_that_line():
    points = [(4.0, 8.0), (6.0, 9.0), (12.0, 12.0), (13.0, 12.5)]
    (stroke,) = arc(points)
    assert all(from_line(p, (points[0], points[-1])) < 1e-9 for p in stroke)
    along = [x for x, y in stroke]
    assert along == sorted(along)


@pytest.mark.parametrize("n", [3, 4, 7])
def test_an_arc_passes_all_its_points_smoothly(n):
    draw = random.Random(n)
    points = [(3.0 * k + draw.uniform(-1, 1), draw.uniform(0, 6)) for k in range(n)]
    (stroke,) = arc(points)
    for p in points:
        assert any(p == pytest.approx(q, abs=1e-9) for q in stroke)
    assert stroke[0] == pytest.approx(points[0])
    assert stroke[-1] == pytest.approx(points[-1])
    headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in zip(stroke, stroke[1:])]
    for a, b in zip(headings, headings[1:]):
        turn = (b - a + math.pi) % (2 * math.pi) - math.pi
        assert abs(turn) < math.radians(6), "a corner"


def test_a_circle():
    (stroke,) = circle((10, 5), 2.5)
    assert stroke[0] == pytest.approx(stroke[-1])
    nearest = 1 - 2.5 / math.hypot(10, 5)
    assert stroke[0] == pytest.approx((10 * nearest, 5 * nearest))
    for x, y in stroke:
        assert math.hypot(x - 10, y - 5) == pytest.approx(2.5)
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(stroke, stroke[1:])) / 2
    assert area == pytest.approx(math.pi * 2.5**2, rel=1e-3)  # positive: counter-clockwise


def test_a_rectangle():
    assert rectangle((8, 2), (12, 5)) == [
        ((8, 2), (12, 2)),
        ((12, 2), (12, 5)),
        ((12, 5), (8, 5)),
        ((8, 5), (8, 2)),
    ]


def test_a_polyline_and_a_line_by_angle_and_length():
    assert polyline([(1, 2), (3, 4), (5, 5)]) == [((1, 2), (3, 4)), ((3, 4), (5, 5))]
    ((start, end),) = line_from((3, 1), math.radians(150), 4)
    assert start == (3, 1)
    assert end == pytest.approx((3 - 2 * math.sqrt(3), 3))


def test_the_strokes_of_a_drawing_join_without_a_gap():
    motions = plan(PLANAR, rectangle((8, 2), (13, 7)), 6)
    assert len(motions) == 4
    for before, after in zip(motions, motions[1:]):
        assert before.end == after.start


@pytest.mark.parametrize(
    ("draw", "says"),
    [
        (lambda: polyline([(1, 2)]), "at least 2 points, not 1"),
        (lambda: polyline([]), "at least 2"),
        (lambda: polyline([(1, 2), (1, 2)]), "twice"),
        (lambda: polyline([(1, 2), (math.nan, 2)]), "nan"),
        (lambda: polyline([(1, 2), (math.inf, 2)]), "inf"),
        (lambda: arc([(1, 2), (3, 4)]), "at least 3 points, not 2"),
        (lambda: arc([(1, 2), (3, 4), (3, 4)]), "twice"),
        (lambda: arc([(1, 2), (3, math.nan), (3, 4)]), "nan"),
        (lambda: circle((10, 0), 0), "radius 0"),
        (lambda: circle((10, 0), -1), "radius -1"),
        (lambda: circle((10, 0), math.nan), "radius nan"),
        (lambda: circle((10, 0), math.inf), "radius inf"),
        (lambda: circle((math.nan, 0), 1), "nan"),
        (lambda: line_from((1, 2), 0, 0), "length 0"),
        (lambda: line_from((1, 2), 0, -3), "length -3"),
        (lambda: line_from((1, 2), 0, math.nan), "length nan"),
        (lambda: line_from((1, 2), math.nan, 3), "nan"),
        (lambda: rectangle((1, 2), (1, 5)), "opposite corners"),
        (lambda: rectangle((1, 2), (math.inf, 5)), "inf"),
        (lambda: polyline([(1, 2), (1e308, 2)]), r"\(1e\+308, 2\), farther than 1000 cm away"),
        (lambda: arc([(10, 0), (5, 10), (-1e308, 0)]), "farther than 1000 cm away"),
        (lambda: arc([(1001, 0), (5, 10), (1, 0)]), "farther than 1000 cm away"),
        (lambda: circle((1e308, 0), 3), "farther than 1000 cm away"),
        (lambda: circle((10, 0), 1e308), r"radius 1e\+308"),
        (lambda: rectangle((1, 2), (-1e308, 5)), "farther than 1000 cm away"),
        (lambda: line_from((1, 2), 0, 1e308), "farther than 1000 cm away"),
    ],
)
def test_what_is_no_path_is_refused_in_one_line(draw, says):
    with pytest.raises(BadPath, match=says) as caught:
        draw()
    assert isinstance(caught.value, ArmError)
    assert "\n" not in str(caught.value)


# Moves of all joints together


@pytest.mark.parametrize("fastest", [(0.9, 1.5), (2.0, 1.1), (9.0, 9.0)])
def test_a_joint_move_is_smooth_and_within_its_limits(fastest):
    start, end = (0.1, -1.0), (1.3, 0.5)
    move = JointMove(start, end, fastest, (6.0, 6.0))
    assert angles(move, -1) == pytest.approx(start)
    assert angles(move, 0) == pytest.approx(start)
    assert angles(move, move.duration) == pytest.approx(end)
    assert angles(move, move.duration + 9) == pytest.approx(end)
    step = 0.001
    for k in range(2):
        q = [angles(move, t)[k] for t in times(move, step)]
        speeds = smoothest(q, step)
        accelerations = smoothest(speeds, step)
        assert max(map(abs, speeds)) <= 1.001 * fastest[k]
        assert max(map(abs, accelerations)) <= 1.001 * 6.0
        speeds_at = [speeds_of(move, t)[k] for t in times(move, step)]
        assert speeds == pytest.approx(
            [(a + b) / 2 for a, b in zip(speeds_at, speeds_at[1:])], abs=1e-3
        )
    # And not needlessly slow: one limit or the other is met.
    swift = [1.875 * abs(b - a) / move.duration / top for a, b, top in zip(start, end, fastest)]
    hard = [5.7735 * abs(b - a) / move.duration**2 / 6.0 for a, b in zip(start, end)]
    assert max(swift + hard) == pytest.approx(1.0, rel=1e-3)


def test_a_joint_move_to_where_it_is():
    move = JointMove((0.3, 0.4), (0.3, 0.4), (1, 1))
    assert move.duration == 0
    assert angles(move, 0) == pytest.approx((0.3, 0.4))
    assert speeds_of(move, 0) == [0.0, 0.0]
    assert move.directions == (0, 0)


# The play


def plays(*sides):
    return tuple(math.radians(2) * side / 2 for side in sides)


def there_and_back():
    """A motion of two joints by hand: the first turns round at 2 s, the second stands."""
    return by_hand((0.0, 0.5), (0.5, 0.5), (1.0, 0.5), (0.5, 0.5), (0.0, 0.5))


@pytest.mark.parametrize("before", [-1, 0, 1])
def test_the_motor_leads_the_link_by_half_the_play_once_it_pushes(before):
    motion = there_and_back()
    plan = BacklashCompensation(PLANAR.joints, motion, (before, before))

    def lead(t):
        return angles(plan, t)[0] - angles(motion, t)[0]

    # link = motor - side * play / 2, with the side it was left on, then forwards, then backwards
    assert lead(-plan.before - 0.01) == pytest.approx(plays(before)[0])
    for t in (0.0, 0.5, 1.5):
        assert lead(t) == pytest.approx(plays(1)[0])
    for t in (2.5, 3.9, 5.0):
        assert lead(t) == pytest.approx(plays(-1)[0])
    assert lead(2.0) == pytest.approx(0.0, abs=1e-9), "half way across where the link turns round"
    assert plan.before == (0.0 if before == 1 else plan.before)
    assert (plan.before > 0) == (before != 1)


def test_a_joint_that_stands_keeps_its_side():
    plan = BacklashCompensation(PLANAR.joints, there_and_back(), (-1, -1))
    for t in (-1, 0, 2, 9):
        assert angles(plan, t)[1] == pytest.approx(0.5 + plays(-1)[0])
    assert plan.sides == (-1, -1)


@pytest.mark.parametrize("end", [(1, 1), (1, -1), (-1, 1)])
@pytest.mark.parametrize("before", [(0, 0), (1, -1)])
def test_after_a_move_the_play_lies_where_the_joints_went(before, end):
    move = JointMove((0.0, 0.0), degrees(30 * end[0], 30 * end[1]), (2, 2))
    plan = BacklashCompensation(PLANAR.joints, move, before)
    assert plan.sides == end
    assert angles(plan, 9) == pytest.approx([a + p for a, p in zip(move.end, plays(*end))])


def test_the_motors_speed_is_the_rate_of_its_angle_also_across_the_play():
    plan = BacklashCompensation(PLANAR.joints, there_and_back(), (-1, 0))
    for k in range(-200, 4500):
        t = k / 1000.0 + 0.0005
        rate = (angles(plan, t + 1e-6)[0] - angles(plan, t - 1e-6)[0]) / 2e-6
        assert speeds_of(plan, t)[0] == pytest.approx(rate, abs=1e-3)


@pytest.mark.parametrize(
    "arm", [PLANAR, described("planar", 3), described("geared", 3), described("geared", 12)]
)
def test_the_shaft_crosses_the_play_gently(arm):
    plan = BacklashCompensation(arm.joints, there_and_back(), (-1, 0))
    play, gear = arm.joints[0].backlash, arm.joints[0].gear
    own = [
        abs(speeds_of(plan, t)[0] - speeds_of(there_and_back(), t)[0]) * gear
        for t in (k / 1000.0 for k in range(-600, 4500))
    ]
    assert max(own) <= 1.5 * math.radians(109) * 1.001
    assert max(own) > 0
    assert play > 0


@pytest.mark.parametrize(("play", "run_up"), [(0, 1.5), (2, 1.5), (12, 6)])
def test_a_start_is_come_to_from_a_little_behind_or_half_the_play(play, run_up):
    """By 1.5 degrees the play may be wider than described; at first its side is not known."""
    move = JointMove(degrees(20, 30), degrees(40, 10), (2, 2))
    joints = described("planar", play).joints
    behind = [math.degrees(angle) for angle in backlash.pose_behind(joints, move)]
    assert behind == pytest.approx([20 - run_up, 30 + run_up])


def test_without_play_the_motor_does_what_the_link_does():
    arm = described("planar", 0)
    motion = there_and_back()
    plan = BacklashCompensation(arm.joints, motion, (-1, 0))
    assert plan.before == 0
    for t in (-1, 0.3, 2.0, 2.05, 4.5):
        assert angles(plan, t) == angles(motion, t)
        assert speeds_of(plan, t) == speeds_of(motion, t)


def pressed_below(limit):
    """Gravity presses the first joint's play to +1 below an angle (rad), to -1 above twice it."""

    def pressed(q):
        return (1 if q[0] < limit else -1 if q[0] > 2 * limit else 0, 0)

    return pressed


def lead_of(plan, motion, t):
    return angles(plan, t)[0] - angles(motion, t)[0]


def test_play_that_gravity_presses_is_not_taken_up():
    motion = there_and_back()
    plan = BacklashCompensation(PLANAR.joints, motion, (1, 1), lambda q: (1, 0))
    assert plan.before == 0
    assert plan.sides == (1, 1)
    for t in (0.0, 1.0, 1.95, 2.0, 2.05, 3.0, 4.0):
        assert lead_of(plan, motion, t) == pytest.approx(plays(1)[0])
    usual = BacklashCompensation(PLANAR.joints, motion, (1, 1))
    assert lead_of(usual, motion, 3.0) == pytest.approx(plays(-1)[0]), "without it the play is"


def test_the_play_is_crossed_where_gravity_lets_go_or_takes_over():
    motion = there_and_back()  # 0 .. 1 .. 0 rad in 2 s each way
    plan = BacklashCompensation(PLANAR.joints, motion, (1, 0), pressed_below(0.3))

    def at(angle, back):
        """The time at which the joint is there, s."""
        half = [t / 1000.0 for t in range(2001)]
        there = min(half, key=lambda t: abs(angles(motion, t)[0] - angle))
        return 4 - there if back else there

    for t, side in (
        (0.0, 1),
        (at(0.45, False), 1),  # between, it is pushed on
        (at(0.75, False), -1),  # past it, gravity pulls it ahead
        (at(0.75, True), -1),  # and turning round changes nothing there
        (at(0.45, True), -1),
        (at(0.10, True), 1),
    ):
        assert lead_of(plan, motion, t) == pytest.approx(plays(side)[0]), t
    for angle, back in ((0.6, False), (0.3, True)):
        middle = lead_of(plan, motion, at(angle, back))
        assert abs(middle) < plays(1)[0], "crossed about there"
    assert plan.sides == (1, 0)


@pytest.mark.parametrize("limit", [0.0005, 0.4998])
def test_play_that_gravity_takes_over_at_the_very_ends_is_crossed_smoothly(limit):
    motion = there_and_back()
    plan = BacklashCompensation(PLANAR.joints, motion, (1, 0), pressed_below(limit))
    places = [angles(plan, -plan.before + 0.001 * k)[0] for k in range(-5, 5000)]
    steps = [abs(b - a) for a, b in zip(places, places[1:])]
    assert max(steps) < 0.001 * (1.0 + 2 * math.radians(2) / 0.14)
    assert lead_of(plan, motion, -plan.before) == pytest.approx(plays(1)[0]), "it starts as it lies"
    assert speeds_of(plan, plan.duration)[0] == 0


# The report's steps


@pytest.mark.parametrize("seed", range(20))
def test_a_step_solves_the_jacobian_and_is_5_degrees_long(seed):
    numpy = pytest.importorskip("numpy")
    draw = random.Random(seed)
    q = degrees(draw.uniform(-90, 170), draw.choice((-1, 1)) * draw.uniform(10, 150))
    dy = (draw.uniform(-15, 15), draw.uniform(-15, 15))
    dq = jacobian_step(PLANAR, q, dy)
    (a, b), (first, second) = q, (11.3, 9.5)
    rows = [
        [-first * math.sin(a) - second * math.sin(a + b), -second * math.sin(a + b)],
        [first * math.cos(a) + second * math.cos(a + b), second * math.cos(a + b)],
    ]
    wanted = numpy.linalg.solve(rows, dy)
    wanted *= math.radians(5) / numpy.linalg.norm(wanted)
    assert dq == pytest.approx(tuple(wanted))


def test_a_step_by_hand():
    """Elbow at a right angle: J = [[-9.5, -9.5], [11.3, 0]]; for dy = (0, 1) dq ~ (1, -1)."""
    dq = jacobian_step(PLANAR, degrees(0, 90), (0, 1))
    assert dq == pytest.approx((STEP_SIZE / math.sqrt(2), -STEP_SIZE / math.sqrt(2)))
    upper, lower = jacobian(PLANAR, degrees(0, 90))
    assert upper == pytest.approx((-9.5, -9.5))
    assert lower == pytest.approx((11.3, 0))


@pytest.mark.parametrize("q", [(0, 0), (30, 0)])
def test_no_step_leads_out_of_a_stretched_arm(q):
    with pytest.raises(Unreachable, match="no inverse"):
        jacobian_step(PLANAR, degrees(*q), (1, 0))


@pytest.mark.parametrize(
    ("p", "over"),
    [
        ((0, 0), False),
        ((8.99, 0), False),
        ((9.0, 0), True),  # to the point: within 1 cm
        ((9.01, 0), True),
        ((10, 0.99), True),
        ((9.9, 1.2), False),
        ((10.0, 5.0), True),  # level with the goal, though far to the side: past it along the line
        ((12, 3), True),
        ((9.9, 5), False),
    ],
)
def test_the_steps_end_within_a_centimetre_or_past_the_goal(p, over):
    turned = [(x * 0.6 - y * 0.8, x * 0.8 + y * 0.6) for x, y in ((0, 0), (10, 0), p)]
    assert has_arrived((0, 0), (10, 0), p) is over
    if p != (9.0, 0) and p[0] != 10.0:  # on the edge, rounding decides
        assert has_arrived(*turned) is over
