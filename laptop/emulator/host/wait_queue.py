"""Wait queue, the one primitive under every lock of a program."""

import collections
from typing import Optional

MYPY = False
if MYPY:
    from typing import Deque  # noqa: F401

    from laptop.emulator.host.virtual_thread import VirtualThread
    from laptop.emulator.host.world import World


class Waiter(object):
    """A thread in a wait queue, and whether it has been woken."""

    __slots__ = ("thread", "woken")

    def __init__(self, thread: "VirtualThread") -> None:
        self.thread = thread
        self.woken = False


class WaitQueue(object):
    """Threads of the program that wait, first come, first served.

    Args:
        world: World, on whose clock they wait.
    """

    def __init__(self, world: "World") -> None:
        self._world = world
        self._waiters = collections.deque()  # type: Deque[Waiter]

    def wait(self, timeout: Optional[float] = None) -> bool:
        """Wait in the queue; True when woken, False after `timeout` s (None: no limit)."""
        world = self._world
        me = world.current()
        assert me is not None  # only threads of the program wait
        waiter = Waiter(me)
        self._waiters.append(waiter)
        try:
            return world._wait(me, None if timeout is None else world.t + timeout, waiter)
        finally:
            if not waiter.woken:
                self._waiters.remove(waiter)

    def wake(self) -> bool:
        """Wake the first; False when the queue is empty."""
        if not self._waiters:
            return False
        with self._world._mutex:
            waiter = self._waiters.popleft()
            waiter.woken = True
            if waiter.thread.waiter is waiter:
                self._world._run.wake_at(waiter.thread, self._world.t)
        return True
