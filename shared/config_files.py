"""Reading and writing of files of settings and state.

Only a regular file of a sensible size is read: a pipe would block, a device would never end. Any
error in its contents is an `InvalidFile`, which says what is wrong; the caller adds the file's name
and the next step.
"""

import math
import os
import stat

MYPY = False
if MYPY:
    from typing import Any, Dict, NoReturn, Optional, Union  # noqa: F401

    AnyPath = Union[str, os.PathLike[str]]

MAX_SIZE = 65536
"""Greatest size of a file, bytes; most have some hundred."""

KINDS = (
    (stat.S_ISDIR, "is a folder"),
    (stat.S_ISFIFO, "is a pipe"),
    (stat.S_ISSOCK, "is a socket"),
)
"""Tests for files that are not regular, and their texts for people."""


class InvalidFile(ValueError):
    """Error for a file with invalid contents; the message continues the file's name."""


def open_file(path):
    # type: (AnyPath) -> int
    """Open a file without blocking; return its descriptor.

    Raises:
        InvalidFile: it is no regular file.
        OSError: it is not there, or may not be read.
    """
    _check_regular(os.stat(path))  # before: opening may already do something to a device
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        _check_regular(os.fstat(descriptor))
    except InvalidFile:
        os.close(descriptor)
        raise
    return descriptor


def open_to_write(path, how=os.O_TRUNC, mode=0o666):
    # type: (AnyPath, int, int) -> int
    """Open a file for writing, made where it is missing, without blocking; return its descriptor.

    Args:
        path: of the file.
        how: os.O_TRUNC empties it, os.O_APPEND keeps what it has, os.O_EXCL wants none.
        mode: of a new file.

    Raises:
        OSError: it cannot be written, or it is a pipe that nobody reads.
    """
    flags = os.O_WRONLY | os.O_CREAT | how | getattr(os, "O_NONBLOCK", 0)
    return os.open(path, flags, mode)


def write_whole(path, text, mode=None, sync=True):
    # type: (str, str, Optional[int], bool) -> None
    """Write a text to a file, all or nothing; make its folder.

    `mode` says who may read and write it, if not as usual; `sync` waits until the card has it.
    """
    draft = path + ".new"
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    if mode is not None and os.path.lexists(draft):
        os.remove(draft)  # readers of an old one could read the new one
    how = os.O_TRUNC if mode is None else os.O_EXCL
    try:
        with open(open_to_write(draft, how, mode or 0o666), "wb") as file:
            if mode is not None:
                os.chmod(draft, mode)  # whatever the mask takes away
            file.write(text.encode())
            if sync:
                file.flush()
                os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        if os.path.isfile(draft):
            os.remove(draft)
        raise


def check_replaceable(path):
    # type: (AnyPath) -> None
    """Refuse to replace anything but a regular file: a rename would replace a device, too.

    Raises:
        InvalidFile: a folder, a device, a pipe or the like is there.
        OSError: the path cannot be examined.
    """
    try:
        found = os.stat(path)
    except FileNotFoundError:
        return
    _check_regular(found)


def _check_regular(found):
    # type: (os.stat_result) -> None
    if not stat.S_ISREG(found.st_mode):
        texts = [text for is_kind, text in KINDS if is_kind(found.st_mode)]
        raise InvalidFile("{}, not a file".format((texts or ["is a device"])[0]))


def read_text(path, most=MAX_SIZE, encoding="utf-8"):
    # type: (AnyPath, int, str) -> str
    """Read the text in a file; its line ends become newlines.

    Args:
        path: of the file.
        most: greatest size, bytes.
        encoding: of the text.

    Raises:
        InvalidFile, OSError: see `open_file`; or it is too long, or no text.
    """
    with open(open_file(path), "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise InvalidFile("has more than {} bytes".format(most))
    try:
        return data.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise InvalidFile("is not a text file (UTF-8)") from None


def read_json(path):
    # type: (AnyPath) -> Dict[str, Any]
    """Read the object (a dict) in a file of JSON.

    Raises:
        InvalidFile, OSError: see `read_text`; or it holds no object.
    """
    return parse_json(read_text(path))


def parse_json(text):
    # type: (str) -> Dict[str, Any]
    """Parse the object (a dict) in a text of JSON.

    Raises:
        InvalidFile: it holds no object.
    """
    import json  # not above: not every program reads one

    try:
        value = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise InvalidFile("is no JSON") from None
    if not isinstance(value, dict):
        raise InvalidFile("holds no JSON object")
    return value


def _refuse(word):
    # type: (str) -> NoReturn
    raise ValueError(word)


def number(value):
    # type: (Any) -> float
    """Return a number that was read as a float.

    Raises:
        InvalidFile: it is no finite number; true and false are none either.
    """
    try:
        result = float(value) if type(value) in (int, float) else math.nan
    except OverflowError:  # of hundreds of digits
        result = math.nan
    if not math.isfinite(result):
        raise InvalidFile("has something else where a number should be")
    return result
