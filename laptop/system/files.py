"""Files for people: written atomically, and never over another kind of file."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from shared.arm_description import ArmError
from shared.config_files import InvalidFile, check_replaceable


class CannotWrite(ArmError, OSError):
    """A file cannot be written there, or would take the place of another one.

    Its `strerror` is the reason alone, for a caller that knows better advice.
    """


def _cannot_write(file: Path, why: str, advice: str = "choose another name") -> CannotWrite:
    error = CannotWrite(f"cannot write {file}: {why}; {advice}")
    error.strerror = why
    return error


def check_new(file: Path, endings: Sequence[str], replace: bool = False) -> None:
    """Refuse a place for a file before anything is worked out for it.

    Args:
        file: its name.
        endings: one of which its name has, such as ".csv"; another one is of another kind of file.
        replace: whether one that is there may be replaced.

    Raises:
        CannotWrite: it has none of them, or cannot be shown; its folder is not there; something
            else than a file is there, or one is and is to stay.
    """
    check_shown(file)
    if file.suffix.lower() not in endings:
        raise CannotWrite(
            f"{file} would be no {' or '.join(endings)} by its name; give it a name that ends so"
        )
    if not file.parent.is_dir():
        raise _cannot_write(file, f"there is no folder {file.parent}", "make it first")
    check_kind(file)
    if Path(os.path.realpath(file)).suffix.lower() not in endings:
        raise CannotWrite(
            f"{file} is a link to {os.path.realpath(file)}, another kind of file; choose another "
            "name"
        )
    if os.path.lexists(file) and not replace:
        raise CannotWrite(
            f"{file} is there already; choose another name, or give --replace to put the new one "
            "in its place"
        )


def check_shown(file: Path, advice: str = "choose another name") -> None:
    """Refuse a name with control characters, which would change the terminal.

    Raises:
        CannotWrite: with the advice.
    """
    if not str(file).isprintable():
        raise CannotWrite(f"{ascii(str(file))} has characters that cannot be shown; {advice}")


def check_kind(file: Path) -> None:
    """Refuse to put a file where something else than a file is.

    Raises:
        CannotWrite: a folder, a device, a pipe or a link that leads nowhere is there.
    """
    try:
        check_replaceable(file)
    except InvalidFile as error:
        raise _cannot_write(file, str(error)) from None
    except OSError as error:
        raise _cannot_write(file, str(error.strerror)) from None
    if file.is_symlink() and not file.exists():
        raise _cannot_write(file, "is a link that leads nowhere")


@contextlib.contextmanager
def written(file: Path, mode: int | None = None) -> Iterator[Path]:
    """Give the place of a draft; at the end of a `with` block without error it is the file.

    What a link leads to is replaced, and the link stays.

    Args:
        file: what it becomes.
        mode: who may read and write it; if not said, whoever might before, or as is usual.

    Raises:
        CannotWrite: something else than a file is there, or there is no room.
    """
    check_kind(file)
    target = Path(os.path.realpath(file))
    draft = None
    try:
        descriptor, name = tempfile.mkstemp(target.suffix, ".draft-", target.parent)
        os.close(descriptor)
        draft = Path(name)
        try:
            yield draft
            if mode is None:
                mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
            draft.chmod(mode)
            os.replace(draft, target)
        finally:
            draft.unlink(missing_ok=True)
    except ArmError as error:  # the writer knows the draft's name only
        if draft is None or str(draft) not in str(error):
            raise
        raise CannotWrite(str(error).replace(str(draft), str(file))) from None
    except OSError as error:
        why = str(error.strerror or error)
        raise _cannot_write(file, why, "make room, or choose another name") from None


def write_whole(file: Path, data: bytes, mode: int | None = None) -> None:
    """Write a file, all of it or nothing; see `written`.

    Raises:
        CannotWrite: see `written`.
    """
    with written(file, mode) as draft:
        draft.write_bytes(data)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
