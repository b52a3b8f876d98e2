"""Inverse kinematics by iteration against the closed form."""

import math
import random

import pytest

from robot.motion import inverse_iteration
from robot.motion.inverse_iteration import broyden_inverse, newton_inverse
from robot.motion.kinematics import Unreachable, branches, forward, inverse, jacobian
from shared.arm_description import ArmError, find_arm, read_arm

ARM = read_arm(find_arm("planar"))
METHODS = [newton_inverse, broyden_inverse]
FREE = ARM._replace(
    joints=tuple(joint._replace(lower=-math.pi, upper=math.pi) for joint in ARM.joints)
)


def radians(*angles):
    return tuple(map(math.radians, angles))


def degrees(q):
    return tuple(map(math.degrees, q))


def tasks(count):
    """Random points between hole and full reach, and starts, for an arm that may turn all round."""
    draw = random.Random(7)
    for _ in range(count):
        distance, heading = draw.uniform(2, 20.7), draw.uniform(-math.pi, math.pi)
        yield (
            (distance * math.cos(heading), distance * math.sin(heading)),
            (draw.uniform(-3, 3), draw.uniform(-2.6, 2.6)),
        )


@pytest.mark.parametrize(
    ("method", "least"), [(newton_inverse, 300), (broyden_inverse, 300)], ids=["newton", "broyden"]
)
def test_iterations_find_an_analytic_branch(method, least):
    found = 0
    for point, q0 in tasks(300):
        try:
            q, trace = method(FREE, point, q0)
        except Unreachable:
            continue
        found += 1
        assert (
            min(max(abs(a - b) for a, b in zip(q, branch)) for branch in branches(FREE, point))
            < 1e-5
        )
        assert trace[0].q == q0
    assert found >= least


@pytest.mark.parametrize("method", METHODS)
def test_trace_tells_the_way(method):
    point, q0 = (10, 5), radians(10, 30)
    solution = method(ARM, point, q0)
    assert [step.iteration for step in solution.trace] == list(range(len(solution.trace)))
    assert solution.trace[0].q == q0
    assert solution.trace[-1].q == pytest.approx(solution.q)
    for before, after in zip(solution.trace, solution.trace[1:]):
        assert after.error_cm <= before.error_cm
        assert max(abs(a - b) for a, b in zip(after.q, before.q)) <= 0.5 + 1e-12
    for step in solution.trace:
        assert step.p == forward(ARM, step.q)
        assert step.error_cm == pytest.approx(math.hypot(10 - step.p[0], 5 - step.p[1]))
    assert solution.trace[-1].error_cm <= 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_the_last_iteration_counts(method):
    steps = len(method(ARM, (10, 5), radians(10, 60)).trace) - 1
    method(ARM, (10, 5), radians(10, 60), max_iterations=steps)
    with pytest.raises(Unreachable, match=f"no solution after {steps - 1} iterations"):
        method(ARM, (10, 5), radians(10, 60), max_iterations=steps - 1)


def test_newton_ends_quadratically_and_in_fewer_steps_than_broyden():
    point, q0 = (10, 5), radians(10, 60)
    newton, broyden = (method(ARM, point, q0).trace for method in METHODS)
    assert len(newton) < len(broyden) < 3 * len(newton)
    assert newton[-1].error_cm < newton[-2].error_cm ** 1.5


def test_broyden_computes_one_jacobian(monkeypatch):
    calls = []
    monkeypatch.setattr(
        inverse_iteration, "jacobian", lambda arm, q: calls.append(q) or jacobian(arm, q)
    )
    broyden_inverse(ARM, (10, 5), radians(10, 60))
    assert calls == [radians(10, 60)]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("point", "q0"),
    [
        ((10, 0), (0, 0)),
        ((19, 0), (0, 0)),
        ((20.79, 0), (0, 0)),
        ((-10, 0), (0, 0)),
        ((10, 0), (0, math.pi)),
        ((-10, 0), (0, math.pi)),
        ((0, 12), (0, 0)),
        ((20.8, 0), (1, 1)),
        ((20.8 - 2e-6, 0), (0, 0)),
    ],
    ids=[
        "inward",
        "near",
        "very near",
        "behind",
        "folded",
        "folded, behind",
        "sideways",
        "to full reach",
        "a hair inward",
    ],
)
def test_singular_poses_are_no_obstacle(method, point, q0):
    q, _ = method(FREE, point, q0)
    assert forward(FREE, q) == pytest.approx(point, abs=1e-5)


@pytest.mark.parametrize(("elbow", "sign"), [("up", 1), ("down", -1)])
def test_out_of_the_stretched_pose_the_preferred_elbow_decides(elbow, sign):
    q, _ = newton_inverse(FREE._replace(elbow=elbow), (10, 0), (0, 0))
    assert q[1] * sign > 0


@pytest.mark.parametrize("method", METHODS)
def test_a_pose_a_turn_away_comes_back_within_the_limits(method):
    q, trace = method(ARM, (10, 5), radians(370, 60))
    assert math.degrees(trace[-1].q[0]) > 180
    assert degrees(q) == pytest.approx(degrees(inverse(ARM, (10, 5), elbow="up")), abs=1e-4)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("point", "q0", "expected"),
    [
        (
            (25, 0),
            (0.1, 1),
            r"\(25, 0\) cm: no solution after 100 iterations from \(5.7, 57.3\) deg,"
            r" still 4.2 cm away; choose another start or point",
        ),
        ((0.5, 0), (0.1, 1), r"still 1.3\d* cm away"),
        ((-15, -8), (-2, 1), "within reach of the links but not of the joint limits"),
        ((math.nan, 0), (0, 1), "2 finite numbers"),
    ],
    ids=["too far", "in the hole", "limits", "NaN"],
)
def test_iterations_say_when_there_is_no_solution(method, point, q0, expected):
    arm = ARM if point != (0.5, 0) else FREE
    with pytest.raises(Unreachable, match=expected):
        method(arm, point, q0)


@pytest.mark.parametrize("q0", [(0,), (0, math.nan), (math.inf, 0)], ids=["short", "NaN", "inf"])
def test_iterations_refuse_a_start_that_is_no_pose(q0):
    with pytest.raises(ArmError, match="a pose is 2 finite angles"):
        newton_inverse(ARM, (10, 0), q0)
