"""Times of pieces of work ("laps"): taken, and put into a table."""

import collections
import os

from robot.clock import Clock

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Any, Callable, Dict, Iterator, List, Sequence, Union  # noqa: F401

EMPTY_LAP = "an empty lap"
"""Name of the lap that taking the time itself is."""


class Laps(object):
    """A stopwatch for pieces of work.

    Attributes:
        taken: name -> list of times, s.
        marks: names of laps that ended, or "", one for each call of os.getppid, which nothing else
            here calls: an emulated processor counts its instructions between them.
    """

    def __init__(self):
        # type: () -> None
        self.taken = collections.OrderedDict()  # type: Dict[str, List[float]]
        self.marks = []  # type: List[str]
        self._clock = Clock()

    def begin(self):
        # type: () -> None
        """Begin a lap."""
        self._mark("")
        self._since = self._clock.now()

    def end(self, name):
        # type: (str) -> None
        """End a lap of that name."""
        self.taken.setdefault(name, []).append(self._clock.now() - self._since)
        self._mark(name)

    def _mark(self, name):
        # type: (str) -> None
        self.marks.append(name)
        os.getppid()

    def timed(self, name, work):
        # type: (Union[str, Callable[[Any], str]], Callable[..., Any]) -> Callable[..., Any]
        """Return `work` with each call a lap; `name` may be a function of what it returns."""

        def timed(*args):
            # type: (*Any) -> Any
            self.begin()
            result = work(*args)
            self.end(name(result) if callable(name) else name)
            return result

        return timed


def middle(values):
    # type: (Sequence[float]) -> float
    """Return the median; of an even number the higher of the two in the middle."""
    return sorted(values)[len(values) // 2]


def table(taken):
    # type: (Dict[str, List[float]]) -> Iterator[str]
    """Yield lines for people: of each lap the number, the median and the greatest, ms."""
    yield "{:<42}{:>6}{:>10}{:>10}".format("what, ms", "n", "median", "greatest")
    for name, laps in taken.items():
        if name:
            yield "{:<42}{:>6}{:>10.2f}{:>10.2f}".format(
                name, len(laps), 1000 * middle(laps), 1000 * max(laps)
            )
