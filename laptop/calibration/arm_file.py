"""Writes measured numbers into an arm's file: comments stay, the old file is kept beside it."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path

from shared.arm_description import (
    Arm,
    ArmError,
    BadArmFile,
    comes_along,
    read_arm,
    users_file,
)
from shared.ini import BadIni, read_ini, with_values

BACKUP = ".bak"
"""What is put behind the name of the file that was there before."""
NOTED = re.compile(r"\s*\+- [^;]*?\b\d{4}-\d\d-\d\d\b;?")
"""A note in a comment, of an earlier measurement."""
COLUMN = 19
"""A line's comment begins behind so many characters."""


class ArmNotWritten(ArmError, OSError):
    """An arm's file cannot be changed; the message says what to write there by hand."""


def own_file(arm: Arm) -> Path:
    """Path of the file in which numbers of an arm belong: its own, never one that comes along."""
    return Path(users_file(arm.name) if comes_along(arm) else os.path.realpath(arm.file))


def write_values(
    arm: Arm,
    values: Mapping[tuple[str, str], str],
    file: str | Path | None = None,
    notes: Mapping[tuple[str, str], str] | None = None,
) -> Path:
    """Write numbers into an arm's file; of one that comes along, into a copy that is the user's.

    Args:
        arm: as it was read.
        values: texts by (section, key); a key that is not there is added to its section.
        file: written instead of the arm's own.
        notes: by (section, key), what goes first in the comment of that line, such as
            "+- 0.2 deg, seen by a camera 2026-05-01"; it takes the place of the one before.

    Returns:
        The file that has them now; the one before is beside it, with BACKUP behind its name.

    Raises:
        ArmNotWritten: nothing has changed.
    """
    path = own_file(arm) if file is None else Path(file)
    lines = ", ".join(f"[{section}] {key} = {text}" for (section, key), text in values.items())

    def refused(why: str) -> ArmNotWritten:
        return ArmNotWritten(f"{_short(path)} is not changed: {why}; write there: {lines}")

    if file is None and comes_along(arm) and path.exists():
        raise refused(f"it is yours, and {arm.file} was measured (--arm {arm.name} means yours)")
    draft = path.with_name(f".{path.name}.new")
    try:
        try:
            # As bytes: the ends of its lines stay as they are.
            text = Path(arm.file).read_bytes().decode("utf-8")
            path.parent.mkdir(parents=True, exist_ok=True)
            draft.write_bytes(_noted(_changed(text, values), notes or {}).encode("utf-8"))
            read_arm(draft)
            if path.exists():
                shutil.copymode(path, draft)
                shutil.copy2(path, f"{path}{BACKUP}")
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)
    except (BadIni, BadArmFile, UnicodeDecodeError) as error:
        raise refused(str(error).replace(str(draft), str(path))) from None
    except OSError as error:
        raise refused(str(error.strerror)) from None
    return path


def _changed(text: str, values: Mapping[tuple[str, str], str]) -> str:
    """Return the text with these values; keys that are not there become last in their section."""
    there = read_ini(text.lstrip("\ufeff").splitlines())
    missing = {place: v for place, v in values.items() if place[1] not in there.get(place[0], {})}
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
            comment = NOTED.sub("", comment).strip()
            told = f"{note}; {comment}" if comment else note
            lines[number] = f"{value.rstrip():<{COLUMN}} ; {told}{line[len(line.rstrip()) :]}"
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
