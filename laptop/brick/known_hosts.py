"""Host keys that this user's ssh has stored: read, added and removed."""

from __future__ import annotations

from pathlib import Path

import asyncssh

from laptop.brick import BrickProblem
from laptop.system.files import write_whole

DEFAULT_PORT = 22


def ssh_folder() -> Path:
    """Return the folder where this user's ssh has its files.

    Raises:
        BrickProblem: the system knows no home folder of this user.
    """
    try:
        return Path.home() / ".ssh"
    except RuntimeError:
        raise BrickProblem(
            "this computer tells of no home folder of yours, where ssh has its keys; set HOME to it"
        ) from None


class KnownHosts:
    """Keys of hosts in a file of OpenSSH's format, also one that other programs write.

    Args:
        file: the file, which need not exist; that of this user's ssh if None.
    """

    def __init__(self, file: Path | None = None) -> None:
        self.file = file or ssh_folder() / "known_hosts"

    def keys_of(self, host: str, port: int) -> list[asyncssh.SSHKey]:
        """Return the keys that are known of a host."""
        return [key for line in self._lines() for key in _keys(line, host, port)]

    def add(self, host: str, port: int, key: asyncssh.SSHKey) -> None:
        """Store a key of a host.

        Raises:
            OSError: the file cannot be written.
        """
        self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        before = self._text()
        gap = "\n" if before and not before.endswith("\n") else ""
        parts = key.export_public_key("openssh").decode().split()[:2]
        with open(self.file, "a", encoding="utf-8", errors="surrogateescape", newline="\n") as file:
            file.write(f"{gap}{_pattern(host, port)} {' '.join(parts)}\n")

    def forget(self, host: str, port: int) -> int:
        """Remove all keys of a host; return how many there were.

        Raises:
            OSError: the file cannot be written; it is as before.
        """
        lines = self._lines()
        others = [line for line in lines if not _keys(line, host, port)]
        if len(others) < len(lines):
            write_whole(self.file, "".join(others).encode(errors="surrogateescape"))
        return len(lines) - len(others)

    def _text(self) -> str:
        try:
            return self.file.read_text(encoding="utf-8", errors="surrogateescape")
        except FileNotFoundError:
            return ""

    def _lines(self) -> list[str]:
        return self._text().splitlines(keepends=True)


def _pattern(host: str, port: int) -> str:
    return host if port == DEFAULT_PORT else f"[{host}]:{port}"


def _keys(line: str, host: str, port: int) -> list[asyncssh.SSHKey]:
    """Return the keys of a host in one line; a line that is none of a host's has none."""
    try:
        known = asyncssh.import_known_hosts(line)
    except ValueError:
        return []
    keys, *_ = known.match(_pattern(host, port), "", None)
    return list(keys)
