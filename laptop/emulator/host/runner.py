"""Runs an ev3dev2 script, unmodified, on an emulated brick, as `python3 SCRIPT ARGS` would there.

Rule: it uses the brick's clock, its sysfs and the reset of its motors alone; the outcome is what a
shell would see.  Exit statuses beyond the program's own:

    2    there is no such script, as Python says it
    75   this computer is too busy for real time: try again later
    124  it does not end: time limit, frozen, deadlock, a wait for the host, or endless computing
    130  an unhandled KeyboardInterrupt
    137  killed: `kill_at`, or the Back button, after which every motor is reset
    128 + n  ended by signal n
"""

import functools
import os
import signal
import sys
import threading
import traceback
import types
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from laptop.emulator.device.buttons import BUTTONS
from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.host import advice, counting, output_lines
from laptop.emulator.host.child_python import ChildPython
from laptop.emulator.host.linux import Signals
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.processor import MAX_START, Processor
from laptop.emulator.host.shims import Shims
from laptop.emulator.host.watchdog import Over
from laptop.system import platforms

MYPY = False
if MYPY:
    from types import CodeType, FrameType

    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.device.buttons import Press
    from laptop.emulator.host.signals import Handler, ProgramSignals  # noqa: F401
    from laptop.emulator.host.virtual_thread import Call
    from laptop.emulator.host.world import World

Outcome = NamedTuple(
    "Outcome",
    [
        ("status", int),
        ("reason", str),
        ("t", float),
        ("accesses", int),
        ("start", Optional[float]),
        ("stack", Tuple[Tuple[str, int, str], ...]),
        ("signals", Tuple[int, ...]),
    ],
)
Outcome.__doc__ = """End of a run.

Attributes:
    status: exit status.
    reason: "ended" (by itself, whatever the status), or what ended it: "timeout", "frozen",
        "killed", "back button", "deadlock", "stuck", "waiting", "unheard" (a signal that it has not
        handled), a signal's name, "no script".
    t: virtual time at its end, s.
    accesses: number of sysfs accesses it made.
    start: duration of its start: Python, imports and all else before it used the brick, waited,
        began a thread or connected, s; None on a brick that computes in no time.
    stack: call stack at which it was cut off, in files of its own folder: (name, line, function),
        the innermost first; () if it has ended.
    signals: numbers of those that reached this process meanwhile, in order; see platforms.obey.
"""

_WHY = {
    "timeout": "stopped after {limit:g} s of virtual time; allow more with a longer timeout",
    "frozen": "frozen at {t:.3f} s, as ordered",
    "killed": "killed at {t:.3f} s, as ordered",
    "back button": "killed by the Back button at {t:.3f} s; every motor was reset",
    "deadlock": "at {t:.3f} s every thread waits for ever, and no button press is due",
    "too busy": "this computer is too busy to go on: the emulated clock stands still at {t:.3f} s, "
    "for {awaited}; end other programs and try again",
    "unheard": "ended at {t:.3f} s by a signal that it did not hear, as it computed, or waited for "
    "something outside the emulated brick; its motors go on as they were told",
    "stuck": "at {t:.3f} s it computed for {patience:g} s without looking at the clock",
    "waiting": "at {t:.3f} s it waited for something outside the emulated brick, which did not "
    "come: what it reads from, or calls, is to have a timeout",
}

_MODULE = "<module>"
"""Python's name for code outside functions."""


def run_script(
    brick: "EmulatedBrick",
    script: str,
    args: Sequence[str] = (),
    peripherals: Optional[Peripherals] = None,
    presses: "Sequence[Press]" = (),
    signals: Sequence[Tuple[float, int]] = (),
    freeze_at: Optional[float] = None,
    kill_at: Optional[float] = None,
    timeout: float = 600.0,
    aftermath: float = 1.0,
    patience: float = 10.0,
    folders: Optional[Mapping[str, str]] = None,
) -> Outcome:
    """Run `script` on `brick` until it ends, and simulate a little longer.

    Signals that reach this process meanwhile go to the script.

    Args:
        brick: has `world`, `sysfs`, `slowness` (0: it computes in no time) and `reset_motors()`.
        script: path of a Python file.
        args: its arguments, strings.
        peripherals: Peripherals on the brick's sysfs; new ones if None.
        presses: Press values, see `buttons.read_press`; one of a button says that the script was
            started from the brick's menu.
        signals: (s, signal number) pairs, to be delivered to the script.
        freeze_at: time at which the script freezes, s; the motors keep their last command.
        kill_at: time of SIGKILL, s; without brickrun the motors keep their last command.
        timeout: greatest duration of the script, virtual s.
        aftermath: time simulated after its end, virtual s.
        patience: greatest time of the host without a read of the clock, s.
        folders: path of a folder on the brick -> its path on this computer.

    Returns:
        Outcome
    """
    try:
        with open(script, "rb") as file:
            source = file.read()
    except OSError as error:
        _complain(
            "can't open script {!r}: {}; give the path of a Python file", script, error.strerror
        )
        return Outcome(2, "no script", brick.world.now(), 0, None, (), ())
    if peripherals is None:
        peripherals = Peripherals(brick.world, brick.sysfs)
    run = _ScriptRun(brick, peripherals, folders, script, source)
    run.press(presses)
    run.signal(signals)
    if freeze_at is not None:
        run.end_at(freeze_at, ProcessExit(ENDLESS, "frozen"))
    if kill_at is not None:
        run.end_at(kill_at, ProcessExit(128 + Signals.SIGKILL, "killed"))
    run.report_modules()
    return run.outcome(args, timeout, patience, aftermath)


class _ScriptRun(object):
    """One run of a script on a brick; events are scheduled first, then it is run."""

    def __init__(
        self,
        brick: "EmulatedBrick",
        peripherals: Peripherals,
        folders: Optional[Mapping[str, str]],
        script: str,
        source: bytes,
    ) -> None:
        self._brick = brick
        self._world = brick.world  # type: World
        self._peripherals = peripherals
        self._script = script
        self._name = os.path.basename(script)
        self._folder = os.path.dirname(os.path.realpath(script))
        self._source = source
        self._world.processor = _processor(brick, self._name)
        self._shims = Shims(self._world, peripherals, folders)
        self._shims.processes.python = ChildPython(self._shims, _interpreted)
        self._world.on_timeout = self._end_unheard
        peripherals.on_back = self._end_by_back_button

    def _end_by_back_button(self) -> None:
        self._world.halt(ProcessExit(128 + Signals.SIGKILL, "back button"))
        self._brick.reset_motors()

    def _end_unheard(self) -> None:
        number = min(self._shims.signals.pending)
        self._world.halt(ProcessExit(128 + number, "unheard"))

    def press(self, presses: "Sequence[Press]") -> None:
        """Schedule presses; one of a button means that the script was started from the menu."""
        self._shims.from_menu = any(press.button in BUTTONS for press in presses)
        for press in presses:
            self._peripherals.press(press)

    def signal(self, signals: Sequence[Tuple[float, int]]) -> None:
        """Schedule signals: (s, number) pairs."""
        for t, number in signals:
            self._world.at(t, functools.partial(self._shims.signals.post, number))

    def end_at(self, t: float, process_exit: ProcessExit) -> None:
        """Schedule an end, s."""
        self._world.at(t, functools.partial(self._world.halt, process_exit))

    def report_modules(self) -> None:
        """Report the modules that it imports and a brick lacks."""
        for name in advice.missing_on_brick(self._source, self._folder):
            _complain(
                "{} imports {}, which this computer has and a brick has not: "
                "there the import fails",
                self._name,
                name,
            )

    def outcome(
        self, args: Sequence[str], timeout: float, patience: float, aftermath: float
    ) -> Outcome:
        """Run the script."""
        world, sysfs, shims = self._world, self._brick.sysfs, self._shims
        start, accesses = world.now(), sysfs.accesses
        argv = [self._script] + list(args)
        shimmed = shims.installed(self._folder, ["python3"] + argv)
        with shimmed, sysfs.installed(), _Forwarding(world, shims.signals) as came:
            sys.excepthook = sys.__excepthook__
            sys.argv = argv
            sys.path.insert(0, self._folder)
            main = functools.partial(_main, shims, self._script, self._source)
            ended = world.run(main, start + timeout, patience)
            sys.stdout.flush()
            end, stack = world.now(), self._cut_at()
            if ended.reason in _WHY:
                self._report_why(_WHY[ended.reason], stack, timeout, patience)
            began = world.processor.behind if world.processor else None
            accesses = sysfs.accesses - accesses
            world.processor = None
            self._peripherals.on_back = None
            world.realtime = False  # no world waits for the time after its end
            world.advance(end + aftermath)
        return Outcome(ended.status, ended.reason, end, accesses, began, stack, tuple(came))

    def _cut_at(self) -> "Tuple[Call, ...]":
        """Outcome.stack."""
        return tuple(
            (os.path.basename(file), line, function)
            for file, line, function in self._world.cut_at
            if os.path.dirname(os.path.realpath(file)) == self._folder
        )

    def _report_why(
        self, reason: str, stack: "Tuple[Call, ...]", timeout: float, patience: float
    ) -> None:
        """Report why it was cut off, by _WHY, and where it was."""
        why = reason.format(
            t=self._world.now(),
            limit=timeout,
            patience=patience,
            awaited=self._world.awaited or "this program",
        )
        where = "; it was at {}".format(in_words(stack)) if stack else ""
        _complain("{}: {}{}", self._name, why, where)


def in_words(stack: "Sequence[Call]") -> str:
    """Return the innermost two calls of Outcome.stack for people."""
    main = stack[-1][0]
    calls = [call for call in stack if call[2] != _MODULE] or stack
    return ", called at ".join(
        "{}line {}{}".format(
            "" if name == main else name + " ",
            line,
            "" if function == _MODULE else " ({})".format(function),
        )
        for name, line, function in calls[:2]
    )


def _processor(brick: "EmulatedBrick", name: str) -> Optional[Processor]:
    """Return the Processor that the script computes on; None where that takes no time."""

    def late() -> None:
        _complain(
            "{}: it has computed for {:g} s on the brick, and has not used it yet; Ctrl-C ends it",
            name,
            MAX_START,
        )

    if not brick.slowness:
        return None
    return Processor(brick.slowness, lambda: brick.world.touch(0.0), late)


def _complain(message: str, *values: object) -> None:
    output_lines.end_lines()
    sys.stderr.write("simulate: " + message.format(*values) + "\n")


@functools.lru_cache(maxsize=16)
def _compiled(source: bytes, script: str, counts: bool) -> "CodeType":
    """Return the script's code, compiled once for all runs."""
    if counts:
        return counting.compiled(source, script)
    return compile(source, script, "exec", dont_inherit=True)


def _main(shims: Shims, script: str, source: bytes) -> int:
    """Interpret the script; return the exit status."""
    shims.begin()
    return _interpreted(shims, script, source, shims.finish)


def _interpreted(
    shims: Shims, script: str, source: bytes, finish: Optional[Callable[[], None]] = None
) -> int:
    """Run `source` as `__main__`, with Python's exit procedure; return the exit status."""
    module = types.ModuleType("__main__")
    vars(module).update(__file__=script, __builtins__=__builtins__, __cached__=None)
    sys.modules["__main__"] = module
    try:
        try:
            counts = shims.world.processor is not None
            exec(_compiled(source, script, counts), vars(module))
            status = 0
        except Over:
            raise
        except BaseException as error:
            status = _status_of(error)
            folder = os.path.dirname(os.path.realpath(script))
            sentence = advice.on(error, source, folder, shims.peripherals.sysfs)
            if sentence:
                _complain("{}", sentence)
        try:
            (finish or shims.call_at_exit)()
        except KeyboardInterrupt as error:
            status = _status_of(error)
    finally:
        sys.stdout.flush()
    _delete_objects(vars(module))
    return status


def _delete_objects(names: Dict[str, Any]) -> None:
    """Delete objects while the world is still open, as Python does at its end for `__del__`."""
    lasting = (type, types.ModuleType, types.FunctionType)
    counts = counting.COUNT, counting.DUE  # `__del__` counts its instructions
    for name in [name for name in names if not isinstance(names[name], lasting)]:
        if not name.startswith("__") and name not in counts:
            del names[name]


def _status_of(value: BaseException) -> int:
    """Report an exception that ends a script; return the exit status."""
    if isinstance(value, SystemExit):
        code = value.code
        if code is None:
            return 0
        if isinstance(code, int):
            return code & 0xFF
        sys.stdout.flush()
        sys.stderr.write("{}\n".format(code))
        return 1
    trace = value.__traceback__
    while trace is not None and trace.tb_frame.f_code is _interpreted.__code__:
        trace = trace.tb_next
    sys.stdout.flush()
    if sys.excepthook is sys.__excepthook__:
        traceback.print_exception(type(value), value, trace)
    else:
        sys.excepthook(type(value), value, trace)
    return 128 + Signals.SIGINT if isinstance(value, KeyboardInterrupt) else 1


class _Forwarding(object):
    """Forwarding of this process's signals to the script; needs the host's main thread.

    A second signal before the first is handled ends the run.
    """

    def __init__(self, world: "World", signals: "ProgramSignals") -> None:
        self._world = world
        self._signals = signals
        self._before = {}  # type: Dict[int, Handler]
        self._came = []  # type: List[int]

    def __enter__(self) -> List[int]:
        if threading.current_thread() is threading.main_thread():
            for number in platforms.ENDING:
                self._before[number] = signal.signal(number, self._forward)
        return self._came

    def _forward(self, number: int, frame: "Optional[FrameType]") -> None:
        self._came.append(number)
        # (Windows has one for which the brick has no name.)
        known = getattr(Signals, signal.Signals(number).name, Signals.SIGINT)  # type: Signals
        if known in self._signals.pending:
            self._world.halt(ProcessExit(128 + known, known.name))
        self._signals.post(known)

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
