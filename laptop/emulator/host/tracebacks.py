"""Tracebacks as Python on the brick prints them: the program's frames, and none of the emulator's.

The emulator's Python code stands for C code or the kernel, which have no frames.
"""

import contextlib
import os
import sys
import traceback
from typing import Any, Iterator

MYPY = False
if MYPY:
    from typing import List  # noqa: F401

    Unraisable = sys.UnraisableHookArgs

_EMULATOR = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep


_LIBRARY = os.path.dirname(os.path.abspath(os.__file__)) + os.sep
_IMPORTING = "<frozen importlib"


def _without_emulator(stack: traceback.StackSummary) -> traceback.StackSummary:
    """Remove the emulator's frames, those of the library that it calls, and its imports'."""
    frames, inside = [], False  # type: List[traceback.FrameSummary], bool
    for frame in stack:
        file = frame.filename
        if file.startswith(_EMULATOR):
            inside = True
            while frames and frames[-1].filename.startswith(_IMPORTING):
                frames.pop()
        elif not (inside and _is_library(file)):
            inside = False
            frames.append(frame)
    stack[:] = frames
    return stack


def _is_library(file: str) -> bool:
    """Return True for a module of Python's own library."""
    return file.startswith(("<frozen", _LIBRARY)) and "site-packages" not in file


@contextlib.contextmanager
def program_tracebacks() -> Iterator[None]:
    """Have `traceback` print, format and extract so, for a `with` block.

    Python's own report of an exception in `__del__` is changed alike.
    """
    exception_class, extracting = (
        traceback.TracebackException,
        vars(traceback.StackSummary)["extract"],
    )
    of_exception, of_frames = exception_class.__init__, traceback.StackSummary.extract
    unraisable = vars(sys).get("unraisablehook")  # Python 3.8

    def init(self: traceback.TracebackException, *args: Any, **kwargs: Any) -> None:
        of_exception(self, *args, **kwargs)
        _without_emulator(self.stack)

    def report(ignored: "Unraisable") -> None:
        what = ignored.err_msg or "Exception ignored in"
        sys.stderr.write("{}: {!r}\n".format(what, ignored.object))
        traceback.print_exception(ignored.exc_type, ignored.exc_value, ignored.exc_traceback)

    setattr(exception_class, "__init__", init)  # noqa: B010 (no method of its own, for mypy)
    setattr(  # noqa: B010
        traceback.StackSummary,
        "extract",
        staticmethod(lambda *args, **kwargs: _without_emulator(of_frames(*args, **kwargs))),
    )
    if unraisable is not None:
        vars(sys)["unraisablehook"] = report
    try:
        yield
    finally:
        setattr(exception_class, "__init__", of_exception)  # noqa: B010
        setattr(traceback.StackSummary, "extract", extracting)  # noqa: B010
        if unraisable is not None:
            vars(sys)["unraisablehook"] = unraisable
