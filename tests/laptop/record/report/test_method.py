"""Aim, method and questions: what belongs to the runs, and formulas that are true."""

import math

import pytest

from laptop.record.report import method
from laptop.record.run import ACCURACY, CALIBRATION, DRAWING, SERVO
from robot.motion.kinematics import forward, jacobian
from shared.arm_description import find_arm, read_arm
from shared.run_options import METHODS


@pytest.fixture
def plain(monkeypatch):
    """Formulas stay TeX: setting them takes long."""
    monkeypatch.setattr(method, "formula", lambda tex: tex)


def titles(*arguments):
    return [step.title for step in method.method(*arguments)]


def test_formulas_are_those_of_the_arms_and_of_what_was_done(plain):
    assert titles(["planar"], [DRAWING], []) == [
        "Forward kinematics of the arm in the plane",
        "Inverse kinematics of the arm in the plane",
        "Jacobian of the arm in the plane",
        "Deviation of a drawing",
    ]
    assert titles([], [SERVO], ["broyden"]) == [
        *("Image Jacobian", "Step (method broyden)", "Broyden's update")
    ]
    assert titles([], [SERVO], ["report"])[1:] == [
        *("The lab report's step (method report)", "Broyden's update")
    ]
    assert titles([], [SERVO], ["chain", "kalman"])[1:] == [
        "Step (method chain and kalman)",
        "Broyden's update, weighted by a Kalman filter",
        "The image of a chain of joints",
    ]
    assert titles([], [ACCURACY, CALIBRATION], []) == [
        *("Accuracy and repeatability", "Calibration")
    ]
    assert titles([], [], []) == []


def test_every_method_of_servoing_has_its_step(plain):
    for name in METHODS:
        assert any(f"method {name})" in title for title in titles([], [SERVO], [name]))


def test_a_formula_is_a_picture_that_holds_itself():
    (step,) = method.method([], [DRAWING], [])
    assert str(step.formulas[0]).startswith('<img class="formula" alt="')
    assert "data:image/svg+xml;base64," in step.formulas[0]


def test_aim_and_questions_are_those_of_the_runs():
    both = method.aim([DRAWING, SERVO])
    assert both.startswith("The aim is to let the arm draw")
    assert "to bring the tip to goals" in both
    assert "camera" not in method.aim([DRAWING])
    assert method.aim([]) == "The aim is to run programs on the arm and to see what it does."
    assert method.questions([]) == [method.LAST_QUESTION]
    assert len(method.questions([DRAWING])) == 4


def test_what_the_formulas_of_the_arm_in_space_say_is_what_the_programs_compute():
    """The TeX says: x = r cos q1, |det J| = l1 l2 |r sin q3|, q2 and q3 by atan2."""
    arm = read_arm(find_arm("spatial"))
    h, l1, l2 = (joint.link for joint in arm.joints)
    q1, q2, q3 = q = (0.4, 1.1, -0.9)
    r = l1 * math.cos(q2) + l2 * math.cos(q2 + q3)
    x, y, z = forward(arm, q)
    assert (x, y) == pytest.approx((r * math.cos(q1), r * math.sin(q1)))
    assert z == pytest.approx(h + l1 * math.sin(q2) + l2 * math.sin(q2 + q3))
    (a, b, c), (d, e, f), (g, i, j) = jacobian(arm, q)
    determinant = a * (e * j - f * i) - b * (d * j - f * g) + c * (d * i - e * g)
    assert abs(determinant) == pytest.approx(l1 * l2 * abs(r * math.sin(q3)))
    square = r**2 + (z - h) ** 2
    bend = 2 * math.atan2(math.sqrt((l1 + l2) ** 2 - square), math.sqrt(square - (l1 - l2) ** 2))
    assert -bend == pytest.approx(q3)
    inside = math.atan2(l2 * math.sin(q3), l1 + l2 * math.cos(q3))
    assert math.atan2(z - h, r) - inside == pytest.approx(q2)
