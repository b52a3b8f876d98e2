#!/usr/bin/env python3
"""Bring the tip where the camera sees the goal: nothing between image and joints is calibrated.

    visual_servoing.py                       to the goal marker that the laptop's tracker sees; the
                                             first time it asks for the pairing code
    visual_servoing.py --goal 400,200        to a pixel
    visual_servoing.py --arm spatial --goal A:400,200 --goal B:310,150     in space, by two cameras
    visual_servoing.py --follow --budget 30    after a goal marker that moves
    visual_servoing.py --wait                a run whenever the laptop says so, and as it orders

The joints' zero must be known (driver.py home), because of their limits.
"""

import _signal  # type: ignore[import-not-found]
import os
import sys

if __name__ == "__main__":  # first of all: until then Ctrl-C is a traceback
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.realpath(__file__))))

from robot import program  # noqa: E402

if __name__ == "__main__":
    program.use_default_signals()

# All else is imported: Python keeps what it has compiled of a module, but of a script nothing.
from robot.servoing_commands import main  # noqa: E402, F401

if __name__ == "__main__":
    sys.exit(main())
