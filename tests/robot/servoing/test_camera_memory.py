"""What a run has seen serves the next one, unless camera, marker or zero are elsewhere since."""

import json
import math
import os

import pytest
from servo_rig import Camera

from robot.servoing.camera_memory import CameraMemory
from robot.servoing.image_models import model_kind
from robot.servoing.measurement import Measurement
from robot.servoing.runs import make_servo
from robot.servoing.servo import Servo
from shared.arm_description import find_arm, read_arm
from shared.run_options import METHODS

ARM = read_arm(find_arm("planar"))
SEEN = [(-0.3, 0.8), (0.1, 0.9), (0.4, 0.6), (0.5, 1.2)]
HERE, THERE = (0.4, 0.7), (-0.2, 1.3)
VIEWS = {"A": [((0.1, 0.2), (300.5, 200.25), 0.5)], "B": [((0.3, 0.4), (1.0, 2.0), 4.0)]}
OTHER_GOAL = 2.0, 17.0


def above(q, shift=0.0):
    """A camera from above, px."""
    x = sum(j.link * math.cos(a) for j, a in zip(ARM.joints, (q[0], q[0] + q[1])))
    y = sum(j.link * math.sin(a) for j, a in zip(ARM.joints, (q[0], q[0] + q[1])))
    return 300 + shift + 9 * x + 4 * y, 400 + 4 * x - 8 * y


def learned():
    """What a run has seen, by camera."""
    return {"A": [(q, above(q), 0.1) for q in SEEN]}


def servo(views=None):
    one = Servo(ARM, model_kind("chain", ARM), 5.0)
    one.models.recall(learned() if views is None else views)
    return one


def decision(one, shift=0.0, cameras="A"):
    """What is decided at HERE for a goal at THERE, by cameras that have moved by so many px."""
    seen, goal = above(HERE, shift), above(THERE, shift)
    return one.decide(HERE, [Measurement(camera, seen, goal, 0.1, 6) for camera in cameras])


@pytest.fixture
def memory(tmp_path):
    """A memory, and the lines that it says."""
    said = []
    return CameraMemory(ARM, str(tmp_path), said.append), said


def test_the_first_step_goes_towards_the_goal():
    one = servo()
    first = decision(one)
    assert (first.action, first.reason) == ("move", "")
    region = max(abs(b - a) for a, b in zip(HERE, first.q))
    whole = max(abs(b - a) for a, b in zip(HERE, THERE))
    on_the_way = [a + (b - a) * region / whole for a, b in zip(HERE, THERE)]
    assert first.q == pytest.approx(on_the_way, abs=math.radians(1))


@pytest.mark.parametrize("prepares", [True, False])
@pytest.mark.parametrize(("shift", "moved"), [(4.0, False), (40.0, True)])
def test_a_camera_that_was_moved_is_explored_anew_and_that_is_said(shift, moved, prepares):
    one = servo()
    if prepares:
        frames = [(0.0, above(HERE, shift), above(THERE, shift))] * 3
        assert list(one.prepare(HERE, {"A": frames})) is not None
    first = decision(one, shift)
    assert first.action == ("explore" if moved else "move")
    assert first.reason.startswith("camera A does not see the tip where") == moved
    assert decision(one, shift).reason == "", "it is said once"
    frames = one.models.views()["A"]
    assert (len(frames) > len(SEEN)) == (not moved)


def test_far_from_what_was_seen_more_may_be_off():
    far = [(q, above(q), 0.1) for q in [(-1.2, 0.5), (-1.0, 0.6), (-1.1, 0.9), (-0.9, 0.7)]]
    assert decision(servo({"A": far}), 20.0).action == "move"


def test_a_camera_that_is_new_beside_one_that_is_known_is_learned_on_the_way():
    assert decision(servo(), cameras="AB").action == "move"


def test_one_that_is_not_there_any_more_is_dropped_silently():
    one = servo(dict(learned(), C=learned()["A"]))
    assert decision(one).reason == ""
    assert sorted(one.models.views()) == ["A"]


def test_a_method_that_knows_one_place_alone_has_nothing_to_store():
    one = Servo(ARM, model_kind("kalman", ARM), 5.0)
    decision(one)
    assert one.models.views() == {}


@pytest.mark.parametrize("method", sorted(METHODS))
def test_each_servo_says_whether_what_it_has_seen_may_be_recalled(method):
    one, _ = make_servo(ARM, method, "look", 5.0)
    assert (one.far_models is not None) == (method == "chain")
    if one.far_models:
        one.far_models.recall(learned())
        assert [frame[:2] for frame in one.far_models.views()["A"]] == [(q, above(q)) for q in SEEN]


# ---- the file


def test_it_reads_what_it_has_written(memory):
    one, said = memory
    assert one.load() == {}
    one.save(VIEWS)
    assert {
        camera: [(tuple(q), tuple(s), variance) for q, s, variance in frames]
        for camera, frames in one.load().items()
    } == VIEWS
    assert said == []


USELESS = {
    "": "is no JSON",
    "[]": "holds no JSON object",
    "{}": "lacks something",
    '{"version": 2, "cameras": {}}': "is of another version",
    '{"version": 1, "cameras": 3}': "lacks something",
    '{"version": 1, "cameras": {"A": 3}}': "lacks something",
    '{"version": 1, "cameras": {"A": [3]}}': "lacks something",
    '{"version": 1, "cameras": {"A": []}}': "lacks something",
    '{"version": 1, "cameras": {"A": [[1, 2, 3, 4, "5"]]}}': "something else where a number",
    '{"version": 1, "cameras": {"A": [[1, 2, 3, 4, 5, 6]]}}': "is of another arm",
    '{"version": 1, "cameras": {"A": [[1, 2, 3, 4, 0]]}}': "is of another arm",
}


@pytest.mark.parametrize("text", sorted(USELESS))
def test_a_file_that_is_of_no_use_is_named_and_not_used(memory, text):
    one, said = memory
    with open(one.file, "w") as file:
        file.write(text)
    assert one.load() == {}
    (line,) = said
    assert line.startswith(one.file)
    assert USELESS[text] in line
    one.save(VIEWS)
    assert sorted(one.load()) == ["A", "B"]


def test_a_folder_in_its_place_stops_nobody(memory):
    one, said = memory
    os.makedirs(one.file)
    assert one.load() == {}
    one.save(VIEWS)
    assert ["is a folder" in said[0], "cannot write" in said[1], len(said)] == [True, True, 2]


# ---- programs


class ShiftedCamera(Camera):
    """A camera that somebody has pushed aside and turned."""

    def pixel(self, p):
        u, v = super().pixel(p)
        return 0.8 * u + 0.6 * v - 60, -0.6 * u + 0.8 * v + 200


def actions(shown):
    return [line["action"] for line in shown.log if line["kind"] == "step"]


@pytest.mark.parametrize("mode", ["look", "stream"])
def test_the_next_program_explores_no_more(watched, mode):
    w = watched()
    first = w.run("--mode", mode)
    assert actions(first)[0] == "explore"
    w.goal = OTHER_GOAL
    second = w.run("--mode", mode)
    assert second.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    assert actions(second)[0] == "move"
    assert "explore" not in actions(second)


def test_a_camera_that_was_moved_between_two_programs_is_noticed_at_once(watched):
    w = watched()
    w.run("--mode", "stream")
    w.goal, w.cameras["A"] = OTHER_GOAL, ShiftedCamera()
    second = w.run("--mode", "stream")
    assert second.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    assert actions(second)[0] == "explore"
    (note,) = [line["text"] for line in second.log if line["kind"] == "note"]
    assert note.startswith("camera A does not see the tip where the last run would have")
    assert note in second.out
    third = w.run("--mode", "stream")
    assert [line for line in third.log if line["kind"] == "note"] == []


def test_a_run_that_fails_stores_nothing(watched):
    w = watched()
    w.run("--mode", "stream")
    file = CameraMemory(w.arm, w.state_folder, print).file
    with open(file) as stored:
        before = json.load(stored)
    w.goal = 60.0, 0.0
    shown = w.run("--mode", "stream", "--budget", "15")
    assert shown.log[-1]["verdict"] != "converged"
    with open(file) as stored:
        assert json.load(stored) == before
