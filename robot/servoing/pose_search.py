"""The search for the joint angles at which the image is as wanted.  Pure."""

import itertools
import math
from operator import add, itemgetter, mul, sub

from robot.servoing.linear_algebra import solve_definite

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    Walls = Tuple[Pose, Pose]  # least and greatest angle of each joint, rad
    Course = Tuple[List[float], float]  # where it leads, rad, and what it leaves over, px

MIN_RESIDUAL, MIN_GAIN_SHARE = 0.25, 0.05
"""A pose is searched until this little is left (px^2), or a step gains no more and this share."""

NEARLY_THERE = 0.3
"""A course that leaves over no more than this share of the error is taken without looking for
another posture, which takes long and finds one where more than a half is left."""

CLEARLY_BETTER = 0.7
"""Another posture must leave over no more than this share of the error."""


START_SHARES = (0.2, 0.5, 0.8), (0.25, 0.75)
"""Where in their ranges joints begin to be searched for another posture: up to two, and more."""

GLANCE_ITERATIONS, FINALISTS = 3, 2
"""Each start is followed for so many steps; so many that are then the best, to their ends."""


def best_pose(image, goal, start, walls, here=(), penalty=None, iterations=12):
    # type: (LinearImageModel, Features, Pose, Walls, Pose, Optional[Matrix], int) -> Course
    """The joint angles within the walls at which the goal is expected to be nearest.

    Makes |s(q) - goal|^2 + (q - here)' penalty (q - here) least, by Levenberg and Marquardt; a
    joint that would leave the box is set to its wall, and the others are solved again for what that
    leaves over (active set).

    Args:
        image: an image model.
        start: rad.
        walls: the least angles, and the greatest, rad.
        here: rad; for the penalty.
        penalty: n x n, px^2/rad^2: covariance of s per square radian away from `here`; None: none.

    Returns:
        (q, distance that is left, px)
    """
    *_, found = descent(image, goal, start, walls, here, penalty, iterations)
    return found


def best_posture(
    image,  # type: LinearImageModel
    goal,  # type: Features
    q,  # type: Pose
    walls,  # type: Walls
    best,  # type: Course
    left,  # type: float
    tolerance,  # type: float
    penalty=None,  # type: Optional[Matrix]
):
    # type: (...) -> Course
    """The best of `best` and of the poses that are found from all over the box, as best_pose.

    Args:
        q: where the joints are, rad.
        best: (q, px left over) of the one that was found from there.
        left: what is left over without another posture, px; see CLEARLY_BETTER.
        tolerance: px; less is not asked for.
        The others as for best_pose.
    """
    begun = [
        best_pose(image, goal, at_shares(shares, *walls), walls, q, penalty, GLANCE_ITERATIONS)
        for shares in itertools.product(START_SHARES[len(q) > 2], repeat=len(q))
    ]
    begun.sort(key=itemgetter(1))
    for start, _ in begun[:FINALISTS]:
        to, off = best_pose(image, goal, start, walls, q, penalty)
        if off < min(best[1], max(tolerance, CLEARLY_BETTER * left)):
            best = to, off
    return best


def at_shares(shares, low, high):
    # type: (Vector, Pose, Pose) -> List[float]
    """Joint angles by their shares of their ranges, rad."""
    return [a + (b - a) * share for a, b, share in zip(low, high, shares)]


def descent(
    image,  # type: LinearImageModel
    goal,  # type: Features
    start,  # type: Pose
    walls,  # type: Walls
    here=(),  # type: Pose
    penalty=None,  # type: Optional[Matrix]
    iterations=12,  # type: int
    sharp=MIN_RESIDUAL,  # type: float
):
    # type: (...) -> Iterator[Course]
    """Iterate over the steps of `best_pose`: (q, distance that is left, px), from the start on."""

    def cost(q):
        # type: (Pose) -> Tuple[float, float, List[float], Vector]
        e = list(map(sub, goal, image.predict(q)))
        square = sum(map(mul, e, e))
        if penalty is None:
            return square, square, e, ()
        away = list(map(sub, q, here))
        pull = [sum(map(mul, row, away)) for row in penalty]
        return square + sum(map(mul, pull, away)), square, e, pull

    low, high = walls
    q = list(map(min, map(max, start, low), high))
    least, square, e, pull = cost(q)
    damping = 1e-4
    yield q, math.sqrt(square)
    for _ in range(iterations):
        columns = list(zip(*image.jacobian(q)))
        H, downhill, trace = [], [], 0.0
        for k, a in enumerate(columns):
            row = [sum(map(mul, a, b)) for b in columns[: k + 1]]
            downhill.append(sum(map(mul, a, e)))
            if penalty:
                row = list(map(add, row, penalty[k]))
                downhill[k] -= pull[k]
            H.append(row)
            trace += row[k]
        extra = damping * trace + 1e-9
        for row in H:
            row[-1] += extra
        there = _step_in_box(H, downhill, q, low, high)
        tried = cost(there)
        gained = least - tried[0]
        if gained > 0:
            q = there
            least, square, e, pull = tried
            damping = max(damping / 8, 1e-6)
            yield q, math.sqrt(square)
            if least < sharp or gained < sharp + MIN_GAIN_SHARE * least:
                return
        else:
            damping *= 16
            if damping > 100:
                return
            yield q, math.sqrt(square)


def _step_in_box(H, b, q, low, high):
    # type: (Matrix, Vector, Pose, Pose, Pose) -> List[float]
    """q + x with H x = b for a positive definite H (its lower triangle), kept in the box."""
    there = list(map(add, q, solve_definite(H, b)))
    for a, least, most in zip(there, low, high):
        if not least <= a <= most:
            break
    else:
        return there
    there = list(q)
    free = list(range(len(q)))
    while free:
        fixed = [k for k in range(len(q)) if k not in free]
        left = [
            b[i] - sum(H[max(i, k)][min(i, k)] * (there[k] - q[k]) for k in fixed) for i in free
        ]
        x = solve_definite([[H[i][k] for k in free if k <= i] for i in free], left)
        for k, d in zip(free, x):
            there[k] = min(max(q[k] + d, low[k]), high[k])
        inside = [k for k, d in zip(free, x) if low[k] <= q[k] + d <= high[k]]
        if len(inside) == len(free):
            break
        free = inside
    return there
