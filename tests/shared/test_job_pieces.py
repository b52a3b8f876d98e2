"""Bounds of what a piece of a job asks of a joint, beside numpy's of very many places."""

import math
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared import job_pieces
from shared.arm_description import JOINT_ACCELERATION, find_arm, joint_accelerations, read_arm
from shared.job_pieces import ACCELERATION_MARGIN, MAX_JUMP, SPEED_MARGIN, BadJob, check_joints

PLANAR = read_arm(find_arm("planar"))
numbers = st.floats(-1, 1)


@given(
    v=st.floats(0.01, 20), a=st.floats(-1, 1), dt=st.floats(0.02, 5), q=st.floats(-3, 3),
    c1=numbers, c2=numbers, c3=numbers,
)  # fmt: skip
def test_the_least_and_greatest_angle_and_speed_of_a_segment_are_found(v, a, dt, q, c1, c2, c3):
    a *= v / dt  # it never runs backwards
    t = np.linspace(0.0, dt, 2001)
    s = t * (v + 0.5 * a * t)
    length = float(s[-1])
    c2, c3 = c2 / length, c3 / length**2
    angle = q + s * (c1 + s * (c2 + s * c3))
    speed = np.abs((v + a * t) * (c1 + s * (2 * c2 + 3 * c3 * s)))
    harder = np.abs(a * (c1 + s * (2 * c2 + 3 * c3 * s)) + (v + a * t) ** 2 * (2 * c2 + 6 * c3 * s))
    pieces = [([0.0, dt], [(v, a, [(q, c1, c2, c3)], None)], (float(angle[-1]),))]
    joint = PLANAR.joints[0]._replace(lower=-math.inf, upper=math.inf, max_speed=math.inf)

    usual = ACCELERATION_MARGIN * JOINT_ACCELERATION

    def is_refused(joint, hardest=math.inf):
        with mock.patch.object(job_pieces, "MAX_SPEED_JUMP", math.inf):
            try:
                check_joints(
                    "a.job",
                    1,
                    pieces,
                    [joint],
                    more=hardest - usual,
                )
            except BadJob:
                return True
        return False

    for sign in (-1, 1):
        scale = sign * 1e-4
        upper = angle.max() + scale * (1 + np.abs(angle).max()) - MAX_JUMP
        assert is_refused(joint._replace(upper=upper)) == (sign < 0)
        lower = angle.min() - scale * (1 + np.abs(angle).max()) + MAX_JUMP
        assert is_refused(joint._replace(lower=lower)) == (sign < 0)
        fastest = (speed.max() + scale * (1 + speed.max())) / SPEED_MARGIN
        assert is_refused(joint._replace(max_speed=fastest)) == (sign < 0)
        assert is_refused(joint, harder.max() + scale * (1 + harder.max())) == (sign < 0)


@pytest.mark.parametrize(("v", "message"), [(1.0, "its speed by 20 deg/s at once"), (0.2, "")])
def test_a_joint_that_would_start_at_once_is_refused(v, message):
    slope = math.radians(20)
    pieces = [([0.0, 1.0], [(v, 0.0, [(0.0, slope, 0.0, 0.0)], None)], (slope,))]
    if message:
        with pytest.raises(BadJob, match="stroke 3 needs the shoulder to change " + message):
            check_joints("a.job", 3, pieces, PLANAR.joints[:1])
    else:
        check_joints("a.job", 3, pieces, PLANAR.joints[:1])


@pytest.mark.parametrize("n", [0, 1])
@pytest.mark.parametrize("share", [1.1, 1.3])
def test_each_joint_may_be_accelerated_a_little_harder_than_is_planned_for_it(n, share):
    a = share * joint_accelerations(PLANAR.joints)[n]
    dt = 0.01
    middle = 0.5 * a * dt**2  # of the way, cm: a radian per cm

    def cubics(angle):
        return [(angle, 1.0, 0.0, 0.0) if k == n else (0.0,) * 4 for k in range(2)]

    segments = [(0.0, a, cubics(0.0), None), (a * dt, -a, cubics(middle), None)]
    pieces = [([0.0, dt, 2 * dt], segments, [c[0] for c in cubics(2 * middle)])]
    if share < ACCELERATION_MARGIN:
        check_joints("a.job", 1, pieces, PLANAR.joints)
    else:
        with pytest.raises(BadJob, match=f"accelerated by {math.degrees(a):.0f} deg"):
            check_joints("a.job", 1, pieces, PLANAR.joints)
