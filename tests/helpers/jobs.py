"""Jobs as a laptop makes them: planned strokes in a file."""

from robot.motion import kinematics, paths, trajectory
from shared.arm_description import find_arm, read_arm
from shared.job import Stroke, header_of, write_job

CROSSES = [((9.0 + 2 * k, 2.0), (10.0 + 2 * k, 6.0)) for k in range(3)]
"""Three short lines apart from one another, cm."""


def length(points):
    """Of a way, cm."""
    return sum(kinematics.distance(a, b) for a, b in zip(points, points[1:]))


def write(folder, strokes=CROSSES, arm="planar", name="crosses", layers=None, **header):
    """Plan strokes (points, cm) and write a job, as text its path.

    The times in it are rough ones; `layers` has a name for each stroke; `header` has other values
    of the JobHeader.
    """
    arm = read_arm(find_arm(arm)) if isinstance(arm, str) else arm
    planned, t, pen_up, last = [], 3.0, 0.0, None
    for k, points in enumerate(strokes):
        motions = trajectory.plan(arm, paths.pieces_of(points))
        pieces = [motion.numbers() for motion in motions]
        planned.append(Stroke(layers[k] if layers else "", length(points), t, pieces))
        t += sum(motion.duration + 0.2 for motion in motions) + 3.0
        pen_up += kinematics.distance(last, points[0]) if last else 0.0
        last = points[-1]
    path = str(folder / f"{name}.job")
    told = header_of(arm, name, arm.speed, planned, pen_up, t)._replace(**header)
    write_job(path, told, planned)
    return path
