"""The report as a document: order, numbers, sources, raw data, and nothing of this computer."""

import os
import re
from html.parser import HTMLParser

import pytest
from csv_rows import rows_in
from lab_runs import PATH, TRACE, drawn, left, paths
from servo_log import log_text

from laptop.record.names import RUN
from laptop.record.report import compose, lab_report
from laptop.record.report.compose import Numbering
from laptop.record.report.find_runs import CONTENTS
from laptop.record.report.lab_report import BadLabReport, check_out, data_folder_of, write
from laptop.record.report.report_run import RawData, ReportRun, TextTable
from laptop.record.run import CALIBRATION, Ending, Run, RunFile, settings, table


@pytest.fixture(autouse=True)
def no_formulas(monkeypatch, no_servo_figures):
    """They take long to be set, and have tests of their own."""
    monkeypatch.setattr("laptop.record.report.method.formula", lambda tex: "")


class Page(HTMLParser):
    """The texts of a page by the part that they stand in."""

    def __init__(self, text):
        super().__init__()
        self.parts, self._open = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag in ("h1", "h2", "h3", "h4", "caption", "figcaption", "li", "td", "th"):
            self._open.append(tag)
            self.parts.append((tag, ""))

    def handle_endtag(self, tag):
        if self._open and self._open[-1] == tag:
            self._open.pop()

    def handle_data(self, data):
        if self._open:
            tag, text = self.parts[-1]
            self.parts[-1] = (tag, text + data)

    def __getitem__(self, tag):
        return [" ".join(text.split()) for found, text in self.parts if found == tag]


def made(folder, title="Lab 3"):
    return lab_report.lab_report(folder, title, "lab-data")


def test_it_is_in_the_order_of_a_lab(tmp_path):
    left(tmp_path / "line")
    (tmp_path / "servo.jsonl").write_text(log_text())
    page = Page(made(tmp_path).html())
    assert page["h1"] == ["Lab 3"]
    assert page["h2"] == [
        *("1 Aim", "2 Set-up", "3 Method", "4 Results", "5 Discussion", "6 Conclusion"),
        "7 Raw data",
    ]
    assert page["h3"][-2:] == ["4.1 Drawing", "4.2 Going to what the camera sees"]


def test_tables_and_figures_are_numbered_in_order_and_name_their_runs(tmp_path):
    left(tmp_path / "line-1")
    left(tmp_path / "line-2")
    drawn(tmp_path / "house")
    report = made(tmp_path)
    page = Page(report.html())
    tables, figures = page["caption"], page["figcaption"]
    assert [re.match(r"Table (\d+)\.", text)[1] for text in tables] == [*"12345"]
    assert [re.match(r"Figure (\d+)\.", text)[1] for text in figures] == [*"123"]
    assert (report.tables, report.figures) == (5, 3)
    assert figures[0].endswith("(picture.png) (run R1, house)")
    assert figures[1].endswith("(picture.png) (run R2, line-1)")
    assert tables[3].endswith("(run R1, house)")
    assert tables[4].endswith("(runs R2, R3)")
    assert all(re.search(r"\(runs? R\d", text) for text in tables + figures)


def test_a_value_that_no_file_holds_does_not_stand_in_it(tmp_path):
    left(tmp_path / "line", tables=[paths({**PATH, "missed mm": None})])
    (tmp_path / "servo.jsonl").write_text(log_text())
    page = Page(made(tmp_path).html())
    assert "missed mm" not in page["th"]  # a column without a value
    assert "truly off mm" not in page["th"]
    assert "end off mm" in page["th"]


def test_what_is_left_out_is_named_with_its_reason(tmp_path):
    left(tmp_path / "line")
    assert "Left out" not in made(tmp_path).html()
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / RUN).write_text("{")
    assert "bad/run.json: it is no JSON; do this run again." in (Page(made(tmp_path).html())["li"])


def test_nothing_of_this_computer_stands_in_it_and_nothing_steers_the_page(tmp_path):
    secret = f"{tmp_path}/secret name/c.py"
    left(
        tmp_path / "line",
        what=f"{secret} --log={tmp_path}/secret name/a.jsonl",
        ending=Ending(0, f"cannot read {secret}: <script>alert(1)</script>"),
        set_up={"plant": "/opt/other/b.svg"},
    )
    (tmp_path / RUN).write_text("{}")
    report = made(tmp_path)
    for text in (report.html(), report.html("A4", linked=False)):
        assert str(tmp_path) not in text
        assert "secret" not in text
        assert "/opt" not in text
        assert "<script" not in text
        assert "&lt;script&gt;alert(1)" in text
    assert "href" not in report.html(linked=False)
    for raw in report.data.values():
        if isinstance(raw.source, str):
            assert "secret" not in raw.source


def test_the_raw_data_lie_beside_it_and_each_table_is_a_csv(tmp_path):
    left(tmp_path / "line", tables=[paths(PATH, {**PATH, "end off mm": None})])
    out = tmp_path / "lab-report.html"
    write(made(tmp_path), out)
    folder = data_folder_of(out)
    assert (folder / "R1-trace.csv").read_text() == TRACE
    told = {row["file"]: row for row in rows_in(folder / CONTENTS)}
    assert told.keys() == {path.name for path in folder.iterdir()} - {CONTENTS}
    assert told["R1-trace.csv"]["from"] == "run R1, line"
    (drawn_paths,) = [name for name, row in told.items() if row["holds"].startswith("Drawn paths")]
    assert [row["end off mm"] for row in rows_in(folder / drawn_paths)] == ["0.75", ""]
    assert 'href="lab-data/R1-trace.csv"' in out.read_text()


def test_written_again_it_tells_of_the_same_runs_and_leaves_no_file_of_before(tmp_path):
    left(tmp_path / "line")
    out = tmp_path / "lab-report.html"
    write(made(tmp_path), out)
    before = out.read_text()
    data = data_folder_of(out)
    stale = data / "R9-trace.csv"
    stale.write_text("")
    with open(data / CONTENTS, "a") as contents:
        contents.write("R9-trace.csv,run R9,a trace\n")
    with pytest.raises(BadLabReport, match="is there already, perhaps with what somebody wrote"):
        check_out(out, replace=False)
    check_out(out, replace=True)
    write(made(tmp_path), out)
    assert out.read_text() == before
    assert not stale.exists()
    assert {path.name for path in tmp_path.iterdir()} == {"line", out.name, "lab-report-data"}


def test_a_file_that_somebody_put_beside_the_raw_data_is_not_lost(tmp_path):
    left(tmp_path / "line")
    out = tmp_path / "x.html"
    write(made(tmp_path), out)
    (tmp_path / "x-data" / "my-notes.txt").write_text("mine")
    for there in (True, False):
        with pytest.raises(BadLabReport, match="my-notes.txt is of no report, and would be lost"):
            check_out(out, replace=there)
        out.unlink(missing_ok=True)


@pytest.mark.parametrize(
    "content",
    [b"a" * 200_000, b'"' + b"a\n" * 200_000, b"\xff\xfe,run R1,\n", b"a,\n" * 2_000_000],
    ids=["field", "quoted", "no text", "long"],
)
def test_a_spoilt_list_of_the_raw_data_is_told_in_a_line(tmp_path, content):
    data = tmp_path / "x-data"
    data.mkdir()
    (data / CONTENTS).write_bytes(content)
    with pytest.raises(BadLabReport) as failed:
        check_out(tmp_path / "x.html", replace=True)
    assert str(failed.value) == (
        f"{data / CONTENTS} is no list of a report's files, so that none is replaced; move {data}, "
        "or give another file with --out"
    )


@pytest.mark.parametrize("name", ["thesis.docx", "marks.csv", "R1-a.csv/b", "R1-trace.csv"])
def test_a_list_of_raw_data_lets_nothing_go_that_no_report_writes(tmp_path, name):
    """Neither files of other names, nor folders and links of such names."""
    left(tmp_path / "line")
    out, mine = tmp_path / "x.html", tmp_path / "x-data" / name
    report = made(tmp_path)
    write(report, out)
    if name == "R1-trace.csv":
        mine.unlink()
        mine.symlink_to(out)
    elif "/" in name:
        mine.mkdir(parents=True)
    else:
        mine.write_text("mine")
    with open(tmp_path / "x-data" / CONTENTS, "a") as contents:
        contents.write(f"{name},run R1,\n{name.split('/')[0]},run R1,\n")
    for attempt in (lambda: check_out(out, replace=True), lambda: write(report, out)):
        with pytest.raises(BadLabReport, match="is of no report, and would be lost; move it"):
            attempt()
    assert os.path.lexists(mine)


def test_the_list_of_raw_data_is_no_link(tmp_path):
    data = tmp_path / "x-data"
    data.mkdir()
    (tmp_path / "list.csv").write_text("table-1.csv,run R1,\n")
    (data / CONTENTS).symlink_to(tmp_path / "list.csv")
    with pytest.raises(BadLabReport, match="x-data is there and is not of a report"):
        check_out(tmp_path / "x.html", replace=True)


def test_where_the_report_is_a_link_what_it_leads_to_is_replaced(tmp_path):
    left(tmp_path / "runs" / "line")
    (tmp_path / "elsewhere").mkdir()
    target = tmp_path / "elsewhere" / "y.html"
    target.write_text("before")
    target.chmod(0o640)
    out = tmp_path / "x.html"
    out.symlink_to(target)
    write(made(tmp_path / "runs"), out)
    assert out.is_symlink()
    assert "Lab 3" in target.read_text()
    assert target.stat().st_mode & 0o777 == 0o640
    assert {path.name for path in tmp_path.iterdir()} == {"runs", "elsewhere", "x.html", "x-data"}
    assert [path.name for path in target.parent.iterdir()] == ["y.html"]


def test_what_is_no_text_in_a_run_is_written_all_the_same(tmp_path):
    left(tmp_path / "runs" / "line\udcff")
    write(made(tmp_path / "runs"), tmp_path / "x.html")
    assert "<td>line </td>" in (tmp_path / "x.html").read_text()


def test_no_letter_of_a_run_steers_a_terminal_or_turns_the_text_around(tmp_path):
    bad = "a\x1b[31mb\x07c\u202ed\x00e"
    left(
        tmp_path / "runs" / bad.replace("\x00", ""),
        what=bad,
        ending=Ending(0, bad),
        set_up={bad: bad},
        built={"name": bad, "joints": [{"name": bad, "port": bad}]},
    )
    damaged = tmp_path / "runs" / "\x1b[32m"
    damaged.mkdir()
    (damaged / RUN).write_text("{")
    told = [table(bad, bad, [bad], [[bad]]), settings({bad: bad})]
    files = [RunFile("x.csv", bad), RunFile("\x07.csv", bad)]
    for folder in (tmp_path / "runs" / "m", tmp_path / "runs" / "n"):
        left(folder, kind=CALIBRATION, tables=told, files=files)
        (folder / "x.csv").write_text(f"{bad},b\n1,2\n".replace("\x00", ""))
    track = f"frame,t,marker,u,v,confidence\n1,5.0,{bad[:-2]},,,\n"
    (tmp_path / "runs" / "t.csv").write_text(track)
    (tmp_path / "runs" / "\x1bu.csv").write_text("frame,t,marker,u,v,confidence\n1,x,a,,,\n")
    report = made(tmp_path / "runs", title=bad)
    assert len(report.runs) == 4
    texts = [report.html()]
    texts += [raw.source for raw in report.data.values() if isinstance(raw.source, str)]
    for text in texts:
        assert {letter for letter in text if not letter.isprintable()} == {"\n"}
    assert "<h1>a b c d e</h1>" in texts[0].replace(" [31m", " ")


def test_raw_data_of_a_report_that_has_another_name_now_stay(tmp_path):
    """Somebody may have written into them, and the report still leads to them."""
    left(tmp_path / "line")
    out = tmp_path / "x.html"
    write(made(tmp_path), out)
    out.rename(tmp_path / "handed-in.html")
    with pytest.raises(BadLabReport) as failed:
        check_out(out, replace=False)
    assert str(failed.value) == (
        f"{tmp_path}/x-data is there already, with the raw data of a report that has perhaps "
        "another name now; give another file with --out, or --replace them"
    )
    check_out(out, replace=True)


def test_a_folder_that_is_somebody_elses_is_not_touched(tmp_path):
    (tmp_path / "x-data").mkdir()
    with pytest.raises(BadLabReport, match="x-data is there and is not of a report"):
        check_out(tmp_path / "x.html", replace=True)
    with pytest.raises(BadLabReport, match="is no folder; make it"):
        check_out(tmp_path / "none" / "x.html", replace=True)


def test_where_there_is_no_room_nothing_is_left_and_what_was_there_stays(tmp_path, monkeypatch):
    left(tmp_path / "line")
    out = tmp_path / "lab-report.html"
    report = made(tmp_path)
    write(report, out)

    def full(*words):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(lab_report.shutil, "copyfile", full)
    with pytest.raises(BadLabReport, match="No space left on device; make room, or give another"):
        write(report, out)
    assert {path.name for path in tmp_path.iterdir()} == {"line", out.name, "lab-report-data"}
    assert (data_folder_of(out) / "R1-trace.csv").exists()


def test_two_files_of_one_name_in_a_run_stay_two():
    run = a_run()
    run.data = [
        RawData("track.csv", "a\n", ""),
        RawData("track.csv", "b\n", ""),
        RawData("../up and/away.csv", "c\n", ""),
    ]
    data, _ = compose._raw_data([run], [], "x")
    assert [*data] == ["R1-track.csv", "R1-track-2.csv", "R1-..-up-and-away.csv", CONTENTS]


def a_run():
    return ReportRun("a", Run(kind="servo", what="", ending=Ending(0, "")), number=1)


def test_a_column_of_numbers_stands_to_the_right():
    shown = TextTable("", "", ("a", "b", "c"), [("x1", "\u22121.5", "50 %"), ("2", "\u2013", "7")])
    assert Numbering().table(shown, [a_run()]).numeric == [False, True, True]


def test_an_empty_table_is_one(tmp_path):
    left(tmp_path / "a", tables=[table("m", "Nothing at all", ["x", "y mm"], [])])
    assert "Nothing at all" in made(tmp_path).html()


def test_tables_that_are_compared_have_no_end_of_columns(tmp_path):
    for k in range(3):
        told = table("m", "M", [f"c{k}.{j}" for j in range(60)], [[1] * 60], True)
        left(tmp_path / f"{k}", tables=[told])
    (shown,) = made(tmp_path).values["compared"]
    assert len(shown.headings) == 1 + 64


def test_tables_of_several_runs_are_one_with_all_their_columns(tmp_path):
    left(tmp_path / "a", tables=[table("m", "M", ["x mm", "y"], [[1.5, 2]], True)])
    left(tmp_path / "b", tables=[table("m", "M", ["x mm", "z"], [[0.25, "w"]], True)])
    (shown,) = made(tmp_path).values["compared"]
    assert shown.headings == ["run", "x mm", "y", "z"]
    assert shown.rows == [["R1", "1.50", "2", "\u2013"], ["R2", "0.25", "\u2013", "w"]]


@pytest.mark.parametrize(("rows", "is_long"), [(45, False), (46, True)])
def test_a_long_table_is_folded_and_in_print_a_csv_is_named(tmp_path, rows, is_long):
    left(tmp_path / "a", tables=[table("m", "Many", ["x"], [[k] for k in range(rows)])])
    report = made(tmp_path)
    text = report.html()
    assert ("<summary>Many" in text) is is_long
    assert (f"its {rows} rows are in <code>table-4.csv</code>" in text) is is_long
    assert "table-4.csv" in report.data
