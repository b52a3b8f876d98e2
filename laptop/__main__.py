"""The laptop's commands: `brickservo demo`, `track ...`, `simulate ...`, `bench ...`.

In a checkout they are `python -m laptop demo`, ...
"""

import os
import sys

_REPO_ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
if not __package__:  # `python .../laptop`, as programs here start others
    sys.path[0] = _REPO_ROOT
elif sys.argv[0] == __file__ and sys.path[0] not in ("", _REPO_ROOT):
    # `-m` lets modules of the folder that one is in come first, such as a robot.py of one's own.
    del sys.path[0]

from laptop.cli.start import run  # noqa: E402

if __name__ == "__main__":
    run()
