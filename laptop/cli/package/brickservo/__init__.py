"""BrickServo: a LEGO EV3 arm that draws and sees.

    import brickservo

    with brickservo.Rig("planar") as rig:
        rig.run("driver.py", "line", "10,0", "5,10")
        print(rig.tip)

`brickservo` is the only name that this package takes among others.  What it is made of stands in a
folder of its own, as packages called `robot`, `laptop` and `shared`, as on the brick.  Others have
packages of these names, too (Robot Framework is called `robot`), so that folder is on the path only
of a process that runs BrickServo's commands, or asks here for what is in them.
"""

import importlib
import importlib.metadata
import os
import sys
from typing import Any

__all__ = ["Rig", "__version__", "open_packages"]

_HERE = os.path.dirname(os.path.abspath(__file__))
_INSTALLED, _CHECKOUT = os.path.join(_HERE, "_house"), os.path.join(_HERE, *4 * [".."])
PACKAGE_ROOT = os.path.realpath(_INSTALLED if os.path.isdir(_INSTALLED) else _CHECKOUT)
"""The folder of the packages."""

PACKAGES = ("robot", "laptop", "shared")


def open_packages() -> None:
    """Make this process import the packages `robot`, `laptop` and `shared` of BrickServo.

    Raises:
        ImportError: this process has imported others of these names.
    """
    for name in PACKAGES:
        other = getattr(sys.modules.get(name), "__path__", None) or [PACKAGE_ROOT + os.sep]
        if not os.path.realpath(next(iter(other))).startswith(PACKAGE_ROOT):
            raise ImportError(
                f"this process uses another package called {name}, {next(iter(other))}: "
                "run BrickServo in a process of its own"
            )
    if PACKAGE_ROOT not in sys.path[:1]:
        sys.path.insert(0, PACKAGE_ROOT)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.metadata.version("brickservo")
    if name == "Rig":
        open_packages()
        return importlib.import_module("laptop.emulator.rig").Rig
    raise AttributeError(f"module 'brickservo' has no attribute {name!r}")
