"""The folder of a command's results: its run.json and its files, each whole."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path, PurePath

from laptop.record.names import RUN, TRACE
from laptop.record.run import DamagedRun, Run, RunFile, as_json, read_run
from laptop.system import platforms
from laptop.system.files import CannotWrite, check_kind, check_shown, written
from shared.arm_description import ArmError

RUNS = "runs"
"""Name of the folder in which every run has a folder of its own by default."""
PICTURE, SIDE_PICTURE = "picture.png", "picture-side.png"
"""Names of the picture from above and, of an arm in space, from the side."""
FIGURES = ("cameras.png", "space.png", "errors.png", "joints.png")
"""Names of the figures of servo runs."""
TRUE_PATH = "goal-true-path.csv"
"""Name of the true path of a servo run in the emulator."""

MIN_KILLED_STATUS = 124
"""Least exit status of a script that was ended, by its time limit or a signal."""
_MAX_TRIES = 100
"""Number of names that are tried for a new folder."""


class NoRunFolder(ArmError, OSError):
    """A folder that cannot take a run."""


class RunFolder:
    """The folder of one run, which has it alone.

    Args:
        path: where it is.
        names: of files that the run may write besides run.json.

    Attributes:
        path: where it is.
    """

    def __init__(self, path: Path, names: Sequence[str] = ()) -> None:
        self.path = path
        self._names = names

    def write(
        self, run: Run, files: Mapping[str, tuple[Callable[[str], None], str]] | None = None
    ) -> str:
        """Write a run and its files, each whole or not at all; an earlier run's files go.

        The trace comes first, pictures come last: whoever waits for run.json has the figures.

        Args:
            run: it names the files that are there already; those written here are added.
            files: name -> a writer to a path, and the file's content in words.

        Returns:
            The files that are there now, in words for people.

        Raises:
            NoRunFolder, CannotWrite: it cannot be written.
        """
        making = dict(files or {})
        before = self._earlier()
        run.files = [*run.files, *(RunFile(name, holds) for name, (_, holds) in making.items())]
        names = dict.fromkeys(file.name for file in run.files)
        writers: dict[str, Callable[[str], None]] = {
            name: writer for name, (writer, _) in making.items() if name == TRACE
        }
        writers[RUN] = writer_of(as_json(run))
        writers |= {name: writer for name, (writer, _) in making.items() if name != TRACE}
        try:
            for name in writers:
                check_kind(self.path / name)
            for name, writer in writers.items():
                (self.path / name).parent.mkdir(exist_ok=True)
                with written(self.path / name) as draft:
                    writer(str(draft))
            for name in before - names.keys():
                self._remove(name)
        except CannotWrite as error:
            raise NoRunFolder(f"{error}, or another folder with --out") from None
        except OSError as error:
            raise _no_room(self.path, error) from None
        shown = sorted(names, key=lambda name: not name.endswith(".png"))
        return f"{_shown(self.path)}/{', '.join([*shown, RUN])}"

    def clear(self) -> None:
        """Remove the earlier run, with all files that it names."""
        for name in self._earlier():
            self._remove(name)
        self._remove(RUN)

    def _remove(self, name: str) -> None:
        """Remove a file of an earlier run; a file behind a link is none of its own."""
        if not any((self.path / part).is_symlink() for part in PurePath(name).parents):
            with contextlib.suppress(IsADirectoryError, NotADirectoryError):
                (self.path / name).unlink(missing_ok=True)

    def keeps_earlier_run(self) -> bool:
        """Return whether a run lies there in which a motor was asked to turn."""
        with contextlib.suppress(DamagedRun):
            return not read_run(self.path).ending.more.get("refused")
        return False

    def check_room(self) -> None:
        """Refuse a folder that cannot take the results, before anything runs.

        Raises:
            NoRunFolder: there is no room, or a file of that name is of no run.
            CannotWrite: something else than a file has such a name.
        """
        out = self.path
        for name in (RUN, *self._names):
            check_kind(out / name)
        own = self._earlier()
        foreign = [name for name in self._names if name not in own and (out / name).exists()]
        if (out / RUN).exists() and not _is_run(out / RUN):
            foreign = [RUN]
        if foreign:
            beside = f", as there is no {RUN} beside it,"
            if foreign[0] == RUN:
                beside = ""
            elif (out / RUN).exists():
                beside = f", as the {RUN} beside it does not name it,"
            raise NoRunFolder(
                f"{out / foreign[0]} is of no run{beside} and would be lost; choose another folder "
                "with --out"
            )
        try:
            with tempfile.TemporaryFile(dir=out) as file:
                file.write(bytes(1 << 20))
                file.flush()
        except OSError as error:
            raise _no_room(out, error) from None

    def _earlier(self) -> set[str]:
        """Return the names of the files of the run that lies there."""
        try:
            return {file.name for file in read_run(self.path).files}
        except DamagedRun:
            return set()


def writer_of(content: bytes) -> Callable[[str], None]:
    """Return a writer of this content to a path."""

    def write(path: str) -> None:
        Path(path).write_bytes(content)

    return write


@contextlib.contextmanager
def run_folder(command: str, out: Path | None, *names: str) -> Iterator[RunFolder]:
    """Provide a folder for a run alone; the system frees it when the process ends.

    A new one in RUNS that is still empty at the end goes.

    Args:
        command: of which it is; it names the folder, with the time.
        out: the folder; None: a new one in RUNS.
        names: of files that the run may write besides run.json.

    Raises:
        NoRunFolder: it cannot be made or written, another run has it, or a file there is of no run.
        CannotWrite: it, or a name in it, is nothing that can be shown or replaced.
    """
    is_first = not Path(RUNS).exists()
    path = new_folder(command) if out is None else out
    check_shown(path, "choose another folder with --out")
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise NoRunFolder(
            f"cannot write to {path}: it is no folder; choose another one with --out"
        ) from None
    except OSError as error:
        raise _no_room(path, error) from None
    descriptor = platforms.open_folder(os.path.realpath(path))
    try:
        if not platforms.lock(descriptor):
            raise NoRunFolder(
                f"another run is at work for {path}; "
                "wait for its end, or choose another folder with --out"
            )
        folder = RunFolder(path, names)
        folder.check_room()
        yield folder
    finally:
        os.close(descriptor)
        if out is None:
            with contextlib.suppress(OSError):  # it holds something
                path.rmdir()
                if is_first:
                    path.parent.rmdir()


def new_folder(command: str, within: Path = Path(RUNS)) -> Path:
    """Make a folder with the time and the command as its name.

    Raises:
        NoRunFolder: it cannot be made.
    """
    name = f"{time.strftime('%Y-%m-%d-%H%M%S')}-{command}"
    try:
        for attempt in range(1, _MAX_TRIES):
            folder = within / (name if attempt == 1 else f"{name}-{attempt}")
            within.mkdir(parents=True, exist_ok=True)
            # Another run of this second may have it, or have just let go of the empty one above.
            with contextlib.suppress(FileExistsError, FileNotFoundError):
                folder.mkdir(mode=0o700)  # pictures are private
                return folder
    except OSError as error:
        raise _no_room(within, error) from None
    raise NoRunFolder(f"too many runs of this second in {within}; choose a folder with --out")


def _shown(path: Path) -> str:
    """Return a folder for people: from where one is on, if it lies below."""
    with contextlib.suppress(ValueError):
        return str(path.resolve().relative_to(Path.cwd()))
    return str(path)


def _is_run(file: Path) -> bool:
    try:
        read_run(file.parent)
    except DamagedRun:
        return False
    return True


def _no_room(out: Path, error: OSError) -> NoRunFolder:
    advice = "make room or " if error.errno == errno.ENOSPC else ""
    return NoRunFolder(
        f"cannot write to {out}: {error.strerror}; {advice}choose another folder with --out"
    )
