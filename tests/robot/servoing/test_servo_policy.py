"""The servo's policy, number by number: each of its constants changed alone makes a test here fail.

The model is exact, or wrong by a share that is set; joints go where they are told.
"""

import math

import pytest

from robot.servoing import servo as servo_module
from robot.servoing import target_poses
from robot.servoing.exploration import is_seen_moving
from robot.servoing.image_model import straight
from robot.servoing.image_models import ModelKind
from robot.servoing.measurement import Measurement
from robot.servoing.servo import Servo
from shared.arm_description import find_arm, read_arm
from shared.verdicts import CONVERGED

ARM = read_arm(find_arm("planar"))
DEG = math.radians(1)
VARIANCE = 0.01
TOLERANCE = 5.0
SCALE = 600.0
"""px per rad, of either joint along an axis of its own."""


class Known:
    """A model that knows J but for a factor."""

    factor = 1.0

    def observe(self, q, s, variance, standing=True):
        """Nothing is learned."""

    def prepare(self, q, s, variance):
        """Nothing is learned."""
        return iter(())

    def seen_from(self, q, s):
        """J as it is believed to be."""
        scale = self.factor * SCALE
        offset = [y - scale * a for y, a in zip(s, q)]
        return straight(((scale, 0.0), (0.0, scale)), offset)

    def covariance(self):
        """There is no doubt."""
        return [[0.0, 0.0], [0.0, 0.0]]

    def inflate_variances(self):
        """There is no doubt."""


def servo(name="known"):
    model = Known()
    return Servo(
        ARM, ModelKind(name, lambda camera: model, far=name == "chain"), TOLERANCE, known=True
    ), model


def look(one, q, goal, variance=VARIANCE):
    """The Decision at q for the goal (px), seen exactly."""
    s = tuple(SCALE * a for a in q)
    return one.decide(q, [Measurement("A", s, goal, variance, 6)])


def test_a_servo_keeps_few_things_in_mind():
    assert len(vars(servo()[0])) <= 15


@pytest.mark.parametrize(("sigmas", "ends"), [(3.1, True), (2.9, False)])
def test_it_ends_three_standard_deviations_within_the_tolerance(sigmas, ends):
    one, _ = servo()
    error = TOLERANCE - sigmas * math.sqrt(VARIANCE)
    decision = look(one, (0.3, 0.4), (SCALE * 0.3 + error, SCALE * 0.4))
    assert (decision.verdict == CONVERGED) is ends


@pytest.mark.parametrize(("share", "ends"), [(0.69, True), (0.71, False)])
def test_it_ends_at_seven_tenths_of_the_tolerance_however_noisy(share, ends):
    one, _ = servo()
    decision = look(one, (0.3, 0.4), (SCALE * 0.3 + share * TOLERANCE, SCALE * 0.4), 4.0)
    assert (decision.verdict == CONVERGED) is ends


@pytest.mark.parametrize(("share", "ends"), [(0.99, True), (1.01, False)])
def test_what_was_corrected_once_ends_at_the_tolerance(share, ends):
    one, _ = servo()
    goal = (SCALE * 0.3, SCALE * 0.4)
    assert look(one, (0.3 + 0.97 * TOLERANCE / SCALE, 0.4), goal).action == "move"
    decision = look(one, (0.3 + share * TOLERANCE / SCALE, 0.4), goal)
    assert (decision.verdict == CONVERGED) is ends


def test_a_degree_is_kept_from_the_limits():
    one, _ = servo()
    upper = ARM.joints[0].upper
    decision = look(one, (upper - 4 * DEG, 0.4), (SCALE * (upper + 1.0), SCALE * 0.4))
    assert decision.q[0] == pytest.approx(upper - DEG)


def test_the_first_step_is_of_35_degrees_at_most():
    one, _ = servo()
    one_step = look(one, (-1.0, 0.4), (SCALE * 0.9, SCALE * 0.4)).q
    waypoint = 150 / SCALE  # a model of one place alone goes no farther at once
    assert one_step[0] == pytest.approx(-1.0 + waypoint, abs=1e-3)
    assert one._region == pytest.approx(35 * DEG)


@pytest.mark.parametrize(
    ("factor", "step", "region"),
    [
        # believed / true: a share |factor - 1| of the step is predicted wrongly
        (1.29, 10, 35),  # right enough: as it was, for twice the step is less
        (1.29, 20, 40),  # twice the step
        (1.29, 40, 60),  # but 60 degrees at most
        (1.31, 20, 35),  # neither right nor wrong
        (1.59, 20, 35),
        (1.61, 20, 10),  # wrong: half the step
        (1.61, 5, 3),  # but 3 degrees at least
    ],
)
def test_the_region_of_trust_follows_how_right_the_model_was(factor, step, region):
    one, model = servo()
    model.factor = factor
    goal = (SCALE * 1.2, SCALE * 0.4)
    look(one, (-1.0, 0.4), goal)
    look(one, (-1.0 + step * DEG, 0.4), goal)
    assert one._region == pytest.approx(region * DEG)


@pytest.mark.parametrize(("moved", "judged"), [(5.9, False), (6.1, True)])
def test_a_step_that_moves_the_marker_by_less_than_six_deviations_tells_nothing(moved, judged):
    one, model = servo()
    model.factor = 2.0
    goal = (SCALE * 1.2, SCALE * 0.4)
    look(one, (-1.0, 0.4), goal)
    look(one, (-1.0 + moved * one.estimator.sigma / SCALE, 0.4), goal)
    assert (one._region != pytest.approx(35 * DEG)) is judged


@pytest.mark.parametrize("times", range(1, 5))
def test_near_the_goal_steps_that_lead_nowhere_get_shorter(times):
    one, _ = servo()
    goal, off = (SCALE * 0.3, SCALE * 0.4), 2 * TOLERANCE / SCALE
    for _ in range(times):
        decision = look(one, (0.3 - off, 0.4), goal)
    gain = 1 / (1 + 0.5 * (times - 1))
    assert decision.q[0] - (0.3 - off) == pytest.approx(gain * off, rel=1e-3)


@pytest.mark.parametrize("other", [None, (-1.0, 0.4)], ids=["there is none", "there is one"])
@pytest.mark.parametrize(("share", "looks"), [(0.29, False), (0.31, True)])
def test_another_posture_is_looked_for_where_three_tenths_would_be_left(
    monkeypatch, share, looks, other
):
    one, _ = servo("chain")
    looked = []

    def best_posture(image, goal, q, walls, best, left, tolerance, penalty=None):
        looked.append(left)
        return best if other is None else (list(other), 0.0)

    for module in (target_poses, servo_module):
        monkeypatch.setattr(module, "best_posture", best_posture)
    most = ARM.joints[0].upper - DEG
    beyond = 60 * DEG * share / (1 - share)  # what a goal beyond the limit leaves over
    look(one, (most - 60 * DEG, 0.4), (SCALE * (most + beyond), SCALE * 0.4))
    assert bool(looked) is looks
    assert one.detour_pose == (list(other) if looks and other else None)


@pytest.mark.parametrize(
    ("slope", "sigma", "moves"),
    [(40, 2.0, False), (50, 2.0, True), (20, 0.1, False), (23, 0.1, True)],
)
def test_a_step_of_eight_degrees_shows_what_is_clear_of_the_noise(slope, sigma, moves):
    """0.14 rad: 6 px of a noise of 2 px, and never less than 3 px."""
    assert is_seen_moving(((1.0, 0.6 * slope), (0.0, 0.8 * slope)), sigma) is moves
