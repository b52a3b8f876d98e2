"""Values over time, as people write them: `30`, `12..80/5s`, `white:black@2`, `FILE.csv`.

    VALUE            that value
    LOW..HIGH/5s     from LOW to HIGH in 5 s, back in 5 s, and so on, to and fro
    A:B@2:C@3.5      A, from 2 s on B, from 3.5 s on C; each of them a value or a ramp
    FILE.csv         rows of time (s) and value, joined by straight lines; the ends go on

Whole numbers and words jump from one value to the next; all else moves evenly between them.
"""

import bisect
import csv
import math
import re
from typing import Any, Callable, List, Optional, Sequence, Tuple

MYPY = False
if MYPY:
    from typing import Type  # noqa: F401

    Value = Any  # a number, or a word: arithmetic is for those that are numbers
    ReadValue = Callable[[str], Value]
    ToError = Callable[[str], Exception]
    Row = Tuple[int, List[str]]  # number of the line, and its cells


MAX_SIGNAL_TIME = 1e6
"""Latest time that may be written, s."""

_RAMP = re.compile(r"^(.+?)\.\.(.+?)/([^/]*?)s?$")

MAX_FILE_LENGTH = 4000000
"""Greatest length of a file of values, characters."""


class _Piece(object):
    """A polyline in time, which may repeat for ever.

    Args:
        points: (s, value) in order of time; before the first and behind the last it stays level.
        jumps: whether a value holds until the next comes.
        repeats: whether it begins anew at the time of its last point, whose value is the first's.
    """

    def __init__(
        self, points: Sequence[Tuple[float, "Value"]], jumps: bool = False, repeats: bool = False
    ) -> None:
        self._times = [t for t, _ in points]
        self._values = [value for _, value in points]
        self._jumps = jumps
        self._period = self._times[-1] if repeats else None
        self._areas = [0.0]  # from the first point to each
        if not isinstance(self._values[0], str):
            for (t, value), (after, follows) in zip(points, points[1:]):
                mean = value if jumps else (value + follows) / 2
                self._areas.append(self._areas[-1] + (after - t) * mean)

    def _segment(self, t: float) -> int:
        """Return the index of the point at or before `t`, -1 if there is none."""
        return bisect.bisect_right(self._times, t) - 1

    def value(self, t: float) -> "Value":
        """Return the value at `t`, s since it began."""
        if self._period:
            t = math.fmod(t, self._period)
        k = self._segment(t)
        if k < 0 or k == len(self._times) - 1 or self._jumps:
            return self._values[max(k, 0)]
        return self._values[k] + self.slope(t) * (t - self._times[k])

    def slope(self, t: float) -> float:
        """Return the rate of change at `t`, 1/s; 0 where it jumps."""
        if self._period:
            t = math.fmod(t, self._period)
        k = self._segment(t)
        if k < 0 or k == len(self._times) - 1 or self._jumps:
            return 0.0
        rise = self._values[k + 1] - self._values[k]  # type: float
        return rise / (self._times[k + 1] - self._times[k])

    def integral(self, t: float) -> float:
        """Return the integral from 0 to `t`, s."""
        if self._period:
            rounds, t = divmod(t, self._period)
            return rounds * self._areas[-1] + self._area(t)
        return self._area(t) - self._area(0.0)

    def _area(self, t: float) -> float:
        """Return the integral from the first point to `t`."""
        k = max(0, self._segment(t))
        since = t - self._times[k]
        twice = self._values[k] + self.value(t)  # type: float
        return self._areas[k] + since * twice / 2


class Signal(object):
    """A quantity over time.

    Args:
        pieces: (s, _Piece) in order of time, the first from 0 s on.
    """

    def __init__(self, pieces: Sequence[Tuple[float, _Piece]]) -> None:
        self._starts = [start for start, _ in pieces]
        self._pieces = [piece for _, piece in pieces]

    def _at(self, t: float) -> Tuple[_Piece, float]:
        k = max(0, bisect.bisect_right(self._starts, t) - 1)
        return self._pieces[k], t - self._starts[k]

    def value(self, t: float) -> "Value":
        """Return the value at `t`, s."""
        piece, since = self._at(t)
        return piece.value(since)

    def slope(self, t: float) -> float:
        """Return its rate of change at `t`, s, in 1/s."""
        piece, since = self._at(t)
        return piece.slope(since)

    def integral(self, t: float) -> float:
        """Return the integral from 0 to `t`, s."""
        total = 0.0
        for start, end, piece in zip(self._starts, self._starts[1:] + [math.inf], self._pieces):
            if start < t:
                total += piece.integral(min(t, end) - start)
        return total


def constant(value: "Value") -> Signal:
    """Return the Signal that never changes."""
    return Signal([(0.0, _Piece([(0.0, value)]))])


def read_signal(text: str, read_value: "ReadValue", jumps: bool, error: "ToError") -> Signal:
    """Read a Signal.

    Args:
        text: in the grammar of this module's docstring.
        read_value: text -> value; raises an error of its own for one that is not allowed.
        jumps: True for whole numbers and words.
        error: message -> exception, for all other mistakes.
    """
    if is_file(text):
        return read_column(text, None, read_value, jumps, error)
    pieces = []  # type: List[Tuple[float, _Piece]]
    for number, part in enumerate(text.split(":")):
        value, at, when = part.partition("@")
        start = _time(when, part, error) if at else 0.0
        if bool(number) != bool(at) or pieces and start <= pieces[-1][0]:
            raise error(
                "'{}': write VALUE:VALUE@SECONDS:VALUE@SECONDS, the first without a time and the "
                "others in order".format(text)
            )
        pieces.append((start, _piece(value, read_value, jumps, error)))
    return Signal(pieces)


def is_file(text: str) -> bool:
    """Return True if the text names a file of values."""
    return text.lower().endswith(".csv")


def _piece(text: str, read_value: "ReadValue", jumps: bool, error: "ToError") -> _Piece:
    ramp = _RAMP.match(text)
    if ramp is None and ".." in text:
        raise error("'{}': write LOW..HIGH/SECONDSs, like 12..80/5s".format(text))
    if ramp is None:
        return _Piece([(0.0, read_value(text))], jumps)
    if jumps:
        raise error("'{}': it jumps from value to value; write A:B@SECONDS".format(text))
    low, high = read_value(ramp.group(1)), read_value(ramp.group(2))
    seconds = _time(ramp.group(3), text, error)
    if not seconds:
        raise error("'{}': a ramp takes more than 0 s".format(text))
    return _Piece([(0.0, low), (seconds, high), (2 * seconds, low)], repeats=True)


def _time(text: str, written: str, error: "ToError") -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds <= MAX_SIGNAL_TIME:
        raise error(
            "'{}': '{}' is not a time from 0 to {:g} s".format(written, text, MAX_SIGNAL_TIME)
        )
    return seconds


def read_column(
    file: str, column: Optional[str], read_value: "ReadValue", jumps: bool, error: "ToError"
) -> Signal:
    """Read the Signal of one column of a file.

    Args:
        file: path.
        column: its name, as in `columns`; None takes the second.
        read_value: as in `read_signal`.
        jumps: as there.
        error: as there.
    """
    names, rows = _rows(file, error)
    index = 1 if column is None or names is None else names.index(column)
    points = []  # type: List[Tuple[float, Value]]
    for number, row in rows:
        try:
            t = float(row[0])
            cell = row[index].strip()
        except (ValueError, IndexError):
            t = math.nan
        if not -MAX_SIGNAL_TIME <= t <= MAX_SIGNAL_TIME or points and t <= points[-1][0]:
            raise error(
                "{} line {}: '{}' is not a value and before it its time, later than the line "
                "above".format(file, number, ",".join(row))
            )
        points.append((t, read_value(cell)))
    if not points:
        raise error("{}: has no line of time,value".format(file))
    return Signal([(0.0, _Piece(points, jumps))])


def columns(file: str, error: "ToError") -> List[str]:
    """Return the names of a file's columns behind the time; none if it has no line of names."""
    return (_rows(file, error)[0] or [])[1:]


def _rows(file: str, error: "ToError") -> Tuple[Optional[List[str]], List["Row"]]:
    """Return the names of the columns (None: there are none), and the numbered rows below."""
    try:
        with open(file, newline="", encoding="utf-8-sig") as text:
            content = text.read(MAX_FILE_LENGTH + 1)
        table = list(csv.reader(content.splitlines()))
    except OSError as reason:
        raise error(
            "cannot read {}: {}; give a file of time and value".format(file, reason.strerror)
        ) from None
    except (UnicodeDecodeError, csv.Error):
        raise error("{}: is not a text of time,value in each line".format(file)) from None
    if len(content) > MAX_FILE_LENGTH:
        raise error("{}: give a file of at most {:g} MB".format(file, MAX_FILE_LENGTH / 1e6))
    rows = [(k, row) for k, row in enumerate(table, 1) if any(cell.strip() for cell in row)]
    if rows and not _is_number(rows[0][1][0]):
        return [cell.strip() for cell in rows[0][1]], rows[1:]
    return None, rows


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
