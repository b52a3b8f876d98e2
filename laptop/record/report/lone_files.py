"""Single files that are a run: logs of visual_servoing.py from a brick, and CSVs of `track`."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from laptop.record.report.raw_figures import draw_tracks
from laptop.record.report.report_run import RawData, ReportFigure, ReportRun
from laptop.record.report.run_files import read_numbers, read_rows
from laptop.record.run import SERVO, TRACKING, DamagedRun, Ending, Run, table
from laptop.record.servo.figures import Scenery, draw
from laptop.record.servo.servo_files import add_servo
from laptop.record.servo.servo_log import read_log
from laptop.record.servo.servo_run import run_of_log

TRACK_HEADING = ["frame", "t", "marker", "u", "v", "confidence"]
"""Headings of a CSV of `track`, without that of the camera."""
MAX_MARKERS, MAX_NAME_LENGTH = 64, 64
"""Greatest number of markers of all cameras, and length of a marker's name, letters."""


def read_lone_log(name: str, file: Path) -> ReportRun:
    """Return the run that a log alone holds.

    Raises:
        DamagedRun: it is no log, or not as it is written.
    """
    log = read_log(file)
    servo = run_of_log("goal", log)
    text = ": ".join(filter(None, (servo.verdict, servo.reason)))
    record = Run(
        kind=SERVO,
        what=f"servo, method {servo.method}",
        ending=Ending(0, text or "cut off", servo.seconds),
        arm={"name": servo.arm} if servo.arm else None,
        set_up={
            "servo": f"mode {servo.mode}, tolerance {servo.tolerance:g} px",
            "cameras": ", ".join(sorted(servo.paths)) or None,
        },
    )
    if log.verdict is None:
        record.notes.append(f"{file.name} ends without a verdict: the run was cut off")
    if not servo.paths:
        record.notes.append("its log holds no place at which the marker was seen")
    add_servo(record, [servo], Scenery(), drawn=False)
    run = ReportRun(name, record)
    run.figures += [ReportFigure(text, png) for _, text, png in draw([servo], Scenery())]
    return run


def is_track(file: Path) -> bool:
    """Return whether a CSV begins as that of `track --to FILE.csv`."""
    try:
        with file.open("rb") as opened:
            first = opened.readline(200).decode("ascii", "replace").strip().split(",")
    except OSError:
        return False
    return [column for column in first if column != "camera"][: len(TRACK_HEADING)] == TRACK_HEADING


def read_track(name: str, file: Path) -> ReportRun:
    """Return the run in a file of `track --to FILE.csv`.

    Raises:
        DamagedRun: it is not as it is written.
    """
    heading, rows = read_rows(file)
    has_cameras = "camera" in heading
    columns = [heading.index(name) for name in ("t", "u", "v", "confidence")]
    keys: dict[tuple[str, str], array[float]] = {}
    for row in rows:
        entry = dict(zip(heading, row, strict=True))
        key = (entry["camera"] if has_cameras else "A", entry["marker"])
        if (key not in keys and len(keys) == MAX_MARKERS) or max(map(len, key)) > MAX_NAME_LENGTH:
            raise DamagedRun(
                f"{file.name} names more than {MAX_MARKERS} markers, or one of more than "
                f"{MAX_NAME_LENGTH} letters"
            )
        numbers = read_numbers([row[c] for c in columns], f"{file.name}: a row of {key[1]}")
        keys.setdefault(key, array("d")).extend(numbers)
    cells, tracks = [], []
    for (camera, marker), numbers_of_key in sorted(keys.items()):
        values = np.array(numbers_of_key).reshape(-1, len(columns))
        seen = np.isfinite(values[:, 1:3]).all(axis=1)
        seconds = round(float(np.ptp(values[:, 0])), 1)
        cells.append((camera, marker, len(values), round(100 * float(seen.mean())), seconds))
        label = f"{marker} ({camera})" if has_cameras else marker
        tracks.append((label, values[:, 1:3]))
    caption = "How often each marker was seen"
    headings = ("camera", "marker", "frames", "seen in %", "time s")
    record = Run(
        kind=TRACKING,
        what="markers tracked by a camera",
        ending=Ending(0, "ended"),
        tables=[table("tracking", caption, headings, cells)],
    )
    run = ReportRun(name, record)
    picture = draw_tracks(tracks)
    if picture:
        run.figures.append(ReportFigure("Where the tracker saw the markers.", picture))
    else:
        run.gaps.append(f"{file.name}: no marker was seen")
    run.data.append(RawData("track.csv", file, "where the tracker saw the markers"))
    return run
