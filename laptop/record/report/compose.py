"""Composition of a report from runs: numbered tables and figures, in the order of a lab report."""

from __future__ import annotations

import csv
import io
import itertools
import os
import re
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from laptop.record.drawing_tables import DRAWINGS, PATHS
from laptop.record.figures.document import data_url, render_report
from laptop.record.report.find_runs import CONTENTS
from laptop.record.report.method import aim, method, questions
from laptop.record.report.report_run import (
    NO_VALUE,
    LeftOut,
    RawData,
    ReportFigure,
    ReportRun,
    TextTable,
    as_texts,
    clean,
)
from laptop.record.report.set_up import describe_arms
from laptop.record.run import (
    ACCURACY,
    CALIBRATION,
    DRAWING,
    MAX_COLUMNS,
    SCRIPT,
    SERVO,
    TRACKING,
    Cell,
    Column,
    RunTable,
)
from laptop.record.servo.servo_run import STEPS
from shared.message_fields import printable
from shared.version import VERSION

TEMPLATE = Path(__file__).with_name("templates") / "report.html"
TALL_ASPECT = 0.9
"""Ratio of height to width above which a picture may take more of a page."""
MAX_ROWS, MAX_STEP_ROWS = 45, 25
"""Greatest number of rows of a table, and of the servo's steps, that is not folded on a screen.

A longer one is a CSV beside a printed report; so are the steps of several goals."""
MAX_STEM_LENGTH = 80
"""Greatest length of the name of a file of raw data, without its ending, letters."""
_NUMERIC = re.compile(r"[\u2212+-]?\d[\d.]*( %)?|" + NO_VALUE)

SECTIONS = {
    DRAWING: "Drawing",
    SERVO: "Going to what the camera sees",
    ACCURACY: "Accuracy and repeatability",
    CALIBRATION: "Calibration",
    TRACKING: "Tracking",
    SCRIPT: "Other programs",
}
"""Headings of the results by kind of run, in order."""


class PrintedTable(NamedTuple):
    """A table with its number; `source` names its runs, `numeric` marks columns of numbers.

    A long one is folded on a screen.
    """

    number: int
    caption: str
    source: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[bool]
    is_long: bool


class PrintedFigure(NamedTuple):
    """A figure with its number; `address` is a data URL, `is_tall` is about as high as wide."""

    number: int
    caption: str
    source: str
    address: str
    is_tall: bool


class RunResults(NamedTuple):
    """The tables and figures of one run in a report."""

    run: ReportRun
    tables: Sequence[PrintedTable]
    figures: Sequence[PrintedFigure]


class ReportSection(NamedTuple):
    """The results of one kind of runs."""

    title: str
    runs: Sequence[RunResults]


class DataFile(NamedTuple):
    """A CSV beside the report: its address from there, its run, and its content in words."""

    address: str
    source: str
    holds: str


@dataclass(eq=False)
class Report:
    """A report, to be written.

    Attributes:
        runs: in the report.
        left_out: folders and files that are not.
        values: of the template.
        data: the CSVs by name.
    """

    runs: list[ReportRun]
    left_out: list[LeftOut]
    values: dict[str, Any]
    data: dict[str, RawData]
    tables: int
    figures: int

    def html(self, paper: str = "", linked: bool = True) -> str:
        """Return its text.

        Args:
            paper: a value of PAPERS; "": whichever it is printed on.
            linked: with links to the CSVs.
        """
        return render_report(TEMPLATE, **self.values, paper=paper, linked=linked)


class Numbering:
    """Numbers of tables and figures, given in order."""

    def __init__(self) -> None:
        self.tables: list[PrintedTable] = []
        self.figures = 0

    def table(
        self,
        table: TextTable,
        runs: Iterable[ReportRun],
        source: str = "",
        most: int = MAX_ROWS,
    ) -> PrintedTable:
        """Return a table with its number; one of more than `most` rows is long."""
        columns = list(zip(*table.rows, strict=True))
        printed = PrintedTable(
            len(self.tables) + 1,
            table.caption,
            ", ".join(filter(None, (_source(runs), source))),
            table.headings,
            table.rows,
            [all(_NUMERIC.fullmatch(cell) for cell in column) for column in columns]
            or [False] * len(table.headings),
            len(table.rows) > most,
        )
        self.tables.append(printed)
        return printed

    def figure(self, figure: ReportFigure, run: ReportRun) -> PrintedFigure:
        """Return a figure with its number."""
        self.figures += 1
        address, is_tall = data_url(figure.picture), _is_tall(figure.picture)
        return PrintedFigure(self.figures, figure.caption, _source([run]), address, is_tall)


def compose(
    runs: Sequence[ReportRun],
    left_out: Sequence[LeftOut],
    title: str,
    data_folder: str | None,
) -> Report:
    """Return the report of some runs.

    Args:
        runs: with their numbers.
        left_out: folders and files that could not be read.
        title: over the report.
        data_folder: name of the folder of CSVs beside a lab report; None: the report of one run,
            which lies among its files.
    """
    arms = describe_arms(runs)
    numbering = Numbering()
    kinds = {run.run.kind for run in runs}
    if any(table.name in (PATHS, DRAWINGS) for run in runs for table in run.compared):
        kinds.add(DRAWING)
    lab = data_folder is not None
    parts: dict[str, Any] = {"overview": None}
    makers: dict[str, Callable[[], Any]] = {
        "compared": lambda: _compared(runs, numbering),
        "sections": lambda: _sections(runs, numbering),
        "ran_on": lambda: _ran_on(runs, numbering),
        "arms": lambda: [numbering.table(arm.table, arm.runs, arm.source) for arm in arms],
    }
    if lab:  # in it the set-up comes first
        set_up = {"overview": lambda: numbering.table(_overview(runs), runs)}
        makers = {**set_up, "arms": makers["arms"], "ran_on": makers["ran_on"], **makers}
    for name, make in makers.items():
        parts[name] = make()
    methods = {name for run in runs for name in run.run.methods}
    first = runs[0]
    data, files = _raw_data(runs, numbering.tables, data_folder)
    tables = f"{data_folder}/table-1.csv to table-{len(numbering.tables)}.csv" if lab else ""
    values = {
        "title": printable(title),
        "lab": lab,
        "good": first.run.ending.is_well,
        "verdict": first.outcome,
        "save_as": "",
        "kept": "",
        "typed": shlex.join(["brickservo", *map(clean, first.run.typed)])
        if first.run.typed
        else "",
        "aim": aim(kinds),
        **parts,
        "steps": list(method({arm.chain for arm in arms}, kinds, methods)) if lab else [],
        "left_out": left_out,
        "questions": questions(kinds),
        "files": files,
        "table_files": tables,
        "version": VERSION,
    }
    return Report([*runs], [*left_out], values, data, len(numbering.tables), numbering.figures)


def _sections(runs: Sequence[ReportRun], numbering: Numbering) -> list[ReportSection]:
    return [
        ReportSection(title, [_results(run, numbering) for run in runs if run.run.kind == kind])
        for kind, title in SECTIONS.items()
        if any(run.run.kind == kind for run in runs)
    ]


def _overview(runs: Sequence[ReportRun]) -> TextTable:
    rows = []
    for run in runs:
        seconds = run.run.ending.seconds
        took = NO_VALUE if seconds is None else f"{seconds:.1f}"
        rows.append((run.label, run.name, run.what, run.arm, took, run.outcome or NO_VALUE))
    headings = ("run", "folder or file", "what it did", "arm", "time s", "ended")
    return TextTable("runs", "The runs of this report", headings, rows)


def _ran_on(runs: Sequence[ReportRun], numbering: Numbering) -> PrintedTable | None:
    """Return brick, camera and settings, each once, with the runs that had them."""
    facts: dict[tuple[str, str], list[str]] = {}
    for run in runs:
        for fact in run.set_up:
            facts.setdefault(fact, []).append(run.label)
    if not facts:
        return None
    several = len(runs) > 1
    headings = ("what", "it was", "in runs")[: 2 + several]
    rows = [(*fact, ", ".join(labels))[: 2 + several] for fact, labels in sorted(facts.items())]
    caption = "Brick, camera and settings, as the runs' files have them"
    reporting = [run for run in runs if run.set_up]
    return numbering.table(TextTable("set-up", caption, headings, rows), reporting)


def _compared(runs: Sequence[ReportRun], numbering: Numbering) -> list[PrintedTable]:
    """Return the tables that compare runs: of each name one, with all columns that a run has."""
    found: dict[str, list[tuple[ReportRun, RunTable]]] = {}
    for run in runs:
        for table in run.compared:
            found.setdefault(table.name, []).append((run, table))
    printed = []
    for name, parts in found.items():
        columns = list(dict.fromkeys(column for _, table in parts for column in table.columns))
        del columns[MAX_COLUMNS:]
        rows: list[list[Cell]] = []
        for run, table in parts:
            for row in table.rows:
                cells = dict(zip(table.columns, row, strict=True))
                rows.append([run.label, *(cells.get(column) for column in columns)])
        caption = parts[0][1].caption
        merged = as_texts(RunTable(name, caption, [Column("run"), *columns], rows))
        if len(runs) == 1:
            merged = merged._replace(
                headings=merged.headings[1:], rows=[row[1:] for row in merged.rows]
            )
        printed.append(numbering.table(_without_empty(merged), [run for run, _ in parts]))
    return printed


def _results(run: ReportRun, numbering: Numbering) -> RunResults:
    several = sum(table.name == STEPS for table in run.tables) > 1
    most = {STEPS: 0 if several else MAX_STEP_ROWS}
    return RunResults(
        run,
        [
            numbering.table(table, [run], most=most.get(table.name, MAX_ROWS))
            for table in run.tables
        ],
        [numbering.figure(figure, run) for figure in run.figures],
    )


def _without_empty(table: TextTable) -> TextTable:
    """Return a table without the columns that have no value in any run."""
    full = [k for k, cells in enumerate(zip(*table.rows, strict=True)) if set(cells) != {NO_VALUE}]
    rows = [[row[k] for k in full] for row in table.rows]
    return table._replace(headings=[table.headings[k] for k in full], rows=rows)


def _source(runs: Iterable[ReportRun]) -> str:
    """Return the runs of a table or figure, in words."""
    own = list(dict.fromkeys(runs))
    if len(own) == 1:
        return f"run {own[0].label}, {own[0].name}" if own[0].number else ""
    return "runs " + ", ".join(run.label for run in own)


def _raw_data(
    runs: Sequence[ReportRun], tables: Sequence[PrintedTable], folder: str | None
) -> tuple[dict[str, RawData], list[DataFile]]:
    """Return all CSVs by their names beside the report, and the report's list of them."""
    if folder is None:  # they lie where they are
        own = [file for run in runs for file in run.run.files if file.name.endswith(".csv")]
        return {}, [DataFile(file.name, "", clean(file.holds)) for file in own if file.holds]
    data: dict[str, RawData] = {}
    files = []
    for run in runs:
        for raw in run.data:
            name = _free(f"{run.label}-{re.sub(r'[^A-Za-z0-9._-]+', '-', raw.name)}", data)
            data[name] = raw
            files.append(DataFile(f"{folder}/{name}", _source([run]), raw.holds))
    for table in tables:
        name = f"table-{table.number}.csv"
        rows = [[cell.replace("\u2212", "-") for cell in row] for row in table.rows]
        cells = [["" if cell == NO_VALUE else cell for cell in row] for row in rows]
        data[name] = RawData(name, _as_csv(table.headings, cells), table.caption)
    contents = [(file.address.split("/")[-1], file.source, file.holds) for file in files]
    contents += [(f"table-{table.number}.csv", table.source, table.caption) for table in tables]
    data[CONTENTS] = RawData(CONTENTS, _as_csv(("file", "from", "holds"), contents), "")
    return data, files


def _as_csv(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([heading, *rows])
    return out.getvalue()


def _is_tall(picture: bytes) -> bool:
    """Return whether a PNG needs more of a page's height, to be as wide as others."""
    wide, high = (int.from_bytes(picture[k : k + 4], "big") for k in (16, 20))
    return picture.startswith(b"\x89PNG") and high > TALL_ASPECT * wide


def _free(name: str, taken: Iterable[str]) -> str:
    stem, ending = os.path.splitext(name)
    stem, ending = stem[:MAX_STEM_LENGTH], ending[:MAX_STEM_LENGTH]
    names = itertools.chain([stem + ending], (f"{stem}-{k}{ending}" for k in itertools.count(2)))
    return next(free for free in names if free not in taken)
