"""Frames: any picture as blue, green, red, and decoders that say nothing on the terminal."""

import subprocess
import sys

import numpy as np
import pytest

from laptop.see.camera.frames import bgr


@pytest.mark.parametrize(
    "image",
    [
        np.full((4, 6), 90, np.uint8),
        np.full((4, 6, 1), 90, np.uint8),
        np.full((4, 6, 4), 90, np.uint8),
        np.full((4, 6), 90 << 8, np.uint16),
    ],
    ids=lambda image: str(image.shape),
)
def test_what_a_driver_hands_over_becomes_blue_green_red(image):
    made = bgr(image)
    assert (made.shape, made.dtype) == ((4, 6, 3), np.uint8)
    assert made[0, 0].tolist() == [90, 90, 90]


def test_while_decoders_are_quiet_python_is_not(tmp_path):
    """In a process of its own: pytest has put something else in the place of stderr."""
    code = (
        "import os, sys\n"
        "from laptop.see.camera.frames import quiet_decoders\n"
        "with quiet_decoders():\n"
        "    os.write(2, b'libjpeg\\n')\n"
        "    print('ours', file=sys.stderr)\n"
        "os.write(2, b'after\\n')\n"
        "print('too', file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr == "ours\nafter\ntoo\n"
