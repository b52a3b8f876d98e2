"""Agenda of what is due at which time, such as events of a world, and threads that sleep."""

import heapq
import math
from typing import Generic, Optional, TypeVar

MYPY = False
if MYPY:
    from typing import List, Tuple  # noqa: F401

What = TypeVar("What")


class Due(Generic[What]):
    """Something on an agenda.

    Attributes:
        t: when it is due, s.
        what: what is due; None once it has been taken back, which leaves its place.
    """

    __slots__ = ("t", "what")

    def __init__(self, t: float, what: What) -> None:
        self.t = t
        self.what = what  # type: Optional[What]


class Agenda(Generic[What]):
    """Whatever is due, by time; of what is due at one time the first that was added."""

    def __init__(self) -> None:
        self._heap = []  # type: List[Tuple[float, int, Due[What]]]
        self._added = 0

    def __len__(self) -> int:
        return len(self._heap)

    def add(self, t: float, what: What) -> Due[What]:
        """Add what is due at `t`, s."""
        due = Due(t, what)
        self._added += 1
        heapq.heappush(self._heap, (t, self._added, due))
        return due

    @property
    def first_t(self) -> float:
        """When the first is due, s, be it taken back or not; inf if there is none."""
        return self._heap[0][0] if self._heap else math.inf

    @property
    def first(self) -> Optional[Due[What]]:
        """The first, be it taken back or not; None if there is none."""
        return self._heap[0][2] if self._heap else None

    def pop(self) -> Due[What]:
        """Take off the first."""
        return heapq.heappop(self._heap)[2]

    def skip_taken_back(self) -> None:
        """Let none be the first that has been taken back."""
        while self._heap and self._heap[0][2].what is None:
            heapq.heappop(self._heap)

    def holds_any(self) -> bool:
        """Return True if there is anything that has not been taken back."""
        return any(due.what is not None for _, _, due in self._heap)
