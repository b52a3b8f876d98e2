"""Reports of runs."""

import re

import numpy as np
import pytest
from page_scene import PATH, PageScene, run
from small_figures import png_of

from laptop.page import report
from laptop.page.run_traces import servo_runs
from laptop.record.run import read_run
from laptop.record.servo import figures, servo_files
from shared.messages import Start


@pytest.fixture(scope="module", autouse=True)
def small_pictures():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "png_of", png_of)
        yield


@pytest.fixture
def no_pictures(monkeypatch):
    """For tests that look at the words of a report only."""
    monkeypatch.setattr(servo_files, "draw", lambda *words: [])


def test_a_run_whose_end_was_not_heard_ends_where_the_next_begins(scene, no_pictures):
    scene.show()
    scene.server.tell("", 1, moves=5)
    scene.show()
    scene.server.tell("", 1, moves=0)
    scene.show()
    assert [run.verdict for run in scene.controller.state().runs] == ["", ""]
    assert scene.controller.record(1).runs[0].ended is not None
    assert "not heard" in report.render(scene.controller.record(1))


def test_orders_that_are_refused_are_a_record_too(scene, no_pictures):
    scene.show()
    scene.controller.runs.start()
    scene.server.tell("refused", 1, reason="no zero")
    scene.show()
    record = scene.controller.record()
    assert (record.runs[0].verdict, record.runs[0].orders) == ("refused", Start())
    assert "No zero" in report.render(record)


def test_the_runs_along_a_path_are_one_record(scene, no_pictures):
    scene.show()
    scene.controller.runs.follow("A", PATH)
    scene.controller.runs.start()
    for number in range(1, 6):
        run(scene, number, steps=1)
    run(scene, 6)  # the brick's own
    record = scene.controller.record(1)
    assert [run.orders.goals["A"][0] for run in record.runs] == [50, 75, 100, 125, 150]
    assert len(scene.controller.record(2).runs) == 1
    text = report.render(record)
    assert text.count("<summary>What the servo measured and did") == 5
    assert "5 points of the path reached" in text


@pytest.mark.short("2")
@pytest.mark.parametrize("cameras", [1, 2])
def test_a_report_is_one_file_that_says_what_was_ordered_and_what_came_of_it(tmp_path, cameras):
    scene = PageScene(tmp_path, cameras=cameras)
    scene.show()
    scene.controller.runs.start("broyden", tolerance=7.0, budget=90.0)
    run(scene, 1, "budget spent", camera="AB"[cameras - 1])
    text = report.render(scene.controller.record())
    for words in (
        "Not there in time", "Because; 12.5 px off", ">broyden<", "mode stream",
        "tolerance 7 px", "budget 90 s", "the marker", "5 moves", 'class="verdict bad"',
        "Save this",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("<img") == 3
    assert not re.search(r"(src|href)=.?(http|/)", text)


def test_what_the_brick_says_is_no_markup_of_the_report(scene, no_pictures):
    scene.show()
    scene.controller.runs.start()
    scene.server.tell("refused", 1, reason="<script>alert(1)</script>")
    scene.show()
    assert "<script" not in report.render(scene.controller.record())


def test_the_error_in_a_report_is_what_the_tracker_saw(scene):
    scene.show()
    scene.controller.runs.aim("A", 102.0, 118.0)
    scene.controller.runs.start()
    run(scene, 1)
    (reported,) = servo_runs(scene.controller.record())
    assert reported.errors[0, 1] == pytest.approx(np.hypot(42, 2), abs=0.5)
    assert reported.seen_error == pytest.approx(np.hypot(2, 2), abs=0.5)
    assert [row[3] for row in reported.steps.rows] == [-42, -32, -22, -12, -2]
    assert reported.samples["A"][:, 0].tolist() == [60, 70, 80, 90, 100]


def test_where_the_tip_was_not_seen_the_report_has_a_gap(scene):
    scene.show()
    scene.controller.runs.aim("A", 102.0, 118.0)
    scene.controller.runs.start()
    scene.server.tell("", 1, e={"A.u": 1.0, "A.v": 0.0})
    for tip in [(60, 120)] * 20 + [None] * 20 + [(100, 120)] * 20:
        scene.show(tip=tip)
    (reported,) = servo_runs(scene.controller.record())
    assert np.isnan(reported.paths["A"]).any(axis=1).sum() == 1
    t, errors = reported.errors.T
    gap = t[np.isnan(errors)]
    assert (gap[0], gap[-1]) == pytest.approx((1.0, 2.0), abs=0.2)
    assert np.isfinite(errors[[1, -2]]).all()


@pytest.mark.long
def test_a_run_is_kept_where_it_is_asked_for(scene, tmp_path):
    scene.show()
    scene.controller.runs.start("broyden")
    run(scene, 1)
    text = report.render(scene.controller.record())
    assert "Save this" in text
    assert "It is kept" not in text
    folder = tmp_path / "runs" / "mine"
    folder.mkdir(parents=True)
    for _ in range(2):  # when there is more of it, again
        text = report.render(scene.controller.record(), folder)
    reported = read_run(folder)
    assert (reported.kind, reported.methods, reported.ending.is_well) == (
        "servo",
        ["broyden"],
        True,
    )
    assert reported.rows("goals")[0]["ended"] == "converged"
    assert {"errors.png", "report.html", "run.json"} <= {file.name for file in folder.iterdir()}
    assert text.count("<img") == (folder / "report.html").read_text().count("<img")
    assert "It is kept for a lab report, too: runs/mine" in text
    assert ", status" not in text


def test_why_a_run_could_not_be_kept_stands_in_its_report(scene, no_pictures):
    scene.show()
    run(scene, 1)
    text = report.render(scene.controller.record(), why_not_stored="cannot write to runs: full")
    assert "cannot write to runs: full" in text
