"""Commands as typed, one after the other in a process, on a computer that is changed as it is told.

    typed_words.py CHANGES COMMANDS

Both are JSON: an object as of `Computer` in test_same_words.py, and an object of the words by name.
Each command's files are left in the folder of its name, with what it said in `said` there.
"""

import contextlib
import json
import os
import socket
import sys
import time
from pathlib import Path

from laptop.cli.start import order_sets


def change(changes):
    """Have another computer, as far as Python may be told so."""
    for name in set(changes) & {"getpid", "getppid", "cpu_count"}:
        setattr(os, name, lambda value=changes[name]: value)
    if "host" in changes:
        socket.gethostname = lambda: changes["host"]
        if hasattr(os, "uname"):
            other = os.uname_result(("Linux", changes["host"], "6.1", "#1", "x86_64"))
            os.uname = lambda: other
    if "user" in changes:
        os.getlogin = lambda: changes["user"]
        os.getuid = os.geteuid = lambda: 1234
    if "cores" in changes and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[: changes["cores"]]))
    if "later" in changes:
        clock = time.time
        time.time = lambda: clock() + changes["later"]
    if changes.get("backwards"):
        listdir, scandir = os.listdir, os.scandir
        os.listdir = lambda *path: listdir(*path)[::-1]

        os.scandir = lambda *path: Backwards(list(scandir(*path))[::-1])


class Backwards:
    """What os.scandir gives, in the other order."""

    def __init__(self, entries):
        self._entries = iter(entries)

    def __iter__(self):
        return self._entries

    def __next__(self):
        return next(self._entries)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    close = __exit__


def run(words, folder):
    """Run a command of the laptop's, and keep what it said."""
    from laptop.cli.main import laptop

    folder.mkdir()
    with open(folder / "said", "w") as said, contextlib.redirect_stdout(said):
        try:
            laptop([word.format(out=folder.name) for word in words], prog_name="brickservo")
        except SystemExit as end:
            print("status", end.code)


def main():
    """The command line."""
    order_sets()  # as `python -m laptop` begins
    changes, commands = map(json.loads, sys.argv[1:])
    change(changes)
    for k, words in enumerate(changes.get("before", [])):
        run(words, Path(f"before-{k}"))
    for name in sorted(commands, reverse="before" in changes):
        run(commands[name], Path(name))


if __name__ == "__main__":
    main()
