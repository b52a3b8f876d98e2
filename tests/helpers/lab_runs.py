"""Folders as runs leave them, made up and small."""

import json

import cv2
import numpy as np

from laptop.record.figures.arm_numbers import numbers_of
from shared.arm_description import find_arm, read_arm

PATH = {
    "greatest_mm": 1.25,
    "rms_mm": 0.5,
    "start_mm": 0.25,
    "end_mm": 0.75,
    "missed_mm": 1.5,
    "seconds": 2.0,
    "length_cm": 11.18,
    "ink_cm": 11.3,
    "floor_mm": None,
}
TRACE = "t,q1,q2,x,y,pen\n0,0,0,20.8,0,0\n1,0.1,0.2,19,1,1\n2,0.2,0.3,18,2,1\n"


def a_picture(shade=200):
    """A PNG."""
    return cv2.imencode(".png", np.full((20, 30, 3), shade, np.uint8))[1].tobytes()


def simulated(folder, **changes):
    """What `simulate` leaves of a line; the summary."""
    arm = changes.pop("arm", "planar")
    summary = {
        "kind": "simulate",
        "script": "/home/anna/robot/driver.py",
        "args": ["line", "10,0", "5,10"],
        "arm": arm,
        "plant": "backlash=3",
        "status": 0,
        "reason": "ended",
        "seconds": 6.4,
        "paths": [PATH],
        "cpu": 1.0,
        "scene": None,
        "arm_numbers": numbers_of(read_arm(find_arm(arm))),
        **changes,
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "summary.json").write_text(json.dumps(summary))
    (folder / "trace.csv").write_text(TRACE)
    (folder / "picture.png").write_bytes(a_picture())
    return summary


def drawn(folder, **changes):
    """What `draw --simulate` leaves; the summary."""
    summary = {
        "kind": "drawing",
        "drawing": "house",
        "arm": "planar",
        "plant": "",
        "status": 0,
        "reason": "ended",
        "estimated_s": 146.21,
        "drawn_s": 144.84,
        "greatest_mm": 1.757,
        "rms_mm": 0.572,
        "missed_mm": 2.184,
        "ink_cm": 140.287,
        "chains": 31,
        "inks": 30,
        **changes,
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "summary.json").write_text(json.dumps(summary))
    (folder / "trace.csv").write_text(TRACE)
    (folder / "picture.png").write_bytes(a_picture())
    return summary
