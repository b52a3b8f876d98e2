"""Bundled scripts of the brick, wherever on this computer they were installed."""

import os

import robot

REPO_ROOT = os.path.dirname(os.path.dirname(os.path.abspath(robot.__file__)))
"""Folder that holds `robot` and `shared`: a checkout, or where the wheel was unpacked."""

DRIVER, SERVO, BENCH_BRICK = (
    os.path.join(REPO_ROOT, "robot", name + ".py")
    for name in ("driver", "visual_servoing", "bench_brick")
)


def find_script(text: str) -> str:
    """Return the path of a script as typed.

    Args:
        text: a path; `robot/NAME.py`, `NAME.py` and `laptop/examples/NAME.py` are, where there is
            no such file, the bundled script of that name.
    """
    folder = os.path.dirname(text) or "robot"
    own = os.path.join(REPO_ROOT, folder, os.path.basename(text))
    if os.path.exists(text) or folder not in ("robot", "laptop/examples"):
        return text
    return own if os.path.isfile(own) else text
