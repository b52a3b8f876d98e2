"""Exploration: motions that show how the joints move the image.  Pure."""

import math

from robot.servoing.linear_algebra import length
from robot.servoing.pose_search import best_pose, within
from robot.servoing.progress import FIRST_STEP

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Sequence  # noqa: F401

    from robot.servoing.camera_selection import CameraSelection  # noqa: F401
    from robot.servoing.image_model import Features, Pose  # noqa: F401
    from robot.servoing.image_models import ImageModels  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.pose_search import Walls  # noqa: F401

EXPLORING_STEP = math.radians(8)
"""Size of a joint's exploring step, rad."""

MIN_EXPLORED_SIGMAS, MIN_EXPLORED_MOTION = 3.0, 3.0
"""Least motion of the marker by which an exploring step shows something, standard deviations of a
frame, and px: a folded arm, seen from a slant, moves it by little."""

LINEAR_ITERATIONS = 4
"""Steps of a search by an image that is linear in the joints' angles."""


def inward(q, walls):
    # type: (Pose, Walls) -> List[float]
    """Return the pose where every joint is an exploring step nearer to the middle of its range.

    Args:
        q: joint angles, rad (n).
        walls: least and greatest angle of each joint, rad.
    """
    return [a + math.copysign(EXPLORING_STEP, (b + c) / 2 - a) for a, b, c in zip(q, *walls)]


def explore_one(q, walls, goal, models, selection):
    # type: (Pose, Walls, Features, ImageModels, CameraSelection) -> List[float]
    """Return where the next joint's exploring step leads; those that are known go on meanwhile.

    Args:
        q: joint angles, rad (n).
        walls: least and greatest angle of each joint, rad.
        goal: px (m).
        models: ImageModels.
        selection: CameraSelection, which counts that joint as explored.
    """
    k, explored = selection.next_joint()
    to = list(q)
    to[k] = inward(q, walls)[k]
    if not any(explored) or models.kind.blames_all:
        return to
    reach = [FIRST_STEP / 2 * known for known in explored]
    near = within(reach, to, walls)
    penalty = models.penalty(selection, len(q))
    penalty[k] = [0.0] * len(q)
    for row in penalty:
        row[k] = 0.0
    image = models.together(selection)
    return best_pose(image, goal, to, near, to, penalty, LINEAR_ITERATIONS)[0]


def is_seen_moving(J, sigma):
    # type: (Matrix, float) -> bool
    """Return whether an exploring step of any joint moves the marker.

    Args:
        J: image Jacobian, px/rad.
        sigma: noise of a frame, px.
    """
    least = max(MIN_EXPLORED_SIGMAS * sigma, MIN_EXPLORED_MOTION)
    return max(map(length, zip(*J))) * EXPLORING_STEP > least
