"""The environment variables and folders that a program finds on the emulated brick."""

import contextlib
import os
import time
from typing import Dict, Iterator, Mapping

from laptop.emulator.host import linux

OWN_VARIABLES = "BRICKSERVO_"
"""Prefix of the variables that a program on the brick finds as they are here."""

BRICK_STATE = linux.HOME + "/.brickservo"
"""Path of the state folder on the brick."""


@contextlib.contextmanager
def brick_environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Have the brick's variables for a `with` block, and its time zone.

    Args:
        variables: name -> value, beside or instead of those that every program finds.
    """
    before = dict(os.environ)
    inherited = {
        key: value
        for key, value in before.items()
        if key.startswith(OWN_VARIABLES) or key in linux.NEEDED
    }
    try:
        _set(dict(linux.ENVIRONMENT, **dict(inherited, **variables)))
        yield
    finally:
        _set(before)


def _set(variables: Mapping[str, str]) -> None:
    os.environ.clear()
    os.environ.update(variables)
    getattr(time, "tzset", lambda: None)()  # not on Windows


def brick_folders(state: str) -> Dict[str, str]:
    """Return the brick's folders, and where they are here: path there -> path here.

    The user's home is the folder that one is in.

    Args:
        state: the state folder here.
    """
    folders = {BRICK_STATE: state}
    if not os.path.isdir(linux.HOME):
        folders[linux.HOME] = os.getcwd()
    return folders
