"""A Python program that another one starts: `python3 other.py`, on the same emulated brick.

It runs to its end before its parent goes on, in the same process of the host.  `__main__`,
arguments, modules of its folder and exit handlers are its own; all other imports are shared.
"""

import contextlib
import io
import os
import re
import sys
from typing import Callable, Iterator, List, Optional, Sequence

from laptop.emulator.device.file_programs import Finished

MYPY = False
if MYPY:
    from laptop.emulator.host.brick_shell import Captured
    from laptop.emulator.host.shims import Shims

MAX_DEPTH = 8
"""Greatest depth of nested programs."""


class ChildPython(object):
    """The brick's `python3`.

    Args:
        shims: Shims.
        run: `run(shims, script, source)` is the interpreter, and gives the exit status.
    """

    def __init__(self, shims: "Shims", run: Callable[["Shims", str, bytes], int]) -> None:
        self._shims = shims
        self._run = run
        self._depth = 0

    @staticmethod
    def is_python(args: Sequence[str]) -> bool:
        """Return True if a command line starts Python, or a script of it by its path."""
        path = args[0]
        return bool(re.match(r"python(3(\.\d+)?)?$", os.path.basename(path))) or (
            path.endswith(".py") and os.path.dirname(path) != "" and os.path.isfile(path)
        )

    def start(self, args: Sequence[str], piped: Optional[bytes], captured: "Captured") -> Finished:
        """Run a command line that `is_python`.

        Args:
            args: the command line, with `python3` first, or a path to a script.
            piped: its standard input, bytes; None: that of its parent.
            captured: whether output and errors are to be in what it returns, two bools.

        Returns:
            Finished.
        """
        args = list(args if args[0].endswith(".py") else args[1:])
        while args and args[0] in ("-u", "-B", "-E", "-s", "-O"):
            args.pop(0)
        if args and args[0] in ("-V", "--version"):
            return Finished(0, b"Python 3.5.3\n", b"", 0.0)
        if not args or args[0].startswith("-") and args[0] != "-c":
            why = "{}: not done on the emulated brick; give a script, or -c\n"
            asked = " ".join(["python3"] + args[:1])
            return Finished(2, b"", why.format(asked).encode(), 0.0)
        if self._depth >= MAX_DEPTH:
            why = "python3: not done: {} programs have started one another\n".format(MAX_DEPTH)
            return Finished(1, b"", why.encode(), 0.0)
        if args[0] == "-c":
            return self._in_place("-c", " ".join(args[1:2]).encode(), args[2:], piped, captured)
        try:
            with open(args[0], "rb") as file:
                source = file.read()
        except OSError as error:
            why = "python3: can't open file '{}': [Errno {}] {}\n".format(
                args[0], error.errno, error.strerror
            )
            return Finished(2, b"", why.encode(), 0.0)
        return self._in_place(args[0], source, args[1:], piped, captured)

    def _in_place(
        self,
        script: str,
        source: bytes,
        args: List[str],
        piped: Optional[bytes],
        captured: "Captured",
    ) -> Finished:
        folder = os.path.dirname(os.path.realpath(script)) if script != "-c" else ""
        streams = [io.TextIOWrapper(io.BytesIO(), "utf-8") if c else None for c in captured]
        with self._isolated(folder), contextlib.ExitStack() as stack:
            for stream, redirect in zip(
                streams, (contextlib.redirect_stdout, contextlib.redirect_stderr)
            ):
                if stream:
                    stack.enter_context(redirect(stream))
            if piped is not None:
                sys.stdin = io.TextIOWrapper(io.BytesIO(piped), "utf-8")
            sys.argv = [script] + list(args)
            sys.path[0] = folder
            status = self._run(self._shims, script, source)
        written = []
        for stream in streams:
            if stream:
                stream.flush()
            written.append(stream.buffer.getvalue() if stream else b"")
        return Finished(status, written[0], written[1], 0.0)

    @contextlib.contextmanager
    def _isolated(self, folder: str) -> Iterator[None]:
        """Store the parent program's own state for a `with` block."""
        argv, path, modules, stdin = sys.argv, list(sys.path), dict(sys.modules), sys.stdin
        excepthook, calls = sys.excepthook, self._shims.exit_calls
        own = [
            name
            for name, module in modules.items()
            if os.path.dirname(os.path.realpath(getattr(module, "__file__", None) or "/")) == folder
        ]
        for name in own:
            del sys.modules[name]
        self._shims.exit_calls = []
        sys.excepthook = sys.__excepthook__
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            self._shims.exit_calls = calls
            sys.excepthook = excepthook
            sys.argv, sys.path[:], sys.stdin = argv, path, stdin
            for name in own + ["__main__"]:
                sys.modules[name] = modules[name]
