"""How long pieces of work take: taken, and put into a table."""

import collections
import os

from robot.clock import Clock

NOTHING = "an empty lap"
"""The name of the piece that taking the time itself is."""


class Laps(object):
    """Takes the time of pieces of work.

    Attributes:
        taken: name -> list of s.
        marks: names of what ended, or "", one for each call of os.getppid, which nothing else here
            calls: a processor that is emulated counts its instructions between them.
    """

    def __init__(self):
        self.taken = collections.OrderedDict()
        self.marks = []
        self._clock = Clock()

    def begin(self):
        """Work begins."""
        self._mark("")
        self._since = self._clock.now()

    def end(self, name):
        """It was a piece of that name."""
        self.taken.setdefault(name, []).append(self._clock.now() - self._since)
        self._mark(name)

    def _mark(self, name):
        self.marks.append(name)
        os.getppid()

    def timed(self, name, work):
        """`work`, but each call is a piece; `name` may be worked out of what it returns."""

        def timed(*args):
            self.begin()
            result = work(*args)
            self.end(name(result) if callable(name) else name)
            return result

        return timed


def middle(values):
    """The median; of an even number the higher of the two in the middle."""
    return sorted(values)[len(values) // 2]


def table(taken):
    """Lines for people: of each piece how many, the median and the greatest, ms."""
    yield "{:<42}{:>6}{:>10}{:>10}".format("what, ms", "n", "median", "greatest")
    for name, laps in taken.items():
        if name:
            yield "{:<42}{:>6}{:>10.2f}{:>10.2f}".format(
                name, len(laps), 1000 * middle(laps), 1000 * max(laps)
            )
