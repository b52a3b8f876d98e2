"""Files that belong on the brick, with their modes and line ends; pure but for reading."""

from __future__ import annotations

import hashlib
import io
import tarfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import shared
from shared.version import VERSION

ROOT = Path(shared.__file__).resolve().parent.parent
"""Folder that holds `robot` and `shared`, in a checkout and where it is installed alike."""

SOURCES = ("robot/**/*.py", "shared/**/*.py", "shared/arms/*.ini")
"""Patterns of the files that the brick needs."""

HOLD = 'exec 8<"$HOME/.brickservo/program/" && flock -s 8'
"""Shell commands that hold the active version until the program started after them has ended."""
THIS_VERSION = '"$(readlink -f "$HOME/.brickservo/program")"'
"""Folder of that version, for sh; the link would lead elsewhere after the next install."""

MENU = {
    "menu/draw": f"""#!/bin/sh
{HOLD}
exec "$HOME/robot/driver.py" "$@"
""",
    "menu/servo": f"""#!/bin/sh
{HOLD}
cd "$HOME" && exec robot/visual_servoing.py --wait --log .brickservo/logs/menu-servo.jsonl "$@"
""",
}
"""Contents of files for the brick's menu, by path, beside those of SOURCES."""

PLAIN, EXECUTABLE = 0o644, 0o755


@dataclass(frozen=True)
class ProgramFile:
    """A file as it should be on the brick.

    Args:
        data: its bytes, with the line ends of Linux.
    """

    data: bytes

    @property
    def mode(self) -> int:
        """Mode of the file, by its content: a checkout may have lost it."""
        return EXECUTABLE if self.data.startswith(b"#!") else PLAIN

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file, in hex."""
        return hashlib.sha256(self.data).hexdigest()


def program_files(root: Path = ROOT) -> dict[str, ProgramFile]:
    """Return the files of the program by their paths on the brick.

    Raises:
        OSError: one cannot be read.
    """
    paths = {path for pattern in SOURCES for path in root.glob(pattern)}
    read = {
        path.relative_to(root).as_posix(): path.read_bytes().replace(b"\r\n", b"\n")
        for path in paths
    }
    read.update((name, text.encode()) for name, text in MENU.items())
    return {name: ProgramFile(data) for name, data in sorted(read.items())}


def version_of(files: Mapping[str, ProgramFile]) -> str:
    """Return a name for exactly these files: the version that people know, and a checksum."""
    lines = [f"{file.mode:o} {file.digest} {name}\n" for name, file in sorted(files.items())]
    return f"{VERSION}+{hashlib.sha256(''.join(lines).encode()).hexdigest()[:8]}"


def manifest(files: Mapping[str, ProgramFile]) -> str:
    """Return lines by which sha256sum checks these files."""
    return "".join(f"{file.digest}  {name}\n" for name, file in sorted(files.items()))


def archive(files: Mapping[str, ProgramFile], names: Iterable[str]) -> bytes:
    """Return the files of some names as a compressed tar; a truncated one cannot be unpacked."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz") as tar:
        for name in names:
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode = len(files[name].data), files[name].mode
            entry.mtime = int(time.time())
            tar.addfile(entry, io.BytesIO(files[name].data))
    return packed.getvalue()
