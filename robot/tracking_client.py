#!/usr/bin/env python3
"""Show what the tracker on the laptop sees: places of markers, newest only.

    tracking_client.py                         pair with the tracker, and show what it sees; the
                                               first time it asks for the pairing code
    tracking_client.py 192.168.0.5 ...         another laptop than the one that ssh came from

Started by itself it moves nothing: it shows whether the brick sees.
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
from robot.tracker_address import (  # noqa: E402, F401
    Memory,
    Refusal,
    ServerAddress,
    find_tracker,
    read_place,
)
from robot.tracking import TrackingClient  # noqa: E402, F401
from robot.tracking_commands import main  # noqa: E402, F401

if __name__ == "__main__":
    sys.exit(main())
