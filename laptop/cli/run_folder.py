"""The folder in which a run on the emulated brick leaves its files, each of them whole."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from laptop.emulator.faults import InvalidSimulationOption
from laptop.emulator.rig import SimulationResult
from laptop.system import platforms
from laptop.system.files import CannotWrite, check_kind, check_shown
from laptop.system.files import written as whole_file
from shared.small_files import read_text

SUMMARY = "summary.json"
TRACE = "trace.csv"
PICTURES = ("picture.png", "picture-side.png", "learning.png")
"""Of a run on the emulated brick; one of an earlier run would be taken for its own."""

SIGNS = frozenset(("kind", "script", "drawing", "status"))
"""One of these is in the summary of every run."""
MAX_SUMMARY = 4_000_000
"""Bytes of one."""

ENDED_BY_OTHERS = 124
"""From this exit status on a script was ended: its time was over, or by a signal."""


@contextlib.contextmanager
def alone_in(out: Path) -> Iterator[None]:
    """Keep the folder to this run; the system frees it when the process ends, however it does.

    Raises:
        InvalidSimulationOption: another run has it.
    """
    descriptor = platforms.open_folder(os.path.realpath(out))
    try:
        if not platforms.lock(descriptor):
            raise InvalidSimulationOption(
                f"another run is at work for {out}; "
                "wait for its end, or choose another folder with --out"
            )
        yield
    finally:
        os.close(descriptor)


def check_room(out: Path, *others: str) -> None:
    """Refuse a folder that cannot take the results, before anything runs.

    Args:
        out: the folder; it is made.
        others: names of files that the run writes, too, besides those of every run.

    Raises:
        click.ClickException: there is no room, or a file of that name is of no run.
        CannotWrite: something else than a file has such a name, or the folder's name cannot be
            shown.
    """
    check_shown(out, "choose another folder with --out")
    try:
        out.mkdir(mode=0o700, parents=True, exist_ok=True)
        for name in (SUMMARY, TRACE, *PICTURES, *others):
            check_kind(out / name)
        if (out / SUMMARY).exists():
            foreign = [] if _is_of_a_run(out / SUMMARY) else [SUMMARY]
        else:
            foreign = [name for name in (TRACE, PICTURES[0], *others) if (out / name).exists()]
        if foreign:
            beside = "" if foreign[0] == SUMMARY else f", as there is no {SUMMARY} beside it,"
            raise click.ClickException(
                f"{out / foreign[0]} is of no run{beside} and would be lost; choose another folder "
                "with --out"
            )
        with tempfile.TemporaryFile(dir=out) as file:
            file.write(bytes(1 << 20))
            file.flush()
    except CannotWrite:
        raise
    except (FileExistsError, NotADirectoryError):
        raise click.ClickException(
            f"cannot write to {out}: it is no folder; choose another one with --out"
        ) from None
    except OSError as error:
        raise _no_room(out, error) from None


def _is_of_a_run(summary: Path) -> bool:
    """Return whether a summary is one, or was to become one before its run was cut off."""
    try:
        told = json.loads(read_text(str(summary), MAX_SUMMARY) or "{}")
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(told, dict) and (not told or not SIGNS.isdisjoint(told))


def was_refused(run: SimulationResult) -> bool:
    """Return True if a script has ended itself, and failed, before any motor was asked to turn."""
    return not run.asked and 0 < run.outcome.status < ENDED_BY_OTHERS


def keeps_earlier_run(out: Path, run: SimulationResult) -> bool:
    """Return True, and say so, if one was refused and the folder holds another one that was not."""
    if not was_refused(run) or not (out / SUMMARY).exists():
        return False
    with contextlib.suppress(OSError, ValueError):
        before = json.loads((out / SUMMARY).read_text(encoding="utf-8"))
        if isinstance(before, dict) and before.get("refused"):
            return False
    click.echo(f"no motor was asked to turn: {out} keeps the files of the run before")
    return True


def write_files(
    out: Path,
    files: Mapping[str, Callable[[str], None] | Mapping[str, Any]],
    others: Iterable[str] = (),
    written: Iterable[str] = (),
) -> None:
    """Write files, each whole or not at all; those of `others` that an earlier run left go.

    Args:
        out: the folder.
        files: by name, what writes one at the path that it is given, or what it holds as JSON.
            The summary names the run's files, as the folder may hold those of other runs, too.
        others: names that mean something of a run.
        written: names of files that the run has left in the folder before.
    """
    try:
        for name in {*files, *others}:
            check_kind(out / name)
        for name, content in files.items():
            if name == SUMMARY and isinstance(content, Mapping):
                content = {**content, "files": [*written, *files]}
            with whole_file(out / name) as draft:
                if isinstance(content, Mapping):
                    text = json.dumps(content, indent=1) + "\n"
                    draft.write_text(text, encoding="utf-8")
                else:
                    content(str(draft))
        for name in set(others) - set(files):
            (out / name).unlink(missing_ok=True)
    except CannotWrite as error:
        raise click.ClickException(f"{error}, or another folder with --out") from None
    except OSError as error:
        raise _no_room(out, error) from None


def _no_room(out: Path, error: OSError) -> click.ClickException:
    advice = "make room or " if error.errno == errno.ENOSPC else ""
    return click.ClickException(
        f"cannot write to {out}: {error.strerror}; {advice}choose another folder with --out"
    )
