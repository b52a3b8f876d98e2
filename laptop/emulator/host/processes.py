"""The programs a script starts: `subprocess` and `os.system` on the world's clock.

Rule: no process is started; `BrickPrograms.run` does what a program of the brick would have done.
"""

import io
import os
import sys

from laptop.emulator.device.brick_programs import Sound
from laptop.emulator.device.file_programs import Finished
from laptop.emulator.host.brick_shell import Shell
from laptop.emulator.host.child_python import ChildPython
from laptop.emulator.host.linux import Signals
from laptop.emulator.host.waiting_line import WaitingLine

#: What starting a process costs, s.
START_COST = 0.03


class _Output(io.BytesIO):
    """A process's output; `seconds` of sound may be in it."""

    seconds = 0.0


class Processes(object):
    """Stands for the shell and the programs of the brick; nothing is started.

    Attributes:
        python: ChildPython; None on one without Python.
    """

    def __init__(self, world, clock, programs):
        self._world = world
        self._clock = clock
        self._programs = programs
        self._last_pid = 1000
        self._shell = Shell(self._run)
        self.python = None

    def execute(self, args, shell, piped, captured):
        """Run a command.

        Args:
            piped: its standard input, bytes.
            captured: whether its output and errors are to be in what it returns, two bools.

        Returns:
            what it does, as Finished.
        """
        if shell:
            line = args if isinstance(args, str) else args[0]
            return self._shell.line(line, piped, captured)
        words = [str(word) for word in (args if isinstance(args, (list, tuple)) else [args])]
        finished = self._run(words, piped, captured)
        if finished is None:
            raise FileNotFoundError(
                2,
                "No such program on the emulated brick, which starts none of the laptop's",
                words[0],
            )
        return finished

    def _run(self, words, piped, captured):
        """Run a program by its words; Finished, or None if there is no such program."""
        name = os.path.basename(words[0])
        if name in ("sudo", "nohup"):
            left = [k for k, word in enumerate(words) if k and not word.startswith("-")]
            if not left:
                return Finished(1, b"", (name + ": a command is missing\n").encode(), 0.0)
            return self._run(words[left[0] :], piped, captured) or Finished(
                127, b"", "{}: {}: command not found\n".format(name, words[left[0]]).encode(), 0.0
            )
        if name in ("sh", "bash", "dash"):
            return self._run_shell(name, words[1:], piped, captured)
        if self.python is not None and ChildPython.is_meant(words):
            return self.python.start(words, captured)
        return self._programs.run(words, piped)

    def _run_shell(self, name, words, piped, captured):
        if words[:1] == ["-c"]:
            return self._shell.line(" ".join(words[1:2]), piped, captured)
        try:
            with open(words[0]) as file:
                lines = [line for line in file if not line.lstrip().startswith("#")]
        except (IndexError, OSError):
            message = "{}: not done: give a script that is there, or -c\n".format(name)
            return Finished(127, b"", message.encode(), 0.0)
        return self._shell.line("".join(lines), piped, captured)

    def system(self, command):
        """os.system."""
        self._clock.step(START_COST)
        finished = self._shell.line(command, b"", (False, False))
        self._world.sleep(finished.seconds)
        return finished.status << 8

    def popen(self):
        """A class for subprocess.Popen."""
        processes, world, clock = self, self._world, self._clock

        class Popen(object):
            """A program of the brick, running in virtual time."""

            def __init__(self, args, bufsize=-1, executable=None, **options):
                module = sys.modules["subprocess"]
                stdin, stdout, stderr = (
                    options.get(name) for name in ("stdin", "stdout", "stderr")
                )
                text = any(
                    options.get(name)
                    for name in ("universal_newlines", "text", "encoding", "errors")
                )
                clock.step(START_COST)
                piped = Sound(stdin.getvalue() if isinstance(stdin, _Output) else b"")
                piped.seconds = getattr(stdin, "seconds", 0.0)
                captured = stdout is not None, stderr is not None
                folder = os.getcwd()
                os.chdir(options.get("cwd") or folder)
                try:
                    finished = processes.execute(args, options.get("shell", False), piped, captured)
                finally:
                    os.chdir(folder)
                self.args = args
                processes._last_pid += 1
                self.pid = processes._last_pid
                self.returncode = None
                self._status = finished.status
                self._end = world.now() + finished.seconds
                self._waiting = WaitingLine(world)

                def stream(target, data, own):
                    if target == module.PIPE:
                        file = _Output(data)
                        file.seconds = getattr(data, "seconds", 0.0)
                        if not text:
                            return file
                        return io.StringIO(data.decode())
                    if target is None and data:
                        own.write(data.decode())
                    elif target not in (None, module.DEVNULL, module.STDOUT) and data:
                        os.write(target if isinstance(target, int) else target.fileno(), data)
                    return None

                output, errors = finished.output, finished.errors
                if stderr == module.STDOUT:
                    output, errors = output + errors, b""
                self.stdout = stream(stdout, output, sys.stdout)
                self.stderr = stream(stderr, errors, sys.stderr)
                self.stdin = None
                if stdin == module.PIPE:
                    self.stdin = io.StringIO() if text else io.BytesIO()

            def poll(self):
                """The exit status, or None while it runs."""
                clock.step()
                if self.returncode is None and world.now() >= self._end:
                    self.returncode = self._status
                return self.returncode

            def wait(self, timeout=None):
                """Wait for its end and return the exit status."""
                deadline = None if timeout is None else world.now() + timeout
                while self.poll() is None:
                    until = self._end if deadline is None else min(self._end, deadline)
                    self._waiting.wait(max(0.0, until - world.now()))
                    if deadline is not None and deadline <= world.now() < self._end:
                        raise sys.modules["subprocess"].TimeoutExpired(self.args, timeout)
                return self.returncode

            def communicate(self, input=None, timeout=None):
                """Wait for its end; (output, errors)."""
                self.wait(timeout)
                return tuple(file and file.read() for file in (self.stdout, self.stderr))

            def send_signal(self, sig):
                """Any signal ends it."""
                if self.poll() is None:
                    self._end = world.now()
                    self._status = -sig
                    while self._waiting.wake():
                        pass

            def terminate(self):
                """End it."""
                self.send_signal(Signals.SIGTERM)

            def kill(self):
                """End it."""
                self.send_signal(Signals.SIGKILL)

            def __enter__(self):
                return self

            def __exit__(self, *error):
                self.wait()

        return Popen
