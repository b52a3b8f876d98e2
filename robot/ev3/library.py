"""The library itself: whether it is installed, and the folder in which it finds motors."""

import contextlib
import sys

from shared.state import laptop_program

MYPY = False
if MYPY:
    from typing import Iterator, Optional  # noqa: F401


def what_is_missing(error):
    # type: (ImportError) -> Optional[str]
    """Return what to do about an ImportError, for people; None if the library is not its cause."""
    if getattr(error, "name", "") != "ev3dev2":
        return None
    advice = "there is no python-ev3dev2 here; run this on the brick, or emulated: {} simulate {}"
    return advice.format(laptop_program(), sys.argv[0])


@contextlib.contextmanager
def motors_shown_in(root):
    # type: (str) -> Iterator[None]
    """Let the library find motors in another folder than the system's, for a `with` block."""
    from ev3dev2.motor import Device

    before = Device.DEVICE_ROOT_PATH
    Device.DEVICE_ROOT_PATH = root
    try:
        yield
    finally:
        Device.DEVICE_ROOT_PATH = before
