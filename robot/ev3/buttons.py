"""The brick's own buttons."""

MYPY = False
if MYPY:
    from typing import Any  # noqa: F401


def brick_buttons():
    # type: () -> Any
    """Return python-ev3dev2's buttons: `buttons_pressed`, and `evdev_device` with their events."""
    from ev3dev2.button import Button  # not above: it is slow to import

    return Button()
