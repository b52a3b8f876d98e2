"""What programs on bricks have said, kept on this computer: the last runs, each of a bounded size.

It is written as it comes, so that it is there also where the cable is cut.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from laptop.brick import COMMAND
from laptop.brick.connection import BrickAddress
from shared.state import BRICK_RUNS_FOLDER, state_folder

KEPT = 20
"""So many runs stay, of all bricks together."""
MOST_FIRST, MOST_LAST = 1 << 18, 1 << 16
"""Of a run that says more, so much of its beginning and of its end is kept, bytes."""
SECRET = "--code"
"""The option whose value is not written."""


def _folder() -> Path:
    return Path(state_folder(), BRICK_RUNS_FOLDER)


def kept_runs() -> list[Path]:
    """Return the files of the last runs, the oldest first."""
    return sorted(_folder().glob("[0-9]*.txt"))


def is_of(file: Path, address: BrickAddress) -> bool:
    """Return True if a file is of a run on this brick."""
    with open(file, encoding="utf-8", errors="replace") as opened:
        return f"on {address}, " in "".join(opened.readline() for _ in range(2))


class KeptRun:
    """The log of one run, for a `with` block; where it cannot be kept, that is said once.

    Args:
        address: the brick's.
        words: what is run, and its words.
        say: shows a line.
    """

    def __init__(
        self, address: BrickAddress, words: tuple[str, ...], say: Callable[[str], None]
    ) -> None:
        self.status: int | None = None
        self._address, self._words, self._say = address, words, say
        self._began = time.monotonic()
        self._file: BinaryIO | None = None
        self._room, self._left_out, self._end = MOST_FIRST, 0, b""

    def __enter__(self) -> KeptRun:
        try:
            self._file = self._new_file()
            self._write(f"{COMMAND} run {shlex.join(_without_code(self._words))}\n")
            self._write(f"on {self._address}, {time.strftime('%Y-%m-%d %H:%M:%S')}\n\n")
        except OSError as error:
            self._fail(error)
        return self

    def hear(self, data: bytes) -> None:
        """Keep some of the output; it is the brick's terminal that ends lines by CR LF."""
        data = data.replace(b"\r", b"")
        first, more = data[: self._room], data[self._room :]
        self._room -= len(first)
        self._write(first)
        end = self._end + more
        self._left_out += max(0, len(end) - MOST_LAST)
        self._end = end[-MOST_LAST:]

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._left_out:
            self._write(f"\n... {self._left_out} bytes are left out here ...\n")
        self._write(self._end)
        how = f"status {self.status}" if self.status is not None else f"{error or 'stopped here'}"
        self._write(f"\nended after {time.monotonic() - self._began:.1f} s: {how}\n")
        if self._file:
            self._file.close()

    def _new_file(self) -> BinaryIO:
        """Return a new file, and remove all but the last ones.

        Raises:
            OSError: it cannot be written.
        """
        folder = _folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for old in kept_runs()[: 1 - KEPT]:
            old.unlink(missing_ok=True)
        stem, k = f"{time.strftime('%Y-%m-%d-%H%M%S')}-{Path(self._words[0]).stem}", 1
        while True:
            try:
                return open(folder / f"{stem}{f'-{k}' * (k > 1)}.txt", "xb", buffering=0)
            except FileExistsError:  # two in one second
                k += 1

    def _write(self, what: str | bytes) -> None:
        if self._file is None:
            return
        try:
            self._file.write(what if isinstance(what, bytes) else what.encode(errors="replace"))
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        if self._file:
            self._file.close()
        self._file = None
        self._say(f"no log of this run is kept: {error.strerror}: {_folder()}")


def _without_code(words: tuple[str, ...]) -> list[str]:
    """Return the words of a command without the pairing code."""
    shown = [f"{SECRET}=..." if word.startswith(f"{SECRET}=") else word for word in words]
    return [
        "..." if before == SECRET else word
        for before, word in zip(["", *shown], shown, strict=False)
    ]
