"""Search for runs in a folder and below it; a damaged one is named and left out."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path, PurePosixPath

from laptop.record.figures.private_paths import without_folders
from laptop.record.names import RUN
from laptop.record.report.lone_files import is_track, read_lone_log, read_track
from laptop.record.report.report_run import LeftOut, ReportRun, clean, read_folder
from laptop.record.report.run_files import is_plain
from laptop.record.run import DamagedRun
from laptop.record.servo.servo_log import is_log
from shared.arm_description import ArmError
from shared.message_fields import printable

CONTENTS = "report-contents.csv"
"""Name of the file that marks a folder of a report's raw data, which holds no run."""
MAX_FOLDERS, MAX_DEPTH = 2000, 8
"""Greatest number of folders, and depth below the first."""


class NoRuns(ArmError, ValueError):
    """A folder without a run for a report."""


def read_runs(folder: Path) -> tuple[list[ReportRun], list[LeftOut]]:
    """Read all runs in a folder and below it, in the order of their folders.

    Raises:
        NoRuns: there is none that can be read, or there are too many folders.
    """
    reader = RunReader(folder)
    for number, (place, files) in enumerate(_walk(folder, reader.leave_out)):
        if number >= MAX_FOLDERS:
            raise NoRuns(
                f"{folder} holds more than {MAX_FOLDERS} folders; give the one with your runs"
            )
        reader.read_place(place, files)
    runs = reader.runs
    if not runs:
        raise NoRuns(_none(folder, reader.left_out))
    for k, run in enumerate(runs, 1):
        run.number = k
    return runs, reader.left_out


def _walk(folder: Path, leave_out: Callable[[Path, str], None]) -> Iterator[tuple[Path, list[str]]]:
    """Yield each folder with the names of its files; folders of reports and hidden ones not.

    Args:
        folder: the walk begins there.
        leave_out: called with each folder that may hold runs and is not searched, and why.
    """
    within = folder.resolve()

    def on_error(error: OSError, place: str = "") -> None:
        leave_out(Path(place or error.filename), f"it cannot be read: {error.strerror}")

    for at, folders, files in os.walk(folder, onerror=on_error):
        place = Path(at)
        if CONTENTS in files:
            folders.clear()
            continue
        folders[:] = sorted(f for f in folders if not f.startswith("."))
        for link in [f for f in folders if (place / f).is_symlink()]:
            folders.remove(link)
            if not Path(os.path.realpath(place / link)).is_relative_to(within):  # else it is met
                leave_out(place / link, LINK)
        if folders and len(place.relative_to(folder).parts) == MAX_DEPTH:
            leave_out(place, TOO_DEEP)
            folders.clear()
        try:
            os.stat(os.path.join(at, "."))  # its names may be read, and nothing in it
            plain = sorted(file for file in files if is_plain(place / file))
        except OSError as error:
            on_error(error, at)
            folders.clear()
            continue
        yield place, plain


LINK = "it is a link, which is not followed; give the folder that it leads to"
TOO_DEEP = (
    f"the folders in it are more than {MAX_DEPTH} deep, and are not looked into; give this folder"
)
READ_ERRORS = (
    *(ValueError, TypeError, LookupError, ArithmeticError, AttributeError),
    *(RecursionError, AssertionError, StopIteration),
)
"""Errors that reading arbitrary data may end in."""


class RunReader:
    """A reader of folders, the upper ones first.

    Args:
        folder: of the report.

    Attributes:
        runs: found so far.
        left_out: folders and files that cannot be read, and why.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.runs: list[ReportRun] = []
        self.left_out: list[LeftOut] = []
        self._reported: set[Path] = set()  # folders and files that belong to a run above

    def leave_out(self, place: Path, why: str) -> None:
        """Record that a folder or file is not in the report, and why."""
        self.left_out.append(LeftOut(printable(_name(self._folder, place)), clean(why)))

    def read_place(self, place: Path, files: Sequence[str]) -> None:
        """Read what is in one folder."""
        if place in self._reported or any(parent in self._reported for parent in place.parents):
            return
        if RUN in files:
            run = self._read(place / RUN, lambda name: read_folder(name, place))
            for name in (file.name for file in run.run.files) if run else ():
                self._reported.add(place / PurePosixPath(name).parts[0])
        for file in files:
            if place / file not in self._reported and (read := _reader_of(place / file)):
                self._read(place / file, read)

    def _read(self, file: Path, read: Callable[[str], ReportRun]) -> ReportRun | None:
        """Read one run, or record why it cannot be."""
        named = file.parent if file.name == RUN else file
        try:
            run = read(_name(self._folder, named))
        except DamagedRun as error:
            why = str(error).removeprefix(f"{file.name}: ")
            why = re.sub(rf"^{re.escape(file.name)} ", "it ", why)
            self.leave_out(file, why)
            return None
        except READ_ERRORS as error:
            # The data may be anything: an unforeseen error costs this run, not the report.
            is_deep = isinstance(error, RecursionError)
            what = "nested too deeply" if is_deep else "not as it is written"
            self.leave_out(file, f"it is {what}; do this run again")
            return None
        self.runs.append(run)
        return run


def _reader_of(file: Path) -> Callable[[str], ReportRun] | None:
    """Return a reader of the run that is a file alone; None if it is none."""
    if file.suffix == ".csv" and is_track(file):
        return partial(read_track, file=file)
    if file.suffix == ".jsonl" and is_log(file):
        return partial(read_lone_log, file=file)
    return None


def _name(folder: Path, place: Path) -> str:
    """Return a folder's or a file's name from the report's folder on, for people."""
    inside = place.relative_to(folder).as_posix()
    return without_folders(folder.resolve().name or "runs") if inside == "." else inside


def _none(folder: Path, left_out: list[LeftOut]) -> str:
    if left_out:
        first = left_out[0]
        more = f" (and {len(left_out) - 1} more)" if len(left_out) > 1 else ""
        return f"no run in {folder} can be read: {first.name}: {first.why}{more}"
    empty = not any(folder.iterdir())
    return (
        f"{folder} {'is empty' if empty else 'holds no run'}; give the one with your runs, "
        "runs if none was given as --out"
    )
