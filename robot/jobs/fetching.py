"""A job that the laptop offers, fetched over the link part after part into a file."""

import os
import zlib

from shared.arm_description import ArmError
from shared.config_files import open_to_write
from shared.job_messages import Want, bytes_of

MYPY = False
if MYPY:
    from typing import IO, Optional  # noqa: F401

    from shared.job_messages import Draw, JobPart  # noqa: F401

RETRY_PERIOD = 1.0
"""Time after which a part that has not come is asked for again, s."""

FETCH_TIMEOUT = 20.0
"""Longest wait after the last part before the job is given up, s."""


class NotFetched(ArmError):
    """A job that did not come as it was offered."""


class JobFetching(object):
    """One transfer of a job from the laptop; what has come survives a lost link.

    Args:
        draw: the Draw that offers it.
        file: path of the file to write; it is there once it is complete.
        t: the time now, s.

    Attributes:
        draw: as given.
        part: number of the next part, from 0 on.
        complete: whether all of it is in the file.

    Raises:
        NotFetched: there is no room for it.
    """

    def __init__(self, draw, file, t):
        # type: (Draw, str, float) -> None
        self.draw = draw
        self.part = 0
        self.complete = False
        self._file = file
        self._draft = file + ".part"
        self._unpacker = zlib.decompressobj()
        self._size = self._crc = 0
        self._asked, self._asked_at, self._came_at = None, t, t  # type: Optional[int], float, float
        self._out = None  # type: Optional[IO[bytes]]
        if self._is_there():
            self.complete = True
            return
        try:
            folder = os.path.dirname(file)
            os.makedirs(folder, mode=0o700, exist_ok=True)
            self._out = open(open_to_write(self._draft), "wb")  # noqa: SIM115 - it stays open
        except OSError as error:
            raise self._no_room(error) from None

    def _is_there(self):
        # type: () -> bool
        """Return whether the file is this job already."""
        try:
            if os.path.getsize(self._file) != self.draw.size:
                return False
            crc = 0
            with open(self._file, "rb") as file:
                for piece in iter(lambda: file.read(65536), b""):
                    crc = zlib.crc32(piece, crc)
            return crc & 0xFFFFFFFF == self.draw.crc
        except OSError:
            return False

    def due(self, t, linked):
        # type: (float, bool) -> Optional[Want]
        """Return the Want that is to be sent, or None.

        Args:
            t: the time now, s.
            linked: whether the laptop can be reached.

        Raises:
            NotFetched: nothing has come for too long.
        """
        if self.complete:
            return None
        if t - self._came_at > FETCH_TIMEOUT:
            raise NotFetched(
                "{} of {} parts of '{}' have come, and no more for {:.0f} s; "
                "press Start again".format(
                    self.part, self.draw.parts, self.draw.name, t - self._came_at
                )
            )
        if not linked:
            self._asked = None
            return None
        if self._asked == self.part and t - self._asked_at < RETRY_PERIOD:
            return None
        self._asked, self._asked_at = self.part, t
        return Want(self.draw.crc, self.part)

    def handle(self, part, t):
        # type: (JobPart, float) -> None
        """Handle a JobPart; any other than the next is ignored.

        Args:
            part: JobPart.
            t: the time when it came, s.

        Raises:
            NotFetched: it is not what was offered, or there is no room for it.
        """
        out = self._out
        if self.complete or out is None or (part.crc, part.part) != (self.draw.crc, self.part):
            return
        room = self.draw.size - self._size
        try:
            data = self._unpacker.decompress(bytes_of(part), room + 1)
        except zlib.error:
            raise self._changed() from None
        if len(data) > room:
            raise self._changed()
        try:
            out.write(data)
            self._size += len(data)
            self._crc = zlib.crc32(data, self._crc)
            self.part += 1
            self._came_at = t
            if self.part == self.draw.parts:
                out.close()
                if (self._size, self._crc & 0xFFFFFFFF) != (self.draw.size, self.draw.crc):
                    raise self._changed()
                os.replace(self._draft, self._file)
                self.complete = True
        except OSError as error:
            raise self._no_room(error) from None

    def close(self):
        # type: () -> None
        """Close the file; an incomplete one is removed."""
        if self._out is not None and not self.complete:
            self._out.close()
            if os.path.exists(self._draft):
                os.remove(self._draft)

    def _changed(self):
        # type: () -> NotFetched
        return NotFetched(
            "'{}' did not come as it was offered; press Start again".format(self.draw.name)
        )

    def _no_room(self, error):
        # type: (OSError) -> NotFetched
        return NotFetched(
            "cannot write {}: {}; make room on the brick".format(self._draft, error.strerror)
        )
