"""Other systems than this one, as far as a program can tell by the names that they lack."""

import os

from places import ROOT


def lacking(system, **variables):
    """The environment of a Python that lacks what "windows" or "macos" has not."""
    folder = ROOT / "tests" / "helpers" / "lacks"
    paths = os.pathsep.join(map(str, (folder, ROOT)))
    return {**os.environ, "LACKS": system, "PYTHONPATH": paths, **variables}
