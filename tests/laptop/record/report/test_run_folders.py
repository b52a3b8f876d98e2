"""Which runs are found in a folder, and what is said of those that cannot be read."""

import json
import os

import pytest
from lab_runs import TRACE, drawn, simulated
from servo_log import log_text

from laptop.record.report.findings import CALIBRATION, DRAWING, SERVO, TRACKING
from laptop.record.report.run_folders import CONTENTS, NoRuns, read_runs

pytestmark = pytest.mark.usefixtures("no_servo_figures")


def names(runs):
    return [(run.label, run.name, run.kind) for run in runs]


def test_runs_are_found_however_deep_and_numbered_by_their_folders(tmp_path):
    simulated(tmp_path / "b" / "deep" / "line")
    drawn(tmp_path / "a")
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "a", DRAWING), ("R2", "b/deep/line", DRAWING)]
    assert left_out == []


def test_the_folder_itself_may_be_a_run(tmp_path):
    simulated(tmp_path / "line-1")
    runs, _ = read_runs(tmp_path / "line-1")
    assert names(runs) == [("R1", "line-1", DRAWING)]


def test_hidden_folders_and_the_data_of_a_report_are_no_runs(tmp_path):
    simulated(tmp_path / "line")
    simulated(tmp_path / ".part")
    simulated(tmp_path / "lab-report-data")
    (tmp_path / "lab-report-data" / CONTENTS).write_text("file,from,holds\n")
    assert names(read_runs(tmp_path)[0]) == [("R1", "line", DRAWING)]


def test_a_run_that_lies_too_deep_is_left_out_by_its_folder(tmp_path):
    deep = tmp_path / "1/2/3/4/5/6/7/8"
    simulated(deep)
    assert read_runs(tmp_path)[1] == []
    (deep / ".hidden").mkdir()
    assert read_runs(tmp_path)[1] == []
    simulated(deep / "9")
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "1/2/3/4/5/6/7/8", DRAWING)]
    assert left_out == [
        (
            "1/2/3/4/5/6/7/8",
            "the folders in it are more than 8 deep, and are not looked into; give this folder",
        )
    ]


def test_a_linked_folder_is_left_out_where_the_report_does_not_meet_it(tmp_path):
    simulated(tmp_path / "elsewhere")
    simulated(tmp_path / "runs" / "line")
    (tmp_path / "runs" / "latest").symlink_to("line")
    (tmp_path / "runs" / "other").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "runs" / ".hidden").symlink_to(tmp_path / "elsewhere")
    runs, left_out = read_runs(tmp_path / "runs")
    assert names(runs) == [("R1", "line", DRAWING)]
    assert left_out == [
        ("other", "it is a link, which is not followed; give the folder that it leads to")
    ]


@pytest.mark.parametrize("function", ["scandir", "stat"])
def test_a_folder_that_may_not_be_read_is_left_out(tmp_path, monkeypatch, function):
    simulated(tmp_path / "line")
    simulated(tmp_path / "secret")
    true = getattr(os, function)

    def refusing(path, **words):
        told = str(path)
        if told.endswith("secret") and function == "scandir" or "secret" + os.sep in told:
            raise PermissionError(13, "Permission denied", told)
        return true(path, **words)

    monkeypatch.setattr(os, function, refusing)
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "line", DRAWING)]
    assert left_out == [("secret", "it cannot be read: Permission denied")]


def test_an_empty_folder_and_one_without_runs_are_told_apart(tmp_path):
    with pytest.raises(NoRuns, match=r"is empty; give the folder that --out of"):
        read_runs(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(NoRuns, match=r"holds no run; give the folder that --out of"):
        read_runs(tmp_path)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "it is no JSON (line 1); do this run again"),
        ("\xff\xfe", "it is no JSON; do this run again"),
        ("[" * 100_000, "it is no JSON; do this run again"),
        ("[1]", "it holds no JSON object; do this run again"),
        ("{}", "it is of none of these: simulate, draw --simulate, accuracy, calibrate"),
        ('{"script": 7}', "'script' is no text; do this run again"),
        ('{"script": "a.py", "args": "x"}', "'args' is not as it is written; do this run again"),
        ('{"script": "a.py", "paths": [1]}', "'paths' is not as it is written; do this run again"),
        ('{"script": "a.py", "status": "0"}', "'status' is no number; do this run again"),
        ('{"script": "a.py", "arm_numbers": 1}', "'arm_numbers' is not as it is written"),
        ('{"drawing": "x", "greatest_mm": true}', "'greatest_mm' is no number; do this run again"),
        ('{"kind": "accuracy"}', "it holds no figure; do this run again"),
        (
            '{"kind": "accuracy", "x": ' + 500 * "[" + 500 * "]" + "}",
            "it is nested too deeply; do this run again",
        ),
    ],
)
def test_a_damaged_summary_is_left_out_with_its_reason_and_the_others_stand(tmp_path, content, why):
    simulated(tmp_path / "good")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "summary.json").write_bytes(content.encode("latin-1"))
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "good", DRAWING)]
    assert left_out == [("bad/summary.json", why)]


def test_if_none_can_be_read_the_first_reason_is_told(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text("{")
    with pytest.raises(NoRuns, match=r"can be read: a/summary.json: it is no JSON .*\(and 1 more"):
        read_runs(tmp_path)


def test_a_trace_alone_is_left_out(tmp_path):
    simulated(tmp_path / "good")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "trace.csv").write_text(TRACE)
    assert read_runs(tmp_path)[1] == [("bad/trace.csv", "there is no summary.json beside it")]


@pytest.mark.parametrize("beside", ["servo", "."])
def test_a_log_belongs_to_the_run_that_wrote_it_beside_or_above_its_folder(tmp_path, beside):
    words = ["--log", "/tmp/x/servo.jsonl"]
    simulated(tmp_path / "servo", script="visual_servoing.py", args=words, paths=[])
    (tmp_path / beside / "servo.jsonl").write_text(log_text())
    runs, _ = read_runs(tmp_path)
    assert names(runs) == [("R1", "servo", SERVO)]
    assert runs[0].outcome == "converged"


def test_a_log_of_an_earlier_run_in_the_folder_is_a_run_of_its_own(tmp_path):
    simulated(tmp_path / "out")
    (tmp_path / "out" / "servo.jsonl").write_text(log_text())
    runs, _ = read_runs(tmp_path)
    assert names(runs) == [("R1", "out", DRAWING), ("R2", "out/servo.jsonl", SERVO)]


def test_what_was_tracked_beside_a_calibration_is_a_run_of_its_own(tmp_path):
    summary = {"kind": "calibration", "poses": 30, "files": ["summary.json", "rests.csv"]}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "rests.csv").write_text("pose,u_px\n1,2\n")
    (tmp_path / "seen.csv").write_text("frame,t,marker,u,v,confidence\n0,0.0,A,3.0,4.0,1.0\n")
    runs, _ = read_runs(tmp_path)
    assert [run.kind for run in runs] == [CALIBRATION, TRACKING]


def test_a_log_alone_is_a_run_on_a_brick_and_one_cut_off_says_so(tmp_path):
    (tmp_path / "whole.jsonl").write_text(log_text())
    (tmp_path / "other.jsonl").write_text('{"event": "ready"}\n')
    (tmp_path / "cut.jsonl").write_text(log_text()[:2000])
    runs, left_out = read_runs(tmp_path)
    assert [run.name for run in runs] == ["cut.jsonl", "whole.jsonl"]
    assert runs[0].gaps == ["cut.jsonl ends without a verdict: the run was cut off"]
    assert left_out == []


def test_a_folder_of_very_many_folders_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("laptop.record.report.run_folders.MAX_FOLDERS", 3)
    for k in range(5):
        simulated(tmp_path / str(k))
    with pytest.raises(NoRuns, match="holds more than 3 folders; give the one with your runs"):
        read_runs(tmp_path)


def test_a_damaged_demo_is_left_out_and_its_drawing_stands(tmp_path):
    (tmp_path / "demo.json").write_text(json.dumps({"arm": "planar"}))
    simulated(tmp_path / "drawing")
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "drawing", DRAWING)]
    assert left_out == [("demo.json", "it is not of a demo; run the demo again")]


@pytest.mark.parametrize("error", [ValueError, OverflowError, KeyError, IndexError, AttributeError])
def test_what_no_rule_foresees_costs_that_run_alone(tmp_path, monkeypatch, error):
    def fail(name, file):
        raise error("surprise")

    simulated(tmp_path / "line")
    (tmp_path / "seen.csv").write_text("frame,t,marker,u,v,confidence\n1,0,effector,1,1,1\n")
    monkeypatch.setattr("laptop.record.report.run_folders.read_track", fail)
    runs, left_out = read_runs(tmp_path)
    assert names(runs) == [("R1", "line", DRAWING)]
    assert left_out == [("seen.csv", "it is not as it is written; do this run again")]


def test_pipes_and_links_among_the_files_are_passed_over(tmp_path):
    """A pipe would be waited for, a link may lead to what is private."""
    simulated(tmp_path / "line")
    (tmp_path / "secret.csv").write_text("frame,t,marker,u,v,confidence\n1,0,effector,1,1,1\n")
    place = tmp_path / "line" / "deeper"
    place.mkdir()
    for name in ("x.jsonl", "x.csv", "demo.json", "summary.json", "trace.csv"):
        os.mkfifo(place / name)
    (place / "seen.csv").symlink_to(tmp_path / "secret.csv")
    (tmp_path / "secret.csv").rename(tmp_path / "secret.txt")
    runs, left_out = read_runs(tmp_path)
    assert (names(runs), left_out) == ([("R1", "line", DRAWING)], [])


def test_columns_and_markers_have_bounds(tmp_path):
    heading = "frame,t,marker,u,v,confidence\n"
    many = "".join(f"1,0,m{k},1,1,1\n" for k in range(100))
    (tmp_path / "many.csv").write_text(heading + many)
    (tmp_path / "long.csv").write_text(heading + f"1,0,{'m' * 100},1,1,1\n")
    wide = tmp_path / "wide"
    simulated(wide)
    joints = ",".join(f"q{k}" for k in range(100))
    (wide / "trace.csv").write_text(f"t,x,y,pen,{joints}\n" + 2 * ("0," * 103 + "0\n"))
    simulated(tmp_path / "line")
    runs, left_out = read_runs(tmp_path)
    told = {left.name: left.why for left in left_out}
    assert "names more than 64 markers" in told["many.csv"]
    assert "names more than 64 markers, or one of more than 64 letters" in told["long.csv"]
    shown = [gap for run in runs for gap in run.gaps] + list(told.values())
    assert any("104 columns, more than 64" in line for line in shown), shown


@pytest.mark.parametrize("key", ["arm", "mode", "method", "goal", "camera"])
def test_no_text_of_a_log_brings_a_folder_of_its_computer_into_a_report(tmp_path, key):
    lines = [json.loads(line) for line in log_text().splitlines()]
    path = "/home/anna/at work/x.ini"
    for told in lines:
        if key in told and isinstance(told[key], str):
            told[key] = path
    (tmp_path / "servo.jsonl").write_text("".join(json.dumps(told) + "\n" for told in lines))
    (run,), left_out = read_runs(tmp_path)
    texts = [run.what, run.outcome, run.arm, *run.gaps, str(run.set_up), str(run.results)]
    texts += [str(run.tables), *(figure.caption for figure in run.figures)]
    assert left_out == []
    assert "anna" not in " ".join(texts)
    assert "x.ini" in " ".join(texts)
