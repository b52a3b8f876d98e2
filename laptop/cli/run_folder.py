"""The folder in which a run on the emulated brick leaves its files, each of them whole."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import click

from laptop import system
from laptop.simulator.session import InvalidSimulationOption


@contextlib.contextmanager
def alone_in(out: Path) -> Iterator[None]:
    """Keep the folder to this run; the system frees it when the process ends, however it does.

    Raises:
        InvalidSimulationOption: another run has it.
    """
    descriptor = system.open_folder(os.path.realpath(out))
    try:
        if not system.lock(descriptor):
            raise InvalidSimulationOption(
                f"another run is at work for {out}; "
                "wait for its end, or choose another folder with --out"
            )
        yield
    finally:
        os.close(descriptor)


def check_room(out: Path) -> None:
    """Refuse a folder that cannot take the results before anything runs."""
    try:
        out.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out) as file:
            file.write(bytes(1 << 20))
            file.flush()
    except OSError as error:
        raise _no_room(out, error) from None


def write_files(
    out: Path, files: Mapping[str, Callable[[str], None]], others: tuple[str, ...] = ()
) -> None:
    """Write files, each whole or not at all; those of `others` that an earlier run left go.

    Args:
        out: the folder.
        files: by name, what writes one at the path that it is given.
        others: names that mean something of a run.
    """
    try:
        for name, write in files.items():
            draft = out / f".{name}.part"
            try:
                write(str(draft))
                os.replace(draft, out / name)
            finally:
                draft.unlink(missing_ok=True)
        for name in set(others) - set(files):
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise _no_room(out, error) from None


def _no_room(out: Path, error: OSError) -> click.ClickException:
    advice = "make room or " if error.errno == errno.ENOSPC else ""
    return click.ClickException(
        f"cannot write to {out}: {error.strerror}; {advice}choose another folder with --out"
    )
