"""The record of a bench, and functions that all of them need for cases and results."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from laptop.bench import workers
from shared.arm_description import ArmError

C = TypeVar("C")
R = TypeVar("R")
K = TypeVar("K", bound=Hashable)

Row = Sequence[str]


class BadBench(ArmError):
    """Options of a bench that do not go together."""


class BenchTable(NamedTuple):
    """A table to be shown, a rule wherever one of the first `sections` columns changes.

    of_this_machine: it tells how fast this machine is, and so comes out otherwise each time.
    """

    title: str
    headings: Row
    rows: Sequence[Row]
    sections: int = 0
    of_this_machine: bool = False


class MachineLine(str):
    """A line below the tables that tells how fast this machine is."""

    __slots__ = ()


def as_dicts(results: Iterable[Any]) -> Any:
    """Return the results for JSON, field by field."""
    return [asdict(one) for one in results]


@dataclass(frozen=True)
class BenchRecord(Generic[C, R]):
    """One bench.  `it` holds the command's options, by their names.

    Attributes:
        doing: a word for the work, beside the bar.
        cases: `it` -> the cases.
        work: case -> result, in another process: a function of a module.
        shown: gathered results and `it` -> the tables, and lines below them.
        figures: gathered results -> the value that --json prints.
        gather: results of the cases and `it` -> gathered ones; may measure more, on this machine.
        in_turn: cases -> results, in this process, in the place of `work`.
        chunk: number of cases that go to a process at a time.
        holds: gathered results -> whether all is as it should be; else the status is 1.
    """

    doing: str
    cases: Callable[[Any], Sequence[C]]
    work: Callable[[C], R] | None
    shown: Callable[[Any, Any], Iterable[BenchTable | str]]
    figures: Callable[[Any], Any] = as_dicts
    gather: Callable[[list[R], Any], Any] = lambda results, it: results
    in_turn: Callable[[Sequence[C]], Iterator[R]] | None = None
    chunk: int = 1
    holds: Callable[[Any], bool] = lambda results: True

    def run(self, cases: Sequence[C], executor: Executor | None = None) -> Iterator[R]:
        """Yield the results of the cases in their order.

        Args:
            cases: of this bench.
            executor: does the work; None for all cores of this machine.
        """
        if self.in_turn:
            return self.in_turn(cases)
        assert self.work
        return workers.map_cases(self.work, cases, self.chunk, executor)


def flat(parts: Iterable[Iterable[R]], it: Any = None) -> list[R]:
    """Gather results that come several a case."""
    return [result for part in parts for result in part]


def grouped(results: Iterable[R], key: Callable[[R], K]) -> dict[K, list[R]]:
    """Return the results by some key, in the order in which the keys come."""
    groups: dict[K, list[R]] = {}
    for result in results:
        groups.setdefault(key(result), []).append(result)
    return groups


def seeds_of(it: Any) -> str:
    """Return the seeds as they were typed."""
    return f"seeds {it.seeds.start}:{it.seeds.stop}"


def percentile(values: Sequence[float], q: int) -> float:
    """Return a percentile that is one of the values."""
    return float(np.percentile(values, q, method="higher"))


def spread(values: Sequence[float], digits: int, *quantiles: int) -> str:
    """Return percentiles with a stroke between them, by default the median and the 95th."""
    return "/".join(f"{percentile(values, q):.{digits}f}" for q in quantiles or (50, 95))


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Discard the output of scripts in a `with` block, and let them have no keyboard.

    A script that polls a keyboard computes longer, and what it is asked meanwhile comes earlier.
    """
    keyboard = sys.stdin
    with open(os.devnull) as nothing, contextlib.redirect_stdout(io.StringIO()):
        sys.stdin = nothing  # as in the processes of a bench
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                yield
        finally:
            sys.stdin = keyboard
