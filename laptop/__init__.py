"""Runs on the laptop."""

import sys

if sys.argv[:1] == ["-m"]:  # `python -m laptop` is being found: no traceback of Ctrl-C from here on
    import _signal  # type: ignore[import-not-found]

    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
