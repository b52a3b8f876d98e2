"""The log of visual_servoing.py, read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from laptop.record.run import MAX_NUMBER, DamagedRun
from shared.config_files import InvalidFile, read_text

MAX_BYTES = 20_000_000
"""Greatest size of a log, bytes."""


class Log(NamedTuple):
    """Log of the servo: settings, observations, steps, remarks; the verdict if it came."""

    run: dict[str, Any]
    seen: list[dict[str, Any]]
    steps: list[dict[str, Any]]
    notes: list[dict[str, Any]]
    verdict: dict[str, Any] | None


def is_log(file: Path) -> bool:
    """Return whether a file begins as a log of visual_servoing.py."""
    try:
        with file.open("rb") as opened:
            return opened.read(20).replace(b" ", b"").startswith(b'{"kind":"run"')
    except OSError:
        return False


def read_log(file: Path) -> Log:
    """Read a log of JSON lines; a truncated last line is left out.

    Raises:
        DamagedRun: it is none.
    """
    kinds: dict[str, list[dict[str, Any]]] = {}
    try:
        if file.is_symlink():
            raise InvalidFile("is a link")
        for line in read_text(str(file), MAX_BYTES).split("\n")[:-1]:
            entry = _values(line, file.name)
            kinds.setdefault(entry["kind"], []).append(entry)
    except DamagedRun:
        raise
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        raise DamagedRun(
            f"{file.name} is no whole log of visual_servoing.py; do this run again"
        ) from None
    runs, verdicts = kinds.get("run", []), kinds.get("verdict", [])
    return Log(
        runs[0] if runs else {},
        kinds.get("seen", []),
        kinds.get("step", []),
        kinds.get("note", []),
        verdicts[-1] if verdicts else None,
    )


def _values(text: str, name: str) -> Any:
    """Return the value of a JSON text; NaN and Infinity are numbers in it.

    Raises:
        DamagedRun: a number is greater than MAX_NUMBER.
        ValueError, RecursionError: it is no JSON.
    """

    def bounded(read: Callable[[str], float]) -> Callable[[str], float]:
        def number(digits: str) -> float:
            if abs(float(digits)) > MAX_NUMBER:
                raise DamagedRun(
                    f"{name} holds {digits[:20]}, which is beyond all that a run measures"
                )
            return read(digits)

        return number

    return json.loads(text, parse_float=bounded(float), parse_int=bounded(int))
