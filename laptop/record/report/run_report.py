"""The report of one run, among its files."""

from __future__ import annotations

from pathlib import Path

from laptop.record.report.compose import compose
from laptop.record.report.report_run import read_folder
from laptop.system.files import written

REPORT = "report.html"


def html_of(folder: Path, save_as: str = "", kept: str = "") -> str:
    """Return the report of the run in a folder, as the text of an HTML file.

    Args:
        folder: of the run.
        save_as: the name under which the page offers to save it, or "".
        kept: in which folder it is kept, for people, or "".

    Raises:
        DamagedRun: there is none, or it is not as it is written.
    """
    run = read_folder(folder.name, folder)
    report = compose([run], [], f"BrickServo: {run.what}", None)
    report.values |= {"save_as": save_as, "kept": kept}
    return report.html()


def write_report(folder: Path) -> Path:
    """Write REPORT into the folder of a run; where it is.

    Raises:
        DamagedRun: there is no run.
        CannotWrite: there is no room.
    """
    file = folder / REPORT
    with written(file) as draft:
        draft.write_text(html_of(folder), encoding="utf-8")
    return file
