"""Output of programs on bricks, stored on this computer: the last runs, each of a bounded size.

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

MAX_RUNS = 20
"""Greatest number of runs that are stored, of all bricks together."""
MAX_HEAD, MAX_TAIL = 1 << 18, 1 << 16
"""Greatest size of what is stored of a run's beginning, and of its end, bytes."""
SECRET = "--code"
"""Option whose value is not written."""


def _folder() -> Path:
    return Path(state_folder(), BRICK_RUNS_FOLDER)


def stored_runs() -> list[Path]:
    """Return the files of the last runs, the oldest first."""
    return sorted(_folder().glob("[0-9]*.txt"))


def is_of(file: Path, address: BrickAddress) -> bool:
    """Return True if a file is of a run on this brick."""
    with open(file, encoding="utf-8", errors="replace") as opened:
        return f"on {address}, " in "".join(opened.readline() for _ in range(2))


class BrickRunLog:
    """The log of one run, for a `with` block; a failure to store it is reported once.

    Args:
        address: the brick's.
        args: the script that is run, and its arguments.
        report: called with a line for people.

    Attributes:
        status: exit status of the run, which others set; None: it has not ended.
    """

    def __init__(
        self, address: BrickAddress, args: tuple[str, ...], report: Callable[[str], None]
    ) -> None:
        self.status: int | None = None
        self._address, self._args, self._report = address, args, report
        self._began = time.monotonic()
        self._file: BinaryIO | None = None
        self._room, self._left_out, self._end = MAX_HEAD, 0, b""

    def __enter__(self) -> BrickRunLog:
        try:
            self._file = self._new_file()
            self._write(f"{COMMAND} run {shlex.join(_without_code(self._args))}\n")
            self._write(f"on {self._address}, {time.strftime('%Y-%m-%d %H:%M:%S')}\n\n")
        except OSError as error:
            self._fail(error)
        return self

    def add(self, data: bytes) -> None:
        """Add output, within the bounds; it is the brick's terminal that ends lines by CR LF."""
        data = data.replace(b"\r", b"")
        first, more = data[: self._room], data[self._room :]
        self._room -= len(first)
        self._write(first)
        end = self._end + more
        self._left_out += max(0, len(end) - MAX_TAIL)
        self._end = end[-MAX_TAIL:]

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
        for old in stored_runs()[: 1 - MAX_RUNS]:
            old.unlink(missing_ok=True)
        stem, k = f"{time.strftime('%Y-%m-%d-%H%M%S')}-{Path(self._args[0]).stem}", 1
        while True:
            try:
                return open(folder / f"{stem}{f'-{k}' * (k > 1)}.txt", "xb", buffering=0)
            except FileExistsError:  # two in one second
                k += 1

    def _write(self, text: str | bytes) -> None:
        if self._file is None:
            return
        try:
            self._file.write(text if isinstance(text, bytes) else text.encode(errors="replace"))
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        if self._file:
            self._file.close()
        self._file = None
        self._report(f"no log of this run is kept: {error.strerror}: {_folder()}")


def _without_code(args: tuple[str, ...]) -> list[str]:
    """Return the arguments of a command without the pairing code."""
    shown = [f"{SECRET}=..." if arg.startswith(f"{SECRET}=") else arg for arg in args]
    return [
        "..." if before == SECRET else arg for before, arg in zip(["", *shown], shown, strict=False)
    ]
