"""Folders as runs leave them, made up and small."""

import cv2
import numpy as np

from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.names import RUN
from laptop.record.run import DRAWING, Ending, Run, RunFile, as_json, table
from shared.arm_description import find_arm, read_arm

TRACE = "t,q1,q2,x,y,pen\n0,0,0,20.8,0,0\n1,0.1,0.2,19,1,1\n2,0.2,0.3,18,2,1\n"
PATH = {"arm": "planar", "path": 1, "greatest mm": 1.25, "end off mm": 0.75, "missed mm": 1.5}
DRAWN = {"arm": "planar", "drawing": "house", "strokes drawn": "30 of 31", "rms mm": 0.572}
FILES = [RunFile("trace.csv", "the motion"), RunFile("picture.png", "The ink.")]


def a_picture(shade=200):
    """A PNG."""
    return cv2.imencode(".png", np.full((20, 30, 3), shade, np.uint8))[1].tobytes()


def paths(*rows):
    """A table of paths."""
    return table("paths", "Drawn paths", [*PATH], [[*row.values()] for row in rows], True)


def numbers(arm="planar"):
    """An arm's numbers, as a run keeps them."""
    return numbers_of(read_arm(find_arm(arm)))


def left(folder, **changes):
    """What a command leaves of a line; its Run."""
    values = {
        "kind": DRAWING,
        "what": "driver.py line 10,0 5,10",
        "ending": Ending(0, "ended", 6.4),
        "arm": numbers(),
        "set_up": {"brick": "emulated", "cpu": 1.0},
        "tables": [paths(PATH)],
        "files": FILES,
        **changes,
    }
    run = Run(**values)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RUN).write_bytes(as_json(run))
    (folder / "trace.csv").write_text(TRACE)
    (folder / "picture.png").write_bytes(a_picture())
    return run


def drawn(folder, **changes):
    """What `draw --simulate` leaves; its Run."""
    told = table("drawings", "Drawings", [*DRAWN], [[*DRAWN.values()]], True)
    return left(folder, what="drawing house", tables=[told], **changes)
