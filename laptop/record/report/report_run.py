"""A run in a report, with texts free of private paths, pictures and CSVs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.report.raw_figures import draw_trace
from laptop.record.report.run_files import read_columns, read_picture, read_rows
from laptop.record.run import Cell, DamagedRun, Run, RunTable, read_run
from shared.message_fields import printable

NO_VALUE = "\u2013"
"""Text of a cell without a value."""
MAX_DIGITS = 4
"""Greatest number of decimals in a table."""
MAX_FIGURES, MAX_VALUE_LENGTH = 50, 1000
"""Greatest number of figures of a run, and length of a value of its set-up, letters."""
PICTURES = (".png", ".jpg", ".jpeg")
"""Endings of pictures' names."""
TRACE_CAPTION = "Way of the tip, with the pen down in black, and the joint angles in time."


def clean(text: str) -> str:
    """Return a text of a run as a report has it: printable, and of each path the last name alone.

    A report is for others, and a run's files may hold anything.
    """
    return printable(without_folders(text))


class TextTable(NamedTuple):
    """A table of texts.

    name      of the table, by which those of several runs are put together
    caption   without its number and run
    headings  of the columns
    rows      of texts, as many each as there are headings
    """

    name: str
    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


def as_texts(table: RunTable) -> TextTable:
    """Return a run's table as texts; numbers of a column have as many decimals each."""
    columns = [_texts([row[k] for row in table.rows]) for k in range(len(table.columns))]
    headings = [clean(column.heading) for column in table.columns]
    rows = [list(row) for row in zip(*columns, strict=True)]
    return TextTable(table.name, clean(table.caption), headings, rows)


def _texts(cells: Sequence[Cell]) -> list[str]:
    """Return a column as texts; a mixed one has each number as it is."""
    fractions = [cell for cell in cells if isinstance(cell, float)]
    mixed = any(isinstance(cell, str) for cell in cells)
    digits = max((_decimals(cell) for cell in fractions), default=0)

    def text(cell: Cell) -> str:
        if cell is None:
            return NO_VALUE
        if isinstance(cell, bool):
            return "yes" if cell else "no"
        if isinstance(cell, float):
            places = _decimals(cell) if mixed else digits
            return f"{cell:.{places}f}".replace("-", "\u2212")
        return clean(str(cell)).replace("-", "\u2212", isinstance(cell, int))

    return [text(cell) for cell in cells]


def _decimals(number: float) -> int:
    return len(f"{number:.{MAX_DIGITS}f}".rstrip("0").partition(".")[2])


class ReportFigure(NamedTuple):
    """A picture as PNG or JPEG, and its caption without number and run."""

    caption: str
    picture: bytes


class RawData(NamedTuple):
    """A CSV that goes beside the report.

    name    of the file, without the run's number
    source  the file that is copied, or the text itself
    holds   in a few words
    """

    name: str
    source: Path | str
    holds: str


@dataclass(eq=False)
class ReportRun:
    """One run in a report.

    Attributes:
        name: its folder or file, from the report's folder on.
        run: its record.
        tables: of it, as texts.
        compared: those that are put together with other runs'.
        figures: of this run alone.
        data: the same.
        gaps: remarks on what its files lack, a sentence each.
        number: in the report, from 1 on.
    """

    name: str
    run: Run
    tables: list[TextTable] = field(default_factory=list)
    compared: list[RunTable] = field(default_factory=list)
    figures: list[ReportFigure] = field(default_factory=list)
    data: list[RawData] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)
    number: int = 0

    def __post_init__(self) -> None:
        self.name = printable(self.name)  # it begins in the report's folder
        for table in self.run.tables:
            if table.compared:
                self.compared.append(table)
            else:
                self.tables.append(as_texts(table))
        self.gaps += [clean(note) for note in self.run.notes]

    @property
    def label(self) -> str:
        """Its name in tables and captions."""
        return f"R{self.number}"

    @property
    def what(self) -> str:
        """Line that says what it did."""
        return clean(self.run.what)

    @property
    def arm(self) -> str:
        """Its arm's name, or NO_VALUE."""
        return clean(str((self.run.arm or {}).get("name") or NO_VALUE))

    @property
    def outcome(self) -> str:
        """Outcome in words, with the exit status."""
        ending = self.run.ending
        status = f", status {ending.status}" if ending.status else ""
        return clean(ending.reason) + status

    @property
    def set_up(self) -> list[tuple[str, str]]:
        """Pairs (name, value) of brick, camera and settings."""
        values: dict[str, Any] = dict(self.run.set_up)
        values |= {f"seed of {name}": seed for name, seed in self.run.seeds.items()}
        known = {what: value for what, value in values.items() if value is not None}
        return [(clean(what), clean(_value(value))) for what, value in known.items()]

    def leave_out(self, error: DamagedRun) -> None:
        """Record a file that cannot be read."""
        self.gaps.append(clean(f"left out: {error}"))


def _value(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)[:MAX_VALUE_LENGTH]


def read_folder(name: str, folder: Path) -> ReportRun:
    """Return the run that a folder holds, with its pictures and CSVs.

    Args:
        name: of the folder, for people.
        folder: of the run.

    Raises:
        DamagedRun: there is none, or it is not as it is written.
    """
    found = ReportRun(name, read_run(folder))
    for file in found.run.files:
        place, text = folder / file.name, clean(file.holds)
        try:
            if any(
                part.is_symlink()
                for part in place.parents
                if part != folder and part.is_relative_to(folder)
            ):
                raise DamagedRun(f"{file.name} is behind a link")
            if file.holds and place.suffix.lower() in PICTURES:
                if len(found.figures) == MAX_FIGURES:
                    raise DamagedRun(
                        f"{file.name[:80]}: a run has no more than {MAX_FIGURES} figures"
                    )
                caption = f"{text.rstrip()} ({file.name})"
                found.figures.append(ReportFigure(clean(caption), read_picture(place)))
            elif file.holds and place.suffix == ".csv":
                for _ in read_rows(place)[1]:  # are they as it is written?
                    pass
                found.data.append(RawData(file.name.replace("/", "-"), place, text))
        except DamagedRun as error:
            found.leave_out(error)
        except OSError as error:
            found.leave_out(DamagedRun(f"{file.name[:80]} cannot be read: {error.strerror}"))
    if not found.figures and any(file.name == TRACE for file in found.run.files):
        _draw_trace(found, folder / TRACE)
    return found


def _draw_trace(found: ReportRun, trace: Path) -> None:
    try:
        picture = draw_trace(read_columns(trace))
    except DamagedRun:  # it is reported already
        return
    if picture is None:
        found.gaps.append("trace.csv holds no motion to draw")
    else:
        found.figures.append(ReportFigure(f"{TRACE_CAPTION} (drawn from {TRACE})", picture))


class LeftOut(NamedTuple):
    """A folder or file that is not in the report, and why."""

    name: str
    why: str
