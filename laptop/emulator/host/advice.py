"""Advice on errors that end a script, where the message itself gives none.

Each sentence is for one cause; a misspelled module has none.
"""

import ast
import importlib.util
import os
import sys
from typing import List, Optional, Sequence

from laptop.emulator.host.program_code import PROGRAM, top_of
from laptop.emulator.host.syntax_tree import imported_modules
from laptop.emulator.host.sys_class import ROOT

MYPY = False
if MYPY:
    from laptop.emulator.device.sysfs import Sysfs

PYBRICKS = (
    "this script is for Pybricks, another firmware, and not for ev3dev: run it on a brick with "
    "Pybricks, or write it with ev3dev2, where Motor(Port.A) is LargeMotor(OUTPUT_A)"
)
OLDER = (
    "ev3dev is the older library, python-ev3dev 1.x: either install it for the Python that runs "
    "simulate (python-ev3dev==1.2.0), or write ev3dev2 for it: from ev3dev2.motor import "
    "LargeMotor, and so on"
)
HUBS = "hub", "mindstorms", "spike"
"""Modules of LEGO's own firmware for other bricks."""

CARD = {
    "PIL": "Pillow",
    "bluetooth": "PyBluez",
    "paho": "paho-mqtt",
    "pyudev": "pyudev",
    "rpyc": "rpyc",
    "serial": "pyserial",
    "smbus": "smbus",
    "evdev": "evdev",
}
"""Modules on a brick's card: {module: package that installs it elsewhere}."""

BUSES = "bluetooth", "pyudev", "serial", "smbus"
"""Modules for hardware that the emulated brick lacks."""


def on(error: BaseException, source: bytes, folder: str, sysfs: "Sysfs") -> Optional[str]:
    """Return a sentence on an exception that a script did not catch; None without one.

    Args:
        error: the exception.
        source: of the script, bytes.
        folder: that it is in.
        sysfs: Sysfs.
    """
    kind = type(error).__name__
    if kind == "DeviceNotFound":
        found = ", ".join(sysfs.plugged_in()) or "nothing"
        return "plugged in: {}; see --plug".format(found)
    if kind == "ModuleNotFoundError" and isinstance(error, ImportError) and error.name:
        return _on_module(error.name, source, folder)
    file = getattr(error, "filename", None)
    if kind == "FileNotFoundError" and isinstance(file, str) and file.startswith(ROOT + "/"):
        return _on_device(file[len(ROOT) + 1 :].split("/"), sysfs)
    return None


def _on_module(name: str, source: bytes, folder: str) -> Optional[str]:
    top = top_of(name)
    if top == "pybricks" or b"pybricks-micropython" in source.partition(b"\n")[0]:
        return PYBRICKS
    if top == "ev3dev":
        return OLDER
    if top in HUBS:
        return (
            "{} is for another brick of LEGO's, with its own firmware: write the script with "
            "ev3dev2, from ev3dev2.motor import LargeMotor, and so on".format(top)
        )
    if top in CARD and top == name:
        return (
            "{} is on a brick's card, but this computer has none for the emulated brick: install "
            "{} for the Python that runs simulate{}".format(
                top,
                CARD[top],
                "; what it talks to is not emulated" if top in BUSES else "",
            )
        )
    beside = sibling(top, folder)
    if top in ("robot", "shared", "laptop") and beside:
        return (
            "{} beside the script is what it imports as {}, as on a brick, and so BrickServo's own "
            "{} is hidden: give yours another name, or leave {} out".format(beside, top, top, name)
        )
    return None


def _on_device(parts: Sequence[str], sysfs: "Sysfs") -> Optional[str]:
    found = sysfs.names(parts[0])
    if len(parts) < 2 or parts[1] in found:
        return None
    return (
        "in {}/{} there is {}; a device has another number after each plugging: look for {}".format(
            ROOT,
            parts[0],
            ", ".join(found) or "nothing: see --plug",
            "its address"
            if parts[0] in ("tacho-motor", "lego-sensor", "lego-port")
            else "its name",
        )
    )


def sibling(name: str, folder: str) -> Optional[str]:
    """Return the file or folder beside a script that is a module of that name; None without one."""
    for file in (name + ".py", name):
        if os.path.exists(os.path.join(folder, file)):
            return file
    return None


def missing_on_brick(source: bytes, folder: str) -> List[str]:
    """Return the modules that a script imports, this computer has and a brick has not, sorted.

    Args:
        source: bytes.
        folder: that the script is in.
    """
    standard = vars(sys).get("stdlib_module_names", ())  # Python 3.10
    try:
        asked = {top_of(name) for name in imported_modules(ast.parse(source).body)}
    except (SyntaxError, ValueError):
        return []
    asked -= set(standard) | set(PROGRAM) | set(CARD) | {"laptop"}
    return sorted(
        name for name in asked if standard and not sibling(name, folder) and _is_installed(name)
    )


def _is_installed(name: str) -> bool:
    """Return True for an installed module, False for a file of the user's own."""
    try:
        found = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return False
    where = (found and found.origin or "").replace(os.sep, "/")
    return "/site-packages/" in where or "/dist-packages/" in where
