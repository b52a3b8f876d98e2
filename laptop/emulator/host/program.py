"""Import of the brick's own modules into this process, as on the emulated brick.

For measurements of single functions; whole scripts run under `runner.run_script`.
"""

import builtins
import contextlib
import importlib
import importlib.machinery
import sys
from types import CodeType, ModuleType
from typing import Dict, Iterator, Optional

from laptop.emulator.host import counting
from laptop.emulator.host.processor import Processor, library_charged
from laptop.emulator.host.program_code import PROGRAM, code_of, top_of

MYPY = False
if MYPY:
    from typing import Protocol

    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.host.world import World

    class _Clock(Protocol):
        def now(self) -> float: ...

        def sleep(self, seconds: float) -> None: ...


class Program(object):
    """A program that runs on a brick.

    Attributes:
        clock: has `now()` and `sleep(seconds)`.
        processor: Processor; None on a brick that computes in no time.
    """

    def __init__(self, clock: "_Clock", processor: Optional[Processor]) -> None:
        self.clock = clock
        self.processor = processor

    def __getitem__(self, name: str) -> ModuleType:
        """Return the module of that name: this process's, or on a slow brick one with counts."""
        if self.processor is None:
            return importlib.import_module(name)
        with self.processor.idle():  # what a script imports at its start
            return importlib.import_module(name)


class _ChargedClock(object):
    """The world's clock, on which computing takes time."""

    def __init__(self, world: "World") -> None:
        self._world = world
        self.sleep = world.sleep

    def now(self) -> float:
        self._world.touch(0.0)
        return self._world.now()


@contextlib.contextmanager
def on(brick: "EmulatedBrick") -> Iterator[Program]:
    """Yield a Program on the brick's sysfs for a `with` block; its start takes no time."""
    if not brick.slowness:
        with brick.sysfs.installed():
            yield Program(brick.world, None)
        return
    processor = Processor(brick.slowness)
    with _counting_modules(processor), brick.sysfs.installed():
        processor.instructions()  # of the library's import
        processor.begin()
        brick.world.processor = processor
        try:
            yield Program(_ChargedClock(brick.world), processor)
        finally:
            brick.world.processor = None


@contextlib.contextmanager
def _counting_modules(processor: Processor) -> Iterator[None]:
    """Load the program's modules anew, with counts for `processor`, for a `with` block.

    So a module that is imported late costs each program the same: on the brick each is a process of
    its own.
    """
    before = _remove_modules()
    setattr(builtins, counting.ENROL, processor.enrol)
    read_by = importlib.machinery.SourceFileLoader
    setattr(read_by, "get_code", _get_code)  # noqa: B010 (another's method, for mypy)
    try:
        with library_charged(processor.spend):
            yield
    finally:
        del read_by.get_code  # it is inherited
        delattr(builtins, counting.ENROL)
        _remove_modules()
        sys.modules.update(before)


def _remove_modules() -> Dict[str, ModuleType]:
    """Remove the program's modules from sys.modules, and return them."""
    names = [name for name in sys.modules if top_of(name) in PROGRAM]
    return {name: sys.modules.pop(name) for name in names}


def _get_code(loader: importlib.machinery.SourceFileLoader, name: str) -> Optional[CodeType]:
    return code_of(loader, name, top_of(name) in PROGRAM)
