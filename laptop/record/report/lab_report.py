"""A lab report of the runs in a folder: one HTML file, and the raw data as CSV beside it."""

from __future__ import annotations

import csv
import itertools
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from laptop.record.figures.document import illustration, render_report
from laptop.record.report.drawing_runs import DRAWINGS, PATHS
from laptop.record.report.findings import (
    ACCURACY,
    CALIBRATION,
    DRAWING,
    NOT_THERE,
    SCRIPT,
    SERVO,
    TRACKING,
    LabFigure,
    LabRun,
    LabTable,
    LeftOut,
    RawData,
)
from laptop.record.report.method import aim, method, questions
from laptop.record.report.run_files import decimal, is_plain
from laptop.record.report.run_folders import CONTENTS, read_runs
from laptop.record.report.servo_runs import GOALS, as_csv
from laptop.record.report.set_up import describe_arms
from laptop.system.files import written
from shared.arm_description import ArmError
from shared.message_fields import printable
from shared.small_files import SpoiltFile, read_text
from shared.version import VERSION

TEMPLATE = Path(__file__).with_name("templates") / "lab_report.html"
TITLE = "Lab report: a robot arm"
OUT = "lab-report.html"
PAPERS = {"a4": "A4", "letter": "letter"}
TALL = 0.9
"""Pictures higher than this share of their width may take more of a page."""
_NUMERIC = re.compile(r"[\u2212+-]?\d[\d.]*( %)?|" + NOT_THERE)

SECTIONS = {
    DRAWING: "Drawing",
    SERVO: "Going to what the camera sees",
    ACCURACY: "Accuracy and repeatability",
    CALIBRATION: "Calibration",
    TRACKING: "Tracking",
    SCRIPT: "Other programs",
}
"""Kinds of runs, in order, and the headings of their results."""
COMPARED = {
    PATHS: (
        "Drawn paths: the ink against the path that was wanted",
        (
            *("arm", "path", "length cm", "time s", "greatest mm", "rms mm", "end off mm"),
            "missed mm",
        ),
    ),
    DRAWINGS: (
        "Drawings: the ink against what was wished",
        (
            *("arm", "drawing", "strokes drawn", "ink cm", "time s", "estimated s"),
            *("greatest mm", "rms mm", "missed mm"),
        ),
    ),
    GOALS: (
        "Goals: how each was reached",
        (
            *("arm", "goal", "method", "ended", "moves", "time s", "off px, as the servo says"),
            *("truly off px", "truly off mm"),
        ),
    ),
}
"""Tables over several runs: caption, and headings after that of the run."""


class BadLabReport(ArmError, OSError):
    """A report that cannot be written."""


class PrintedTable(NamedTuple):
    """A table with its number; `source` names the runs; `numeric` says of each column if it is."""

    number: int
    caption: str
    source: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[bool]


class PrintedFigure(NamedTuple):
    """A figure with its number; `address` is a data URL, `is_tall` is about as high as wide."""

    number: int
    caption: str
    source: str
    address: str
    is_tall: bool


class RunResults(NamedTuple):
    """What a report shows of one run."""

    run: LabRun
    tables: Sequence[PrintedTable]
    figures: Sequence[PrintedFigure]


class ReportSection(NamedTuple):
    """The results of one kind of runs."""

    title: str
    tables: Sequence[PrintedTable]
    runs: Sequence[RunResults]


class DataFile(NamedTuple):
    """A CSV beside the report: its address from there, whose it is, and what it holds."""

    address: str
    source: str
    holds: str


@dataclass(eq=False)
class LabReport:
    """A report, to be written.

    Attributes:
        runs, left_out: what was found.
        values: of the template.
        data: the CSVs by name.
    """

    runs: list[LabRun]
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
    """Gives tables and figures their numbers, in order."""

    def __init__(self) -> None:
        self.tables: list[PrintedTable] = []
        self.figures = 0

    def table(self, table: LabTable, runs: Iterable[LabRun], source: str = "") -> PrintedTable:
        """Return a table with its number."""
        columns = list(zip(*table.rows, strict=True))
        printed = PrintedTable(
            len(self.tables) + 1,
            table.caption,
            _source(runs) + (f", {source}" if source else ""),
            table.headings,
            table.rows,
            [all(_NUMERIC.fullmatch(cell) for cell in column) for column in columns],
        )
        self.tables.append(printed)
        return printed

    def figure(self, figure: LabFigure, run: LabRun) -> PrintedFigure:
        """Return a figure with its number."""
        self.figures += 1
        address = illustration("", "", figure.picture).source
        if figure.picture.startswith(b"\xff\xd8"):
            address = address.replace("image/png", "image/jpeg", 1)
        is_tall = _is_tall(figure.picture)
        return PrintedFigure(self.figures, figure.caption, _source([run]), address, is_tall)


def compose(folder: Path, title: str, data_folder: str) -> LabReport:
    """Return the report of the runs in a folder.

    Slow, and to be called by one thread at a time: matplotlib's style is everybody's.

    Args:
        folder: of the runs.
        title: over the report.
        data_folder: name of the folder of CSVs beside the report.

    Raises:
        NoRuns: there is none.
    """
    runs, left_out = read_runs(folder)
    arms = describe_arms(runs)
    numbering = Numbering()
    kinds = {run.kind for run in runs} | {DRAWING for run in runs if _has(run, PATHS)}
    overview = numbering.table(
        LabTable(
            "The runs of this report",
            ("run", "folder or file", "what it did", "arm", "time s", "ended"),
            [
                (run.label, run.name, run.what, run.arm or NOT_THERE, decimal(run.seconds, 1))
                + (run.outcome or NOT_THERE,)
                for run in runs
            ],
        ),
        runs,
    )
    arm_tables = [numbering.table(arm.table, arm.runs, arm.source) for arm in arms]
    told: dict[tuple[str, str], list[str]] = {}
    for run in runs:
        for fact in run.set_up:
            told.setdefault(fact, []).append(run.label)
    ran_on = None
    if told:
        caption = "Brick, camera and settings, as the runs' files have them"
        rows = [(what, value, ", ".join(labels)) for (what, value), labels in sorted(told.items())]
        tellers = [run for run in runs if run.set_up]
        ran_on = numbering.table(LabTable(caption, ("what", "it was", "in runs"), rows), tellers)
    methods = {m for run in runs for m in run.methods}
    sections = [_section(kind, runs, numbering) for kind in SECTIONS if _there(kind, runs)]
    data, files = _raw_data(runs, numbering.tables, data_folder)
    values = {
        "title": printable(title),
        "aim": aim(kinds),
        "overview": overview,
        "arms": arm_tables,
        "ran_on": ran_on,
        "steps": list(method({arm.chain for arm in arms}, kinds, methods)),
        "sections": sections,
        "left_out": left_out,
        "questions": questions(kinds),
        "files": files,
        "table_files": f"{data_folder}/table-1.csv to table-{len(numbering.tables)}.csv",
        "version": VERSION,
    }
    return LabReport(runs, left_out, values, data, len(numbering.tables), numbering.figures)


def _has(run: LabRun, table: str) -> bool:
    return any(name == table for name, _ in run.results)


def _there(kind: str, runs: Sequence[LabRun]) -> bool:
    return any(run.kind == kind or (kind == DRAWING and _has(run, PATHS)) for run in runs)


def _section(kind: str, runs: Sequence[LabRun], numbering: Numbering) -> ReportSection:
    """Return the results of a kind: first what compares the runs, then run by run."""
    compared = []
    for name in {DRAWING: (PATHS, DRAWINGS), SERVO: (GOALS,)}.get(kind, ()):
        rows = [(run.label, *row) for run in runs for table, row in run.results if table == name]
        if rows:
            caption, headings = COMPARED[name]
            table = _without_empty(LabTable(caption, ("run", *headings), rows))
            compared.append(numbering.table(table, [run for run in runs if _has(run, name)]))
    single = [
        RunResults(
            run,
            [numbering.table(table, [run]) for table in run.tables],
            [numbering.figure(figure, run) for figure in run.figures],
        )
        for run in runs
        if run.kind == kind
    ]
    return ReportSection(SECTIONS[kind], compared, single)


def _without_empty(table: LabTable) -> LabTable:
    """Return a table without columns of which no run's files hold a value."""
    kept = [k for k, cells in enumerate(zip(*table.rows, strict=True)) if set(cells) != {NOT_THERE}]
    return LabTable(
        table.caption,
        [table.headings[k] for k in kept],
        [[row[k] for k in kept] for row in table.rows],
    )


def _source(runs: Iterable[LabRun]) -> str:
    """Return in words which runs something is from."""
    told = list(dict.fromkeys(runs))
    if len(told) == 1:
        return f"run {told[0].label}, {told[0].name}"
    return "runs " + ", ".join(run.label for run in told)


def _raw_data(
    runs: Sequence[LabRun], tables: Sequence[PrintedTable], folder: str
) -> tuple[dict[str, RawData], list[DataFile]]:
    """Return all CSVs by their names beside the report, and how the report tells of them."""
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
        cells = [["" if cell == NOT_THERE else cell for cell in row] for row in rows]
        data[name] = RawData(name, as_csv(table.headings, cells), table.caption)
    told = [(file.address.split("/")[-1], file.source, file.holds) for file in files]
    told += [(f"table-{table.number}.csv", table.source, table.caption) for table in tables]
    data[CONTENTS] = RawData(CONTENTS, as_csv(("file", "from", "holds"), told), "")
    return data, files


def _is_tall(picture: bytes) -> bool:
    """Return whether a PNG needs more of a page's height, to be as wide as others."""
    wide, high = (int.from_bytes(picture[k : k + 4], "big") for k in (16, 20))
    return picture.startswith(b"\x89PNG") and high > TALL * wide


def _free(name: str, taken: Iterable[str]) -> str:
    stem, ending = os.path.splitext(name)
    stem, ending = stem[:MAX_STEM], ending[:MAX_STEM]
    names = itertools.chain([stem + ending], (f"{stem}-{k}{ending}" for k in itertools.count(2)))
    return next(free for free in names if free not in taken)


def check_out(out: Path, replace: bool) -> None:
    """Refuse where a report cannot be, or would take what somebody wrote with it.

    Raises:
        BadLabReport: so it is.
    """
    if out.exists() and not replace:
        raise BadLabReport(
            f"{out} is there already, perhaps with what somebody wrote into it; give another file "
            "with --out, or --replace it"
        )
    data = data_folder_of(out)
    if os.path.lexists(data):
        _check_own(data)
        if not replace:
            raise BadLabReport(
                f"{data} is there already, with the raw data of a report that has perhaps another "
                "name now; give another file with --out, or --replace them"
            )
    if not out.parent.is_dir():
        raise BadLabReport(f"{out.parent} is no folder; make it, or give another file with --out")


def _check_own(data: Path) -> None:
    """Refuse a folder that holds anything but what a report has written there: it is to go.

    Its list may be anybody's, so that it is believed of files only that a report names so.

    Raises:
        BadLabReport: it does.
    """
    if data.is_symlink() or not is_plain(data / CONTENTS):
        raise BadLabReport(f"{data} is there and is not of a report; give another file with --out")
    try:
        contents = read_text(str(data / CONTENTS), MAX_CONTENTS).splitlines()
        told = {row[0] for row in csv.reader(contents) if row}
    except (SpoiltFile, OSError, csv.Error):
        raise BadLabReport(
            f"{data / CONTENTS} is no list of a report's files, so that none is replaced; move "
            f"{data}, or give another file with --out"
        ) from None
    own = {name for name in told if _OWN.fullmatch(name) and is_plain(data / name)}
    others = sorted(set(os.listdir(data)) - own - {CONTENTS})
    if others:
        raise BadLabReport(
            f"{data / others[0]} is of no report, and would be lost; move it, or give another "
            "file with --out"
        )


MAX_CONTENTS = 4_000_000
"""A longer list of a report's files is none, bytes."""
_OWN = re.compile(r"(?:R\d+-[A-Za-z0-9._-]*|table-\d+)\.csv")
"""Names of the files of raw data."""
MAX_STEM = 80
"""Letters of the name of a file of raw data, without its ending."""


def data_folder_of(out: Path) -> Path:
    """Return the folder of CSVs that goes with a report."""
    return out.with_name(out.stem + "-data")


def write(report: LabReport, out: Path) -> None:
    """Write a report and its CSVs, both whole or none; those of an earlier one go.

    What a link leads to is replaced, and the link stays; its CSVs lie beside the link.

    Raises:
        BadLabReport: they cannot be written, or something else would go, too.
    """
    folder = data_folder_of(out)
    if os.path.lexists(folder):
        _check_own(folder)
    try:
        with (
            tempfile.TemporaryDirectory(prefix=".lab-report-", dir=out.parent) as made,
            written(out) as page,
        ):
            draft = Path(made)
            data = draft / "data"
            data.mkdir()
            for name, raw in report.data.items():
                if isinstance(raw.source, Path):
                    shutil.copyfile(raw.source, data / name)
                else:
                    (data / name).write_bytes(raw.source.encode("utf-8", "replace"))
            page.write_bytes(report.html().encode("utf-8", "replace"))
            if folder.exists():
                os.replace(folder, draft / "before")
            os.replace(data, folder)
    except OSError as error:
        raise BadLabReport(
            f"cannot write {out}: {error.strerror}; make room, or give another file with --out"
        ) from None
