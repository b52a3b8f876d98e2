"""The one primitive under every lock of a program: a line in which its threads wait."""

import collections
from typing import Optional

MYPY = False
if MYPY:
    from typing import Deque  # noqa: F401

    from laptop.emulator.host.virtual_thread import VirtualThread
    from laptop.emulator.host.world import World


class Ticket(object):
    """A place in a waiting line."""

    __slots__ = ("thread", "called")

    def __init__(self, thread: "VirtualThread") -> None:
        self.thread = thread
        self.called = False


class WaitingLine(object):
    """Threads of the program waiting their turn.

    Args:
        world: World, on whose clock they wait.
    """

    def __init__(self, world: "World") -> None:
        self._world = world
        self._line = collections.deque()  # type: Deque[Ticket]

    def wait(self, timeout: Optional[float] = None) -> bool:
        """Stand in line; True when woken, False after `timeout` s (None: no limit)."""
        world = self._world
        me = world.current()
        assert me is not None  # only threads of the program wait
        ticket = Ticket(me)
        self._line.append(ticket)
        try:
            return world._wait(me, None if timeout is None else world.t + timeout, ticket)
        finally:
            if not ticket.called:
                self._line.remove(ticket)

    def wake(self) -> bool:
        """Wake the first in line; False when the line is empty."""
        if not self._line:
            return False
        with self._world._mutex:
            ticket = self._line.popleft()
            ticket.called = True
            if ticket.thread.ticket is ticket:
                self._world._run.wake_at(ticket.thread, self._world.t)
        return True
