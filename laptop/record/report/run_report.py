"""The report of one run, among its files."""

from __future__ import annotations

from pathlib import Path

from laptop.record.report.compose import Report, compose
from laptop.record.report.report_run import read_folder
from laptop.system.files import written

REPORT = "report.html"
"""Name of the report's file."""


def report_of(folder: Path) -> Report:
    """Return the report of the run in a folder.

    Raises:
        DamagedRun: there is none, or it is not as it is written.
    """
    run = read_folder(folder.name, folder)
    return compose([run], [], f"BrickServo: {run.what}", None)


def write_report(folder: Path, report: Report) -> Path:
    """Write a report as REPORT into a folder, and return its path.

    Raises:
        CannotWrite: there is no room.
    """
    file = folder / REPORT
    with written(file) as draft:
        draft.write_text(report.html(), encoding="utf-8")
    return file
