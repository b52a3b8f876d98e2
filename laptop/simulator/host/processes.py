"""The programs a script starts: `subprocess` and `os.system` on the world's clock.

Rule: no process is started; `BrickPrograms.run` does what a program of the brick would have done.
"""

import io
import os
import sys

from laptop.simulator.device.brick_programs import Finished, split_line
from laptop.simulator.host.linux import Signals
from laptop.simulator.host.waiting_line import WaitingLine

#: What starting a process costs, s.
START_COST = 0.03


class _Output(io.BytesIO):
    """A process's output; `seconds` of sound may be in it."""

    seconds = 0.0


class Processes(object):
    """Stands for the shell and the programs of the brick; nothing is started."""

    def __init__(self, world, clock, programs):
        self._world = world
        self._clock = clock
        self._programs = programs
        self._last_pid = 1000

    def execute(self, args, shell, piped):
        """Run a command; returns what it does, as Finished."""
        if shell:
            return self._shell(args if isinstance(args, str) else args[0], piped)
        words = [args] if isinstance(args, str) else [str(word) for word in args]
        finished = self._programs.run(words, piped)
        if finished is None:
            raise FileNotFoundError(
                2,
                "No such program on the emulated brick, which starts none of the laptop's",
                words[0],
            )
        return finished

    def _shell(self, line, piped):
        status, output, errors, seconds = 0, b"", b"", 0.0
        try:
            commands = split_line(line)
        except ValueError as error:
            return Finished(2, b"", "sh: {}\n".format(error).encode(), 0.0)
        for words, background, reads_pipe in commands:
            sound = getattr(output, "seconds", 0.0) if reads_pipe else piped
            finished = self._programs.run(words, sound)
            if finished is None:
                message = "sh: 1: {}: not found\n".format(words[0]).encode()
                finished = Finished(127, b"", message, 0.0)
            status = finished.status
            output = finished.output if reads_pipe or not output else output + finished.output
            errors += finished.errors
            seconds += 0.0 if background else finished.seconds
        return Finished(status, output, errors, seconds)

    def system(self, command):
        """os.system."""
        self._clock.step(START_COST)
        finished = self._shell(command, 0.0)
        self._world.sleep(finished.seconds)
        sys.stdout.write(finished.output.decode())
        sys.stderr.write(finished.errors.decode())
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
                piped = getattr(stdin, "seconds", 0.0)
                finished = processes.execute(args, options.get("shell", False), piped)
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
