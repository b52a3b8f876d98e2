"""This Python, as a process of its own."""

import subprocess
import sys

from places import ROOT


def python(*words, **options):
    """Run it with these words, in the checkout; what has become of it, with its output as text."""
    return subprocess.run(
        [sys.executable, *map(str, words)], cwd=ROOT, capture_output=True, text=True, **options
    )
