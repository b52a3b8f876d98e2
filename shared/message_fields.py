"""Checks of a message's values: each takes a value and returns it validated.

The same checks hold for messages sent and received.
"""

import functools
import re

MYPY = False
if MYPY:
    from typing import Any, Callable, Dict, Optional, Pattern, Tuple, TypeVar  # noqa: F401

    Key = TypeVar("Key")
    Clean = TypeVar("Clean")
    # Takes what JSON holds, returns it clean, or raises WrongValue.
    Check = Callable[[Any], Clean]

MAX_JOINTS = 8
"""Greatest number of joint angles in a message."""

MAX_TEXT = 200
"""Greatest length of a text for people, characters."""


class WrongValue(Exception):
    """Error for a value that is not allowed; its text says what is."""


def whole_number(lowest, highest):
    # type: (int, int) -> Check[int]
    """Return a check for whole numbers from `lowest` to `highest`."""
    allowed = "a whole number from {} to {}".format(lowest, highest)

    def check(value):
        # type: (Any) -> int
        if type(value) is not int:
            from numbers import Integral  # not above: only the laptop has others than int

            if isinstance(value, bool) or not isinstance(value, Integral):
                raise WrongValue(allowed)
        if not lowest <= value <= highest:
            raise WrongValue(allowed)
        return int(value)

    return check


def number(lowest, highest, unit, decimals):
    # type: (float, float, str, int) -> Check[float]
    """Return a check for numbers of a range (in `unit`), which it rounds to so many decimals."""
    allowed = "a number from {:g} to {:g} {}".format(lowest, highest, unit).rstrip()

    def check(value):
        # type: (object) -> float
        if type(value) is not float:
            from numbers import Real

            if isinstance(value, bool) or not isinstance(value, Real):
                raise WrongValue(allowed)
            try:
                value = float(value)
            except OverflowError:
                raise WrongValue(allowed) from None
        if not lowest <= value <= highest:  # NaN is not
            raise WrongValue(allowed)
        return round(value, decimals)

    return check


@functools.lru_cache(maxsize=None)
def _compiled(pattern):
    # type: (str) -> Pattern[str]
    """Compile a pattern where it is first needed: it takes the brick a while."""
    return re.compile(pattern)


def matching(pattern, allowed):
    # type: (str, str) -> Check[str]
    """Return a check for texts that match a pattern; `allowed` describes them for people."""

    def check(value):
        # type: (object) -> str
        if not isinstance(value, str) or not _compiled(pattern).match(value):
            raise WrongValue(allowed)
        return value

    return check


def printable(text):
    # type: (str) -> str
    """Replace line ends, and all else that would control a terminal, by blanks."""
    return "".join([letter if letter.isprintable() else " " for letter in text])


def one_line(text):
    # type: (str) -> str
    """Return any text as a message takes it: printable, and cut to MAX_TEXT."""
    text = printable(text)
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 3] + "..."


def text(value):
    # type: (object) -> str
    """Check a line for people."""
    # Printable: no line ends, no lone surrogates, nothing that would control a terminal.
    if not isinstance(value, str) or len(value) > MAX_TEXT or not value.isprintable():
        raise WrongValue("at most {} printable characters".format(MAX_TEXT))
    return value


def flag(value):
    # type: (object) -> bool
    """Check true or false."""
    if not isinstance(value, bool):
        raise WrongValue("true or false")
    return value


def or_none(check):
    # type: (Check[Clean]) -> Check[Optional[Clean]]
    """Return the same check, which also lets None pass."""
    return lambda value: None if value is None else check(value)


NONCE = matching(r"[0-9a-f]{32}\Z", "32 hex digits")
PROOF = matching(r"[0-9a-f]{64}\Z", "64 hex digits")
MARKER_NAME = matching(r"[A-Za-z0-9_-]{1,32}\Z", "1 to 32 of A-Z a-z 0-9 _ -")
CAMERA_NAME = matching(r"[A-Za-z0-9_-]{1,16}\Z", "1 to 16 of A-Z a-z 0-9 _ -")
ROW_NAME = matching(r"[A-Za-z0-9_-]{1,16}\.[uv]\Z", "a camera's name and .u or .v")
WORD = matching(r"[a-z-]{1,16}\Z", "1 to 16 of a-z -")
VERDICT = matching(r"[a-z ]{0,32}\Z", "at most 32 of a-z and spaces")
COUNT = whole_number(0, 2**53)
TIME = number(0, 1e9, "s", 6)
PIXEL = number(-1e5, 1e5, "px", 3)
CONFIDENCE = number(0, 1, "", 3)
ANGLE = number(-1000, 1000, "rad", 6)
ERROR = number(0, 1e6, "px", 3)
COMPONENT = number(-1e6, 1e6, "px", 3)
CONDITION = number(0, 1e12, "", 3)
VOLTS = number(0, 100, "V", 2)


def compile_patterns():
    # type: () -> None
    """Compile the patterns of observations ahead, or the first of them would be late."""
    CAMERA_NAME("A")
    MARKER_NAME("A")


def angles(value):
    # type: (object) -> Tuple[float, ...]
    """Check a list of joint angles, rad."""
    if not isinstance(value, (list, tuple)) or len(value) > MAX_JOINTS:
        raise WrongValue("a list of at most {} angles, rad".format(MAX_JOINTS))
    return tuple(ANGLE(angle) for angle in value)


def table(most, what, key, check):
    # type: (int, str, Check[Key], Check[Clean]) -> Check[Dict[Key, Clean]]
    """Return a check for dicts.

    Args:
        most: greatest number of items.
        what: the items, for people.
        key: check of each key.
        check: check of each value.
    """

    def check_all(value):
        # type: (object) -> Dict[Key, Clean]
        if not isinstance(value, dict) or len(value) > most:
            raise WrongValue("a table of at most {} {}".format(most, what))
        return {key(name): check(item) for name, item in value.items()}

    return check_all


def pixels(value):
    # type: (object) -> Tuple[float, float]
    """Check (u, v), px."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise WrongValue("u and v for each camera")
    return PIXEL(value[0]), PIXEL(value[1])


def sighting(value):
    # type: (object) -> Optional[Tuple[float, float, float]]
    """Check (u, v, confidence), or None."""
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise WrongValue("u, v and confidence, or null, for each marker")
    return PIXEL(value[0]), PIXEL(value[1]), CONFIDENCE(value[2])
