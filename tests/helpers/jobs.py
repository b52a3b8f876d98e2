"""Jobs, for tests that look at how they get about."""

import random

from shared.job import JobHeader, Stroke, write_job

HEADER = JobHeader("a line", "planar", "planar", (11.3, 9.5), 12.0, 300, 3.0, 1.0, 9.0)


def job_file(folder, seed=1):
    """A job whose numbers are all different, so that it comes in many parts."""
    dice = random.Random(seed)
    strokes = []
    for _ in range(HEADER.strokes):
        q = [dice.random() for _ in range(2)]
        piece = [0, 1], [(1.0, 0.0, [[q[0], 0, 0, 0], [q[1], 0, 0, 0]], None)], q
        strokes.append(Stroke("", 0.01, 0.0, [piece]))
    path = folder / "a.job"
    write_job(str(path), HEADER, strokes)
    return path
