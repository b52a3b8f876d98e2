"""The commands: `brickservo demo`, or `python -m brickservo demo`."""

import importlib
import sys

from . import open_packages


def run() -> None:
    """Run the command that was typed, and end this process with its status."""
    if sys.argv[0] == __file__:  # `-m`: a random.py of the folder that one is in is none of ours
        del sys.path[0]
    open_packages()
    importlib.import_module("laptop.cli.start").run()


if __name__ == "__main__":
    run()
