#!/usr/bin/env python3
"""Draw with the arm: lines, arcs, circles, rectangles, by joint motions planned on the brick.

    driver.py check                     which motor is where, and which way it turns: once, at first
    driver.py home                      you put the arm in its home pose, and it believes that
    driver.py line 10,0 5,10            centimetres: x forward, y left, from the shoulder
    driver.py line 10,0,5 5,10,15       in space: z up, from the table
    driver.py                           home if need be, then the three lines of the first report
    driver.py touch                     you lead the arm by hand, and a press takes a point
    driver.py job rose                  what a laptop has planned; also: driver.py jobs, order pause

From Brickman start it by its name; from a shell also as `python3 -m robot.driver`.
"""

import _signal  # type: ignore[import-not-found]
import os
import sys

if __name__ == "__main__":  # first of all: until then Ctrl-C is a traceback
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.realpath(__file__))))

from robot import program  # noqa: E402

MYPY = False
if MYPY:
    from typing import List  # noqa: F401

if __name__ == "__main__":
    program.use_default_signals()


def _command(args):
    # type: (List[str]) -> str
    """Return the command that is typed, if nothing but an arm or --take stands before it."""
    while args and args[0].startswith("--"):
        args = args[2 if args[0] == "--arm" else 1 :]
    return args[0] if args else ""


# All else is imported: Python keeps what it has compiled of a module, but of a script nothing.
if __name__ == "__main__" and sys.argv[1:2] and sys.argv[1] in ("job", "jobs", "order"):
    from robot.job_commands import main  # without the rest: an order is not to wait for it

    sys.exit(main())
if __name__ == "__main__" and _command(sys.argv[1:]) == "touch":
    from robot.touch_command import main

    sys.exit(main())

from robot.drawing import Driver  # noqa: E402, F401
from robot.drawing_commands import LINES, main  # noqa: E402, F401

if __name__ == "__main__":
    sys.exit(main())
