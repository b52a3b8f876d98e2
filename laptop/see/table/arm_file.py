"""Measured numbers in an arm's file: comments stay, and the old file is backed up beside it."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import NamedTuple

from laptop.system.files import CannotWrite, check_kind, written
from shared.arm_description import (
    Arm,
    ArmError,
    BadArmFile,
    is_bundled,
    read_arm,
    user_arm_file,
)
from shared.ini import BadIni, read_ini, with_values

BACKUP_SUFFIX = ".bak"
"""Suffix of the previous file's name; a number follows if that is kept."""
NOTE_PATTERN = re.compile(r"\s*\+- [^;]*?\b\d{4}-\d\d-\d\d\b;?")
"""Pattern of a note in a comment, of an earlier measurement."""
COMMENT_COLUMN = 19
"""Column, in characters, behind which a line's comment begins."""


class ArmNotWritten(ArmError, OSError):
    """An arm's file cannot be changed; the message says what to write there by hand."""


class WrittenArm(NamedTuple):
    """An arm's file that has new numbers, and the one that is kept of before, if there was one."""

    file: Path
    before: Path | None


def own_file(arm: Arm) -> Path:
    """Return the path of the file for an arm's own numbers, never a bundled one."""
    return Path(user_arm_file(arm.name) if is_bundled(arm) else os.path.realpath(arm.file))


def write_values(
    arm: Arm,
    values: Mapping[tuple[str, str], str],
    file: str | Path | None = None,
    notes: Mapping[tuple[str, str], str] | None = None,
) -> WrittenArm:
    """Write numbers into an arm's file; of one that comes along, into a copy that is the user's.

    Args:
        arm: as it was read.
        values: texts by (section, key); a key that is not there is added to its section.
        file: written instead of the arm's own.
        notes: by (section, key), what goes first in the comment of that line, such as
            "+- 0.2 deg, seen by a camera 2026-05-01"; it takes the place of the one before.

    Returns:
        The file that has them now, and the one before, beside it, its name with BACKUP_SUFFIX.

    Raises:
        ArmNotWritten: nothing has changed.
    """
    path = own_file(arm) if file is None else Path(file)
    lines = ", ".join(f"[{section}] {key} = {text}" for (section, key), text in values.items())

    def refused(why: str) -> ArmNotWritten:
        return ArmNotWritten(f"{_short(path)} is not changed: {why}; write there: {lines}")

    if file is None and is_bundled(arm) and path.exists():
        raise refused(f"it is yours, and {arm.file} was measured (--arm {arm.name} means yours)")
    before = None
    try:
        # As bytes: the ends of its lines stay as they are.
        text = Path(arm.file).read_bytes().decode("utf-8")
        new = _noted(_changed(text, values), notes or {}).encode("utf-8")
        if not path.parent.is_dir():
            path.parent.mkdir(parents=True)
        with written(path) as draft:
            draft.write_bytes(new)
            try:
                read_arm(draft)
            except BadArmFile as error:
                raise refused(str(error).replace(str(draft), str(path))) from None
            before = _back_up(path)
    except (BadIni, UnicodeDecodeError) as error:
        raise refused(str(error)) from None
    except ArmNotWritten:
        raise
    except FileExistsError:
        raise refused(f"{_short(path.parent)} is no folder") from None
    except OSError as error:
        raise refused(str(error.strerror)) from None
    return WrittenArm(path, before)


def check_writable(path: Path) -> None:
    """Refuse, before anything is measured, what cannot become an arm's file.

    Raises:
        CannotWrite: something else than a file is there, or something else than a folder above it.
    """
    above = next(folder for folder in path.parents if os.path.lexists(folder))
    if not above.is_dir():
        raise CannotWrite(f"cannot write {path}: {above} is no folder; name another one")
    check_kind(path)


def _back_up(path: Path) -> Path | None:
    """Back up a file beside itself, under a free name; return None if it does not exist.

    Raises:
        CannotWrite: there is no room.
    """
    if not path.exists():
        return None
    names = (Path(f"{path}{BACKUP_SUFFIX}{number if number > 1 else ''}") for number in count(1))
    before = next(name for name in names if not os.path.lexists(name))
    with written(before, path.stat().st_mode & 0o777) as draft:
        shutil.copy2(path, draft)
    return before


def _changed(text: str, values: Mapping[tuple[str, str], str]) -> str:
    """Return the text with these values; keys that are not there become last in their section."""
    existing = read_ini(text.lstrip("\ufeff").splitlines())
    missing = {
        place: v for place, v in values.items() if place[1] not in existing.get(place[0], {})
    }
    text = with_values(text, {place: v for place, v in values.items() if place not in missing})
    for (section, key), value in missing.items():
        text = _added(text, section, key, value)
    return text


def _noted(text: str, notes: Mapping[tuple[str, str], str]) -> str:
    """Return the text with notes in the comments of lines."""
    lines, section = text.splitlines(keepends=True), ""
    for number, line in enumerate(lines):
        bare = line.lstrip("\ufeff").rstrip("\r\n")
        if bare.startswith("["):
            section = bare[1 : bare.find("]")]
        note = notes.get((section, bare.partition("=")[0].strip()))
        if note and bare[:1] not in ("#", ";"):
            value, _, comment = line.rstrip("\r\n").partition(";")
            comment = NOTE_PATTERN.sub("", comment).strip()
            noted = f"{note}; {comment}" if comment else note
            lines[number] = (
                f"{value.rstrip():<{COMMENT_COLUMN}} ; {noted}{line[len(line.rstrip()) :]}"
            )
    return "".join(lines)


def _added(text: str, section: str, key: str, value: str) -> str:
    lines = text.splitlines(keepends=True)
    current, last = None, None
    for number, line in enumerate(lines):
        bare = line.lstrip("\ufeff")
        if bare.startswith("["):
            current = bare[1 : bare.find("]")]
        if current == section and bare.strip() and bare.lstrip()[0] not in ";#":
            last = number
    if last is None:
        raise BadIni(section, None, f"there is no section [{section}]")
    end = "\r\n" if lines[last].endswith("\r\n") else "\n"
    if not lines[last].endswith(("\n", "\r")):
        lines[last] += end
    lines.insert(last + 1, f"{key} = {value}{end}")
    return "".join(lines)


def _short(path: Path) -> str:
    return str(path).replace(os.path.expanduser("~") + os.sep, "~" + os.sep, 1)
