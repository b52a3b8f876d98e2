"""Programs that a script starts: `subprocess` and `os.system` on the world's clock.

Rule: no process is started; `BrickPrograms.run` emulates the programs of the brick.
"""

import io
import os
import sys
from typing import Any, List, Optional, Tuple

from laptop.emulator.device.brick_programs import Sound
from laptop.emulator.device.file_programs import Finished
from laptop.emulator.host.brick_shell import Shell
from laptop.emulator.host.child_python import ChildPython
from laptop.emulator.host.linux import Signals
from laptop.emulator.host.wait_queue import WaitQueue

MYPY = False
if MYPY:
    from typing import Sequence, TextIO, Type, Union

    from laptop.emulator.device.brick_programs import BrickPrograms
    from laptop.emulator.host.brick_shell import Captured
    from laptop.emulator.host.clocks import ProgramClock
    from laptop.emulator.host.world import World

#: Cost of starting a process, s.
START_COST = 0.03


class _Output(io.BytesIO):
    """A process's output; `seconds` of sound may be in it."""

    seconds = 0.0


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
        self._shell = Shell(self._run)
        self.python = None  # type: Optional[ChildPython]

    def execute(
        self, args: "Union[str, Sequence[str]]", shell: bool, piped: bytes, captured: "Captured"
    ) -> Finished:
        """Run a command.

        Args:
            args: its arguments, or a line for the shell.
            shell: whether the shell runs it.
            piped: its standard input, bytes.
            captured: whether its output and errors are to be in what it returns, two bools.

        Returns:
            Finished.
        """
        if shell:
            line = args if isinstance(args, str) else args[0]
            return self._shell.line(line, piped, captured)
        argv = [str(word) for word in (args if isinstance(args, (list, tuple)) else [args])]
        finished = self._run(argv, piped, captured)
        if finished is None:
            raise FileNotFoundError(
                2,
                "No such program on the emulated brick, which starts none of the laptop's",
                argv[0],
            )
        return finished

    def _run(self, argv: List[str], piped: bytes, captured: "Captured") -> Optional[Finished]:
        """Run a program by its argv; Finished, or None if there is no such program."""
        name = os.path.basename(argv[0])
        if name in ("sudo", "nohup"):
            left = [k for k, word in enumerate(argv) if k and not word.startswith("-")]
            if not left:
                return Finished(1, b"", (name + ": a command is missing\n").encode(), 0.0)
            return self._run(argv[left[0] :], piped, captured) or Finished(
                127, b"", "{}: {}: command not found\n".format(name, argv[left[0]]).encode(), 0.0
            )
        if name in ("sh", "bash", "dash"):
            return self._run_shell(name, argv[1:], piped, captured)
        if self.python is not None and ChildPython.is_python(argv):
            return self.python.start(argv, captured)
        return self._programs.run(argv, piped)

    def _run_shell(
        self, name: str, argv: List[str], piped: bytes, captured: "Captured"
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
        finished = self._shell.line(command, b"", (False, False))
        self.world.sleep(finished.seconds)
        return finished.status << 8

    def popen(self) -> "Type[ProgramPopen]":
        """Return a class for subprocess.Popen."""
        return type("Popen", (ProgramPopen,), {"_processes": self})

    def begin(
        self, args: Any, shell: bool, folder: Optional[str], piped: bytes, captured: "Captured"
    ) -> Tuple[int, Finished]:
        """Begin what `execute` runs in a folder; the number of the process, and what it does."""
        self.clock.step(START_COST)
        before = os.getcwd()
        os.chdir(folder or before)
        try:
            finished = self.execute(args, shell, piped, captured)
        finally:
            os.chdir(before)
        self._last_pid += 1
        return self._last_pid, finished


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
        self.args = args
        self.pid, finished = self._processes.begin(
            args,
            options.get("shell", False),
            options.get("cwd"),
            _standard_input(stdin),
            (stdout is not None, stderr is not None),
        )
        self.returncode = None  # type: Optional[int]
        self._status = finished.status
        self._end = world.now() + finished.seconds
        self._waiting = WaitQueue(world)
        output, errors = finished.output, finished.errors
        if stderr == module.STDOUT:
            output, errors = output + errors, b""
        self.stdout = _written(output, stdout, sys.stdout, text)
        self.stderr = _written(errors, stderr, sys.stderr, text)
        self.stdin = None  # type: Union[io.StringIO, io.BytesIO, None]
        if stdin == module.PIPE:
            self.stdin = io.StringIO() if text else io.BytesIO()

    def poll(self) -> Optional[int]:
        """Return the exit status, or None while it runs."""
        self._processes.clock.step()
        if self.returncode is None and self._processes.world.now() >= self._end:
            self.returncode = self._status
        return self.returncode

    def wait(self, timeout: Optional[float] = None) -> Optional[int]:
        """Wait for its end and return the exit status."""
        world = self._processes.world
        deadline = None if timeout is None else world.now() + timeout
        while self.poll() is None:
            until = self._end if deadline is None else min(self._end, deadline)
            self._waiting.wait(max(0.0, until - world.now()))
            if deadline is not None and deadline <= world.now() < self._end:
                raise sys.modules["subprocess"].TimeoutExpired(self.args, timeout)
        return self.returncode

    def communicate(
        self, input: object = None, timeout: Optional[float] = None
    ) -> "Tuple[Union[str, bytes, None], ...]":
        """Wait for its end; return (output, errors)."""
        self.wait(timeout)
        files = self.stdout, self.stderr
        return tuple(None if file is None else file.read() for file in files)

    def send_signal(self, sig: int) -> None:
        """End it, whatever the signal."""
        if self.poll() is None:
            self._end = self._processes.world.now()
            self._status = -sig
            while self._waiting.wake():
                pass

    def terminate(self) -> None:
        """End it."""
        self.send_signal(Signals.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(Signals.SIGKILL)

    def __enter__(self) -> "ProgramPopen":
        return self

    def __exit__(self, *error: object) -> None:
        self.wait()


def _standard_input(stdin: object) -> Sound:
    """Return the standard input of a process by Popen's argument."""
    piped = Sound(stdin.getvalue() if isinstance(stdin, _Output) else b"")
    piped.seconds = getattr(stdin, "seconds", 0.0)
    return piped


def _written(
    data: bytes, target: Any, own: "TextIO", text: bool
) -> "Union[_Output, io.StringIO, None]":
    """Write a process's output to the target by Popen's argument; return a file for a pipe.

    Args:
        data: bytes.
        target: Popen's argument.
        own: the script's stream, where the argument is None.
        text: whether a pipe is of text.
    """
    module = sys.modules["subprocess"]
    if target == module.PIPE:
        if text:
            return io.StringIO(data.decode())
        file = _Output(data)
        file.seconds = getattr(data, "seconds", 0.0)
        return file
    if target is None and data:
        own.write(data.decode())
    elif target not in (None, module.DEVNULL, module.STDOUT) and data:
        os.write(target if isinstance(target, int) else target.fileno(), data)
    return None
