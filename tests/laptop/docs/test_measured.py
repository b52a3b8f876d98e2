"""What the benches have measured is kept, compared, and shown in the pages as it was kept."""

import sys
from types import SimpleNamespace

import pytest
from places import ROOT

from laptop.bench.bench import BenchRecord, BenchTable, MachineLine
from laptop.cli import bench
from laptop.docs import measured, tables
from laptop.docs.measured import MEASURED, Measurements, NotMeasured

DOCS = ROOT / "laptop" / "docs"
PAGES = "\n".join(page.read_text("utf-8") for page in sorted(DOCS.rglob("*.md")))
LINES = BenchTable(
    "Lines",
    ("arm", "line", "mm", "x"),
    [
        ["planar", "line 1", "1.2", "0.8"],
        ["planar", "line 2", "1.4", "1.0"],
        ["geared", "line 1", "failed", "failed"],
    ],
)
SPEED = BenchTable("Cost", ("what", "us"), [["[ours], {all}", "61"]], of_this_machine=True)


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A folder for records, with one."""
    monkeypatch.setattr(measured, "FOLDER", tmp_path)
    record = Measurements("brickservo bench lines", [LINES, SPEED], ['it said "no"', "so"])
    measured.write("lines", record)
    return record


def shown(capsys):
    return [line for line in capsys.readouterr().out.splitlines() if line]


def test_a_record_is_read_as_it_was_written_a_row_a_line(kept, tmp_path):
    found = measured.read("lines")
    assert found.command == kept.command
    assert [table._asdict() for table in found.tables] == [
        table._asdict() | {"headings": list(table.headings)} for table in kept.tables
    ]
    assert found.lines == kept.lines
    assert '"planar", "line 2", "1.4", "1.0"' in (tmp_path / "lines.json").read_text("utf-8")


def test_a_change_is_told_but_not_of_how_fast_the_machine_is(kept):
    other = LINES._replace(rows=[*LINES.rows[:2], ["geared", "line 1", "0.3", "1.1"]])
    faster = SPEED._replace(rows=[["ours", "12"]])
    found = kept._replace(tables=[other, faster], lines=["so"])
    assert list(measured.changes(kept, found)) == [
        "- geared | line 1 | failed | failed",
        '- it said "no"',
        "+ geared | line 1 | 0.3 | 1.1",
    ]
    assert list(measured.changes(measured.read("lines"), kept)) == []


def test_what_was_not_measured_is_named_with_the_next_step(kept):
    with pytest.raises(NotMeasured, match="laptop.docs space"):
        measured.read("space")
    with pytest.raises(NotMeasured, match="no row of"):
        tables.bench_table("lines", ("arm",), arm="spatial")
    with pytest.raises(NotMeasured, match="no line is like"):
        tables.bench_lines("lines", "nothing")


def test_a_table_shows_columns_of_rows_that_match(kept, capsys):
    tables.bench_table("lines", {"arm": "{arm}", "how far": "{mm} ({x})"}, line="line [1]")
    assert shown(capsys) == [
        "| arm | how far |",
        "|---|---|",
        "| planar | 1.2 (0.8) |",
        "| geared | failed |",  # what would stand twice stands once
    ]


@pytest.mark.usefixtures("kept")
def test_a_table_lays_the_values_of_a_column_side_by_side(capsys):
    tables.bench_table(("lines", "lines"), ("arm",), across={"line": "{mm}"})
    assert shown(capsys) == [
        "| arm | line 1 | line 2 |",
        "|---|---|---|",
        "| planar | 1.2 | 1.4 |",
        "| geared | failed |  |",
    ]


def test_lines_and_commands_are_shown(kept, capsys):
    tables.bench_lines("lines", "s.")
    tables.bench_command("lines")
    assert shown(capsys) == ["* so", "```sh", kept.command, "```"]


def test_a_bench_is_measured_by_its_words(monkeypatch):
    def work(case):
        return 2 * case

    def tell(results, it):
        yield BenchTable(f"{it.cpu:g}", ("twice",), [[f"{one}"] for one in results])
        yield MachineLine("fast")
        yield "done"

    record = BenchRecord(
        "trying", lambda it: [1, 2], None, tell, in_turn=lambda cases: map(work, cases)
    )
    monkeypatch.setitem(sys.modules, "bench_of_a_test", SimpleNamespace(BENCH=record))
    command = bench.BenchCommand("try", "bench_of_a_test", "Try.", (bench.cpu_option(),))
    monkeypatch.setattr(bench, "BENCHES", (command,))
    monkeypatch.setattr(measured, "MEASURED", {"it": "try --plant cpu=3"})
    found = measured.measure("it")
    assert found == Measurements(
        "brickservo bench try --plant cpu=3",
        [BenchTable("3", ("twice",), [["2"], ["4"]])],
        ["done"],
    )


@pytest.mark.parametrize("name", MEASURED)
def test_each_record_is_of_the_command_that_the_pages_show(name):
    assert measured.read(name).command == f"brickservo bench {MEASURED[name]}"
    assert f"{measured.read(name).command}\n" in PAGES


def test_no_record_lies_about_that_nobody_makes():
    assert {file.stem for file in measured.FOLDER.glob("*.json")} == set(MEASURED)
