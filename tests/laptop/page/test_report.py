"""Reports of runs."""

import io
import re

import numpy as np
import pytest
from page_scene import PATH, PageScene, run

from laptop.page import report, report_figures
from laptop.page.run_traces import traces_of
from laptop.record.figures.sheet import DPI
from shared.messages import Start


@pytest.fixture
def scene(tmp_path):
    return PageScene(tmp_path)


@pytest.fixture(scope="module", autouse=True)
def small_pictures():
    """Drawn as ever, in a tenth of the pixels each way."""

    def png_of(figure):
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=DPI / 10)
        return file.getvalue()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_figures, "png_of", png_of)
        yield


@pytest.fixture
def no_pictures(monkeypatch):
    """For tests that look at the words of a report only."""
    monkeypatch.setattr(report_figures, "png_of", lambda figure: b"")


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
    assert text.count("<summary>") == 5
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
        "Not there in time", "Because; 12.5 px off", "method broyden", "mode look",
        "tolerance 7 px", "budget 90 s", "the marker", "5 moves", 'class="bad"', "Save this",
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
    (traces,) = traces_of(scene.controller.record())
    assert traces.errors[0] == pytest.approx(np.hypot(42, 2), abs=0.5)
    assert traces.final_error == pytest.approx(np.hypot(2, 2), abs=0.5)
    assert [sample.e["A.u"] for sample in traces.measured] == [-42, -32, -22, -12, -2]


def test_where_the_tip_was_not_seen_the_report_has_a_gap(scene):
    scene.show()
    scene.controller.runs.aim("A", 102.0, 118.0)
    scene.controller.runs.start()
    scene.server.tell("", 1, e={"A.u": 1.0, "A.v": 0.0})
    for tip in [(60, 120)] * 20 + [None] * 20 + [(100, 120)] * 20:
        scene.show(tip=tip)
    (traces,) = traces_of(scene.controller.record())
    assert np.isnan(traces.tips["A"]).any(axis=1).sum() == 1
    gap = traces.t[np.isnan(traces.errors)]
    assert (gap[0], gap[-1]) == pytest.approx((1.0, 2.0), abs=0.2)
    assert np.isfinite(traces.errors[[1, -2]]).all()
