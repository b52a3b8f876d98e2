"""A run as a report has it."""

import pytest
from lab_runs import TRACE, a_picture, left, paths

from laptop.record.report.report_run import as_texts, read_folder
from laptop.record.run import Ending, RunFile, table


def read(folder, **changes):
    left(folder, **changes)
    return read_folder("line", folder)


def test_a_line_is_told_by_its_figures_and_its_picture(tmp_path):
    run = read(tmp_path)
    assert (run.what, run.outcome, run.arm) == ("driver.py line 10,0 5,10", "ended", "planar")
    assert run.set_up == [("brick", "emulated"), ("cpu", "1")]
    assert [figure.picture for figure in run.figures] == [a_picture()]
    assert run.figures[0].caption == "The ink. (picture.png)"
    assert [(raw.name, raw.source) for raw in run.data] == [("trace.csv", tmp_path / "trace.csv")]
    assert (len(run.compared), run.tables, run.gaps) == (1, [], [])


def test_seeds_and_lists_are_part_of_the_set_up(tmp_path):
    run = read(tmp_path, set_up={"sensors": ["a", "/home/anna/b.csv"]}, seeds={"plant": 3})
    assert run.set_up == [("sensors", "a, b.csv"), ("seed of plant", "3")]


def test_what_failed_bears_its_status_and_no_folder(tmp_path):
    run = read(tmp_path, ending=Ending(3, "blocked: /home/anna/x.py"))
    assert run.outcome == "blocked: x.py, status 3"


def test_numbers_of_a_column_have_as_many_decimals_and_a_missing_one_is_a_dash():
    rows = [[1, 0.5, -2.25, True, None], [10, None, 3.0, False, "a-b"]]
    shown = as_texts(table("m", "M", ["n", "x mm", "y", "is", "text"], rows))
    assert shown.headings == ["n", "x mm", "y", "is", "text"]
    assert shown.rows == [
        ["1", "0.5", "\u22122.25", "yes", "\u2013"],
        ["10", "\u2013", "3.00", "no", "a-b"],
    ]
    mixed = as_texts(table("m", "M", ["value"], [["word"], [0.125], [7]]))
    assert [row[0] for row in mixed.rows] == ["word", "0.125", "7"]


def test_files_without_words_are_neither_figures_nor_data(tmp_path):
    run = read(tmp_path, files=[RunFile("picture.png"), RunFile("trace.csv")])
    assert run.data == []
    assert [figure.caption.split("(")[-1] for figure in run.figures] == ["drawn from trace.csv)"]


def test_without_a_picture_one_is_drawn_of_the_trace(tmp_path):
    run = read(tmp_path, files=[RunFile("trace.csv", "the motion")])
    assert run.figures[0].picture.startswith(b"\x89PNG")
    (tmp_path / "trace.csv").write_text("t,q1\n0,1\n")
    run = read_folder("line", tmp_path)
    assert (run.figures, run.gaps) == ([], ["trace.csv holds no motion to draw"])


def test_what_is_damaged_or_gone_is_left_out_and_the_run_stands(tmp_path):
    left(tmp_path, files=[RunFile(name, "x") for name in ("trace.csv", "picture.png", "gone.png")])
    (tmp_path / "trace.csv").write_text("t,q1\n0\n")
    (tmp_path / "picture.png").write_bytes(a_picture()[:60])
    run = read_folder("line", tmp_path)
    assert (len(run.compared), run.figures, run.data) == (1, [], [])
    assert run.gaps == [
        "left out: trace.csv: row 1 has 1 values, its heading has 2",
        "left out: picture.png is a damaged picture",
        "left out: gone.png is not there, or no file",
    ]


def test_a_name_that_no_file_can_have_costs_that_file_alone(tmp_path):
    run = read(tmp_path, files=[RunFile("a" * 300 + "/b/x.png", "x"), RunFile("picture.png", "y")])
    assert len(run.figures) == 1
    assert "cannot be read: File name too long" in run.gaps[0]


def test_very_many_figures_are_not_all_shown(tmp_path):
    names = [f"{k}.png" for k in range(52)]
    for name in names:
        (tmp_path / name).write_bytes(a_picture())
    run = read(tmp_path, files=[RunFile(name, "x") for name in names])
    assert len(run.figures) == 50
    assert run.gaps == [
        f"left out: {name}: a run has no more than 50 figures" for name in names[50:]
    ]


@pytest.mark.parametrize("behind", ["folder", "file"])
def test_what_is_behind_a_link_is_not_shown(tmp_path, behind):
    """It may be private."""
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "a.csv").write_text(TRACE)
    run = tmp_path / "run"
    left(run, files=[RunFile("sub/a.csv", "x")])
    if behind == "folder":
        (run / "sub").symlink_to(tmp_path / "private")
    else:
        (run / "sub").mkdir()
        (run / "sub" / "a.csv").symlink_to(tmp_path / "private" / "a.csv")
    found = read_folder("run", run)
    assert found.data == []
    assert found.gaps[0].startswith("left out: ")


def test_no_letter_and_no_folder_of_a_run_gets_into_a_report(tmp_path):
    bad = "a\x1b[31mb /home/anna/x.py"
    told = paths(dict.fromkeys(("arm", "path", "greatest mm", "end off mm", "missed mm"), bad))
    run = read(
        tmp_path,
        what=bad,
        ending=Ending(0, bad),
        arm={"name": bad},
        set_up={bad: bad},
        tables=[told, table(bad, bad, [bad], [[bad]])],
        notes=[bad],
        files=[RunFile("picture.png", bad), RunFile("trace.csv", bad)],
    )
    texts = [run.what, run.outcome, run.arm, *run.gaps, str(run.set_up)]
    texts += [
        str(run.tables[0][1:]),
        str(as_texts(run.compared[0])[1:]),
        run.figures[0].caption,
        run.data[0].holds,
    ]
    for text in texts:
        assert "x.py" in text
        assert "anna" not in text
        assert "\x1b" not in text
