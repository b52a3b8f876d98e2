"""Runs of accuracy and of calibration: all figures of their summaries, by their names."""

import pytest
from lab_runs import a_picture

from laptop.record.report import measured_runs
from laptop.record.report.findings import ACCURACY, CALIBRATION, DamagedRun
from laptop.record.report.measured_runs import in_words, read_measured, tables_of

SUMMARY = {
    "kind": "accuracy",
    "arm": "planar",
    "cycles": 30,
    "poses": [
        {"pose": "P1", "accuracy_mm": 1.234567, "repeatability_mm": float("nan")},
        {"pose": "P2", "accuracy_mm": -0.5, "seen": True},
    ],
    "line": {"accuracy_mm": 0.75, "speeds": [2, 4, 8]},
    "links": {"upper": {"cm": 11.3, "sigma_cm": 0.01}, "fore": {"cm": 9.5}},
    "from": "/home/anna/arm.ini",
    "plant": "",
}


def test_a_summary_becomes_tables_with_its_own_names():
    found = {title: (heading, rows) for title, heading, rows in tables_of(SUMMARY, "all", [])}
    assert found["all"][1] == [["cycles", "30"], ["from", "arm.ini"]]
    assert found["poses"] == (
        ["pose", "accuracy, mm", "repeatability, mm", "seen"],
        [["P1", "1.235", "\u2013", "\u2013"], ["P2", "\u22120.500", "\u2013", "yes"]],
    )
    assert found["line"][1] == [["accuracy, mm", "0.75"], ["speeds", "2, 4, 8"]]
    assert found["links"][1] == [["upper", "11.30", "0.01000"], ["fore", "9.50", "\u2013"]]


def test_csvs_and_pictures_come_along_and_damaged_ones_are_told(tmp_path):
    (tmp_path / "accuracy.csv").write_text("pose,x_cm\nP1,3\n")
    (tmp_path / "cut.csv").write_text("pose,x_cm\nP1\n")
    (tmp_path / "accuracy.png").write_bytes(a_picture())
    (tmp_path / "cut.png").write_bytes(a_picture()[:50])
    files = ["accuracy.csv", "summary.json", "cut.csv", "accuracy.png", "cut.png", "gone.png"]
    run = read_measured("a", tmp_path, {**SUMMARY, "files": files}, ACCURACY)
    assert [(raw.name, raw.holds) for raw in run.data] == [("accuracy.csv", "pose, x_cm")]
    assert [figure.picture for figure in run.figures] == [a_picture()]
    assert run.gaps == [
        "left out: cut.csv: row 1 has 1 values, its heading has 2",
        "left out: cut.png is a damaged picture",
        "left out: gone.png is not there, or no file",
    ]
    assert "files" not in [row[0] for table in run.tables for row in table.rows]


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize(
    ("kind", "files", "figures"),
    [(CALIBRATION, ["rests.csv"], []), (ACCURACY, ["accuracy.csv"], ["accuracy.png"])],
)
def test_files_of_other_runs_in_the_same_folder_are_not_its_own(
    tmp_path, kind, files, figures, named
):
    for name in ("trace.csv", "rests.csv", "accuracy.csv", "notes.csv"):
        (tmp_path / name).write_text("a,b\n1,2\n")
    for name in ("picture.png", "learning.png", "accuracy.png", "photo.png"):
        (tmp_path / name).write_bytes(a_picture())
    told = {"files": ["summary.json", *files, *figures]} if named else {}
    run = read_measured("out", tmp_path, {**SUMMARY, **told, "kind": kind}, kind)
    assert [raw.name for raw in run.data] == files
    assert [figure.caption.partition("(")[2].rstrip(")") for figure in run.figures] == figures
    assert run.gaps == []


@pytest.mark.parametrize("files", ["x.csv", [1], [None], ["../x.csv"], ["/x.csv"], [".."], [""]])
def test_what_is_named_lies_in_the_runs_folder(tmp_path, files):
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    (tmp_path / "out").mkdir()
    with pytest.raises(DamagedRun, match="'files' is not as it is written; do this run again"):
        read_measured("out", tmp_path / "out", {**SUMMARY, "files": files}, ACCURACY)


def test_a_table_too_large_to_print_is_left_to_the_csv(tmp_path):
    summary = {"sights": [{"u": k} for k in range(100)], "rms_px": 0.5}
    run = read_measured("c", tmp_path, summary, CALIBRATION)
    assert [table.rows for table in run.tables] == [[["rms, px", "0.5"]]]
    assert run.gaps == [
        "sights has 100 rows of 1 values: too many here",
        "there is no CSV, so no raw data",
    ]


def test_cells_of_a_table_too_large_to_print_are_not_made(tmp_path, monkeypatch):
    """Objects of other keys each are as many columns as rows."""
    made = []
    monkeypatch.setattr(measured_runs, "_cell", lambda value: made.append(value) or "1")
    objects = [{f"k{k}": 1} for k in range(2000)]
    summary = {"a": objects, "b": dict(enumerate(objects)), "c": objects[0], "rms": 5}
    run = read_measured("c", tmp_path, summary, CALIBRATION)
    assert run.gaps[:2] == [
        "a has 2000 rows of 2000 values: too many here",
        "b has 2000 rows of 2001 values: too many here",
    ]
    assert sorted(made) == [1, 5]


def test_a_summary_of_very_many_figures_or_tables_is_not_printed(tmp_path):
    many = {f"k{k}": 1 for k in range(1000)}
    run = read_measured("c", tmp_path, {"fit": many, "rms": 5}, CALIBRATION)
    assert run.gaps[0] == "fit has 1000 rows of 2 values: too many here"
    for many in (
        {f"k{k}": [{"a": 1}] for k in range(101)},
        {f"k{k}": {"a": 1} for k in range(101)},
    ):
        with pytest.raises(DamagedRun) as failed:
            read_measured("c", tmp_path, many, CALIBRATION)
        assert str(failed.value) == "summary.json holds more than 100 tables; do this run again"


def test_a_summary_without_a_figure_is_damaged(tmp_path):
    with pytest.raises(DamagedRun, match="holds no figure"):
        read_measured("c", tmp_path, {"kind": "calibration", "arm": "planar"}, CALIBRATION)


def test_a_key_is_told_in_words():
    assert in_words("end_off_mm") == "end off, mm"
    assert in_words("arms") == "arms"
    assert in_words("speed_cm_per_s") == "speed, cm per s"
