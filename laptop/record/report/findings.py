"""What a report is made of: runs with their tables, figures and raw data.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from laptop.record.figures.private_paths import without_folders
from shared.arm_description import ArmError
from shared.message_fields import printable

DRAWING, SERVO, ACCURACY, CALIBRATION, SCRIPT, TRACKING = (
    *("drawing", "servo", "accuracy", "calibration", "script", "tracking"),
)
"""Kinds of runs, in the order of a report's sections."""
NOT_THERE = "\u2013"
"""In a cell of which the files hold no value."""


class DamagedRun(ArmError, ValueError):
    """A run whose files cannot be understood; the text says which and why."""


def clean(text: str) -> str:
    """Return a text of a run as a report has it: printable, and of each path the last name alone.

    A report is for others, and what a run's files hold may be anything.
    """
    return printable(without_folders(text))


class LabTable(NamedTuple):
    """A table of texts.

    caption   without its number and run
    headings  of the columns
    rows      of texts, as many each as there are headings
    """

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


def clean_table(table: LabTable) -> LabTable:
    """Return a table with all its texts `clean`."""
    rows = [[*map(clean, row)] for row in table.rows]
    return LabTable(clean(table.caption), [*map(clean, table.headings)], rows)


class LabFigure(NamedTuple):
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
class LabRun:
    """One run, as its files tell it.

    Attributes:
        name: its folder or file, from the report's folder on.
        kind: DRAWING, SERVO, ...
        what: it did, in a line.
        outcome: how it ended, in a few words, or "".
        seconds: it took, or None.
        arm: its name, or "".
        arm_numbers: as `laptop.record.figures.arm_numbers` has them, or None.
        built_numbers: the same of the arm as it was built, where that is another one.
        set_up: (what, as the files have it) of brick, camera, scene.
        results: rows for the tables of its kind, by their caption.
        methods: of servoing, that it used.
        tables, figures, data: of this run alone.
        gaps: what its files do not hold, a sentence each.
        number: in the report, from 1 on.
    """

    name: str
    kind: str
    what: str
    outcome: str = ""
    seconds: float | None = None
    arm: str = ""
    arm_numbers: dict[str, Any] | None = None
    built_numbers: dict[str, Any] | None = None
    set_up: list[tuple[str, str]] = field(default_factory=list)
    results: list[tuple[str, tuple[str, ...]]] = field(default_factory=list)
    methods: list[str] = field(default_factory=list)
    tables: list[LabTable] = field(default_factory=list)
    figures: list[LabFigure] = field(default_factory=list)
    data: list[RawData] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)
    number: int = 0

    @property
    def label(self) -> str:
        """Its name in tables and captions."""
        return f"R{self.number}"

    def clean(self) -> None:
        """Make all its texts `clean`."""
        self.name = printable(self.name)  # it begins in the report's folder
        self.what, self.outcome, self.arm = map(clean, (self.what, self.outcome, self.arm))
        self.set_up = [(clean(what), clean(value)) for what, value in self.set_up]
        self.results = [(name, tuple(map(clean, row))) for name, row in self.results]
        self.tables = [*map(clean_table, self.tables)]
        self.figures = [LabFigure(clean(caption), picture) for caption, picture in self.figures]
        self.data = [RawData(raw.name, raw.source, clean(raw.holds)) for raw in self.data]
        self.gaps = [*map(clean, self.gaps)]


class LeftOut(NamedTuple):
    """What is not in the report: its folder or file, and why."""

    name: str
    why: str
