"""Temporary folders that are swept though their owner was killed.

Each is locked as long as its owner lives: the system frees it, however he dies. Then whoever comes
next may sweep it; on Windows, where no open folder is renamed, people may.
"""

import contextlib
import os
import shutil
import tempfile

from laptop import system

PREFIX = "brickservo-"
IN_MEMORY = "/dev/shm"
"""Where Linux has files that are on no disk, which takes 50 ms to be rid of a folder of ours."""

_HELD = {}  # type: dict  # path -> descriptor of its lock


def make(name, place=None):
    """Make a folder of this process, to be removed by `remove`; its path.

    Args:
        name: for people, a part of the folder's.
        place: folder; None takes IN_MEMORY, or where temporary files go if that is not there.
    """
    if place is None:
        try:
            draft = tempfile.mkdtemp(prefix="." + PREFIX, dir=IN_MEMORY)
        except OSError:
            draft = tempfile.mkdtemp(prefix="." + PREFIX)
    else:
        draft = tempfile.mkdtemp(prefix="." + PREFIX, dir=place)
    place, unique = os.path.split(draft)
    path = os.path.join(place, PREFIX + name + "-" + unique[len("." + PREFIX) :])
    if system.OPENS_FOLDERS:
        _HELD[path] = system.open_folder(draft)
        system.lock(_HELD[path])
    os.rename(draft, path)  # only now: what bears our name and is not locked has no owner
    return path


def remove(path):
    """Remove a folder that `make` has made."""
    shutil.rmtree(path, ignore_errors=True)
    if path in _HELD:
        os.close(_HELD.pop(path))


@contextlib.contextmanager
def made(name, place=None):
    """The path of a new folder for a `with` block."""
    path = make(name, place)
    try:
        yield path
    finally:
        remove(path)


def sweep(places=None):
    """Remove the folders of processes that are no more; the number of them.

    Args:
        places: folders; None takes those of `make`.
    """
    swept = 0
    if not system.OPENS_FOLDERS:
        return swept
    for place in {IN_MEMORY, tempfile.gettempdir()} if places is None else places:
        with contextlib.suppress(OSError):  # there is no such place here
            for name in os.listdir(place):
                if name.startswith(PREFIX):
                    swept += _sweep_one(os.path.join(place, name))
    return swept


def _sweep_one(path):
    try:
        descriptor = system.open_folder(path)
    except OSError:  # another user's, or just removed
        return 0
    try:
        if os.fstat(descriptor).st_uid != os.getuid() or not system.lock(descriptor):
            return 0  # another user's, or its owner lives
        shutil.rmtree(path, ignore_errors=True)
        return 1
    except OSError:  # one that cannot be locked
        return 0
    finally:
        os.close(descriptor)
