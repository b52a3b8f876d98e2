"""Mutants: single safety-relevant lines broken one at a time, and which test notices.

In a copy of the checkout one line is replaced by a wrong one, the tests named for it are run as
`.ci/run` does, and the line is restored (mutation testing; DeMillo, Lipton and Sayward, 1978).  At
first all of these tests run unbroken: a test that fails anyway would kill any mutant.
"""

from __future__ import annotations

import itertools
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laptop.bench.bench import BadBench, BenchRecord, BenchTable
from laptop.emulator.bundled_scripts import REPO_ROOT
from tests.claims.mutant_list import MUTANTS, Mutant

COPIED = ("robot", "shared", "laptop", "tests", "pyproject.toml", "README.md")
"""Entries of the checkout that the tests need."""

TIMEOUT = 1800.0
"""Longest time of the tests of a mutant, s."""

FAILED, PASSED = 1, 0
"""Exit status of pytest where a test failed, and where all passed; others mean that none ran."""

UNBROKEN = Mutant(
    "", "nothing", "", "", "", tuple(dict.fromkeys(path for one in MUTANTS for path in one.tests))
)
"""No mutant, and all tests of all."""


class LineGone(BadBench):
    """A line of source that is not to be found, or several times."""


@dataclass(frozen=True)
class MutantResult:
    """Result of one mutant, or of none.

    Attributes:
        group: as of the Mutant; "" of none.
        what: is broken.
        file: of the line.
        test: that failed first; "" where none did.
        ended: "failed", "passed", "timed out", or the last line of a pytest that ran no test.
        seconds: that its tests took, s.
        is_kept: whether it is as it should be: a mutant fails a test, and none fails no test.
    """

    group: str
    what: str
    file: str
    test: str
    ended: str
    seconds: float
    is_kept: bool


def position(mutant: Mutant, source: str) -> int:
    """Return the index of the mutant's line among the lines of its file.

    Raises:
        LineGone: there is not exactly one such line.
    """
    found = [k for k, line in enumerate(source.splitlines()) if line.strip() == mutant.line]
    if len(found) != 1:
        raise LineGone(
            f"{mutant.file} has {len(found)} lines '{mutant.line}', not one: the code has changed; "
            "name the line that guards this now in tests/claims/mutant_list.py"
        )
    return found[0]


def mutated(mutant: Mutant, source: str) -> str:
    """Return the source of the mutant's file with its line replaced."""
    k, lines = position(mutant, source), source.splitlines(keepends=True)
    lines[k] = lines[k].replace(mutant.line, mutant.mutant)
    return "".join(lines)


class Checkout:
    """A copy of the checkout in which lines are broken.

    Args:
        folder: where it is made.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        for name in COPIED:
            source = Path(REPO_ROOT) / name
            if source.is_dir():
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, folder / name, ignore=ignored, symlinks=True)
            else:
                shutil.copy2(source, folder / name)
        # Bytecode is taken for that of a source with the same size and second.
        self._seconds = itertools.count(int(time.time()))

    def run(self, mutant: Mutant) -> MutantResult:
        """Break one line, run the tests, and restore it.

        Raises:
            LineGone: see `position`.
        """
        if not mutant.file:
            return self._tried(mutant)
        file = self._folder / mutant.file
        source = file.read_text(encoding="utf-8")
        self._write(file, mutated(mutant, source))
        try:
            return self._tried(mutant)
        finally:
            self._write(file, source)

    def _write(self, file: Path, source: str) -> None:
        file.write_text(source, encoding="utf-8")
        second = next(self._seconds)
        os.utime(file, (second, second))

    def _tried(self, mutant: Mutant) -> MutantResult:
        options = ("-x", "-q", "-n", "0", "-rfE", "--tb=no")
        marked = ("-m", "not claims and not browser")
        command = [sys.executable, "-m", "pytest", *options, *marked, *mutant.tests]
        began, out = time.monotonic(), ""
        try:
            done = subprocess.run(
                command, cwd=self._folder, capture_output=True, text=True, timeout=TIMEOUT
            )
            status, out = done.returncode, done.stdout + done.stderr
            ended = {FAILED: "failed", PASSED: "passed"}.get(status) or last_line(out)
        except subprocess.TimeoutExpired:
            status, ended = -1, "timed out"
        wanted = FAILED if mutant.file else PASSED
        seconds = time.monotonic() - began
        return MutantResult(
            mutant.group, mutant.what, mutant.file, failed_test(out), ended, seconds,
            status == wanted,
        )  # fmt: skip


def failed_test(out: str) -> str:
    """Return the first test that failed, by pytest's short summary; "" if there is none."""
    found = re.search(
        r"^(?:FAILED|ERROR) (?:\S*?/)*(\w+\.py::\w+(?:\[.*?\])?)(?: - .*)?$", out, re.MULTILINE
    )
    return found[1] if found else ""


def last_line(out: str) -> str:
    """Return the last line that says something."""
    return next((line for line in reversed(out.splitlines()) if line.strip()), "no word")


def run(mutants: Sequence[Mutant]) -> Iterator[MutantResult]:
    """Yield the results of mutants in their order; each core has a copy of the checkout.

    Raises:
        LineGone: a line is not there; no test has run.
    """
    for mutant in mutants:
        if mutant.file:
            position(mutant, (Path(REPO_ROOT) / mutant.file).read_text(encoding="utf-8"))
    copies: queue.Queue[Checkout] = queue.Queue()

    def tried(mutant: Mutant) -> MutantResult:
        copy = copies.get()
        try:
            return copy.run(mutant)
        finally:
            copies.put(copy)

    cores = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(cores) as pool:
        for k in range(cores):
            copies.put(Checkout(Path(folder) / str(k)))
        try:
            yield from pool.map(tried, mutants)
        finally:
            pool.shutdown(cancel_futures=True)


HEADINGS = ("guards", "what is broken", "in", "killed by", "s")


def table(results: Sequence[MutantResult]) -> list[list[str]]:
    """A row for each mutant."""
    return [
        [r.group, r.what, r.file, r.test if r.ended == "failed" else f"SURVIVES: {r.ended}",
         f"{r.seconds:.0f}"]
        for r in results
        if r.file
    ]  # fmt: skip


def summary(results: Sequence[MutantResult]) -> str:
    """Return the line below the table."""
    mutants = [r for r in results if r.file]
    lines = [f"{sum(r.is_kept for r in mutants)} of {len(mutants)} are killed."]
    for r in results:
        if not r.file:
            named = f" at {r.test}" if r.test else ""
            lines.append(f"Unbroken the tests {r.ended}{named} ({r.seconds:.0f} s).")
    return " ".join(lines)


def _cases(it: Any) -> list[Mutant]:
    chosen = [one for one in MUTANTS if one.group in it.groups or not it.groups]
    paths = tuple(dict.fromkeys(path for one in chosen for path in one.tests))
    return [UNBROKEN._replace(tests=paths), *chosen]


BENCH = BenchRecord(
    "breaking",
    _cases,
    None,
    lambda results, it: [
        BenchTable("lines broken one at a time", HEADINGS, table(results), 1),
        summary(results),
    ],
    in_turn=run,
    holds=lambda results: all(r.is_kept for r in results),
)
