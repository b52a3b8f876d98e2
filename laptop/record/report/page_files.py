"""What people save from the page and from `track`: reports of runs, plots, a CSV of markers."""

from __future__ import annotations

import base64
import binascii
import re
from array import array
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import numpy as np

from laptop.record.figures.private_paths import without_folders
from laptop.record.report.findings import (
    NOT_THERE,
    SERVO,
    TRACKING,
    DamagedRun,
    LabFigure,
    LabRun,
    LabTable,
    RawData,
)
from laptop.record.report.lab_figures import draw_servo, draw_tracks
from laptop.record.report.run_files import (
    MAX_PICTURE,
    checked_picture,
    decimal,
    read_bytes,
    read_columns,
    read_numbers,
    read_rows,
)
from laptop.record.report.servo_runs import GOALS

REPORT = re.compile(r"brickservo-.*-run-\d+.*\.html")
HISTORY = re.compile(r"history.*\.csv")
TRACK_HEADING = ["frame", "t", "marker", "u", "v", "confidence"]
_PICTURE = re.compile(r"data:image/(?:png|jpeg);base64,([A-Za-z0-9+/=\s]+)")
_ROW = ("goal", "method", "brick says", "moves", "s", "brick px", "tracker px")


MAX_LETTERS, MAX_MARKERS, MAX_NAME = 10_000, 64, 64
"""Letters of a text, markers of all cameras, and letters of a marker's name, in a report's sources.
"""
MAX_TAGS = 400_000
"""A page with more is not read."""
MAX_PARTS = {"goals": 1000, "values": 20_000, "texts": 5000, "pictures": 50}
"""What is read of a page, at most."""


class PageReport(HTMLParser):
    """Reads a report that the page made: its texts, its first table, its pictures.

    It raises DamagedRun as soon as there are more of them than any report has.

    Args:
        name: of its file.

    Attributes:
        texts: by the part of the page that they stand in, in order.
        rows: of the first table, its heading first.
        pictures: (caption, address) each.
    """

    TEXTS = {"h1": "verdict", "p": "line", "figcaption": "caption", "h2": "heading"}

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name, self._counts = name, Counter[str]()
        self.texts: list[tuple[str, str]] = []
        self.rows: list[list[str]] = []
        self.pictures: list[tuple[str, str]] = []
        self._source, self._tables, self._open = "", 0, ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a part."""
        if tag == "table":
            self._tables += 1
        elif tag == "tr" and self._tables == 1:
            self._count("goals")
            self.rows.append([])
        elif tag in ("td", "th") and self._tables == 1 and self.rows:
            self._count("values")
            self.rows[-1].append("")
            self._open = "cell"
        elif tag == "img":
            self._source = dict(attrs).get("src") or ""
        elif tag == "small":
            self._open = ""
        elif tag in self.TEXTS:
            self._count("texts")
            self._open = self.TEXTS[tag]
            self.texts.append((self._open, ""))

    def handle_endtag(self, tag: str) -> None:
        """End a part."""
        if tag == "small":
            self._open = "verdict"
        elif tag in (*self.TEXTS, "td", "th"):
            self._open = ""
        if tag == "figcaption" and self._source:
            self._count("pictures")
            self.pictures.append((self.texts[-1][1].strip(), self._source))
            self._source = ""
        if tag == "table":
            self._tables += self._tables == 1

    def handle_data(self, data: str) -> None:
        """Take a text."""
        if self._open == "cell":
            self.rows[-1][-1] += data[: max(0, MAX_LETTERS - len(self.rows[-1][-1]))]
        elif self._open:
            kind, text = self.texts[-1]
            self.texts[-1] = (kind, text + data[: max(0, MAX_LETTERS - len(text))])

    def _count(self, part: str) -> None:
        self._counts[part] += 1
        if self._counts[part] > MAX_PARTS[part]:
            raise DamagedRun(f"{self._name} has more than {MAX_PARTS[part]} {part}")


def read_page_report(name: str, file: Path) -> LabRun:
    """Return a run as the page reported it.

    Raises:
        DamagedRun: it is no such report.
    """
    text = read_bytes(file, MAX_PICTURE).decode("utf-8", "replace")
    if not text.rstrip().endswith("</html>"):
        raise DamagedRun(f"{file.name} is no whole report of the page")
    if text.count("<") > MAX_TAGS:
        raise DamagedRun(f"{file.name} has more than {MAX_TAGS} tags")
    page = PageReport(file.name)
    page.feed(text)
    lines = [" ".join(text.split()) for kind, text in page.texts if kind == "line"]
    verdicts = [" ".join(text.split()) for kind, text in page.texts if kind == "verdict"]
    headings = [" ".join(cell.split()) for cell in page.rows[0]] if page.rows else []
    if not verdicts or len(lines) < 2 or headings[:1] != ["goal"]:
        raise DamagedRun(f"{file.name} is no whole report of the page")
    run = LabRun(name, SERVO, "run on the page", outcome=without_folders(verdicts[0]))
    run.set_up = [("as the page has it", without_folders(lines[1]))]
    for row in page.rows[1:]:
        told = dict(zip(headings, (cell.strip() for cell in row), strict=False))
        cells = [told.get(column) or NOT_THERE for column in _ROW]
        run.results.append((GOALS, (NOT_THERE, *cells, NOT_THERE)))
        if told.get("method") in ("chain", "kalman", "broyden", "report"):
            run.methods.append(told["method"])
    run.gaps.append(f"{file.name} does not name the arm; 'true' there is as the tracker saw it")
    for caption, source in page.pictures:
        try:
            run.figures.append(LabFigure(without_folders(caption), _held(source, file.name)))
        except DamagedRun as error:
            run.gaps.append(f"left out: {error}")
    return run


def _held(source: str, name: str) -> bytes:
    """Return the picture that an address holds.

    Raises:
        DamagedRun: it holds none.
    """
    match = _PICTURE.fullmatch(source)
    try:
        content = base64.b64decode(match[1], validate=False) if match else b""
    except binascii.Error:
        content = b""
    return checked_picture(content, f"a picture in {name}")


def read_history(name: str, file: Path) -> LabRun:
    """Return the plots that were saved from the page.

    Raises:
        DamagedRun: they are not as the page writes them.
    """
    columns = read_columns(file)
    if not {"t", "error_px"} <= columns.keys():
        raise DamagedRun(f"{file.name} has no columns t and error_px")
    if np.isnan(columns["t"]).all():
        raise DamagedRun(f"{file.name} holds no time in its column t")
    t = columns["t"] - np.nanmin(columns["t"])
    errors = np.column_stack([t, columns["error_px"]])
    errors = errors[np.isfinite(errors).all(axis=1)]
    joints = {
        column.removesuffix("_deg"): _rows(t, np.radians(columns[column]))
        for column in columns
        if re.fullmatch(r"q\d+_deg", column)
    }
    run = LabRun(name, SERVO, "plots saved from the page")
    run.seconds = float(t[-1]) if np.isfinite(t[-1]) else None
    condition = _rows(t, columns.get("condition", np.full(len(t), np.nan)))
    picture = draw_servo(errors, np.zeros((0, 2)), joints, condition, None)
    if picture:
        words = (
            "Above: distance from the goal in time, on a logarithmic scale. Below: joint angles, "
            "and the condition number of the image Jacobian."
        )
        run.figures.append(LabFigure(words, picture))
    else:
        run.gaps.append(f"{file.name} holds neither an error nor joint angles")
    run.gaps.append(f"{file.name} names neither arm nor goal nor method")
    run.data.append(RawData("history.csv", file, "the page's plots"))
    return run


def _rows(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    rows = np.column_stack([t, values])
    return rows[np.isfinite(rows).all(axis=1)]


def is_track(file: Path) -> bool:
    """Return whether a CSV begins as that of `track --csv`."""
    try:
        with file.open("rb") as opened:
            first = opened.readline(200).decode("ascii", "replace").strip().split(",")
    except OSError:
        return False
    return [column for column in first if column != "camera"][: len(TRACK_HEADING)] == TRACK_HEADING


def read_track(name: str, file: Path) -> LabRun:
    """Return what `track --csv` wrote.

    Raises:
        DamagedRun: it is not as it is written.
    """
    heading, rows = read_rows(file)
    run = LabRun(name, TRACKING, "markers tracked by a camera")
    has_cameras = "camera" in heading
    columns = [heading.index(name) for name in ("t", "u", "v", "confidence")]
    keys: dict[tuple[str, str], array[float]] = {}
    for row in rows:
        told = dict(zip(heading, row, strict=True))
        key = (told["camera"] if has_cameras else "A", told["marker"])
        if (key not in keys and len(keys) == MAX_MARKERS) or max(map(len, key)) > MAX_NAME:
            raise DamagedRun(
                f"{file.name} names more than {MAX_MARKERS} markers, or one of more than "
                f"{MAX_NAME} letters"
            )
        numbers = read_numbers([row[c] for c in columns], f"{file.name}: a row of {key[1]}")
        keys.setdefault(key, array("d")).extend(numbers)
    cells, tracks = [], []
    for (camera, marker), told_rows in sorted(keys.items()):
        values = np.array(told_rows).reshape(-1, len(columns))
        seen = np.isfinite(values[:, 1:3]).all(axis=1)
        share = f"{100 * seen.mean():.0f} %"
        cells.append(
            (camera, marker, str(len(values)), share, decimal(float(np.ptp(values[:, 0])), 1))
        )
        label = f"{marker} ({camera})" if has_cameras else marker
        tracks.append((label, values[:, 1:3]))
    caption = "How often each marker was seen"
    run.tables.append(LabTable(caption, ("camera", "marker", "frames", "seen in", "s"), cells))
    picture = draw_tracks(tracks)
    if picture:
        run.figures.append(LabFigure("Where the tracker saw the markers.", picture))
    else:
        run.gaps.append(f"{file.name}: no marker was seen")
    run.data.append(RawData("track.csv", file, "where the tracker saw the markers"))
    return run
