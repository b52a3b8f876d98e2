"""The modules `time` and `datetime` on the world's clock, for a program.

Rule: a read of the clock costs time, so that polling loops end; it is free outside the program.
"""

import datetime as real_datetime
import time as real_time
import types
from typing import Callable, Optional

MYPY = False
if MYPY:
    from typing import Any, Tuple, Union

    from laptop.emulator.host.world import World

    TimeParts = Union[Tuple[int, int, int, int, int, int, int, int, int], real_time.struct_time]

CLOCK_COST = 20e-6
"""Cost of reading a clock, taking a lock or asking a thread's state, s."""

EPOCH = 1586476800.0
"""Time of day at virtual time 0, s since 1970."""

UPTIME = 100.0
"""Time since the brick was switched on at virtual time 0, s."""


def copy_module(module: types.ModuleType, **others: object) -> types.ModuleType:
    """Copy a module; `others` replace its names or add to them."""
    shim = types.ModuleType(module.__name__)
    vars(shim).update(vars(module), **others)
    return shim


class ProgramClock(object):
    """Readings of the world's clock by a program.  They are free for other callers."""

    def __init__(self, world: "World") -> None:
        self._world = world

    def step(self, cost: float = CLOCK_COST) -> None:
        """Spend time, s."""
        if self._world.current() is not None:
            self._world.touch(cost)

    def sleep(self, seconds: float) -> None:
        """Wait, s."""
        self._world.sleep(seconds)

    def time(self) -> float:
        """Return the seconds since 1970."""
        self.step()
        return EPOCH + self._now()

    def monotonic(self) -> float:
        """Return the seconds since the brick was switched on."""
        self.step()
        return UPTIME + self._now()

    def busy(self) -> float:
        """Return the seconds that the program has computed."""
        self.step()
        return self._world.busy + self._behind()

    def _now(self) -> float:
        return self._world.now() + self._behind()

    def _behind(self) -> float:
        """Return the duration of its start, which the world's clock leaves out, s."""
        return self._world.processor.behind if self._world.processor else 0.0


def _in_nanoseconds(read: Callable[[], float]) -> Callable[[], int]:
    def read_ns() -> int:
        return int(round(read() * 1e9))

    return read_ns


def time_module(clock: ProgramClock) -> types.ModuleType:
    """Make a `time` module."""

    def sleep(secs: float) -> None:
        """Wait `secs` of virtual time."""
        if secs < 0:
            raise ValueError("sleep length must be non-negative")
        clock.step()
        clock.sleep(secs)

    def clock_gettime(clk_id: int) -> float:
        """Time of one of the system's clocks, s."""
        return clock.time() if clk_id == real_time.CLOCK_REALTIME else clock.monotonic()

    def localtime(secs: Optional[float] = None) -> real_time.struct_time:
        """Parts of a local time, of now if none is given."""
        return real_time.localtime(clock.time() if secs is None else secs)

    def gmtime(secs: Optional[float] = None) -> real_time.struct_time:
        """Parts of a time in UTC, of now if none is given."""
        return real_time.gmtime(clock.time() if secs is None else secs)

    def ctime(secs: Optional[float] = None) -> str:
        """Return a time as text, of now if none is given."""
        return real_time.ctime(clock.time() if secs is None else secs)

    def asctime(t: "Optional[TimeParts]" = None) -> str:
        """Parts of a time as text, of now if none are given."""
        return real_time.asctime(localtime() if t is None else t)

    def strftime(format: str, t: "Optional[TimeParts]" = None) -> str:
        """Parts of a time as text by a format, of now if none are given."""
        return real_time.strftime(format, localtime() if t is None else t)

    seconds = {
        "time": clock.time,
        "monotonic": clock.monotonic,
        "perf_counter": clock.monotonic,
        "process_time": clock.busy,
        "thread_time": clock.busy,
    }
    shim = copy_module(
        real_time,
        sleep=sleep,
        clock_gettime=clock_gettime,
        clock_gettime_ns=lambda clk_id: int(round(clock_gettime(clk_id) * 1e9)),
        clock=clock.busy,  # gone since Python 3.8, but on the brick
        localtime=localtime,
        gmtime=gmtime,
        ctime=ctime,
        asctime=asctime,
        strftime=strftime,
        **seconds,
    )
    for name, read in seconds.items():
        setattr(shim, name + "_ns", _in_nanoseconds(read))
    for name, value in list(vars(shim).items()):
        if isinstance(value, types.FunctionType):
            setattr(shim, name, Builtin(value))
    return shim


class Builtin(object):
    """A function that, like those of C, is not bound as an attribute of a class."""

    def __init__(self, function: Callable[..., "Any"]) -> None:
        self._function = function
        self.__name__ = function.__name__
        self.__doc__ = function.__doc__

    def __call__(self, *args: "Any", **kwargs: "Any") -> "Any":
        """Call it."""
        return self._function(*args, **kwargs)


class _SubstituteMeta(type):
    """Metaclass: instances and subclasses of the replaced class count as those of its class."""

    def __instancecheck__(cls, value: object) -> bool:
        real = vars(cls).get("_stands_for")
        return isinstance(value, real) if real else type.__instancecheck__(cls, value)

    def __subclasscheck__(cls, other: type) -> bool:
        real = vars(cls).get("_stands_for")
        return issubclass(other, real) if real else type.__subclasscheck__(cls, other)


def datetime_module(clock: ProgramClock) -> types.ModuleType:
    """Make a `datetime` module."""

    class datetime(real_datetime.datetime, metaclass=_SubstituteMeta):  # noqa: N801 its name
        """datetime.datetime on virtual time."""

        _stands_for = real_datetime.datetime

        @classmethod
        def now(cls, tz: Optional[real_datetime.tzinfo] = None) -> "datetime":
            return cls.fromtimestamp(clock.time(), tz)

        @classmethod
        def utcnow(cls) -> "datetime":
            return cls.fromtimestamp(clock.time(), real_datetime.timezone.utc).replace(tzinfo=None)

        @classmethod
        def today(cls) -> "datetime":
            return cls.now()

    class date(real_datetime.date, metaclass=_SubstituteMeta):  # noqa: N801 its name
        """datetime.date on virtual time."""

        _stands_for = real_datetime.date

        @classmethod
        def today(cls) -> "date":
            return cls.fromtimestamp(clock.time())

    return copy_module(real_datetime, datetime=datetime, date=date)
