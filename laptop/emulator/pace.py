"""Clock of an emulated world in real time, one for all the processes that live in it.

It goes with the wall's clock, and waits for whoever is late. With p_k the promise of member k (a
brick, a synthetic camera), the time until which nothing more of it happens:

    now = min(wall - lag, p_1, ..., p_n)

So no promise is ever overtaken. This is the conservative synchronisation of distributed simulation;
a promise is a null message with its lookahead (Chandy and Misra, Distributed simulation, IEEE
Trans. Software Eng. 5, 1979). The optimistic way, Time Warp (Jefferson 1985), would have to roll
back: a picture that people have seen cannot be taken back.

A busy computer so slows down the whole world, brick, camera and physics alike, and nothing in it is
late. A delay below MAX_CATCH_UP is caught up with; the rest goes into `lag`, and shows as pace
below 1.

The clock is a small file in the state folder, mapped by all.  A lock on a byte of it says that a
member lives: whoever is killed keeps nobody waiting.
"""

import collections
import contextlib
import math
import mmap
import os
import struct
import threading
import time as wall
from typing import Iterator, Optional, Tuple

from laptop.system import platforms
from shared.state import CLOCK_FILE as FILE
from shared.state import state_folder

MYPY = False
if MYPY:
    from typing import Any, Deque, Dict, List, Protocol, Set  # noqa: F401

    class Ticking(Protocol):
        """Clock with a `now()`, s."""

        def now(self) -> float:
            """Return it."""


MAX_CATCH_UP = 0.25
"""Greatest delay that is caught up with, s."""

PACE_WINDOW = 5.0
"""Window over which the pace is measured, wall s."""

BUSY_PACE = 0.9
"""Pace below which people are told that the computer is busy."""

POLL_PERIOD = 0.001
"""Period of the checks whether a late member has kept its promise, wall s."""

MAX_MEMBERS = 16
_NAME_LENGTH = 40
_MAGIC = b"BSCLOCK1"
_LAG = struct.Struct("=d")
_PROMISES = struct.Struct("={}d".format(MAX_MEMBERS))
_LAG_AT, _PROMISES_AT = 8, 16
_NAMES_AT = _PROMISES_AT + _PROMISES.size
_SIZE = _NAMES_AT + MAX_MEMBERS * _NAME_LENGTH


class _File(object):
    """The mapped file; one for each process, because closing another one would lose its locks."""

    _open = {}  # type: Dict[Any, _File]  # by what is on the disk; one of our own by itself
    _opening = threading.Lock()

    def __init__(self, path: str) -> None:
        self.users = 0
        self.mine = set()  # type: Set[int]
        self._thread = threading.RLock()
        self.descriptor = None  # type: Optional[int]
        try:
            os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
            self.descriptor = platforms.open_to_share(path)
            with self.locked():
                os.lseek(self.descriptor, 0, os.SEEK_SET)  # what has no beginning is no file
                begin = os.read(self.descriptor, len(_MAGIC))
                if begin != _MAGIC or os.fstat(self.descriptor).st_size != _SIZE:
                    os.ftruncate(self.descriptor, _SIZE)
                    os.lseek(self.descriptor, 0, os.SEEK_SET)
                    os.write(self.descriptor, self._blank())
            self.map = mmap.mmap(self.descriptor, _SIZE)
        except OSError:  # a clock of our own: nobody else can be in a world that cannot be written
            if self.descriptor is not None:
                os.close(self.descriptor)
                self.descriptor = None
            self.map = mmap.mmap(-1, _SIZE)
            self.map[:] = self._blank()

    @staticmethod
    def _blank() -> bytes:
        promises = _PROMISES.pack(*[math.inf] * MAX_MEMBERS)
        return _MAGIC + _LAG.pack(0.0) + promises + bytes(MAX_MEMBERS * _NAME_LENGTH)

    @classmethod
    def shared(cls, path: str) -> "_File":
        """Return the file at `path`, opened if this process has not yet done so."""
        with cls._opening:
            key = cls._key(path)  # type: Any
            if key is None or key not in cls._open:
                file = cls(path)
                key = cls._key(path) if file.descriptor is not None else file
                cls._open[key] = file
            cls._open[key].users += 1
            return cls._open[key]

    @staticmethod
    def _key(path: str) -> Optional[Tuple[int, int]]:
        try:
            found = os.stat(path)
        except OSError:
            return None
        return found.st_dev, found.st_ino

    def drop(self) -> None:
        """Close it if nobody in this process uses it any more."""
        with self._opening:
            self.users -= 1
            if self.users:
                return
            for key in [key for key, file in self._open.items() if file is self]:
                del self._open[key]
            self.map.close()
            if self.descriptor is not None:
                os.close(self.descriptor)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the file for a `with` block: nobody else changes it meanwhile."""
        with self._thread:
            if self.descriptor is not None:
                platforms.lock_byte(self.descriptor, 0, wait=True)
            try:
                yield
            finally:
                if self.descriptor is not None:
                    platforms.unlock_byte(self.descriptor, 0)

    def _lives(self, k: int) -> bool:
        """Return True if the process of member `k` lives."""
        if k in self.mine or self.descriptor is None:
            return k in self.mine
        try:
            if not platforms.lock_byte(self.descriptor, 1 + k):
                return True
        except OSError:
            return True
        platforms.unlock_byte(self.descriptor, 1 + k)
        return False

    # What stands in it

    @property
    def lag(self) -> float:
        """Delay behind the wall's clock, s."""
        (lag,) = _LAG.unpack_from(self.map, _LAG_AT)  # type: Tuple[float]
        return lag

    @property
    def promises(self) -> Tuple[float, ...]:
        """Per member, until when nothing more of it happens, s; inf where there is none."""
        return _PROMISES.unpack_from(self.map, _PROMISES_AT)

    def promise(self, k: int, t: float) -> None:
        """Promise that member `k` does nothing before `t`, s."""
        _LAG.pack_into(self.map, _PROMISES_AT + k * _LAG.size, t)

    def settle(self) -> float:
        """Add to the lag what is not caught up with; return the time now, s.  Call it locked."""
        while True:
            promises = self.promises
            limit = min(promises)
            now = wall.monotonic() - self.lag
            if now - limit <= MAX_CATCH_UP:
                return min(now, limit)
            latest = promises.index(limit)
            if not self._lives(latest):
                self.promise(latest, math.inf)
                continue
            _LAG.pack_into(self.map, _LAG_AT, self.lag + now - limit - MAX_CATCH_UP)
            return limit

    def join(self, name: str) -> Optional[int]:
        """Return the number of a new member, whose promise is now; None if there is no room."""
        alive = [k for k in range(MAX_MEMBERS) if self._lives(k)]
        if not alive:
            _LAG.pack_into(self.map, _LAG_AT, 0.0)
        free = [k for k in range(MAX_MEMBERS) if k not in alive]
        for k in free:
            self.promise(k, math.inf)
        if not free:
            return None
        k = free[0]
        self.promise(k, self.settle())
        text = "{} (process {})".format(name, os.getpid()).encode("ascii", "replace")[:_NAME_LENGTH]
        self.map[_NAMES_AT + k * _NAME_LENGTH : _NAMES_AT + (k + 1) * _NAME_LENGTH] = text.ljust(
            _NAME_LENGTH, b"\0"
        )
        if self.descriptor is not None:
            platforms.lock_byte(self.descriptor, 1 + k, wait=True)  # nobody has it: it is free
        self.mine.add(k)
        return k

    def leave(self, k: int) -> None:
        """Remove member `k`."""
        self.promise(k, math.inf)
        if self.descriptor is not None:
            platforms.unlock_byte(self.descriptor, 1 + k)
        self.mine.discard(k)

    def name(self, k: int) -> str:
        """Return the name of member `k`, for people."""
        start = _NAMES_AT + k * _NAME_LENGTH
        return self.map[start : start + _NAME_LENGTH].rstrip(b"\0").decode("ascii")


class PacedClock(object):
    """The world's clock, as one of its processes sees it.

    Args:
        folder: whose processes share it; None takes the state folder.
    """

    def __init__(self, folder: Optional[str] = None) -> None:
        self._file = _File.shared(os.path.join(folder or state_folder(), FILE))

    def now(self) -> float:
        """Return the seconds since some moment, the same for every process of the world."""
        file = self._file
        limit = min(file.promises)
        now = wall.monotonic() - file.lag
        if now <= limit:
            return now
        if now - limit > MAX_CATCH_UP:
            with file.locked():
                return file.settle()
        return limit

    def sleep_until(self, t: float) -> None:
        """Wait until the clock shows `t`, s: for a member, no later than what it has promised."""
        while self.now() < t:
            wall.sleep(self.worth_waiting(t))

    def worth_waiting(self, until: float) -> float:
        """Return the wall seconds that it takes at least until the clock shows `until` (s)."""
        return max(until - (wall.monotonic() - self._file.lag), POLL_PERIOD)

    def join(self, name: str) -> "Member":
        """Let the world wait for a new Member from now on.

        Args:
            name: for people.
        """
        with self._file.locked():
            return Member(self, self._file, self._file.join(name))

    @property
    def latest(self) -> str:
        """Name of whom the clock waits for just now; "" for nobody."""
        promises = self._file.promises
        limit = min(promises)
        if wall.monotonic() - self._file.lag <= limit:
            return ""
        return self._file.name(promises.index(limit))

    def close(self) -> None:
        """Let go of the file."""
        self._file.drop()


class Member(object):
    """Member for whom the world waits.

    Args:
        number: None for one who found no room, and whom nobody waits for.
    """

    def __init__(self, clock: PacedClock, file: _File, number: Optional[int]) -> None:
        self._clock = clock
        self._file = file
        self._number = number
        self._promised = -math.inf

    def promise(self, t: float) -> None:
        """Promise that nothing of this member happens before `t`, s; a later promise stays."""
        if self._number is None or t <= self._promised:
            return
        self._promised = t
        with self._file.locked():
            self._file.settle()
            self._file.promise(self._number, t)

    def leave(self) -> None:
        """Let nobody wait for this member any more."""
        if self._number is not None:
            with self._file.locked():
                self._file.leave(self._number)
            self._number = None


class PaceMeter(object):
    """Meter of the pace of a PacedClock: emulated seconds per second of the wall's clock.

    A sample counts as one second at most: while this process itself stands still, nothing is known.

    Args:
        clock: has `now()`.
        window: over which the latest pace is measured, wall s.
    """

    MIN_INTERVAL, MAX_INTERVAL = 0.1, 1.0
    """Bounds of the time between two samples, wall s."""

    def __init__(self, clock: "Ticking", window: float = PACE_WINDOW) -> None:
        self._clock = clock
        self._window = window
        self._last = None  # type: Optional[Tuple[float, float]]
        self._samples = collections.deque()  # type: Deque[List[float]]
        self._sums = [0.0, 0.0]
        self.latest = 1.0

    def sample(self) -> float:
        """Sample the clock; return the pace over the last window, 1 until that is over."""
        now = self._clock.now(), wall.monotonic()
        if self._last is not None and now[1] - self._last[1] < self.MIN_INTERVAL:
            return self.latest
        if self._last is not None:
            passed = [after - before for before, after in zip(self._last, now)]
            if passed[1] > self.MAX_INTERVAL:
                passed = [each * self.MAX_INTERVAL / passed[1] for each in passed]
            self._samples.append(passed)
            self._sums = [a + b for a, b in zip(self._sums, passed)]
            while sum(each[1] for each in self._samples) - self._samples[0][1] >= self._window:
                self._samples.popleft()
        self._last = now
        emulated, real = (sum(each[k] for each in self._samples) for k in (0, 1))
        if real >= self._window:
            self.latest = emulated / real
        return self.latest

    @property
    def mean(self) -> float:
        """Mean pace since the first sample."""
        return self._sums[0] / self._sums[1] if self._sums[1] else 1.0


def in_words(pace: float) -> str:
    """Return what people are told about a pace below BUSY_PACE."""
    return "this computer is busy: running at {:.2g} x".format(pace)
