"""State of this process that a program may change, stored during a run."""

import builtins
import contextlib
import importlib
import importlib.machinery
import io
import locale
import os
import sys
from typing import Any, List, Optional

from laptop.emulator.host.program_code import top_of

try:
    import termios
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]


def _terminal_settings() -> Optional[List[Any]]:
    """Return the terminal's settings; None where there is none."""
    if termios is not None:
        with contextlib.suppress(termios.error):
            return termios.tcgetattr(0)
    return None


class HostState(object):
    """State of the host that a run may change; `restore` sets it again."""

    def __init__(self) -> None:
        self._modules = dict(sys.modules)
        self._namespaces = [(vars(module), dict(vars(module))) for module in (builtins, io, os)]
        self._sys = {
            name: getattr(sys, name)
            for name in ("argv", "path", "stdin", "stdout", "stderr", "excepthook", "displayhook",
                         "dont_write_bytecode", "unraisablehook", "meta_path", "path_hooks",
                         "executable")
            if hasattr(sys, name)
        }  # fmt: skip
        self._lists = [
            (value, list(value)) for value in self._sys.values() if isinstance(value, list)
        ]
        self._recursion = sys.getrecursionlimit()
        self._environment = dict(os.environ)
        self._folder = os.getcwd()
        self._locale = locale.setlocale(locale.LC_ALL)
        self._terminal = _terminal_settings()

    def restore(self) -> None:
        """Restore all."""
        for namespace, before in self._namespaces:
            for name in [name for name in namespace if name not in before]:
                del namespace[name]
            namespace.update(before)
        for name, value in self._sys.items():
            setattr(sys, name, value)
        for value, items in self._lists:
            value[:] = items
        sys.setrecursionlimit(self._recursion)
        os.environ.clear()
        os.environ.update(self._environment)
        os.chdir(self._folder)
        locale.setlocale(locale.LC_ALL, self._locale)
        if self._terminal is not None and _terminal_settings() not in (None, self._terminal):
            # (None: it has been closed meanwhile.)
            termios.tcsetattr(0, termios.TCSADRAIN, self._terminal)
        self._restore_modules()

    def _restore_modules(self) -> None:
        # Extension modules cannot be relied on to be imported twice: their packages stay, but for
        # Pillow, which can, and which python-ev3dev2 brings in.
        compiled = {
            top_of(name)
            for name, module in list(sys.modules.items())
            if isinstance(
                getattr(getattr(module, "__spec__", None), "loader", None),
                importlib.machinery.ExtensionFileLoader,
            )
        } - {"PIL"}
        # A thread that never comes back from importing a module would hold that module's lock.
        locks = getattr(importlib._bootstrap, "_module_locks", {})
        for name in list(sys.modules):
            if name not in self._modules and top_of(name) not in compiled:
                module = sys.modules.pop(name)
                parent, _, child = name.rpartition(".")
                if module is not None and getattr(self._modules.get(parent), child, None) is module:
                    delattr(self._modules[parent], child)
                locks.pop(name, None)
        sys.modules.update(self._modules)
