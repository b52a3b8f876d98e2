"""Temporary folders that are swept though their owner was killed.

Each has a file beside it, which is locked as long as its owner lives: the system frees it, however
he dies.  Then whoever comes next may sweep both.
"""

import contextlib
import os
import shutil
import tempfile
from functools import partial
from typing import Iterable, Iterator, Optional, Tuple

from laptop.system import platforms

MYPY = False
if MYPY:
    from typing import Dict  # noqa: F401


PREFIX, LOCK = "brickservo-", ".lock"
"""Prefix of each folder's name, and suffix of its lock file."""
IN_MEMORY = "/dev/shm"
"""Folder of Linux for files in memory; on a disk, to remove a folder takes 50 ms."""

_HELD = {}  # type: Dict[str, int]  # path -> descriptor of its lock


def make(name: str, place: Optional[str] = None) -> str:
    """Make a folder of this process, for `remove`; return its path.

    Args:
        name: for people, a part of the folder's.
        place: folder; None takes IN_MEMORY, or where temporary files go if that is not there.
    """
    while True:
        try:
            descriptor, lock = _lock_file(name, place or IN_MEMORY)
        except OSError:
            if place:
                raise
            descriptor, lock = _lock_file(name, tempfile.gettempdir())
        # Somebody may be sweeping just now, and take it for a dead one's.
        if platforms.lock(descriptor) and platforms.is_named(descriptor, lock):
            break
        os.close(descriptor)
    path = lock[: -len(LOCK)]
    os.mkdir(path, 0o700)  # only now: what bears our name is of somebody who holds its lock
    _HELD[path] = descriptor
    return path


def _lock_file(name: str, place: str) -> Tuple[int, str]:
    return tempfile.mkstemp(prefix=PREFIX + name + "-", suffix=LOCK, dir=place)


def remove(path: str) -> None:
    """Remove a folder that `make` has made."""
    if path in _HELD:
        _remove(path, _HELD.pop(path))


def _remove(path: str, descriptor: int) -> None:
    shutil.rmtree(path, ignore_errors=True)
    platforms.remove_open(path + LOCK, partial(os.close, descriptor))


@contextlib.contextmanager
def made(name: str, place: Optional[str] = None) -> Iterator[str]:
    """Make a folder for a `with` block; yield its path."""
    path = make(name, place)
    try:
        yield path
    finally:
        remove(path)


def sweep(places: Optional[Iterable[str]] = None) -> int:
    """Remove the folders of ended processes; return their number.

    Args:
        places: folders; None takes those of `make`.
    """
    swept = 0
    for place in {IN_MEMORY, tempfile.gettempdir()} if places is None else places:
        with contextlib.suppress(OSError):  # there is no such place here
            for name in os.listdir(place):
                if name.startswith(PREFIX) and name.endswith(LOCK):
                    swept += _sweep_one(os.path.join(place, name[: -len(LOCK)]))
    return swept


def _sweep_one(path: str) -> int:
    try:
        descriptor = os.open(path + LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except OSError:  # another user's, or just removed
        return 0
    dead = False
    try:
        dead = platforms.is_ours(descriptor) and platforms.lock(descriptor)
    except OSError:  # one that cannot be locked
        dead = False
    if not dead:
        os.close(descriptor)
        return 0
    _remove(path, descriptor)
    return 1
