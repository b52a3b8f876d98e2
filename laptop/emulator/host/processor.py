"""The emulated brick's processor: what counted programs compute becomes seconds of its clock."""

import contextlib
import functools
import importlib
import json
import math
import os
import re
import sys
from typing import Callable, Iterator, Optional, Sequence

from laptop.emulator.host.counting import COUNT, DUE, EV3DEV2, LOAD, LOOK, SPEND
from laptop.emulator.host.linux import HOME
from laptop.emulator.host.prices import (
    CLEARED,
    COMPILED,
    FOUND,
    IN_COMPANY,
    LIBRARY,
    LOADED,
    PATTERN,
    START,
    imports,
)
from laptop.emulator.own_programs import HOUSE

MYPY = False
if MYPY:
    from types import FrameType  # noqa: F401
    from typing import Any, Dict, List, Pattern, Set, Tuple, Union  # noqa: F401

    Names = Dict[str, Any]  # of a module, with its count among them
    Spend = Callable[[float], object]  # with thousands of instructions

CYCLES_PER_SECOND, CYCLES_PER_INSTRUCTION = 300e6, 6.8
"""The EV3's ARM926; the second as modelled with its caches, between 4.5 and 9.7."""

SECONDS = CYCLES_PER_INSTRUCTION / CYCLES_PER_SECOND
"""Time of an instruction, s."""

LONGEST_START = 60.0
"""Time that a program may compute before it has to do with the world; what is more passes on the
world's clock, so that a program that goes on for ever comes to its time limit, s."""

SWITCH_INTERVAL = 5e-3
"""Time after which Python lets another thread have its turn, s (`sys.getswitchinterval`)."""


class Processor(object):
    """One processor, and one program on it, from its start to its end.

    Args:
        slowness: how many times as long as the real one it takes.
        look: called by a thread that has gone round for a SWITCH_INTERVAL without looking at the
            clock; None where there is one thread only.
        late: called when it has computed for LONGEST_START and not had to do with the world.

    Attributes:
        start: what the program took before it first had to do with the world, see World.begin, s;
            None: it has not done so yet.
    """

    def __init__(
        self,
        slowness: float = 1.0,
        look: Optional[Callable[[], object]] = None,
        late: Callable[[], object] = lambda: None,
    ) -> None:
        self.slowness = slowness
        self._look = look
        self._late = late
        self.start = None  # type: Optional[float]
        self._starting = 0.0
        self._per_instruction = slowness * SECONDS * IN_COMPANY
        self._slice = SWITCH_INTERVAL / self._per_instruction
        self._modules = []  # type: List[Names]
        self._imported = set()  # type: Set[str]
        self._taken = 0
        self._beside = 0.0
        self._running = False
        self._early = []  # type: List[Tuple[Names, int, Sequence[str]]]

    def enrol(self, names: "Names", length: int, asked: Sequence[str]) -> None:
        """A counted module begins.

        What the emulator itself imports of `ev3dev2` before the script begins is charged when the
        script imports it.

        Args:
            names: its namespace.
            length: of its source, bytes.
            asked: what it imports of the standard library and of ev3dev2.
        """
        names[COUNT] = 0

        def spend(price: float) -> None:
            names[COUNT] += price

        def look() -> None:
            """Called in every turn of a `while` from DUE on."""
            left = self._slice - (self._total() - self._taken + self._beside)
            if left <= 0 and self._look:
                self._look()
                left = self._slice
            names[DUE] = names[COUNT] + left

        names[SPEND], names[LOOK] = spend, look
        names[LOAD] = self._import
        names[DUE] = self._slice if self._look else math.inf
        self._modules.append(names)
        if names["__name__"] == "__main__":
            self._running = True
            self.instructions()  # of nobody yet
            self.spend(START + COMPILED * length)
        if not self._running:
            self._early.append((names, length, asked))
            return
        self._load(FOUND + LOADED * length, asked)

    def _import(self, asked: Sequence[str]) -> None:
        """A function is about to import these."""
        if self._running:
            self._load(0, asked)

    def _load(self, own: float, asked: Sequence[str]) -> None:
        """Loading takes `own`, thousand instructions, and what it asks for."""
        self.spend((1 + CLEARED) * (own + sum(map(self._loaded, asked))))
        if EV3DEV2 in asked:
            early, self._early = self._early, []
            for names, length, others in early:
                self._load(FOUND + LOADED * length, others)
                self._beside += names[COUNT]

    def spend(self, thousands: float) -> None:
        """Something beside counted code took so many thousand instructions."""
        self._beside += 1000 * thousands / IN_COMPANY

    @contextlib.contextmanager
    def idle(self) -> Iterator[None]:
        """Charge nothing for what is computed within a `with` block."""
        before = self.instructions()
        try:
            yield
        finally:
            self.instructions()
            self._beside = before

    def _loaded(self, name: str) -> int:
        """Price of importing a module with all that it imports, thousand instructions."""
        if name in self._imported or name not in imports():
            return 0
        self._imported.add(name)
        price, others = imports()[name]
        return price + sum(map(self._loaded, others))

    def _total(self) -> int:
        total = 0
        for names in self._modules:
            total += names[COUNT]
        return total

    def instructions(self) -> float:
        """Return the instructions since the last call; as a program by itself, see IN_COMPANY."""
        total = self._total()
        new = total - self._taken + self._beside
        self._taken, self._beside = total, 0
        return new

    def take(self) -> float:
        """Seconds that the program has computed since this was asked last; of its start, none."""
        seconds = self._per_instruction * self.instructions()
        if self.start is None:
            self._starting += seconds
            if self._starting > LONGEST_START:
                self.start = self._starting
                self._late()
            return 0.0
        return seconds

    def begin(self) -> None:
        """The program now first has to do with the world."""
        self._running = True
        self.take()
        self.start = self._starting

    @property
    def behind(self) -> float:
        """Time of its computing that has not passed on the world's clock, s."""
        return self._starting


@contextlib.contextmanager
def library_charged(spend: "Spend") -> Iterator[None]:
    """Have the library's functions tell what they take, for a `with` block.

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
    """A pattern of the folders that are the brick's HOME there, as a text in JSON has them."""
    folders = [re.escape(json.dumps(folder)[1:-1]) for folder in (HOUSE, os.getcwd())]
    return re.compile('(?:{})(?=["/\\\\]|$)'.format("|".join(folders)))


def _length(text: str, elsewhere: "Pattern[str]") -> int:
    """Length of a text as it would be on the brick, where all that is `elsewhere` is in HOME."""
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
