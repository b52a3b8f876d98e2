"""The drawings of the pages that say why, made of the project's own formulas and emulated runs.

Letters are large and words are few, so that they can be read on a phone.  Equal programs give equal
bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from laptop.docs.drawings.brick import emulator_drawing, pace_drawing, safety_drawing
from laptop.docs.drawings.motion import backlash_drawing, kinematics_drawing
from laptop.docs.drawings.sight import servoing_drawing, tracking_drawing

DRAWINGS: dict[str, Callable[[Path], None]] = {
    "why-kinematics.png": kinematics_drawing,
    "why-backlash.png": backlash_drawing,
    "why-servoing.png": servoing_drawing,
    "why-tracking.png": tracking_drawing,
    "why-pace.png": pace_drawing,
    "why-safety.png": safety_drawing,
    "why-emulator.png": emulator_drawing,
}
"""Each drawing: its name in the folder of pictures, and what writes it to a file."""
