"""Programs that a script starts: `subprocess` and `os.system` on the world's clock.

Rule: no process is started; `BrickPrograms.run` emulates the programs of the brick.
"""

import io
import math
import os
import sys
from typing import Any, List, Optional, Tuple

from laptop.emulator.device.brick_programs import Sound
from laptop.emulator.device.file_programs import Finished
from laptop.emulator.host.brick_shell import Shell, split_line
from laptop.emulator.host.child_python import ChildPython
from laptop.emulator.host.linux import Signals
from laptop.emulator.host.wait_queue import WaitQueue

MYPY = False
if MYPY:
    from typing import Callable, Sequence, TextIO, Type, Union  # noqa: F401

    from laptop.emulator.device.brick_programs import BrickPrograms
    from laptop.emulator.host.brick_shell import Captured
    from laptop.emulator.host.clocks import ProgramClock
    from laptop.emulator.host.world import World

#: Cost of starting a process, s.
START_COST = 0.03

PREFIXES = "sudo", "nohup"
"""Programs that run another one."""

SHELLS = "sh", "bash", "dash"
"""Names of the shell."""


class _Output(io.BytesIO):
    """A process's output; `seconds` of sound may be in it."""

    seconds = 0.0


class _BytesInput(io.BytesIO):
    """A process's standard input, which it reads once that is closed.

    Attributes:
        on_close: called with what was written, bytes; None: nobody reads it.
    """

    on_close = None  # type: Optional[Callable[[bytes], object]]

    def close(self) -> None:
        """Let the process read what was written."""
        if not self.closed:
            data = self.getvalue()
            super().close()
            if self.on_close:
                self.on_close(data)

    def __del__(self) -> None:
        """Close nothing: no process begins where its parent's memory is cleared."""


class _TextInput(io.TextIOWrapper):
    """A _BytesInput for text."""

    def __del__(self) -> None:
        """Close nothing, as _BytesInput."""


def _words(args: Any, shell: bool) -> List[str]:
    """Return a command's argv by Popen's argument."""
    if shell:
        return ["sh", "-c", args if isinstance(args, str) else args[0]]
    return [str(word) for word in (args if isinstance(args, (list, tuple)) else [args])]


def _behind_prefix(argv: List[str]) -> List[str]:
    """Return the command behind one of PREFIXES and its options."""
    words = [k for k, word in enumerate(argv) if k and not word.startswith("-")]
    return argv[words[0] :] if words else []


class Processes(object):
    """Substitute for the shell and the programs of the brick; nothing is started.

    Attributes:
        world, clock: World and ProgramClock, on which its programs run.
        python: ChildPython; None on one without Python.
    """

    def __init__(self, world: "World", clock: "ProgramClock", programs: "BrickPrograms") -> None:
        self.world = world
        self.clock = clock
        self._programs = programs
        self._last_pid = 1000
        self._shell = Shell(self._run, self.reads_input)
        self.python = None  # type: Optional[ChildPython]

    def execute(
        self,
        args: "Union[str, Sequence[str]]",
        shell: bool,
        piped: Optional[bytes],
        captured: "Captured",
    ) -> Finished:
        """Run a command.

        Args:
            args: its arguments, or a line for the shell.
            shell: whether the shell runs it.
            piped: its standard input, bytes; None: that of the script.
            captured: whether its output and errors are to be in what it returns, two bools.

        Returns:
            Finished.
        """
        if shell:
            return self._shell.line(_words(args, shell)[-1], piped, captured)
        argv = _words(args, shell)
        finished = self._run(argv, piped, captured)
        if finished is None:
            raise FileNotFoundError(
                2,
                "No such program on the emulated brick, which starts none of the laptop's",
                argv[0],
            )
        return finished

    def reads_input(self, argv: List[str]) -> Optional[bool]:
        """Return whether a program reads its standard input; None where it may."""
        name = os.path.basename(argv[0])
        if name in PREFIXES:
            left = _behind_prefix(argv)
            return bool(left) and self.reads_input(left)
        if name in SHELLS and argv[1:2] == ["-c"]:
            try:
                commands = split_line(" ".join(argv[2:3]))
            except ValueError:
                return False
            free, before = [], ""
            for command in commands:
                if before != "|" and 0 not in command.redirected and command.args:
                    free.append(self.reads_input(command.args))
                before = command.end
            return True if True in free else None if None in free else False
        if name in SHELLS or (self.python is not None and ChildPython.is_python(argv)):
            return None
        return self._programs.reads_input(argv)

    def _run(
        self, argv: List[str], piped: Optional[bytes], captured: "Captured"
    ) -> Optional[Finished]:
        """Run a program by its argv; Finished, or None if there is no such program."""
        name = os.path.basename(argv[0])
        if name in PREFIXES:
            left = _behind_prefix(argv)
            if not left:
                return Finished(1, b"", (name + ": a command is missing\n").encode(), 0.0)
            return self._run(left, piped, captured) or Finished(
                127, b"", "{}: {}: command not found\n".format(name, left[0]).encode(), 0.0
            )
        if name in SHELLS:
            return self._run_shell(name, argv[1:], piped, captured)
        if self.python is not None and ChildPython.is_python(argv):
            return self.python.start(argv, piped, captured)
        return self._programs.run(argv, b"" if piped is None else piped)

    def _run_shell(
        self, name: str, argv: List[str], piped: Optional[bytes], captured: "Captured"
    ) -> Finished:
        if argv[:1] == ["-c"]:
            return self._shell.line(" ".join(argv[1:2]), piped, captured)
        try:
            with open(argv[0]) as file:
                lines = [line for line in file if not line.lstrip().startswith("#")]
        except (IndexError, OSError):
            message = "{}: not done: give a script that is there, or -c\n".format(name)
            return Finished(127, b"", message.encode(), 0.0)
        return self._shell.line("".join(lines), piped, captured)

    def system(self, command: str) -> int:
        """Run a line as os.system does; return its status."""
        self.clock.step(START_COST)
        finished = self._shell.line(command, None, (False, False))
        self.world.sleep(finished.seconds)
        return finished.status << 8

    def popen(self) -> "Type[ProgramPopen]":
        """Return a class for subprocess.Popen."""
        return type("Popen", (ProgramPopen,), {"_processes": self})

    def next_pid(self) -> int:
        """Return the number of a new process."""
        self._last_pid += 1
        return self._last_pid

    def execute_in(
        self,
        folder: Optional[str],
        args: Any,
        shell: bool,
        piped: Optional[bytes],
        captured: "Captured",
    ) -> Finished:
        """Run a command, see `execute`, in a folder; None: in the current one."""
        before = os.getcwd()
        os.chdir(folder or before)
        try:
            return self.execute(args, shell, piped, captured)
        finally:
            os.chdir(before)


class ProgramPopen(object):
    """subprocess.Popen: a program of the brick, running in virtual time."""

    @property
    def _processes(self) -> Processes:
        raise NotImplementedError("of the class that Processes makes")

    def __init__(
        self, args: Any, bufsize: int = -1, executable: object = None, **options: Any
    ) -> None:
        module, world = sys.modules["subprocess"], self._processes.world
        stdin, stdout, stderr = (options.get(name) for name in ("stdin", "stdout", "stderr"))
        text = any(
            options.get(name) for name in ("universal_newlines", "text", "encoding", "errors")
        )
        shell = options.get("shell", False)
        self.args = args
        self.returncode = None  # type: Optional[int]
        self.stdin = None  # type: Union[_TextInput, _BytesInput, None]
        self._options = options.get("cwd"), args, shell
        self._targets = stdout, stderr
        self._status, self._end = 0, math.inf
        self._waiting = WaitQueue(world)
        self._stdout = _pipe(text) if stdout == module.PIPE else None
        self._stderr = _pipe(text) if stderr == module.PIPE else None
        self._waits_for = False  # type: Optional[bool]  # input: see Processes.reads_input
        self._processes.clock.step(START_COST)
        if stdin == module.PIPE:
            self._input = _BytesInput()
            self.stdin = (
                _TextInput(self._input, "utf-8", write_through=True) if text else self._input
            )
            self._waits_for = self._processes.reads_input(_words(args, shell))
        if self._waits_for is False:
            self._start(_standard_input(stdin))
        else:
            self._input.on_close = self._start
        self.pid = self._processes.next_pid()

    def _start(self, piped: Optional[bytes]) -> None:
        """Run it with its standard input, unless it has run, or was ended before."""
        if self._end < math.inf:
            return
        stdout, stderr = self._targets
        captured = stdout is not None, stderr is not None
        folder, args, shell = self._options
        finished = self._processes.execute_in(folder, args, shell, piped, captured)
        self._status, self._waits_for = finished.status, False
        self._end = self._processes.world.now() + finished.seconds
        output, errors = finished.output, finished.errors
        if stderr == sys.modules["subprocess"].STDOUT:
            output, errors = _with_errors(output, errors), b""
        _write(output, stdout, self._stdout or sys.stdout)
        _write(errors, stderr, self._stderr or sys.stderr)
        self._wake()

    def _start_unless_it_waits(self) -> None:
        """Run it now if it may go on without what is not written yet."""
        if self._waits_for is None and self.stdin:
            self._start(self._input.getvalue())

    @property
    def stdout(self) -> "Union[_Output, io.StringIO, None]":
        """Its output, where that is a pipe."""
        self._start_unless_it_waits()
        return self._stdout

    @property
    def stderr(self) -> "Union[_Output, io.StringIO, None]":
        """Its errors, where they go into a pipe of their own."""
        self._start_unless_it_waits()
        return self._stderr

    def _wake(self) -> None:
        while self._waiting.wake():
            pass

    def poll(self) -> Optional[int]:
        """Return the exit status, or None while it runs."""
        self._processes.clock.step()
        self._start_unless_it_waits()
        if self.returncode is None and self._processes.world.now() >= self._end:
            self.returncode = self._status
        return self.returncode

    def wait(self, timeout: Optional[float] = None) -> Optional[int]:
        """Wait for its end and return the exit status."""
        world = self._processes.world
        deadline = None if timeout is None else world.now() + timeout
        while self.poll() is None:
            until = self._end if deadline is None else min(self._end, deadline)
            self._waiting.wait(max(0.0, until - world.now()) if until < math.inf else None)
            if deadline is not None and deadline <= world.now() < self._end:
                raise sys.modules["subprocess"].TimeoutExpired(self.args, timeout)
        return self.returncode

    def communicate(
        self, input: Any = None, timeout: Optional[float] = None
    ) -> "Tuple[Union[str, bytes, None], ...]":
        """Give it its input, wait for its end; return (output, errors)."""
        if self.stdin and self.stdin.closed and input:
            raise ValueError("Cannot send input after starting communication")
        if self.stdin and not self.stdin.closed:
            if input:
                self.stdin.write(input)
            self.stdin.close()
        self.wait(timeout)
        files = self.stdout, self.stderr
        return tuple(None if file is None else file.read() for file in files)

    def send_signal(self, sig: int) -> None:
        """End it, whatever the signal."""
        if self.poll() is None:
            self._end = self._processes.world.now()
            self._status, self._waits_for = -sig, False
            self._wake()

    def terminate(self) -> None:
        """End it."""
        self.send_signal(Signals.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(Signals.SIGKILL)

    def __enter__(self) -> "ProgramPopen":
        return self

    def __exit__(self, *error: object) -> None:
        if self.stdin:
            self.stdin.close()
        self.wait()


def _standard_input(stdin: object) -> Optional[Sound]:
    """Return the standard input of a process by Popen's argument; None: that of the script."""
    if stdin is None:
        return None
    piped = Sound(stdin.getvalue() if isinstance(stdin, _Output) else b"")
    piped.seconds = getattr(stdin, "seconds", 0.0)
    return piped


def _with_errors(output: bytes, errors: bytes) -> Sound:
    """Return output and errors in one pipe; sound in it lasts as long."""
    both = Sound(output + errors)
    both.seconds = getattr(output, "seconds", 0.0)
    return both


def _pipe(text: bool) -> "Union[_Output, io.StringIO]":
    """Return a process's end of a pipe, of text or bytes."""
    return io.StringIO() if text else _Output()


def _write(data: bytes, target: Any, file: "Union[TextIO, _Output]") -> None:
    """Write a process's output to the target by Popen's argument.

    Args:
        data: bytes.
        target: Popen's argument.
        file: the pipe, where the argument is PIPE, else the script's own stream.
    """
    module = sys.modules["subprocess"]
    if isinstance(file, _Output):
        file.write(data)
        file.seconds = getattr(data, "seconds", 0.0)
        file.seek(0)
    elif target == module.PIPE:
        file.write(data.decode())
        file.seek(0)
    elif target is None and data:
        file.write(data.decode())
    elif target not in (None, module.DEVNULL, module.STDOUT) and data:
        os.write(target if isinstance(target, int) else target.fileno(), data)
