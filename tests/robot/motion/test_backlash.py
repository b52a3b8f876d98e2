"""Which reversals of a joint are worth a crossing of its backlash.

Two degrees of backlash: an inner pair of reversals is crossed from 0.3 degrees on, an outer one
from 0.15.
"""

import math
import random

import pytest
from rig import described, switched_on

from robot.motion.backlash import BacklashCompensation, crossed_turns, pose_behind
from robot.motion.trajectory import Trajectory

JOINT = described("planar", 2).joints[:1]
STEP = 0.05


def going(*degrees):
    """Return a motion of one joint through these angles, a step each, straight between."""
    q = [math.radians(angle) for angle in degrees]
    segments = [(1.0, 0.0, [(a, (b - a) / STEP, 0.0, 0.0)], None) for a, b in zip(q, q[1:])]
    return Trajectory([STEP * k for k in range(len(q))], segments, q[-1:])


def turns(*degrees):
    """Return the first direction, and which angles the joint is taken to turn round at."""
    (first,), (times,) = crossed_turns(JOINT, going(*degrees))
    return (first, *(degrees[round(t / STEP)] for t in times))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("angles", "expected"),
    [
        ((0, 5, 0), (1, 5)),
        ((0, 5, 4.72, 9), (1,)),
        ((0, 5, 4.68, 9), (1, 5, 4.68)),
        # the shallowest goes first: one turn is left of three
        ((0, 5, 4.9, 5.2, 0), (1, 5.2)),
        ((0, 5.2, 4.9, 5, 0), (1, 5.2)),
        ((0, 5, 4.9, 5.1, 4.85, 9), (1,)),
        ((0, 5, 4.9, 5.0, 4.6, 9), (1, 5, 4.6)),
        # at an end one turn goes alone
        ((0, 0.14, -5), (-1,)),
        ((0, 0.16, -5), (1, 0.16)),
        ((0, 5, 4.86), (1,)),
        ((0, 5, 4.84), (1, 5)),
        ((0, 0.1, -0.1, 5, 4.9), (1,)),
        ((0, 0.1, 0.04), (1,)),
    ],
)
def test_reversals_that_are_worth_a_crossing(angles, expected, sign):
    assert turns(*(sign * a for a in angles)) == tuple(sign * value for value in expected)


def deadband(angles, depth):
    """Return the extremes from which a path comes back by `depth`: by following it step by step."""
    out, low, high, sign = [], angles[0], angles[0], 1
    for angle in angles[1:]:
        low, high = min(low, angle), max(high, angle)
        if sign > 0 and high - angle >= depth:
            out.append(high)
            sign, low = -1, angle
        elif sign < 0 and angle - low >= depth:
            out.append(low)
            sign, high = 1, angle
    return out


@pytest.mark.parametrize("seed", range(30))
def test_what_is_left_is_what_a_dead_band_leaves(seed):
    rng = random.Random(seed)
    angles = [0.0, 20.0]
    for k in range(40):
        angles.append(angles[-1] + (-1) ** (k + 1) * rng.choice([0.05, 0.2, 0.4, 2]) * rng.random())
    angles += [40.0] if angles[-1] > angles[-2] else [angles[-1] + 1e-3, 40.0]
    if angles[-3] > angles[-2]:
        angles.pop(-2)
    assert turns(*angles) == (1, *deadband(angles, 0.3))


def test_the_motor_does_not_cross_for_a_slight_reversal():
    motion = going(0, 5, 4.9, 9)
    plan = BacklashCompensation(JOINT, motion, (1,))
    for k in range(16):
        t = k / 100.0
        (q,), (motor,) = motion.at(t)[0], plan.at(t)[0]
        assert motor == pytest.approx(q + math.radians(1))
    assert plan.sides == (1,)


def test_a_start_is_come_to_in_the_direction_that_lasts():
    (behind,) = pose_behind(JOINT, going(10, 10.1, 0))
    assert math.degrees(behind) == pytest.approx(10 + 1.5)


def test_a_joint_without_backlash_keeps_all_its_reversals():
    _, (times,) = crossed_turns(described("planar", 0).joints[:1], going(0, 5, 4.99, 9))
    assert times == pytest.approx([STEP, 2 * STEP])


def test_a_learned_correction_does_not_change_which_reversals_are_crossed():
    plan, corrected = going(0, 5, 4.6, 9), going(0, 5, 4.8, 9)
    motion = Trajectory(*corrected.numbers(), turning=plan.numbers()[1])
    assert crossed_turns(JOINT, motion)[1] == crossed_turns(JOINT, plan)[1]
    assert crossed_turns(JOINT, corrected)[1] == [[]]


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("apart", [0.06, 0.1])
def test_a_slight_reversal_does_not_throw_the_link(seed, apart, tmp_path):
    """The shoulder's speed is a parabola of time, zero at 0.5 s -+ `apart` / 2."""
    bend = math.radians(60)

    def angle(t):
        return bend * ((t - 0.5) ** 3 / 3 - (apart / 2) ** 2 * (t - 0.5))

    ticks = [0.05 * k for k in range(21)]
    segments = []
    for t in ticks[:-1]:
        speed = bend * ((t - 0.5) ** 2 - (apart / 2) ** 2)
        shoulder = angle(t), speed, bend * (t - 0.5), bend / 3
        segments.append((1.0, 0.0, [shoulder, (0.6 + 0.2 * t, 0.2, 0.0, 0.0)], None))
    off = []

    def compare(now, links):
        shoulder, elbow = rig.q
        t = (elbow - 0.6) / 0.2
        if 0.3 < t < 0.8:
            off.append(abs(math.degrees(shoulder - angle(t))))

    with switched_on(tmp_path, "geared", plant=f"seed={seed}") as rig:
        robot = rig.robot()
        motion = rig.its(Trajectory)(ticks, segments, [angle(1.0), 0.8])
        assert motion.reversals[0] == pytest.approx((0.5 - apart / 2, 0.5 + apart / 2), abs=1e-3)
        assert math.degrees(abs(motion.extremes[0][2] - motion.extremes[0][1])) < 0.02
        robot.pre_approach(motion)
        robot.follow([motion], on_tick=compare)
    assert len(off) > 10
    assert max(off) < 0.45
