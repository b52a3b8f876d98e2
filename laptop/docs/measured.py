"""What the documentation has measured: which benches, and their tables, kept beside the pages.

A record is JSON, one row of a table a line: so one sees which rows another version changes.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

from cogapp.cogapp import CogGeneratedError

from laptop.bench.bench import BenchTable, MachineLine
from laptop.cli import bench

FOLDER = Path(__file__).resolve().parent / "figures"
MEASURED: Mapping[str, str] = {
    "lines": "draw",
    "lines-in-space": "draw --arm spatial",
    "drawings": "plot",
    "planning": "planning",
    "servoing": "servo --seeds 1000:1050",
    "servoing-peers": "servo --method peer-broyden --method peer-kalman --method peer-rls "
    "--method peer-ibvs --arm planar --seeds 1000:1030",
    "servoing-look": "servo --mode look --method chain --seeds 1000:1050",
    "servoing-outliers": "servo outliers --method chain --seeds 1000:1050",
    "servoing-lego": "servo lego --method chain --seeds 1000:1050",
    "servoing-latency": "servo latency --method chain --seeds 1000:1030",
    "servoing-moving": "servo moving --method chain --method oracle --seeds 1000:1015",
    "servoing-programs": "servo programs --seeds 1000:1030",
    "servoing-programs-in-space": "servo programs --arm spatial --seeds 1000:1030",
    "servoing-in-space": "servo --arm spatial --seeds 1000:1030",
    "servoing-by-xyz": "servo --arm spatial --rows xyz --method chain --seeds 1000:1030",
    "tracking": "track",
    "calibration": "calibrate --seeds 9000:9020",
    "accuracy": "accuracy --seeds 6010:6012",
    "learning": "ilc --seeds 8100:8106",
    "learning-bounds": "ilc bounds --seeds 8300:8304",
    "learning-drawings": "ilc drawings --seeds 8300:8304",
}
"""By its name in the pages each bench, as it is typed after `brickservo bench`."""


class NotMeasured(CogGeneratedError):  # type: ignore[misc]
    """A page shows what no record holds; `str()` says what.  Cog tells it in one line."""


class Measurements(NamedTuple):
    """A bench, its tables, and the lines below them but for those on this machine's speed."""

    command: str
    tables: list[BenchTable]
    lines: list[str]


def measure(name: str) -> Measurements:
    """Run a bench anew, on all cores of this machine; a bar is shown meanwhile.

    Raises:
        ArmError: it cannot be run.
    """
    words = MEASURED[name].split()
    known = {one.name: one for one in bench.BENCHES}[words[0]]
    command = bench.command_of(known)
    with command.make_context(words[0], words[1:]) as context:
        it = SimpleNamespace(**context.params)
        record, results = bench.measure(known, it)
        shown = list(record.shown(results, it))
    tables = [part for part in shown if isinstance(part, BenchTable)]
    lines = [part for part in shown if isinstance(part, str) and not isinstance(part, MachineLine)]
    return Measurements(f"brickservo bench {MEASURED[name]}", tables, lines)


def read(name: str) -> Measurements:
    """Return what was measured last.

    Raises:
        NotMeasured: there is no such record.
    """
    file = FOLDER / f"{name}.json"
    if not file.is_file():
        raise NotMeasured(f"{name} has not been measured: python -m laptop.docs {name}")
    kept = json.loads(file.read_text("utf-8"))
    tables = [BenchTable(**table) for table in kept["tables"]]
    return Measurements(kept["command"], tables, kept["lines"])


def write(name: str, measured: Measurements) -> None:
    """Keep what was measured."""
    tables = [
        {**table._asdict(), "rows": [list(row) for row in table.rows]} for table in measured.tables
    ]
    text = json.dumps(measured._asdict() | {"tables": tables}, indent=1, ensure_ascii=False)
    flat = re.sub(r"\[[^\[\]{}]*\]", lambda found: re.sub(r"\n *", " ", found[0]), text)
    (FOLDER / f"{name}.json").write_text(flat + "\n", "utf-8")


def changes(before: Measurements, after: Measurements) -> Iterator[str]:
    """Yield each row and line that went or came; tables of this machine's speed are left out."""
    old, new = _lines(before), _lines(after)
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    for what, start, end, first, last in matcher.get_opcodes():
        if what != "equal":
            yield from (f"- {line}" for line in old[start:end])
            yield from (f"+ {line}" for line in new[first:last])


def _lines(measured: Measurements) -> list[str]:
    """Return all that comes out alike on every machine."""
    tables = (table for table in measured.tables if not table.of_this_machine)
    rows = [" | ".join(row) for table in tables for row in (table.headings, *table.rows)]
    return [measured.command, *rows, *measured.lines]
