"""Measured by the camera: runs of `accuracy` and of `calibrate`.

Of their summaries all figures are shown, by the names that they have there.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from laptop.record.figures.private_paths import without_folders
from laptop.record.report.findings import (
    ACCURACY,
    CALIBRATION,
    NOT_THERE,
    DamagedRun,
    LabFigure,
    LabRun,
    LabTable,
    RawData,
)
from laptop.record.report.run_files import decimal, own_files, read_picture, read_rows, word

WORDS = {
    ACCURACY: ("accuracy and repeatability", "Accuracy and repeatability, measured by the camera."),
    CALIBRATION: ("calibration of the arm", "The calibration's fit."),
}
FILES = {ACCURACY: ("accuracy.csv", "accuracy.png"), CALIBRATION: ("rests.csv",)}
"""What such a run leaves beside its summary."""
MAX_ROWS, MAX_COLUMNS = 45, 12
"""A larger table is a CSV beside the report only."""
MAX_TABLES = 100
"""Of a summary."""
DIGITS = 4
"""Of a figure."""
UNITS = re.compile(r"_((?:mm|cm|px|deg|rad)(?:_per_s)?|s|percent)$")
HEAD = frozenset(("kind", "arm", "status", "reason", "arm_numbers", "built_numbers", "files"))
"""What the report tells of elsewhere."""


def read_measured(name: str, folder: Path, summary: dict[str, Any], kind: str) -> LabRun:
    """Return a run that measured the arm.

    Raises:
        DamagedRun: it holds no figure, or is not as it is written.
    """
    what, caption = WORDS[kind]
    run = LabRun(name, kind, what, arm=word(summary, "arm"))
    run.outcome = without_folders(word(summary, "reason"))
    if summary.get("simulated") is True:
        plant = word(summary, "plant")
        run.set_up.append(("brick", "emulated" + (f", {plant}" if plant else "")))
    for attribute in ("arm_numbers", "built_numbers"):
        if isinstance(summary.get(attribute), dict):
            setattr(run, attribute, summary[attribute])
    for title, heading, rows in tables_of(summary, what, run.gaps):
        run.tables.append(LabTable(f"{title[:1].upper()}{title[1:]}", heading, rows))
    if not run.tables:
        raise DamagedRun("summary.json holds no figure; do this run again")
    own = [folder / name for name in own_files(folder, summary, FILES[kind])]
    for file in (file for file in own if file.suffix == ".csv"):
        try:
            heading, lines = read_rows(file)
            for _ in lines:  # are they as it is written?
                pass
        except DamagedRun as error:
            run.gaps.append(f"left out: {error}")
            continue
        run.data.append(RawData(file.name, file, ", ".join(heading)[:100]))
    if not run.data:
        run.gaps.append("there is no CSV, so no raw data")
    for file in (file for file in own if file.suffix == ".png"):
        try:
            run.figures.append(LabFigure(f"{caption} ({file.name})", read_picture(file)))
        except DamagedRun as error:
            run.gaps.append(f"left out: {error}")
    return run


def tables_of(
    values: dict[str, Any], title: str, gaps: list[str], depth: int = 0
) -> list[tuple[str, list[str], list[list[str]]]]:
    """Return the figures of a summary as tables: (title, headings, rows of texts).

    Args:
        values: of the summary.
        title: of what is no table there.
        gaps: tables that are too large are told of there.
        depth: of the values in the summary.

    Raises:
        DamagedRun: there are more tables than any run has.
    """
    simple: list[tuple[str, Any]] = []
    found = []
    for key, value in values.items():
        if depth == 0 and key in HEAD:
            continue
        if isinstance(value, dict) and value:
            if all(isinstance(x, dict) for x in value.values()):
                rows = [{"": k, **v} for k, v in value.items()]
                found += _of_rows(in_words(key), rows, gaps)
            elif depth < 3:
                found += tables_of(value, in_words(key), gaps, depth + 1)
        elif isinstance(value, list) and value and all(isinstance(x, dict) for x in value):
            found += _of_rows(in_words(key), value, gaps)
        elif value not in ("", [], {}):
            simple.append((key, value))
        if len(found) + len(gaps) > MAX_TABLES:
            raise DamagedRun(f"summary.json holds more than {MAX_TABLES} tables; do this run again")
    if len(simple) > MAX_ROWS:
        gaps.append(_too_large(title, len(simple), 2))
    elif simple:
        cells = [[in_words(key), _cell(value)] for key, value in simple]
        found.insert(0, (title, ["quantity", "value"], cells))
    return found


def _of_rows(
    title: str, rows: list[dict[str, Any]], gaps: list[str]
) -> list[tuple[str, list[str], list[list[str]]]]:
    """Return a list of objects as a table; what they hold of objects stays away.

    One that is too large is none, and is told of as a gap before its cells are made: each key of
    each row would be a column.
    """
    keys = list(
        dict.fromkeys(key for row in rows for key, x in row.items() if not isinstance(x, dict))
    )
    if len(keys) > MAX_COLUMNS or len(rows) > MAX_ROWS:
        gaps.append(_too_large(title, len(rows), len(keys)))
        return []
    columns = [_column([row.get(key) for row in rows]) for key in keys]
    return [(title, [in_words(key) for key in keys], [*map(list, zip(*columns, strict=True))])]


def _too_large(title: str, rows: int, columns: int) -> str:
    return f"{title} has {rows} rows of {columns} values: too many here"


def _column(values: list[Any]) -> list[str]:
    """Return a column's cells; fractions have as many decimals as the greatest needs."""
    numbers = [abs(x) for x in values if isinstance(x, float) and math.isfinite(x)]
    digits = DIGITS - 1 - math.floor(math.log10(max([*numbers, 1e-9])))
    return [
        decimal(x, min(max(digits, 0), 6)) if isinstance(x, float) else _cell(x) for x in values
    ]


def in_words(key: str) -> str:
    """Return a key for people: `end_mm` is "end, mm"."""
    key = UNITS.sub(r", \1", without_folders(str(key)))
    return key.replace("_", " ")


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return NOT_THERE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}".replace("-", "\u2212")
    if isinstance(value, list):
        shown = ", ".join(_cell(x) for x in value[:8])
        return shown + (f", ... ({len(value)})" if len(value) > 8 else "")
    return without_folders(str(value))[:200]
