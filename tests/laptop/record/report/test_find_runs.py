"""Which runs are found in a folder, and what is said of those that cannot be read."""

import os

import pytest
from lab_runs import drawn, left
from servo_log import lines_of, log_text, text_of

from laptop.record.names import RUN
from laptop.record.report.find_runs import CONTENTS, NoRuns, read_runs
from laptop.record.report.report_run import as_texts
from laptop.record.run import DRAWING, SERVO, TRACKING, RunFile

pytestmark = pytest.mark.usefixtures("no_servo_figures")


def found(folder):
    """Number, name and kind of each run, and what is left out."""
    runs, left_out = read_runs(folder)
    return [(run.label, run.name, run.run.kind) for run in runs], left_out


def test_runs_are_found_however_deep_and_numbered_by_their_folders(tmp_path):
    left(tmp_path / "b" / "deep" / "line")
    drawn(tmp_path / "a")
    assert found(tmp_path) == ([("R1", "a", DRAWING), ("R2", "b/deep/line", DRAWING)], [])


def test_the_folder_itself_may_be_a_run(tmp_path):
    left(tmp_path / "line-1")
    assert found(tmp_path / "line-1") == ([("R1", "line-1", DRAWING)], [])


def test_hidden_folders_and_the_data_of_a_report_are_no_runs(tmp_path):
    left(tmp_path / "line")
    left(tmp_path / ".part")
    left(tmp_path / "lab-report-data")
    (tmp_path / "lab-report-data" / CONTENTS).write_text("file,from,holds\n")
    assert found(tmp_path) == ([("R1", "line", DRAWING)], [])


def test_a_run_that_lies_too_deep_is_left_out_by_its_folder(tmp_path):
    deep = tmp_path / "1/2/3/4/5/6/7/8"
    left(deep)
    assert read_runs(tmp_path)[1] == []
    (deep / ".hidden").mkdir()
    assert read_runs(tmp_path)[1] == []
    left(deep / "9")
    why = "the folders in it are more than 8 deep, and are not looked into; give this folder"
    place = "1/2/3/4/5/6/7/8"
    assert found(tmp_path) == ([("R1", place, DRAWING)], [(place, why)])


def test_a_linked_folder_is_left_out_where_the_report_does_not_meet_it(tmp_path):
    left(tmp_path / "elsewhere")
    left(tmp_path / "runs" / "line")
    (tmp_path / "runs" / "latest").symlink_to("line")
    (tmp_path / "runs" / "other").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "runs" / ".hidden").symlink_to(tmp_path / "elsewhere")
    why = "it is a link, which is not followed; give the folder that it leads to"
    assert found(tmp_path / "runs") == ([("R1", "line", DRAWING)], [("other", why)])


@pytest.mark.parametrize("function", ["scandir", "stat"])
def test_a_folder_that_may_not_be_read_is_left_out(tmp_path, monkeypatch, function):
    left(tmp_path / "line")
    left(tmp_path / "secret")
    true = getattr(os, function)

    def refusing(path, **words):
        told = str(path)
        if told.endswith("secret") and function == "scandir" or "secret" + os.sep in told:
            raise PermissionError(13, "Permission denied", told)
        return true(path, **words)

    monkeypatch.setattr(os, function, refusing)
    why = "it cannot be read: Permission denied"
    assert found(tmp_path) == ([("R1", "line", DRAWING)], [("secret", why)])


def test_an_empty_folder_and_one_without_runs_are_told_apart(tmp_path):
    with pytest.raises(NoRuns, match=r"is empty; give the one with your runs"):
        read_runs(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(NoRuns, match=r"holds no run; give the one with your runs"):
        read_runs(tmp_path)


def test_a_damaged_run_is_left_out_with_its_reason_and_the_others_stand(tmp_path):
    left(tmp_path / "good")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / RUN).write_text("{")
    why = "it is no JSON; do this run again"
    assert found(tmp_path) == ([("R1", "good", DRAWING)], [("bad/run.json", why)])


def test_if_none_can_be_read_the_first_reason_is_told(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / RUN).write_text("{")
    with pytest.raises(NoRuns, match=r"can be read: a/run.json: it is no JSON.*\(and 1 more"):
        read_runs(tmp_path)


@pytest.mark.parametrize("name", ["servo.jsonl", "goal-1/servo.jsonl"])
def test_a_log_that_a_run_names_is_none_of_its_own(tmp_path, name):
    left(tmp_path / "out", files=[RunFile(name)])
    (tmp_path / "out" / name).parent.mkdir(exist_ok=True)
    (tmp_path / "out" / name).write_text(log_text())
    assert found(tmp_path) == ([("R1", "out", DRAWING)], [])


def test_a_run_in_a_folder_that_another_one_names_is_part_of_that(tmp_path):
    left(tmp_path / "demo", files=[RunFile("drawing/trace.csv")])
    left(tmp_path / "demo" / "drawing")
    left(tmp_path / "demo" / "drawing" / "deeper")
    left(tmp_path / "demo" / "mine")
    runs, _ = read_runs(tmp_path)
    assert [run.name for run in runs] == ["demo", "demo/mine"]


def test_a_log_of_an_earlier_run_in_the_folder_is_a_run_of_its_own(tmp_path):
    left(tmp_path / "out")
    (tmp_path / "out" / "servo.jsonl").write_text(log_text())
    runs = [("R1", "out", DRAWING), ("R2", "out/servo.jsonl", SERVO)]
    assert found(tmp_path) == (runs, [])


def test_what_was_tracked_beside_a_run_is_a_run_of_its_own(tmp_path):
    left(tmp_path)
    (tmp_path / "seen.csv").write_text("frame,t,marker,u,v,confidence\n0,0.0,A,3.0,4.0,1.0\n")
    runs, _ = read_runs(tmp_path)
    assert [run.run.kind for run in runs] == [DRAWING, TRACKING]


def test_a_log_alone_is_a_run_on_a_brick_and_one_cut_off_says_so(tmp_path):
    (tmp_path / "whole.jsonl").write_text(log_text())
    (tmp_path / "other.jsonl").write_text('{"event": "ready"}\n')
    (tmp_path / "cut.jsonl").write_text(log_text()[:2000])
    runs, left_out = read_runs(tmp_path)
    assert [run.name for run in runs] == ["cut.jsonl", "whole.jsonl"]
    assert runs[0].gaps == ["cut.jsonl ends without a verdict: the run was cut off"]
    assert left_out == []


def test_a_folder_of_very_many_folders_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("laptop.record.report.find_runs.MAX_FOLDERS", 3)
    for k in range(5):
        left(tmp_path / str(k))
    with pytest.raises(NoRuns, match="holds more than 3 folders; give the one with your runs"):
        read_runs(tmp_path)


@pytest.mark.parametrize("error", [ValueError, OverflowError, KeyError, IndexError, AttributeError])
def test_what_no_rule_foresees_costs_that_run_alone(tmp_path, monkeypatch, error):
    def fail(name, file):
        raise error("surprise")

    left(tmp_path / "line")
    (tmp_path / "seen.csv").write_text("frame,t,marker,u,v,confidence\n1,0,effector,1,1,1\n")
    monkeypatch.setattr("laptop.record.report.find_runs.read_track", fail)
    why = "it is not as it is written; do this run again"
    assert found(tmp_path) == ([("R1", "line", DRAWING)], [("seen.csv", why)])


def test_pipes_and_links_among_the_files_are_passed_over(tmp_path):
    """A pipe would be waited for, a link may lead to what is private."""
    left(tmp_path / "line")
    (tmp_path / "secret.csv").write_text("frame,t,marker,u,v,confidence\n1,0,effector,1,1,1\n")
    place = tmp_path / "line" / "deeper"
    place.mkdir()
    for name in ("x.jsonl", "x.csv", "run.json", "trace.csv"):
        os.mkfifo(place / name)
    (place / "seen.csv").symlink_to(tmp_path / "secret.csv")
    (tmp_path / "secret.csv").rename(tmp_path / "secret.txt")
    assert found(tmp_path) == ([("R1", "line", DRAWING)], [])


def test_columns_and_markers_have_bounds(tmp_path):
    heading = "frame,t,marker,u,v,confidence\n"
    many = "".join(f"1,0,m{k},1,1,1\n" for k in range(100))
    (tmp_path / "many.csv").write_text(heading + many)
    (tmp_path / "long.csv").write_text(heading + f"1,0,{'m' * 100},1,1,1\n")
    wide = tmp_path / "wide"
    left(wide, files=[RunFile("trace.csv", "the motion")])
    joints = ",".join(f"q{k}" for k in range(100))
    (wide / "trace.csv").write_text(f"t,x,y,pen,{joints}\n" + 2 * ("0," * 103 + "0\n"))
    left(tmp_path / "line")
    runs, left_out = read_runs(tmp_path)
    told = {left.name: left.why for left in left_out}
    assert "names more than 64 markers" in told["many.csv"]
    assert "names more than 64 markers, or one of more than 64 letters" in told["long.csv"]
    shown = [gap for run in runs for gap in run.gaps] + list(told.values())
    assert any("104 columns, more than 64" in line for line in shown), shown


@pytest.mark.parametrize("key", ["arm", "mode", "method", "goal", "camera"])
def test_no_text_of_a_log_brings_a_folder_of_its_computer_into_a_report(tmp_path, key):
    lines = lines_of(log_text())
    path = "/home/anna/at work/x.ini"
    for told in lines:
        if key in told and isinstance(told[key], str):
            told[key] = path
    (tmp_path / "servo.jsonl").write_text(text_of(lines))
    (run,), left_out = read_runs(tmp_path)
    texts = [run.what, run.outcome, run.arm, *run.gaps, str(run.set_up), str(run.tables)]
    texts += [str([as_texts(table) for table in run.compared])]
    texts += [figure.caption for figure in run.figures]
    assert left_out == []
    assert "anna" not in " ".join(texts)
    assert "x.ini" in " ".join(texts)
