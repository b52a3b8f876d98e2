"""The small files that programs keep, whatever may have become of them.

A regular file of a sensible size is read, and nothing else: a pipe would be waited for, a device
read for ever. Any error in what it holds is a `SpoiltFile`, which says in words what is wrong;
naming the file, and the next step, is up to who knows them.
"""

import math
import os
import stat

MYPY = False
if MYPY:
    from typing import Any, Dict, NoReturn, Union  # noqa: F401

    AnyPath = Union[str, os.PathLike[str]]

MAX_SIZE = 65536
"""Greatest size of such a file, bytes; they have some hundred."""

KINDS = (
    (stat.S_ISDIR, "is a folder"),
    (stat.S_ISFIFO, "is a pipe"),
    (stat.S_ISSOCK, "is a socket"),
)


class SpoiltFile(ValueError):
    """The file is not what it should be; the message says it, to stand behind its name."""


def open_file(path):
    # type: (AnyPath) -> int
    """Open a file, never waiting; its descriptor.

    Raises:
        SpoiltFile: it is no regular file.
        OSError: it is not there, or may not be read.
    """
    _check_regular(os.stat(path))  # before: opening may already do something to a device
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        _check_regular(os.fstat(descriptor))
    except SpoiltFile:
        os.close(descriptor)
        raise
    return descriptor


def open_to_write(path, how=os.O_TRUNC):
    # type: (AnyPath, int) -> int
    """Make a file, or take the one that is there, never waiting; its descriptor.

    Args:
        how: os.O_TRUNC empties it, os.O_APPEND keeps what it has.

    Raises:
        OSError: it cannot be written, or it is a pipe that nobody reads.
    """
    flags = os.O_WRONLY | os.O_CREAT | how | getattr(os, "O_NONBLOCK", 0)
    return os.open(path, flags, 0o666)


def check_replaceable(path):
    # type: (AnyPath) -> None
    """Let a file be put where none is, or a regular one: what a rename does, it does to anything.

    Raises:
        SpoiltFile: a folder, a device, a pipe or the like is there.
        OSError: that cannot be found out.
    """
    try:
        found = os.stat(path)
    except FileNotFoundError:
        return
    _check_regular(found)


def _check_regular(found):
    # type: (os.stat_result) -> None
    if not stat.S_ISREG(found.st_mode):
        words = [words for is_kind, words in KINDS if is_kind(found.st_mode)]
        raise SpoiltFile("{}, not a file".format((words or ["is a device"])[0]))


def read_text(path, most=MAX_SIZE, encoding="utf-8"):
    # type: (AnyPath, int, str) -> str
    """The text in a file, its lines ended by a newline.

    Args:
        most: bytes; a longer one is none of ours.

    Raises:
        SpoiltFile, OSError: see `open_file`; or it is too long, or no text.
    """
    with open(open_file(path), "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise SpoiltFile("has more than {} bytes".format(most))
    try:
        return data.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise SpoiltFile("is not a text file (UTF-8)") from None


def read_json(path):
    # type: (AnyPath) -> Dict[str, Any]
    """The object (a dict) in a file of JSON.

    Raises:
        SpoiltFile, OSError: see `read_text`; or it is something else.
    """
    return parse_json(read_text(path))


def parse_json(text):
    # type: (str) -> Dict[str, Any]
    """The object (a dict) in a text.

    Raises:
        SpoiltFile: it is something else.
    """
    import json  # not above: not every program reads one

    try:
        value = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise SpoiltFile("is no JSON") from None
    if not isinstance(value, dict):
        raise SpoiltFile("holds no JSON object")
    return value


def _refuse(word):
    # type: (str) -> NoReturn
    raise ValueError(word)


def number(value):
    # type: (Any) -> float
    """A number that was read, as a float.

    Raises:
        SpoiltFile: it is none; true and false are none either.
    """
    try:
        result = float(value) if type(value) in (int, float) else math.nan
    except OverflowError:  # of hundreds of digits
        result = math.nan
    if not math.isfinite(result):
        raise SpoiltFile("has something else where a number should be")
    return result
