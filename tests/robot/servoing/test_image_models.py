"""What image models know of themselves: how right they were lately, and how little is known."""

import pytest

from robot.servoing.camera_selection import CameraSelection
from robot.servoing.image_models import ImageModels, model_kind
from robot.servoing.measurement import Measurement
from robot.servoing.rows import Rows
from shared.arm_description import find_arm, read_arm
from shared.run_options import SERVO_METHODS

ARM = read_arm(find_arm("planar"))
POSES = [(0.0, 0.5), (0.2, 0.5), (0.2, 0.8), (0.3, 0.9)]


def seen(q):
    """A camera by which every pixel goes with a joint."""
    return [300.0 + 200.0 * q[0], 200.0 + 150.0 * q[1]]


@pytest.fixture
def models():
    """The models of a camera that has seen every joint move."""
    found = ImageModels(model_kind("kalman", ARM), ARM.joints, lambda camera: 0.5)
    for q in POSES[:3]:
        found.update(q, [Measurement("A", seen(q), (0.0, 0.0), 0.25, 6)])
    return found


def test_every_method_that_goes_by_a_model_has_the_one_of_its_name():
    for method in SERVO_METHODS:
        if method.maker.endswith(":model_servo"):
            assert model_kind(method.name, ARM).name == method.name


def test_one_step_predicted_rightly_does_not_make_up_for_a_wrong_one(models):
    before, there = {"A": seen(POSES[2])}, POSES[3]
    begin = models.wrong
    models.judge(there, before, {"A": [a + 300.0 for a in seen(there)]})
    wrong = models.wrong
    assert wrong > begin
    models.judge(there, before, {"A": seen(there)})
    assert models.wrong > 0.3 * wrong, "it is not forgotten"
    assert models.wrong < 0.7 * wrong, "but it counts for less"


def test_what_is_not_known_of_the_picture_is_a_penalty_on_the_way(models):
    selection = CameraSelection(Rows("stereo", 2), 2)
    selection.choose(["A"], ["A"], lambda camera: 0.5)
    penalty = models.penalty(selection, 2)
    covariance = models.of("A").covariance()
    for row, known in zip(penalty, covariance):
        # (A tenth of each of the two rows.)
        assert row == pytest.approx([0.2 * value for value in known])
    assert min(penalty[0][0], penalty[1][1]) > 0
