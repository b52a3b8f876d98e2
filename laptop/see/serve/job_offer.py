"""A job that is offered to the brick, which asks for it part after part, and logs what it does."""

from __future__ import annotations

import zlib
from collections import deque
from pathlib import Path

from shared.job import Job
from shared.job_log import LogRow
from shared.job_messages import PART_SIZE, Draw, JobLog, JobPart, Want, part_of


class JobOffer:
    """A job's file, compressed, and what the brick has asked for.

    Args:
        path: of the file; it is read here, and may be gone afterwards.
        first: stroke to begin with, from 1 on.
        alone: the brick goes on when the link is lost.
        dry: the pen stays up.

    Attributes:
        job: the shared.job.Job.
        draw: the Draw that offers it.
        asked: number of parts that the brick has asked for at least once.
        log: LogRows that have come so far, t on the laptop's clock.

    Raises:
        shared.job.BadJob: the file is no job.
    """

    def __init__(self, path: Path, first: int = 1, alone: bool = False, dry: bool = False) -> None:
        self.job = Job(str(path))
        deque(self.job.strokes(), maxlen=0)  # each is checked as it is read
        data = path.read_bytes()
        self._packed = zlib.compress(data, 9)
        parts = -(-len(self._packed) // PART_SIZE)
        crc = zlib.crc32(data)
        self.draw = Draw(self.job.header.name, len(data), parts, crc, first, alone, dry)
        self.asked = 0
        self.log: list[LogRow] = []

    def part(self, want: Want) -> JobPart | None:
        """Return the part that the brick asks for; None: it is none of this job's."""
        if want.crc != self.draw.crc or want.part >= self.draw.parts:
            return None
        self.asked = max(self.asked, want.part + 1)
        return part_of(self._packed, want.crc, want.part)

    def add_log(self, message: JobLog, offset: float) -> None:
        """Store what the brick logs of this job.

        Args:
            message: of this job, or of another one.
            offset: of the brick's clock from ours, s.
        """
        if message.crc == self.draw.crc:
            rows = [LogRow(*row) for row in message.rows]
            self.log += [row._replace(t=row.t - offset) for row in rows]
