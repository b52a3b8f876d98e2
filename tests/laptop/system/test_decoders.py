"""Decoders are quiet, Python is not."""

import subprocess
import sys


def test_while_decoders_are_quiet_python_is_not(tmp_path):
    """In a process of its own: pytest has put something else in the place of stderr."""
    code = (
        "import os, sys\n"
        "from laptop.system.decoders import quiet_decoders\n"
        "with quiet_decoders():\n"
        "    os.write(2, b'libjpeg\\n')\n"
        "    print('ours', file=sys.stderr)\n"
        "os.write(2, b'after\\n')\n"
        "print('too', file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr == "ours\nafter\ntoo\n"
