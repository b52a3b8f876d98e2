"""One run: the record that every command leaves as run.json, and the reading of it.

A table carries its caption and units, a file its content in words.  So a run can be read without
knowing its command.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias

import msgspec

from laptop.record.names import RUN
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_text
from shared.version import VERSION

Cell: TypeAlias = bool | int | float | str | None
"""Value in a cell of a table."""

DRAWING, SERVO, ACCURACY, CALIBRATION, SCRIPT, TRACKING = (
    *("drawing", "servo", "accuracy", "calibration", "script", "tracking"),
)
"""Kinds of runs, on which sections, aim and method of a report depend."""

UNITS = frozenset(("cm", "mm", "px", "s", "deg", "g", "%", "deg/s", "cm/s"))
"""Units of columns."""
MAX_BYTES = 40_000_000
"""Greatest size of run.json, bytes."""
MAX_COLUMNS, MAX_TABLES, MAX_CELLS, MAX_FILES = 64, 200, 300_000, 500
"""Greatest number of columns of a table, of tables, of their cells, and of files of a run."""
MAX_NAME_SHOWN = 80
"""Greatest length of a name in a message, letters."""
MAX_NUMBER = 1e12
"""Greatest number that a run measures or counts."""


class DamagedRun(ArmError, ValueError):
    """A run whose files cannot be understood; the text says which and why."""


class Column(msgspec.Struct, frozen=True):
    """A column of a table; `unit` is "" where there is none."""

    name: str
    unit: str = ""

    @property
    def heading(self) -> str:
        """Name and unit, for people."""
        return f"{self.name} {self.unit}".strip()


class RunTable(msgspec.Struct, frozen=True):
    """A table of a run's measurements.

    name      by which programs find it
    caption   for people
    columns   as many as each row has cells
    rows      of cells; None where there is no value
    compared  whether a report makes one table of it and of those of other runs
    """

    name: str
    caption: str
    columns: list[Column]
    rows: list[list[Cell]]
    compared: bool = False


class RunFile(msgspec.Struct, frozen=True):
    """A file of a run: its name from the run's folder on, and its content in words.

    A picture with words goes into a report as a figure, a CSV beside it as raw data; without words
    neither does.
    """

    name: str
    holds: str = ""


class Ending(msgspec.Struct, frozen=True):
    """The ending of a run.

    status   of the program, 0 if well; None: it is of no one program
    reason   in a few words
    seconds  that it took; on the brick's clock, where one program ran there
    more     further values for programs, by name
    well     whether it is what was wanted; by default, if the status is 0
    """

    status: int | None
    reason: str
    seconds: float | None = None
    more: dict[str, Any] = {}
    well: bool | None = None

    @property
    def is_well(self) -> bool:
        """Whether it is what was wanted."""
        return not self.status if self.well is None else self.well


class Run(msgspec.Struct, kw_only=True):
    """One run.

    kind     DRAWING, SERVO, ...
    what     it did, in a line
    typed    the command's words
    version  of BrickServo
    ending   how it ended
    arm      its numbers, see `laptop.record.figures.arm_numbers`; None: it had none
    built    the same of the arm as it truly was, where that is another one
    set_up   brick, camera, settings, by their names
    seeds    of what was drawn at random, by what it is of
    methods  of servoing, that it used
    tables   what it measured
    files    that it left
    notes    what is missing of it, or to be known, a sentence each
    """

    kind: str
    what: str
    ending: Ending
    typed: list[str] = []
    version: str = VERSION
    arm: dict[str, Any] | None = None
    built: dict[str, Any] | None = None
    set_up: dict[str, Cell | list[Cell]] = {}
    seeds: dict[str, int] = {}
    methods: list[str] = []
    tables: list[RunTable] = []
    files: list[RunFile] = []
    notes: list[str] = []

    def on_emulated_brick(self, plant: str = "", scene: str | None = None, /, **more: Any) -> None:
        """Record that the brick was emulated, and its seeds.

        Args:
            plant: changes of its constants, as text.
            scene: before its cameras, as text; None: none, or nothing in it is random.
            more: further values of the set-up, by their names.
        """
        self.set_up = {**self.set_up, "brick": "emulated", **more}
        if plant:
            self.set_up["plant"] = plant
        self.seeds = self.seeds | seeds_of(plant=plant, scene=scene)

    def rows(self, table: str) -> list[dict[str, Cell]]:
        """Return the rows of a table as values by their headings; [] if there is no such one.

        Args:
            table: its name.

        Returns:
            A dictionary for each row, such as {"path": 1, "greatest mm": 0.51}.
        """
        return [
            dict(zip((column.heading for column in one.columns), row, strict=True))
            for one in self.tables
            if one.name == table
            for row in one.rows
        ]


def table(
    name: str,
    caption: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[Any]],
    compared: bool = False,
) -> RunTable:
    """Return a table; numbers beyond MAX_NUMBER are None in it.

    Args:
        name: by which programs find it.
        caption: for people.
        headings: of the columns; a unit of UNITS is their last word, as in "greatest mm".
        rows: of cells.
        compared: whether a report makes one table of it and of those of other runs.
    """
    columns = []
    for heading in headings:
        quantity, _, unit = heading.rpartition(" ")
        has_unit = bool(quantity) and unit in UNITS
        columns.append(Column(quantity, unit) if has_unit else Column(heading))
    cells = [[_cell(v) for _, v in zip(columns, row, strict=True)] for row in rows]
    return RunTable(name, caption, columns, cells, compared)


def settings(values: Mapping[str, Any]) -> RunTable:
    """Return single values by their names, with a unit as their last word, as a table."""
    rows = [(name, value) for name, value in values.items()]
    return table("values", "What it was done with, and what came of it", ("what", "value"), rows)


def seeds_of(**texts: str | None) -> dict[str, int]:
    """Return the seeds in texts such as "backlash=3,seed=4", by what they are of."""
    found = {}
    for name, text in texts.items():
        for key, _, value in (part.partition("=") for part in (text or "").split(",")):
            if key.rpartition(".")[2].strip() == "seed" and value.strip().isdecimal():
                prefix = key.strip().removesuffix("seed").strip(".")
                found[f"{name} {prefix}".strip()] = int(value)
    return found


def _cell(value: Any) -> Cell:
    if value is None or isinstance(value, (bool, str)):
        return value
    if not abs(value) <= MAX_NUMBER:
        return None
    return value if isinstance(value, int) else float(value)


def as_json(run: Run) -> bytes:
    """Return the bytes of run.json, with a line for each row of a table."""
    values = msgspec.to_builtins(run)
    rows = []
    for k, one in enumerate(values["tables"]):
        lines = [json.dumps(row, ensure_ascii=False) for row in one["rows"]]
        rows.append("[\n    " + ",\n    ".join(lines) + "\n   ]" if lines else "[]")
        one["rows"] = f"\0{k}"
    text = json.dumps(values, indent=1, ensure_ascii=False)
    for k, lines_of in enumerate(rows):
        text = text.replace(f'"rows": "\\u0000{k}"', f'"rows": {lines_of}')
    return text.encode("utf-8", "replace") + b"\n"


def read_run(folder: Path) -> Run:
    """Read a run from its folder.

    Raises:
        DamagedRun: there is none, or it is not as it is written.
    """
    file = folder / RUN
    try:
        if file.is_symlink():
            raise DamagedRun(f"{RUN} is a link")
        content = read_text(str(file), MAX_BYTES)
        run = msgspec.json.decode(content.encode(), type=Run)
    except InvalidFile as error:
        raise DamagedRun(f"{RUN} {error}") from None
    except OSError as error:
        raise DamagedRun(f"{RUN} cannot be read: {error.strerror}") from None
    except msgspec.ValidationError as error:
        reason = str(error).replace("`", "'")[: 2 * MAX_NAME_SHOWN]
        raise DamagedRun(f"{RUN} is not as it is written ({reason}); do this run again") from None
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        raise DamagedRun(f"{RUN} is no JSON; do this run again") from None
    _check(run)
    return run


def _check(run: Run) -> None:
    """Raise DamagedRun if a run is beyond the limits above."""
    if len(run.tables) > MAX_TABLES or len(run.files) > MAX_FILES:
        raise DamagedRun(f"{RUN} holds more than {MAX_TABLES} tables or {MAX_FILES} files")
    if sum(len(row) for one in run.tables for row in one.rows) > MAX_CELLS:
        raise DamagedRun(f"{RUN} holds tables of more than {MAX_CELLS} values")
    if abs(run.ending.seconds or 0.0) > MAX_NUMBER:
        raise DamagedRun(f"{RUN}: it took {run.ending.seconds} s, beyond any run's")
    for one in run.tables:
        name = one.name[:MAX_NAME_SHOWN]
        if len(one.columns) > MAX_COLUMNS:
            raise DamagedRun(f"{RUN}: the table '{name}' has more than {MAX_COLUMNS} columns")
        if any(len(row) != len(one.columns) for row in one.rows):
            raise DamagedRun(f"{RUN}: a row of the table '{name}' has too many or few values")
        for value in (cell for row in one.rows for cell in row):
            if isinstance(value, (int, float)) and abs(value) > MAX_NUMBER:
                raise DamagedRun(f"{RUN}: the table '{name}' holds {value}, beyond any run's")
    names = [file.name for file in run.files]
    if len(names) > len({*names}):
        raise DamagedRun(f"{RUN} names a file twice")
    for name in names:
        place = PurePosixPath(name)
        if place.is_absolute() or not place.parts or ".." in place.parts or "\\" in name:
            shown = name[:MAX_NAME_SHOWN]
            raise DamagedRun(f"{RUN}: the file '{shown}' is outside of the run's folder")
