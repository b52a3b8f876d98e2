"""The modules that are the program's own, and their code, with counts where it is charged."""

import importlib.machinery

from laptop.emulator.host import counting

PROGRAM = ("ev3dev2", "ev3dev", "robot", "shared")
"""Packages on the program's side: never shared with the host."""


def top_of(name):
    """Return the package of a module, by its name."""
    return name.partition(".")[0]


_CODES = {}  # type: dict


def code_of(loader, name, counts):
    """Return the code of a module, compiled once for all runs as long as its file is the same.

    Args:
        loader: SourceFileLoader of the module.
        name: of the module.
        counts: whether the code is to count its instructions.
    """
    path = loader.get_filename(name)
    key = path, counts, tuple(sorted(loader.path_stats(path).items()))
    if key not in _CODES:
        if counts:
            _CODES[key] = counting.compiled(loader.get_data(path), path)
        else:
            _CODES[key] = super(importlib.machinery.SourceFileLoader, loader).get_code(name)
    return _CODES[key]
