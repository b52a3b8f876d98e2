"""Physics and motor drivers as extension modules, where they were compiled of these very sources.

`python -m laptop.emulator.compiling` makes them.  They lie in FOLDER of the checkout, in a folder
whose name is a hash of what they depend on: their sources, the sources of the types that are
compiled in, and this Python.  So modules of other sources are not found, and the sources count.
They compute the same bytes: each operation on floats is the one of Python, in the same order.
"""

import importlib.machinery
import importlib.util
import os
import sys
from typing import Optional, Sequence

from shared.state import PURE

MYPY = False
if MYPY:
    from types import ModuleType  # noqa: F401

REPO_ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""Folder that holds `laptop`, `robot` and `shared`."""

FOLDER = ".compiled"
"""Folder of the checkout that holds them."""

GROUP = "brickservo_physics"
"""Name of the library that they share, without mypyc's ending."""

MODULES = (
    "laptop.emulator.device.encoder",
    "laptop.emulator.device.motor_and_link",
    "laptop.emulator.device.plant",
    "laptop.emulator.device.stepping",
    "laptop.emulator.device.tacho_motor",
)
"""Modules that are compiled."""

READ = (
    "laptop.emulator.compiling",
    "laptop.emulator.device.hand_guiding",
    "laptop.emulator.device.masses",
    "laptop.emulator.device.motion_record",
    "laptop.emulator.device.plant_constants",
    "laptop.emulator.device.wheels",
    "robot.motion.chains",
    "robot.motion.gravity",
    "robot.motion.kinematics",
    "shared.arm_description",
)
"""Modules on which the compiled code depends, too: how it is made, and the types that it uses."""

SUFFIX = importlib.machinery.EXTENSION_SUFFIXES[0]
"""Ending of an extension module; it names the Python and the processor that it is for."""


def path_of(module: str, suffix: str = ".py") -> str:
    """Return the path of a module below REPO_ROOT, or below the folder of the compiled ones."""
    return os.path.join(*module.split(".")) + suffix


def key() -> str:
    """Return the hash of all that the compiled modules depend on."""
    import hashlib  # nobody else needs it, and few have compiled anything

    # In their tracebacks stand paths of the sources.
    digest = hashlib.sha256("\0".join([SUFFIX, REPO_ROOT]).encode())
    for module in MODULES + READ:
        with open(os.path.join(REPO_ROOT, path_of(module)), "rb") as file:
            digest.update(b"\0" + file.read())
    return digest.hexdigest()[:20]


def folder() -> str:
    """Return the folder of the modules that were compiled of these sources; it need not exist."""
    return os.path.join(REPO_ROOT, FOLDER, key())


class CompiledFinder(object):
    """Finder of the compiled modules, for `sys.meta_path`.

    Args:
        folder: where they lie.
    """

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._names = set(MODULES + (GROUP + "__mypyc",))

    def find_spec(
        self,
        name: str,
        path: Optional[Sequence[str]] = None,
        target: "Optional[ModuleType]" = None,
    ) -> Optional[importlib.machinery.ModuleSpec]:
        """Return the spec of a compiled module; None for any other."""
        if name not in self._names:
            return None
        file = os.path.join(self._folder, path_of(name, SUFFIX))
        loader = importlib.machinery.ExtensionFileLoader(name, file)
        return importlib.util.spec_from_file_location(name, file, loader=loader)


def install() -> bool:
    """Let all imports from now on find the compiled modules; return whether there are any."""
    if os.environ.get(PURE) or not os.path.isdir(os.path.join(REPO_ROOT, FOLDER)):
        return False
    found = folder()
    if not os.path.isdir(found):
        return False
    sys.meta_path.insert(0, CompiledFinder(found))
    return True
