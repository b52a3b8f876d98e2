"""Queue of events by their time, such as those of a world, or the wake-ups of threads."""

import heapq
import math
from typing import Generic, Optional, TypeVar

MYPY = False
if MYPY:
    from typing import List, Tuple  # noqa: F401

What = TypeVar("What")


class QueuedEvent(Generic[What]):
    """An event of a queue.

    Attributes:
        t: its time, s.
        what: its contents; None once it is cancelled, which leaves its place.
    """

    __slots__ = ("t", "what")

    def __init__(self, t: float, what: What) -> None:
        self.t = t
        self.what = what  # type: Optional[What]


class EventQueue(Generic[What]):
    """Events in order of time; those of one time in the order in which they were added."""

    def __init__(self) -> None:
        self._heap = []  # type: List[Tuple[float, int, QueuedEvent[What]]]
        self._added = 0

    def __len__(self) -> int:
        return len(self._heap)

    def add(self, t: float, what: What) -> QueuedEvent[What]:
        """Add an event at `t`, s."""
        event = QueuedEvent(t, what)
        self._added += 1
        heapq.heappush(self._heap, (t, self._added, event))
        return event

    @property
    def first_t(self) -> float:
        """Time of the first event, s, cancelled or not; inf if there is none."""
        return self._heap[0][0] if self._heap else math.inf

    @property
    def first(self) -> Optional[QueuedEvent[What]]:
        """First event, cancelled or not; None if there is none."""
        return self._heap[0][2] if self._heap else None

    def pop(self) -> QueuedEvent[What]:
        """Remove and return the first event."""
        return heapq.heappop(self._heap)[2]

    def drop_cancelled(self) -> None:
        """Remove cancelled events from the head of the queue."""
        while self._heap and self._heap[0][2].what is None:
            heapq.heappop(self._heap)

    def has_pending(self) -> bool:
        """Return True if there is an event that is not cancelled."""
        return any(event.what is not None for _, _, event in self._heap)
