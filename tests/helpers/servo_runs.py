"""Runs of the servo, made up: by a log, and with the truth."""

import numpy as np
from servo_log import GOAL, log_text

from laptop.record.servo.servo_log import read_log
from laptop.record.servo.servo_run import Space, Truth, run_of_log

PLACE = (10.0, 5.0, 12.0)


def truth(off, cameras="A"):
    """The tip comes from 200 px to `off` px, and rests there after the end."""
    goal = GOAL * len(cameras)
    ways = [(t, max(off, 200 - 50 * t)) for t in np.linspace(0, 5, 51)]
    path = np.array([[t, goal[0] - way, *goal[1:]] for t, way in ways])
    space = None
    if cameras != "A":
        space = Space(PLACE, np.array([[PLACE[0] - 0.09 * w, *PLACE[1:]] for _, w in ways]), 1.1)
    return Truth(tuple(cameras), goal, path, 0.9 * off, space)


def told(tmp_path, off=2.0, text=None, true=None, cameras="A", **words):
    file = tmp_path / "servo.jsonl"
    file.write_text(text or log_text(off, cameras=cameras, **words))
    return run_of_log("goal 1", read_log(file), true)
