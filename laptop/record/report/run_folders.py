"""Finds the runs in a folder and below it, and reads each; a damaged one is named and left out."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from laptop.record.figures.private_paths import without_folders
from laptop.record.report.drawing_runs import TRACE, read_drawing, read_simulated
from laptop.record.report.findings import (
    ACCURACY,
    CALIBRATION,
    SERVO,
    DamagedRun,
    LabRun,
    LeftOut,
    clean,
)
from laptop.record.report.measured_runs import read_measured
from laptop.record.report.page_files import (
    HISTORY,
    REPORT,
    is_track,
    read_history,
    read_page_report,
    read_track,
)
from laptop.record.report.run_files import is_plain, items, read_object, word
from laptop.record.report.servo_runs import is_log, read_demo, read_servo_log
from shared.arm_description import ArmError
from shared.message_fields import printable

SUMMARY, DEMO = "summary.json", "demo.json"
CONTENTS = "report-contents.csv"
"""A folder with this file holds the raw data of a report, and no run."""
MAX_FOLDERS, MAX_DEPTH = 2000, 8


class NoRuns(ArmError, ValueError):
    """A folder without a run that a report could tell of."""


def read_runs(folder: Path) -> tuple[list[LabRun], list[LeftOut]]:
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
        leave_out: is called with each folder that may hold runs and is not looked into, and why.
    """
    within = folder.resolve()

    def unread(error: OSError, place: str = "") -> None:
        leave_out(Path(place or error.filename), f"it cannot be read: {error.strerror}")

    for at, folders, files in os.walk(folder, onerror=unread):
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
            unread(error, at)
            folders.clear()
            continue
        yield place, plain


LINK = "it is a link, which is not followed; give the folder that it leads to"
TOO_DEEP = (
    f"the folders in it are more than {MAX_DEPTH} deep, and are not looked into; give this folder"
)
SURPRISES = (
    *(ValueError, TypeError, LookupError, ArithmeticError, AttributeError),
    *(RecursionError, AssertionError, StopIteration),
)
"""What may come of reading anything."""


class RunReader:
    """Reads folder by folder, the upper ones first.

    Attributes:
        left_out: what cannot be read, and why.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._runs: list[tuple[Path, LabRun]] = []  # what each was read from
        self.left_out: list[LeftOut] = []
        self._told: set[Path] = set()  # folders and files of which another run has told

    @property
    def runs(self) -> list[LabRun]:
        """What was read, each run once."""
        return [run for source, run in self._runs if source not in self._told]

    def leave_out(self, place: Path, why: str) -> None:
        """Note that a folder or file is not in the report, and why."""
        self.left_out.append(LeftOut(printable(_name(self._folder, place)), clean(why)))

    def read_place(self, place: Path, files: Sequence[str]) -> None:
        """Read what is in one folder."""
        if place in self._told:
            return
        claimed = {DEMO, SUMMARY}
        if DEMO in files and self._read(place / DEMO, lambda name: read_demo(name, place)):
            logs = [place / file for file in files if file.endswith(".jsonl")]
            self._told |= {*logs, *(log.with_suffix("") for log in logs)}
            claimed.add("track.csv")
        if SUMMARY in files:
            self._read(place / SUMMARY, lambda name: self._of_summary(name, place))
        elif TRACE in files:
            self.leave_out(place / TRACE, "there is no summary.json beside it")
        for file in files:
            if file not in claimed and (read := _reader_of(place / file)):
                self._read(place / file, read)

    def _read(self, file: Path, read: Callable[[str], LabRun]) -> bool:
        """Read one run, or note why it cannot be."""
        whole = file.parent if file.name in (DEMO, SUMMARY) else file
        try:
            run = read(_name(self._folder, whole))
            run.clean()
            self._runs.append((file, run))
        except DamagedRun as error:
            why = str(error).removeprefix(f"{file.name}: ")
            why = re.sub(rf"^{re.escape(file.name)} ", "it ", why)
            self.leave_out(file, why)
            return False
        except SURPRISES as error:
            # It is data, and may be anything: what no rule foresees costs this run, not the report.
            is_deep = isinstance(error, RecursionError)
            what = "nested too deeply" if is_deep else "not as it is written"
            self.leave_out(file, f"it is {what}; do this run again")
            return False
        return True

    def _of_summary(self, name: str, place: Path) -> LabRun:
        """Return the run of a summary, with the logs that belong to it.

        Raises:
            DamagedRun: the summary is not as it is written.
        """
        summary = read_object(place / SUMMARY)
        kind = word(summary, "kind")
        if kind in (ACCURACY, CALIBRATION):
            return read_measured(name, place, summary, kind)
        if "drawing" in summary:
            return read_drawing(name, place, summary)
        if "script" not in summary:
            known = "simulate, draw --simulate, accuracy, calibrate"
            raise DamagedRun(f"{SUMMARY} is of none of these: {known}")
        run = read_simulated(name, place, summary)
        told = [part.rpartition("=")[2] for part in items(summary, "args", str) if part]
        named = [Path(part).name for part in told if part.endswith(".jsonl")]
        beside = [place / log for log in named if (place / log).exists()]
        above = [place.parent / log for log in named] if place != self._folder else []
        for log in beside or above:
            if is_plain(log) and is_log(log):
                self._told.add(log)
                try:
                    read_servo_log(run, log)
                except DamagedRun as error:
                    run.gaps.append(f"left out: {error}")
        return run


def _reader_of(file: Path) -> Callable[[str], LabRun] | None:
    """Return what reads the run of which a file alone tells; None if it tells of none."""
    if REPORT.fullmatch(file.name):
        return partial(read_page_report, file=file)
    if HISTORY.fullmatch(file.name):
        return partial(read_history, file=file)
    if file.suffix == ".csv" and is_track(file):
        return partial(read_track, file=file)
    if file.suffix == ".jsonl" and is_log(file):
        return partial(_of_log, file=file)
    return None


def _of_log(name: str, file: Path) -> LabRun:
    run = LabRun(name, SERVO, "")
    read_servo_log(run, file)
    return run


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
        f"{folder} {'is empty' if empty else 'holds no run'}; give the folder that --out of "
        "simulate, draw --simulate or demo named, or one above it"
    )
