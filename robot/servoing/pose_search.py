"""The search for the joint angles at which the image is as wanted.  Pure."""

import itertools
import math
from operator import add, itemgetter, mul, sub

from robot.servoing.linear_algebra import normal_equations, solve_definite

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Iterator, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    Walls = Tuple[Pose, Pose]  # least and greatest angle of each joint, rad
    Target = Tuple[List[float], float]  # where it leads, rad, and what it leaves over, px

MIN_RESIDUAL, MIN_GAIN_SHARE = 0.25, 0.05
"""Residual at which a search ends, px^2; a step that gains no more than it and this share ends
it."""

MAX_LEFTOVER_SHARE = 0.3
"""Share of the error that a target may leave over and be taken without a search for another
posture, which takes long and finds one where more than a half is left."""

BETTER_POSTURE_SHARE = 0.7
"""Share of the error that another posture may leave over at most."""


START_SHARES = (0.2, 0.5, 0.8), (0.25, 0.75)
"""Shares of the joints' ranges where the search for another posture begins: of up to two joints,
and of more."""

GLANCE_ITERATIONS, MAX_FINALISTS = 3, 2
"""Steps for which each start is followed; number of the best that are followed to their ends."""


def best_pose(image, goal, start, walls, here=(), penalty=None, iterations=12):
    # type: (LinearImageModel, Features, Pose, Walls, Pose, Optional[Matrix], int) -> Target
    """Return the joint angles within the walls at which the goal is expected to be nearest.

    Minimizes |s(q) - goal|^2 + (q - here)' penalty (q - here) by Levenberg (1944) and Marquardt
    (1963); a joint that would leave the box is set to its wall, and the others are solved again for
    what that leaves over (active set).

    Args:
        image: LinearImageModel.
        goal: px (m).
        start: where the search begins, rad (n).
        walls: (least angles, greatest), rad (n).
        here: where the penalty is 0, rad (n).
        penalty: n x n, px^2/rad^2: covariance of s per square radian away from `here`; None: none.
        iterations: the most.

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
    best,  # type: Target
    left,  # type: float
    tolerance,  # type: float
    penalty=None,  # type: Optional[Matrix]
):
    # type: (...) -> Target
    """Return the best of `best` and of the poses that are found from all over the box.

    Args:
        image: as for best_pose.
        goal: as for best_pose.
        q: where the joints are, rad (n).
        walls: as for best_pose.
        best: (q, px left over) of the pose that was found from there.
        left: what is left over without another posture, px; see BETTER_POSTURE_SHARE.
        tolerance: px; less is not asked for.
        penalty: as for best_pose.
    """
    begun = [
        best_pose(image, goal, at_shares(shares, *walls), walls, q, penalty, GLANCE_ITERATIONS)
        for shares in itertools.product(START_SHARES[len(q) > 2], repeat=len(q))
    ]
    begun.sort(key=itemgetter(1))
    for start, _ in begun[:MAX_FINALISTS]:
        to, off = best_pose(image, goal, start, walls, q, penalty)
        if off < min(best[1], max(tolerance, BETTER_POSTURE_SHARE * left)):
            best = to, off
    return best


def within(reach, q, walls):
    # type: (Pose, Pose, Walls) -> Walls
    """Return the walls of what every joint can reach from q by so much, rad (n), inside others."""
    low = [max(wall, a - r) for wall, a, r in zip(walls[0], q, reach)]
    return low, [min(wall, a + r) for wall, a, r in zip(walls[1], q, reach)]


def at_shares(shares, low, high):
    # type: (Vector, Pose, Pose) -> List[float]
    """Return joint angles by their shares of their ranges, rad (n)."""
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
    # type: (...) -> Iterator[Target]
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
        H, downhill = normal_equations(image.jacobian(q), e)
        if penalty:
            H = [list(map(add, row, more)) for row, more in zip(H, penalty)]
            downhill = list(map(sub, downhill, pull))
        extra = damping * sum([row[-1] for row in H]) + 1e-9
        for row in H:
            row[-1] += extra
        candidate = _step_in_box(H, downhill, q, low, high)
        tried = cost(candidate)
        gained = least - tried[0]
        if gained > 0:
            q = candidate
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
    """Return q + x with H x = b for a positive definite H (its lower triangle), kept in the box."""
    stepped = list(map(add, q, solve_definite(H, b)))
    for a, least, most in zip(stepped, low, high):
        if not least <= a <= most:
            break
    else:
        return stepped
    stepped = list(q)
    free = list(range(len(q)))
    while free:
        fixed = [k for k in range(len(q)) if k not in free]
        left = [
            b[i] - sum(H[max(i, k)][min(i, k)] * (stepped[k] - q[k]) for k in fixed) for i in free
        ]
        x = solve_definite([[H[i][k] for k in free if k <= i] for i in free], left)
        for k, d in zip(free, x):
            stepped[k] = min(max(q[k] + d, low[k]), high[k])
        inside = [k for k, d in zip(free, x) if low[k] <= q[k] + d <= high[k]]
        if len(inside) == len(free):
            break
        free = inside
    return stepped
