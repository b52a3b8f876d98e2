"""Logs of the servo and demos: goals, figures, steps."""

import csv
import io
import json
import re

import pytest
from servo_log import line, log_text

from laptop.record.report.findings import SERVO, DamagedRun, LabRun
from laptop.record.report.servo_runs import GOALS, as_csv, is_log, read_demo, read_servo_log
from laptop.record.servo import demo_report


def read(tmp_path, text):
    file = tmp_path / "servo.jsonl"
    file.write_text(text)
    run = LabRun("servo.jsonl", SERVO, "")
    read_servo_log(run, file)
    return run


def test_a_log_tells_goal_way_and_steps(tmp_path):
    run = read(tmp_path, log_text(off=2.0, method="broyden"))
    goal = ("planar", "marker", "broyden", "converged", "4", "4.5", "2.0", "\u2013", "\u2013")
    assert run.results == [(GOALS, goal)]
    assert (run.methods, run.arm, run.seconds) == (["broyden"], "planar", 4.5)
    assert len(run.figures) == 2
    assert [len(table.rows) for table in run.tables] == [5]
    raw = run.data[0]
    rows = list(csv.DictReader(io.StringIO(raw.source)))
    assert raw.name == "servo-steps.csv"
    assert [row["error_px"] for row in rows] == ["200", "150.5", "101", "51.5", "2"]
    assert rows[1]["shoulder_deg"] == "5.729577951"
    assert rows[0]["condition"] == ""


def test_two_cameras_have_a_panel_each(tmp_path):
    run = read(tmp_path, log_text(cameras="AB"))
    assert run.set_up[0][1].endswith("tolerance 5 px, camera A")  # only A has seen something
    assert len(run.figures) == 2


def test_a_log_in_which_nothing_was_seen_says_so(tmp_path):
    text = log_text().splitlines(keepends=True)
    run = read(tmp_path, text[0] + text[-1])
    assert run.gaps == ["its log holds no place at which the marker was seen"]
    assert (run.figures, run.tables, run.data) == ([], [], [])


def test_very_many_steps_are_a_csv_only(tmp_path, no_servo_figures):
    head, *others = log_text().splitlines(keepends=True)
    steps = [text for text in others if '"step"' in text]
    run = read(tmp_path, head + "".join(steps * 8))
    assert run.tables == []
    assert "its 40 steps are in servo-steps.csv, too many to print" in run.gaps


@pytest.mark.parametrize(
    "text",
    [
        line("run"),
        line("run", method="chain", tolerance="wide"),
        log_text().replace('"t": 4.5', '"t": "soon"'),
        log_text().replace('"s": [', '"s": [["x"], '),
    ],
)
def test_a_log_that_is_not_as_it_is_written_is_damaged(tmp_path, text):
    with pytest.raises(DamagedRun, match=r"^servo.jsonl is not as visual_servoing.py writes it$"):
        read(tmp_path, text)


def test_a_number_beyond_all_that_a_run_measures_is_named(tmp_path):
    text = log_text().replace('"t": 4.0', '"t": 1e308')
    with pytest.raises(DamagedRun, match=r"^servo.jsonl holds 1e308, which is beyond all that a"):
        read(tmp_path, text)


def test_a_log_of_nothing_but_zeros_is_drawn_without_a_warning(tmp_path, recwarn):
    text = re.sub(r'"(error|condition)": [0-9.]+', r'"\1": 0.0', log_text(off=0.0))
    read(tmp_path, text)
    assert [str(warning.message) for warning in recwarn] == []


def test_a_log_is_known_by_its_first_line(tmp_path):
    file = tmp_path / "x.jsonl"
    file.write_text(log_text())
    assert is_log(file)
    file.write_text('{"event": "ready"}')
    assert not is_log(file)
    assert not is_log(tmp_path / "none.jsonl")


def a_demo(folder, **changes):
    (folder / "goal-1.jsonl").write_text(log_text())
    record = {
        "name": "goal 1",
        "log": "goal-1.jsonl",
        "goal": [400.0, 300.0],
        "path": [[0.0, 200.0, 300.0], [4.5, 398.0, 300.0]],
        "miss_mm": 1.8,
    }
    results = {
        "arm": "planar",
        "scene": "seed=0",
        "cameras": "A",
        "size": [64, 48],
        "lines": [{"greatest_mm": 1.2}],
        "seconds": 61.0,
        "trouble": "",
        "approaches": [record],
        "rival": None,
        **changes,
    }
    (folder / "demo.json").write_text(json.dumps(results))


def test_a_demo_tells_what_was_true(tmp_path, monkeypatch):
    monkeypatch.setattr(demo_report, "CAPTIONS", [("", "The way.", lambda run: b"\x89PNG")])
    a_demo(tmp_path)
    (tmp_path / "track.csv").write_text("frame,t,marker,u,v,confidence\n")
    run = read_demo("demo", tmp_path)
    goal = ("planar", "goal 1", "chain", "converged", "4", "4.5", "2.0", "2.0", "1.8")
    assert [row for name, row in run.results if name == GOALS] == [goal]
    assert [figure.caption for figure in run.figures] == ["The way."]
    assert [raw.name for raw in run.data] == [
        *("goal-1-steps.csv", "goal-1-true-path.csv", "track.csv")
    ]
    assert run.data[1].source.splitlines()[1] == "0,200,300"
    assert run.outcome == "all lines drawn, all goals reached"


def test_its_lines_stand_once_where_its_drawing_is_a_run_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(demo_report, "CAPTIONS", [])
    a_demo(tmp_path)
    assert [name for name, _ in read_demo("demo", tmp_path).results] == ["paths", GOALS]
    (tmp_path / "drawing").mkdir()
    (tmp_path / "drawing" / "summary.json").write_text("{}")
    assert [name for name, _ in read_demo("demo", tmp_path).results] == [GOALS]


@pytest.mark.parametrize("changes", [{"size": None}, {"lines": 3}, {"approaches": [{}]}])
def test_a_demo_that_is_not_as_it_is_written_is_damaged(tmp_path, changes):
    a_demo(tmp_path, **changes)
    with pytest.raises(DamagedRun, match=r"^demo.json is not of a demo; run the demo again$"):
        read_demo("demo", tmp_path)


def test_a_damaged_picture_of_a_demo_is_the_cause(tmp_path):
    a_demo(tmp_path)
    (tmp_path / "camera.png").write_bytes(b"hello")
    with pytest.raises(DamagedRun, match=r"^camera.png is neither PNG nor JPEG$"):
        read_demo("demo", tmp_path)


def test_a_csv_has_an_empty_cell_for_what_is_not_there():
    assert as_csv(("a", "b"), [[1.5, None], ["x", 2]]) == "a,b\n1.5,\nx,2\n"
