"""Runs of `simulate` and of `draw --simulate`: what a report shows of them."""

import json

from lab_runs import PATH, a_picture, drawn, simulated

from laptop.record.report import drawing_runs
from laptop.record.report.drawing_runs import DRAWINGS, PATHS, read_drawing, read_simulated
from laptop.record.report.findings import DRAWING, SCRIPT


def read(folder, **changes):
    return read_simulated("line", folder, simulated(folder, **changes))


def test_a_line_is_told_by_its_figures_and_its_picture(tmp_path):
    run = read(tmp_path)
    assert (run.kind, run.what) == (DRAWING, "driver.py line 10,0 5,10")
    assert (run.outcome, run.seconds, run.arm) == ("ended", 6.4, "planar")
    cells = ("planar", "1", "11.18", "2.00", "1.25", "0.50", "0.75", "1.50")
    assert run.results == [(PATHS, cells)]
    assert run.set_up == [("brick", "emulated, cpu=1, backlash=3")]
    assert [figure.picture for figure in run.figures] == [a_picture()]
    assert run.figures[0].caption.endswith("(picture.png)")
    assert [(raw.name, raw.source) for raw in run.data] == [("trace.csv", tmp_path / "trace.csv")]
    assert run.gaps == []


def test_what_failed_bears_its_status(tmp_path):
    run = read(tmp_path, status=3, reason="blocked: /home/anna/x.py", paths=[])
    assert (run.kind, run.outcome) == (SCRIPT, "blocked: x.py, status 3")


def test_of_very_many_paths_the_first_are_shown(tmp_path, monkeypatch):
    monkeypatch.setattr(drawing_runs, "MAX_PATHS", 2)
    run = read(tmp_path, paths=[PATH, PATH, None])
    assert len(run.results) == 2
    assert run.gaps == ["it has 3 paths, of which the first 2 are here"]


def test_a_path_that_was_not_drawn_and_a_figure_that_is_none_are_gaps_not_figures(tmp_path):
    run = read(tmp_path, paths=[None, {**PATH, "rms_mm": float("nan"), "end_mm": None}])
    (_, first), (_, second) = run.results
    assert set(first[2:]) == {"\u2013"}
    assert (second[4], second[5], second[6]) == ("1.25", "\u2013", "\u2013")
    assert run.gaps == [
        "path 1 was not drawn",
        "path 2: summary.json has no value for rms_mm, end_mm",
    ]


def test_without_a_trace_or_a_picture_it_says_so_or_draws_one(tmp_path):
    summary = simulated(tmp_path)
    (tmp_path / "picture.png").unlink()
    run = read_simulated("line", tmp_path, summary)
    assert run.figures[0].caption.endswith("(drawn from trace.csv)")
    assert run.figures[0].picture.startswith(b"\x89PNG")
    (tmp_path / "trace.csv").unlink()
    run = read_simulated("line", tmp_path, summary)
    assert (run.figures, run.data) == ([], [])
    assert run.gaps == ["there is no trace.csv, so no raw data of the motion"]


def test_a_damaged_trace_or_picture_is_left_out_and_the_run_stands(tmp_path):
    summary = simulated(tmp_path)
    (tmp_path / "trace.csv").write_text("t,q1\n0\n")
    (tmp_path / "picture.png").write_bytes(a_picture()[:60])
    run = read_simulated("line", tmp_path, summary)
    assert (len(run.results), run.figures, run.data) == (1, [], [])
    assert run.gaps == [
        "left out: trace.csv: row 1 has 1 values, its heading has 2",
        "left out: picture.png is a damaged picture",
    ]


def test_a_picture_of_an_older_run_that_bears_a_folder_is_drawn_anew(tmp_path):
    summary = simulated(tmp_path)
    del summary["kind"]
    run = read_simulated("line", tmp_path, summary)
    assert run.figures[0].caption.endswith("(drawn from trace.csv)")
    assert run.gaps == ["picture.png bears a folder of a computer in its title, so it is left out"]
    summary["script"] = "driver.py"
    assert read_simulated("line", tmp_path, summary).figures[0].picture == a_picture()


def test_a_drawing_is_told_by_its_figures(tmp_path):
    run = read_drawing("house", tmp_path, drawn(tmp_path))
    cells = ("planar", "house", "30 of 31", "140.29", "144.84", "146.21", "1.76", "0.57", "2.18")
    assert run.results == [(DRAWINGS, cells)]
    assert (run.what, run.seconds) == ("drawing house", 144.84)


def test_the_picture_of_what_was_learned_is_shown_where_it_is_of_this_drawing(tmp_path):
    summary = drawn(tmp_path)
    for name in ("picture-side.png", "learning.png"):
        (tmp_path / name).write_bytes(a_picture())

    def shown(**told):
        run = read_drawing("house", tmp_path, {**summary, **told})
        return [figure.caption.split("(")[-1] for figure in run.figures]

    assert shown() == ["picture.png)"]
    assert shown(files=["trace.csv", "summary.json", "picture.png"]) == ["picture.png)"]
    learned = ["trace.csv", "summary.json", "picture.png", "learning.png"]
    assert shown(files=learned) == ["picture.png)", "learning.png)"]


def test_the_picture_of_an_earlier_run_is_not_that_of_one_without(tmp_path):
    run = read(tmp_path, files=["trace.csv", "summary.json"])
    assert [figure.caption.split("(")[-1] for figure in run.figures] == ["drawn from trace.csv)"]
    assert run.gaps == []


def test_a_drawing_without_ink_has_no_figures(tmp_path):
    drawn(tmp_path, greatest_mm=float("nan"), rms_mm=float("nan"), missed_mm=float("nan"))
    summary = json.loads((tmp_path / "summary.json").read_text())
    run = read_drawing("house", tmp_path, summary)
    assert run.results[0][1][-3:] == ("\u2013",) * 3
    assert run.gaps == ["summary.json has no value for greatest_mm, rms_mm, missed_mm"]


def test_the_scene_of_a_camera_is_part_of_the_set_up(tmp_path):
    assert read(tmp_path, scene="").set_up[1] == ("camera", "synthetic, the usual scene")
    assert read(tmp_path, scene="seed=4").set_up[1] == ("camera", "synthetic, scene seed=4")
