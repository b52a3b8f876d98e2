"""Records of runs."""

import cv2
import numpy as np
import pytest
from page_scene import BLUE, run

from laptop.page import controller as controllers
from laptop.page import run_records
from laptop.page.run_traces import servo_runs


def test_a_run_is_recorded_from_start_to_verdict(scene):
    scene.show()
    assert scene.controller.record() is None
    scene.controller.runs.aim("A", 102.0, 118.0)
    scene.controller.runs.start("kalman")
    began = scene.t
    run(scene, 1)
    for _ in range(20):
        scene.show(tip=(150, 120), ink=BLUE)  # what comes later is no part of it
    record = scene.controller.record()
    (only,) = record.runs
    assert only.orders == scene.server.sent[0]
    assert (only.verdict, only.reason) == ("converged", "because")
    assert (only.began, only.ended) == pytest.approx((began + 0.05, began + 2.55), abs=0.06)
    assert [round(u) for _, u, _ in only.tips["A"]][::10] == [60, 70, 80, 90, 100]
    assert {(u, v) for _, u, v in only.goals["A"]} == {(102.0, 118.0)}
    assert [sample.moves for sample in only.samples] == [0, 1, 2, 3, 4, 5]
    image = cv2.imdecode(np.frombuffer(record.images["A"], np.uint8), cv2.IMREAD_COLOR)
    assert image[120, 100, 2] > 150 > 80 > image[120, 100, 0], "the tip is where it was in the end"
    assert scene.controller.state().runs == ((1, record.when, "converged"),)


def test_a_run_that_goes_on_can_be_looked_at(scene):
    scene.show()
    scene.controller.runs.start()
    scene.server.tell("", 1)
    scene.show(tip=(100, 120))
    first = scene.controller.record()
    assert (first.runs[0].verdict, first.runs[0].ended) == ("", None)
    points = len(first.runs[0].tips["A"])
    scene.show(tip=(120, 120))
    assert len(first.runs[0].tips["A"]) == points, "what was handed over changes no more"
    assert len(scene.controller.record().runs[0].tips["A"]) == points + 1


def test_a_run_that_the_brick_does_by_itself_is_recorded_without_orders(scene):
    scene.show()
    run(scene, 1)
    run(scene, 1, "marker lost")  # the program was started again, and counts anew
    first, second = (scene.controller.record(number) for number in (1, 2))
    assert first.runs[0].orders is second.runs[0].orders is None
    assert [run.verdict for run in (first.runs[0], second.runs[0])] == ["converged", "marker lost"]
    (reported,) = servo_runs(first)
    assert reported.goals["A"] == pytest.approx((102, 118), abs=0.5), "as the brick's errors tell"


def test_what_was_there_before_is_no_run(scene):
    scene.server.tell("converged", 3)
    for _ in range(3):
        scene.show()
    assert scene.controller.record() is None


@pytest.mark.long
def test_only_the_last_runs_are_kept_and_long_ones_get_thinner(scene, monkeypatch):
    monkeypatch.setattr(run_records, "MAX_POINTS", 30)
    scene.show()
    for number in range(1, run_records.MAX_GROUPS + 3):
        run(scene, number)
    assert [run.number for run in scene.controller.state().runs] == list(
        range(3, run_records.MAX_GROUPS + 3)
    )
    assert scene.controller.record(1) is None
    assert all(scene.controller.record(run.number).images for run in scene.controller.state().runs)
    tips = scene.controller.record().runs[0].tips["A"]
    assert 15 <= len(tips) <= 30
    assert tips[-1][1] - tips[0][1] == pytest.approx(40, abs=0.5)


def test_a_run_whose_brick_is_gone_for_good_is_over(scene):
    scene.show()
    scene.controller.runs.aim("A", 100, 100)
    scene.controller.runs.start()
    scene.server.tell("", run=1)
    scene.show()
    scene.server.there = False
    scene.show()
    assert scene.controller.record().runs[-1].ended is None
    scene.t += controllers.BRICK_GONE_TIMEOUT
    scene.show()
    assert scene.controller.record().runs[-1].ended is not None
