"""What may have become of a small file, each kind made where it should be."""

import os
import socket

from shared.config_files import MAX_SIZE


def put(path, data):
    with open(path, "wb") as file:
        file.write(data)


def long_one(path):
    """A file of 100 MB, most of it never written."""
    with open(path, "wb") as file:
        file.truncate(10**8)


def listening(path):
    sock = socket.socket(socket.AF_UNIX)
    sock.bind(path)
    sock.close()


ODD = {
    "folder": (os.mkdir, "is a folder"),
    "pipe": (os.mkfifo, "is a pipe"),
    "socket": (listening, "is a socket"),
    "endless": (lambda path: os.symlink("/dev/zero", path), "is a device"),
    "bottomless": (lambda path: os.symlink("/dev/null", path), "is a device"),
    "100 MB": (long_one, "has more than"),
    "no text": (lambda path: put(path, b"\xff\xfe\x00"), "is not a text file"),
    "deep": (lambda path: put(path, b'{"a":' * 10000), "is no JSON"),
    "deep list": (lambda path: put(path, b"[" * MAX_SIZE), "is no JSON"),
    "half": (lambda path: put(path, b'{"zero": {"A": 1'), "is no JSON"),
    "not a number": (lambda path: put(path, b'{"zero": NaN}'), "is no JSON"),
    "poem": (lambda path: put(path, b"roses are red"), "is no JSON"),
    "list": (lambda path: put(path, b"[1]"), "holds no JSON object"),
    "empty": (lambda path: put(path, b""), "is no JSON"),
}
"""By name: makes it at a path; the words in which a reader of JSON refuses it."""
