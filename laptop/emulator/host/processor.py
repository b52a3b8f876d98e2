"""Processor of the emulated brick: converts counts of instructions into seconds.

    seconds = instructions * PROGRAM_FACTOR * slowness * CYCLES_PER_INSTRUCTION / CYCLES_PER_SECOND

A program does not stop at each count. Counts are charged at synchronisation points: it reads
the time, sleeps, accesses a device, or has spent a SWITCH_INTERVAL in a `while`. Between them the
program runs at the host's speed, and events are late by at most one such piece. The computation
before the first access to the world is the program's start, during which the world's bodies rest.

The cycles per instruction are a mean over Python's interpreter with its cache misses (Hennessy and
Patterson, Computer Architecture, 1.9). A model of each cache access
would need the brick's machine code, which no program of the emulator has.
"""

import contextlib
import functools
import importlib
import json
import math
import operator
import os
import re
import sys
from typing import Callable, Iterator, Optional, Sequence

from laptop.emulator.bundled_scripts import REPO_ROOT
from laptop.emulator.host.counting import COUNT, DUE, EV3DEV2, LOAD, LOOK, SPEND
from laptop.emulator.host.instruction_costs import (
    CLEARED,
    COMPILED,
    FOUND,
    LIBRARY,
    LOADED,
    PATTERN,
    PROGRAM_FACTOR,
    START,
    imports,
)
from laptop.emulator.host.linux import HOME

MYPY = False
if MYPY:
    from types import FrameType  # noqa: F401
    from typing import Any, Dict, List, Pattern, Set, Tuple, Union  # noqa: F401

    Names = Dict[str, Any]  # of a module, with its count among them
    Spend = Callable[[float], object]  # with thousands of instructions

CYCLES_PER_SECOND, CYCLES_PER_INSTRUCTION = 300e6, 6.8
"""Clock rate of the EV3's ARM926, and its mean cycles per instruction, cache misses included
(modelled, between 4.5 and 9.7)."""

SECONDS_PER_INSTRUCTION = CYCLES_PER_INSTRUCTION / CYCLES_PER_SECOND
"""Time of an instruction, s."""

MAX_START = 60.0
"""Greatest time of a program's start, before its first access to the world, s; more passes on the
world's clock, so that an endless program reaches its time limit."""

SWITCH_INTERVAL = 5e-3
"""Time after which Python switches threads, s (`sys.getswitchinterval`)."""

_count_of = operator.itemgetter(COUNT)


class Processor(object):
    """One processor, and one program on it, from its start to its end.

    Args:
        slowness: time of a computation, as a multiple of the real brick's.
        check_clock: called by a thread that has computed for a SWITCH_INTERVAL without reading the
            clock; None where there is one thread only.
        late: called when it has computed for MAX_START without an access to the world.

    Attributes:
        start: duration of the program's start, see World.begin, s; None before it ends.
    """

    def __init__(
        self,
        slowness: float = 1.0,
        check_clock: Optional[Callable[[], object]] = None,
        late: Callable[[], object] = lambda: None,
    ) -> None:
        self.slowness = slowness
        self._check_clock = check_clock
        self._late = late
        self.start = None  # type: Optional[float]
        self._starting = 0.0
        self._per_instruction = slowness * SECONDS_PER_INSTRUCTION * PROGRAM_FACTOR
        self._slice = SWITCH_INTERVAL / self._per_instruction
        self._modules = []  # type: List[Names]
        self._imported = set()  # type: Set[str]
        self._taken = 0
        self._beside = 0.0
        self._running = False
        self._early = []  # type: List[Tuple[Names, int, Sequence[str]]]

    def enrol(self, names: "Names", length: int, asked: Sequence[str]) -> None:
        """Register a counted module at its begin.

        Modules of `ev3dev2` that the emulator has imported before are charged when the script
        imports them.

        Args:
            names: its namespace.
            length: of its source, bytes.
            asked: names that it imports of the standard library and of ev3dev2.
        """
        names[COUNT] = 0

        def spend(cost: int) -> None:
            names[COUNT] += cost

        def check_clock() -> None:
            """Let others run; each pass of a `while` calls this once the count exceeds DUE."""
            left = self._slice - (self._total() - self._taken + self._beside)
            if left <= 0 and self._check_clock:
                self._check_clock()
                left = self._slice
            names[DUE] = names[COUNT] + left

        names[SPEND], names[LOOK] = spend, check_clock
        names[LOAD] = self._import
        names[DUE] = self._slice if self._check_clock else math.inf
        self._modules.append(names)
        if names["__name__"] == "__main__":
            self._running = True
            self.instructions()  # charged to none
            self.spend(START + COMPILED * length)
        if not self._running:
            self._early.append((names, length, asked))
            return
        self._load(FOUND + LOADED * length, asked)

    def _import(self, asked: Sequence[str]) -> None:
        """Charge the modules that a function is about to import."""
        if self._running:
            self._load(0, asked)

    def _load(self, own: float, asked: Sequence[str]) -> None:
        """Charge a module's loading: `own`, thousand instructions, and that of its imports."""
        self.spend((1 + CLEARED) * (own + sum(map(self._loaded, asked))))
        if EV3DEV2 in asked:
            early, self._early = self._early, []
            for names, length, others in early:
                self._load(FOUND + LOADED * length, others)
                self._beside += names[COUNT]

    def spend(self, thousands: float) -> None:
        """Charge thousands of instructions beside those of counted code."""
        self._beside += 1000 * thousands / PROGRAM_FACTOR

    @contextlib.contextmanager
    def idle(self) -> Iterator[None]:
        """Charge nothing for computations within a `with` block."""
        before = self.instructions()
        try:
            yield
        finally:
            self.instructions()
            self._beside = before

    def _loaded(self, name: str) -> int:
        """Return the cost of importing a module with its imports, thousand instructions."""
        if name in self._imported or name not in imports():
            return 0
        self._imported.add(name)
        cost, others = imports()[name]
        return cost + sum(map(self._loaded, others))

    def _total(self) -> int:
        return sum(map(_count_of, self._modules))

    def instructions(self) -> float:
        """Return the instructions since the last call; by themselves, without PROGRAM_FACTOR."""
        total = self._total()
        new = total - self._taken + self._beside
        self._taken, self._beside = total, 0
        return new

    def charge(self) -> float:
        """Return the seconds computed since the last call; 0 during the program's start."""
        seconds = self._per_instruction * self.instructions()
        if self.start is None:
            self._starting += seconds
            if self._starting > MAX_START:
                self.start = self._starting
                self._late()
            return 0.0
        return seconds

    def begin(self) -> None:
        """End the start, at the program's first access to the world."""
        self._running = True
        self.charge()
        self.start = self._starting

    @property
    def behind(self) -> float:
        """Computing time that has not yet passed on the world's clock, s."""
        return self._starting


@contextlib.contextmanager
def library_charged(spend: "Spend") -> Iterator[None]:
    """Charge the library's functions written in Python, for a `with` block.

    Args:
        spend: called with thousands of instructions.
    """
    before = []  # type: List[Tuple[Any, str, Any]]
    elsewhere = _elsewhere()

    def replace(owner: "Any", name: str, function: "Any") -> None:
        before.append((owner, name, vars(owner)[name]))
        setattr(owner, name, function)

    try:
        for place, (once, each) in LIBRARY.items():
            module, _, path = place.partition(":")
            *above, name = path.split(".")
            owner = functools.reduce(getattr, above, importlib.import_module(module))
            replace(owner, name, _charged(getattr(owner, name), once, each, spend, elsewhere))
        regular = importlib.import_module("re")
        replace(regular, "_compile", _charged_once(vars(regular)["_compile"], spend))
        yield
    finally:
        for owner, name, function in reversed(before):
            setattr(owner, name, function)


_LIBRARY = {place.partition(":")[0].partition(".")[0] for place in LIBRARY} | {"re"}


def _for_the_program() -> bool:
    """Return True if counted code has called, through the library: the laptop has its own."""
    frame = sys._getframe(2)  # type: Optional[FrameType]
    while frame is not None and COUNT not in frame.f_globals:
        if frame.f_globals.get("__name__", "").partition(".")[0] not in _LIBRARY:
            return False
        frame = frame.f_back
    return frame is not None


def _charged(
    function: Callable[..., "Any"],
    once: float,
    each: float,
    spend: "Spend",
    elsewhere: "Pattern[str]",
) -> Callable[..., "Any"]:
    @functools.wraps(function)
    def charged(*args: "Any", **kwargs: "Any") -> "Any":
        result = function(*args, **kwargs)
        if not _for_the_program():
            return result
        texts = [value for value in (result, *args[1:2]) if isinstance(value, str)]
        spend(once + each * (_length(texts[0], elsewhere) if texts else 0))
        return result

    return charged


def _elsewhere() -> "Pattern[str]":
    """Return a pattern of the folders that are HOME on the brick, as a text in JSON has them."""
    folders = [re.escape(json.dumps(folder)[1:-1]) for folder in (REPO_ROOT, os.getcwd())]
    return re.compile('(?:{})(?=["/\\\\]|$)'.format("|".join(folders)))


def _length(text: str, elsewhere: "Pattern[str]") -> int:
    """Return the length of a text as it would be on the brick, with `elsewhere` as HOME."""
    return len(elsewhere.sub(HOME, text))


def _charged_once(function: Callable[..., "Any"], spend: "Spend") -> Callable[..., "Any"]:
    seen = set()  # type: Set[Tuple[Union[str, bytes], int]]

    @functools.wraps(function)
    def charged(pattern: object, flags: int) -> "Any":
        if isinstance(pattern, (str, bytes)) and (pattern, flags) not in seen:
            if not _for_the_program():
                return function(pattern, flags)
            seen.add((pattern, flags))
            once, each = PATTERN
            spend(once + each * len(pattern))
        return function(pattern, flags)

    return charged
