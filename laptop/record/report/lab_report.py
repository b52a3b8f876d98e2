"""A lab report of the runs in a folder: one HTML file, and the raw data as CSV beside it."""

from __future__ import annotations

import csv
import os
import re
import shutil
import tempfile
from pathlib import Path

from laptop.record.report.compose import Report, compose
from laptop.record.report.find_runs import CONTENTS, read_runs
from laptop.record.report.run_files import is_plain
from laptop.system.files import written
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_text

TITLE = "Lab report: a robot arm"
"""Default title."""
OUT = "lab-report.html"
"""Default name of the file."""
PAPERS = {"a4": "A4", "letter": "letter"}
"""Sizes of paper in CSS, by the words of the option."""


class BadLabReport(ArmError, OSError):
    """A report that cannot be written."""


def lab_report(folder: Path, title: str, data_folder: str) -> Report:
    """Return the lab report of the runs in a folder.

    It is slow, and only one thread at a time may call it: matplotlib's style is global.

    Args:
        folder: of the runs.
        title: over the report.
        data_folder: name of the folder of CSVs beside the report.

    Raises:
        NoRuns: there is none.
    """
    return compose(*read_runs(folder), title, data_folder)


def check_out(out: Path, replace: bool) -> None:
    """Refuse a file where a report cannot be, or would replace somebody's own.

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
    """Refuse a folder with anything but a report's files, as it is to be replaced.

    Its list may be anybody's, so that it is believed of files only that a report names so.

    Raises:
        BadLabReport: it does.
    """
    if data.is_symlink() or not is_plain(data / CONTENTS):
        raise BadLabReport(f"{data} is there and is not of a report; give another file with --out")
    try:
        contents = read_text(str(data / CONTENTS), MAX_CONTENTS).splitlines()
        listed = {row[0] for row in csv.reader(contents) if row}
    except (InvalidFile, OSError, csv.Error):
        raise BadLabReport(
            f"{data / CONTENTS} is no list of a report's files, so that none is replaced; move "
            f"{data}, or give another file with --out"
        ) from None
    own = {name for name in listed if _OWN.fullmatch(name) and is_plain(data / name)}
    others = sorted(set(os.listdir(data)) - own - {CONTENTS})
    if others:
        raise BadLabReport(
            f"{data / others[0]} is of no report, and would be lost; move it, or give another "
            "file with --out"
        )


MAX_CONTENTS = 4_000_000
"""Greatest size of a list of a report's files, bytes."""
_OWN = re.compile(r"(?:R\d+-[A-Za-z0-9._-]*|table-\d+)\.csv")
"""Names of the files of raw data."""


def data_folder_of(out: Path) -> Path:
    """Return the folder of CSVs that goes with a report."""
    return out.with_name(out.stem + "-data")


def write(report: Report, out: Path) -> None:
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
