"""Jobs, for tests that look at how they get about."""

import math
import random

from robot.motion import paths, trajectory
from shared.job import JobHeader, Stroke, header_of, write_job

HEADER = JobHeader("a line", "planar", "planar", (11.3, 9.5), 12.0, 300, 3.0, 1.0, 900.0)


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


def planned_job(path, arm, polylines, name="lines", speed=None, **asked):
    """A job that draws these polylines (cm) with the arm, written to a path.

    `asked` has other values of the JobHeader.
    """
    strokes, t = [], 0.0
    for points in polylines:
        plans = trajectory.plan(arm, paths.polyline(points), speed)
        cm = sum(math.dist(a, b) for a, b in zip(points, points[1:], strict=False))
        strokes.append(Stroke("", round(cm, 3), t, [plan.numbers() for plan in plans]))
        t += sum(plan.duration for plan in plans) + 1.0
    header = header_of(arm, name, speed or arm.speed, strokes, 1.0, t)._replace(**asked)
    write_job(str(path), header, strokes)
    return path
