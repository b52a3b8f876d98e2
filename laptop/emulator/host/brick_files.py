"""Paths of the brick's own folders on this computer, for all functions of `os` that take one.

Rule: a program sees the brick's paths alone, also in errors; all other paths are this computer's.
"""

import functools
import os
from typing import Iterable, Mapping

from laptop.emulator import temporary_folders

MYPY = False
if MYPY:
    from typing import Any, Callable, Optional, TypeVar  # noqa: F401

    Value = TypeVar("Value")

ONE_PATH = (
    "access", "chdir", "chmod", "listdir", "lstat", "mkdir", "open", "readlink", "remove", "rmdir",
    "scandir", "stat", "statvfs", "truncate", "unlink", "utime",
)  # fmt: skip
TWO_PATHS = ("link", "rename", "replace", "symlink")
"""Functions of `os`, by how many paths they take; a host may lack some."""


class BrickFiles(object):
    """Folders and system files of the brick; the files are made at the first access.

    Args:
        folders: the brick's path -> path on this computer.
        texts: path of each file of the system -> its text.  Folders at their tops have no other
            files.
    """

    def __init__(self, folders: Mapping[str, str], texts: Mapping[str, str]) -> None:
        self._folders = dict(folders)
        self._texts = texts
        self._tops = {"/" + path.split("/")[1] for path in texts}
        self._made = None  # type: Optional[str]

    def host_path(self, path: object) -> object:
        """Return the path of a file on this computer; `path` itself for any other path."""
        text = path.__fspath__() if hasattr(path, "__fspath__") else path
        if not isinstance(text, str) or not text.startswith("/"):
            return path
        for folder in sorted(self._folders, key=len, reverse=True):
            if text == folder or text.startswith(folder + "/"):
                return self._folders[folder] + text[len(folder) :]
        if "/" + text.split("/")[1] in self._tops:
            return self._system() + text
        return path

    def wrapping(self, function: "Callable[..., Value]", paths: int) -> "Callable[..., Value]":
        """Wrap a function of `os`, whose first `paths` arguments are paths of the brick."""

        @functools.wraps(function)
        def on_the_brick(*args: "Any", **kwargs: "Any") -> "Value":
            host_paths = tuple(map(self.host_path, args[:paths]))
            if host_paths == args[:paths]:
                return function(*args, **kwargs)
            try:
                return function(*(host_paths + args[paths:]), **kwargs)
            except OSError as error:
                error.filename = args[0]
                if paths == 2:
                    error.filename2 = args[1]
                raise

        return on_the_brick

    def close(self) -> None:
        """Remove the files that were made."""
        if self._made:
            temporary_folders.remove(self._made)
            self._made = None

    def _system(self) -> str:
        if self._made is None:
            self._made = made = temporary_folders.make("system")
            for path, text in self._texts.items():
                os.makedirs(os.path.dirname(made + path), exist_ok=True)
                with open(made + path, "w") as file:
                    file.write(text)
        return self._made


class Entries(object):
    """Iterator of entries, as os.scandir returns it."""

    def __init__(self, entries: Iterable[object]) -> None:
        self._left = iter(entries)

    def __iter__(self) -> "Entries":
        return self

    def __next__(self) -> object:
        return next(self._left)

    def close(self) -> None:
        """Do nothing: there is nothing to release."""

    def __enter__(self) -> "Entries":
        return self

    def __exit__(self, *error: object) -> None:
        pass


class MovedEntry(object):
    """An os.DirEntry that has another path."""

    def __init__(self, entry: "os.DirEntry[str]", path: str) -> None:
        self._entry, self.path = entry, path

    def __fspath__(self) -> str:
        return self.path

    def __getattr__(self, name: str) -> object:
        return getattr(self._entry, name)
