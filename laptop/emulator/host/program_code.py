"""Modules that are the program's own, and their code, with counts where it is charged."""

import importlib.machinery
from types import CodeType
from typing import Optional

from laptop.emulator.host import counting

MYPY = False
if MYPY:
    from typing import Any, Dict, Tuple  # noqa: F401

    Key = Tuple[str, bool, Tuple[Tuple[str, Any], ...]]  # path, whether it counts, its stats

PROGRAM = ("ev3dev2", "ev3dev", "robot", "shared")
"""Packages on the program's side: never shared with the host."""


def top_of(name: str) -> str:
    """Return the package of a module, by its name."""
    return name.partition(".")[0]


_CODES = {}  # type: Dict[Key, Optional[CodeType]]


def code_of(
    loader: importlib.machinery.SourceFileLoader, name: str, counts: bool
) -> Optional[CodeType]:
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
