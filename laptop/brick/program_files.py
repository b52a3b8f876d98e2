"""What belongs on the brick: which files, with which modes and line ends; pure but for reading."""

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
"""The folder that holds `robot` and `shared`, in a checkout and where it is installed alike."""

SOURCES = ("robot/**/*.py", "shared/**/*.py", "shared/arms/*.ini")
"""Patterns of the files that the brick needs."""

HOLD = 'exec 8<"$HOME/.brickservo/program/" && flock -s 8'
"""Lets the version that counts stay until what is started behind this has ended."""
THIS_VERSION = '"$(readlink -f "$HOME/.brickservo/program")"'
"""Its folder, for sh; the link would lead elsewhere after the next install."""

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
"""Files that stand in the brick's menu, beside those."""

PLAIN, EXECUTABLE = 0o644, 0o755


@dataclass(frozen=True)
class ProgramFile:
    """A file as it should be on the brick.

    Args:
        data: its bytes, lines ended as Linux does.
    """

    data: bytes

    @property
    def mode(self) -> int:
        """Its mode, by what it is: a checkout may have lost it."""
        return EXECUTABLE if self.data.startswith(b"#!") else PLAIN

    @cached_property
    def digest(self) -> str:
        """SHA-256, in hex."""
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
    """Return a name for exactly these files: the version that people know, and what tells."""
    lines = [f"{file.mode:o} {file.digest} {name}\n" for name, file in sorted(files.items())]
    return f"{VERSION}+{hashlib.sha256(''.join(lines).encode()).hexdigest()[:8]}"


def manifest(files: Mapping[str, ProgramFile]) -> str:
    """Return lines by which sha256sum checks these files."""
    return "".join(f"{file.digest}  {name}\n" for name, file in sorted(files.items()))


def archive(files: Mapping[str, ProgramFile], names: Iterable[str]) -> bytes:
    """Return some of the files as a compressed tar; a part of it is none."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz") as tar:
        for name in names:
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode = len(files[name].data), files[name].mode
            entry.mtime = int(time.time())
            tar.addfile(entry, io.BytesIO(files[name].data))
    return packed.getvalue()
