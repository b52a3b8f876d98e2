"""What image models know of themselves: how right they were lately, and how little is known."""

import pytest

from robot.servoing.camera_selection import CameraSelection
from robot.servoing.image_model import straight
from robot.servoing.image_models import ImageModels, ModelKind, model_kind
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


class Learner:
    """A model that only counts what it is to learn, before a camera that `seen` describes."""

    def __init__(self):
        self.learned = []

    def observe(self, q, s, variance, standing=True):
        if not standing:
            self.learned.append(tuple(s))

    def shape(self):
        return straight([[200.0, 0.0], [0.0, 150.0]])

    def seen_from(self, q, s):
        return self.shape()


@pytest.fixture
def watched():
    """The models of a camera that has seen the arm stand at (0, 0), and what is learned."""
    learner = Learner()
    found = ImageModels(ModelKind("any", lambda camera: learner), ARM.joints, lambda camera: 0.5)
    found.update((0.0, 0.0), [Measurement("A", seen((0.0, 0.0)), (0.0, 0.0), 0.25, 6)])
    return found, learner.learned


def test_a_frame_in_motion_that_follows_is_learned_from_at_once(watched):
    models, learned = watched
    for q in ((0.02, 0.0), (0.4, 0.1), (1.0, 0.4)):  # near the one before, or as predicted
        models.observe_in_motion("A", q, seen(q))
        assert learned[-1] == tuple(seen(q))


def test_an_outlier_in_motion_is_left_out_and_delays_nothing(watched):
    models, learned = watched
    models.observe_in_motion("A", (0.1, 0.0), seen((0.1, 0.0)))
    models.observe_in_motion("A", (0.2, 0.0), [20.0, 400.0])
    assert len(learned) == 1
    models.observe_in_motion("A", (0.3, 0.1), seen((0.3, 0.1)))
    assert learned[1:] == [tuple(seen((0.3, 0.1)))]


def test_what_no_model_expects_is_learned_from_once_its_neighbours_confirm_it(watched):
    models, learned = watched
    path = [[300.0 - 150.0 * k, 200.0 + 200.0 * k] for k in (1, 2, 3, 4)]
    for k, s in enumerate(path, 1):
        models.observe_in_motion("A", (0.1 * k, 0.0), s)
    assert learned == [tuple(s) for s in path[1:3]]
