"""The file of observations: one row per frame and marker."""

from __future__ import annotations

import csv
import errno
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from laptop.see.camera.frames import Frame
from laptop.see.markers.view import BoardPlace
from shared.arm_description import ArmError


class TrackingInterrupted(ArmError):
    """Cameras that were given up, a disk that is full: what ends tracking before its time."""


class PairedPlace(NamedTuple):
    """A marker's place that two cameras see together.

    frame, t  of the first one's picture, s
    marker    its name
    confidence  the lesser one
    place     on the board
    gap       between the two lines of sight, cm
    cameras   "A+B"
    """

    frame: int
    t: float
    marker: str
    confidence: float
    place: BoardPlace
    gap: float
    cameras: str


class ObservationCsv:
    """Rows of observations, from any thread.

    Args:
        file: an old one is replaced.
        several: several cameras, so that each row names its own.
        columns: further ones, cm: of x, y, z, gap, arm_x and arm_y; they are empty where that
            is not known.

    Raises:
        TrackingInterrupted: from every method, if the file cannot be written.
    """

    def __init__(self, file: Path, several: bool, columns: Sequence[str] = ()) -> None:
        self.file = file
        self._columns = columns
        self._several = several
        self._lock = threading.Lock()  # one row after the other, whoever writes it
        with self._refusing():
            self._out = file.open("w", newline="", encoding="utf-8")
            self._writer = csv.writer(self._out, lineterminator="\n")
            heading = ["frame", "t", "marker", "u", "v", "confidence"]
            try:
                self._writer.writerow([*heading, *columns, *["camera"] * several])
                self._out.flush()
            except OSError:
                with suppress(OSError):  # there is still no room
                    self._out.close()
                raise

    def add(
        self,
        camera: str,
        frame: Frame,
        markers: Mapping[str, Any],
        places: Mapping[str, BoardPlace] = MappingProxyType({}),
    ) -> None:
        """Write the rows of one frame.

        Args:
            camera: its short name.
            frame: index and capture time are taken from it.
            markers: as in an Observation: (u, v, confidence) or None, by name.
            places: on the board, by name; as far as that is known.
        """
        self._write(
            [
                [
                    *(frame.index, f"{frame.t:.6f}", name),
                    *(_cells(seen) if seen else ("", "", "0.000")),
                    *self._placed(places.get(name)),
                    *[camera] * self._several,
                ]
                for name, seen in markers.items()
            ]
        )

    def add_pairs(self, pairs: Sequence[PairedPlace]) -> None:
        """Write a row for each place that two cameras tell together; it has no pixel."""
        self._write(
            [
                [
                    *(pair.frame, f"{pair.t:.6f}", pair.marker, "", "", f"{pair.confidence:.3f}"),
                    *self._placed(pair.place, pair.gap),
                    pair.cameras,
                ]
                for pair in pairs
            ]
        )

    def _placed(self, place: BoardPlace | None, gap: float | None = None) -> list[str]:
        """Return the cells of a place."""
        if place is None:
            return [""] * len(self._columns)
        arm_x, arm_y = place.arm or (None, None)
        known = {"x": place.x, "y": place.y, "z": place.z, "gap": gap}
        known.update(arm_x=arm_x, arm_y=arm_y)
        cells = [known[column] for column in self._columns]
        return ["" if cell is None else f"{cell:.4f}" for cell in cells]

    def _write(self, rows: Sequence[Sequence[object]]) -> None:
        with self._refusing(), self._lock:
            self._writer.writerows(rows)

    def flush(self) -> None:
        """Put on the disk all that was added."""
        with self._refusing(), self._lock:
            self._out.flush()

    def close(self) -> None:
        """Close the file."""
        with self._refusing(), self._lock:
            self._out.close()

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            advice = "make room or " if error.errno == errno.ENOSPC else ""
            raise TrackingInterrupted(
                f"cannot write {self.file}: {error.strerror}; {advice}choose another with --to"
            ) from None


def _cells(seen: Sequence[float]) -> tuple[str, str, str]:
    u, v, confidence = seen
    return f"{u:.3f}", f"{v:.3f}", f"{confidence:.3f}"
