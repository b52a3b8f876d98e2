"""The file of observations: one row per frame and marker."""

from __future__ import annotations

import csv
import errno
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any

from laptop.vision.frames import Frame
from shared.arm_description import ArmError


class TrackingInterrupted(ArmError):
    """Cameras that were given up, a disk that is full: what ends tracking before its time."""


class ObservationCsv:
    """Rows of observations, from any thread.

    Args:
        file: an old one is replaced.
        several: several cameras, so that each row names its own.
        placed: with columns for places on the table, cm.

    Raises:
        TrackingInterrupted: from every method, if the file cannot be written.
    """

    def __init__(self, file: Path, several: bool, placed: bool = False) -> None:
        self.file = file
        self._placed = placed
        self._several = several
        self._lock = threading.Lock()  # one row after the other, whoever writes it
        with self._refusing():
            self._out = file.open("w", newline="", encoding="utf-8")
            self._writer = csv.writer(self._out, lineterminator="\n")
            heading = ["frame", "t", "marker", "u", "v", "confidence"]
            try:
                self._writer.writerow(heading + ["x", "y"] * placed + ["camera"] * several)
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
        places: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    ) -> None:
        """Write the rows of one frame.

        Args:
            camera: its short name.
            frame: index and capture time are taken from it.
            markers: as in an Observation: (u, v, confidence) or None, by name.
            places: (x, y) on the table, cm, by name; as far as that is known.
        """
        t = f"{frame.t:.6f}"
        last = [camera] * self._several
        rows = [
            [
                *(frame.index, t, name),
                *(_cells(seen) if seen else ("", "", "0.000")),
                *([f"{x:.4f}" for x in places.get(name, ())] or ["", ""]) * self._placed,
                *last,
            ]
            for name, seen in markers.items()
        ]
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
                f"cannot write {self.file}: {error.strerror}; {advice}choose another with --csv"
            ) from None


def _cells(seen: Sequence[float]) -> tuple[str, str, str]:
    u, v, confidence = seen
    return f"{u:.3f}", f"{v:.3f}", f"{confidence:.3f}"
