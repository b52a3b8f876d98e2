"""Inverse kinematics by iteration: Newton's and Broyden's method with a trust region.  Pure.

For comparison and teaching: the arm itself uses the closed form, `kinematics.inverse`.  With the
letters of kinematics, each step minimises |J dq - e|^2 + lambda^2 |dq|^2:

    dq = (J^T J + lambda^2 I)^-1 J^T e,    lambda = max(|e| / 10, MIN_DAMPING)

(Levenberg, 1944; Marquardt, 1963; for arms Wampler, 1986).  Newton's plain J^-1 e grows beyond all
bounds near a singular pose and lands far off.  A lambda in proportion to |e| fades at the goal, so
that convergence stays quadratic (Yamashita and Fukushima, 2001); a constant one would slow it.

The step is cut to a trust radius of the largest joint change.  If the tip comes nearer, the step
is taken and the radius doubled; else it is discarded and the radius divided by four (Conn, Gould
and Toint, Trust-Region Methods, 2000).  The usual test compares the gain with a predicted one.  It
is left out: with a learned J a poor prediction is no reason to discard a step that helps.
"""

from robot.motion.kinematics import (
    Unreachable,
    chain_of,
    check_point,
    check_pose,
    distance,
    forward,
    jacobian,
    point_text,
    pose_text,
    turned_into_limits,
)
from robot.motion.linear_systems import broyden_update, damped_solve, dot
from shared.record import record

MYPY = False
if MYPY:
    from typing import Callable, List, NamedTuple, Sequence, Tuple  # noqa: F401

    from robot.motion.chains import FixedPoint, FixedPose, Point, Pose  # noqa: F401
    from robot.motion.linear_systems import Matrix, Vector  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    JacobianUpdate = Callable[[Matrix, Pose, Vector, Vector], Matrix]  # of J at q, by dq and dp

MIN_DAMPING = 1e-3
"""Minimum damping, cm/rad: a singular J stays solvable, and a regular one converges as fast."""

MIN_RADIUS_SHARE = 0.1
"""Minimum trust radius for a learned J, as a share of the maximum step; below it J is computed."""


if MYPY:
    Solution = NamedTuple("Solution", [("q", FixedPose), ("trace", List["Iterate"])])
else:
    Solution = record("Solution", "q trace")
Solution.__doc__ = "Result of an iteration: q, rad, and its trace, a list of Iterate from q0 on."

if MYPY:
    Iterate = NamedTuple(
        "Iterate", [("iteration", int), ("q", FixedPose), ("p", FixedPoint), ("error_cm", float)]
    )
else:
    Iterate = record("Iterate", "iteration q p error_cm")
Iterate.__doc__ = "One pose of an iteration: number, q in rad, p in cm, distance to the goal in cm."


def newton_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    # type: (Arm, Point, Pose, float, int, float) -> Solution
    """Return the Solution of Newton's method from q0 for a tip at p; J is computed at each pose.

    Args:
        arm: shared.arm_description.Arm.
        p: wanted tip, cm.
        q0: first pose, rad.
        tolerance: of the tip's position, cm.
        max_iterations: number of steps.
        max_step: maximum change of any joint in one step, rad.

    Raises:
        Unreachable: no solution after `max_iterations`, or one outside the joint limits; the
            limits do not bend the path to it.
    """

    def exact(J, q, dq, dp):
        # type: (Matrix, Pose, Vector, Vector) -> Matrix
        return jacobian(arm, q)

    return _iterate(arm, p, q0, exact, tolerance, max_iterations, max_step)


def broyden_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    # type: (Arm, Point, Pose, float, int, float) -> Solution
    """Return the Solution of Broyden's method, as `newton_inverse` but with a learned Jacobian.

    J is computed at q0.  Then each step dq, which moved the tip by dp, corrects it by the smallest
    change with J dq = dp (Broyden, 1965):

        J <- J + (dp - J dq) dq^T / (dq^T dq)

    Rejected steps correct it, too: there the prediction was worst.  Once the trust radius is small,
    J is computed again.  From far off fewer than 1 start in 1000 takes more than 100 iterations.
    """

    def learned(J, q, dq, dp):
        # type: (Matrix, Pose, Vector, Vector) -> Matrix
        return broyden_update(J, dq, dp)

    return _iterate(arm, p, q0, learned, tolerance, max_iterations, max_step)


def _iterate(arm, p, q0, update, tolerance, max_iterations, max_step):
    # type: (Arm, Point, Pose, JacobianUpdate, float, int, float) -> Solution
    """Iterate from q0 with J updated by `update`; see newton_inverse."""
    check_point(arm, p)
    check_pose(arm, q0)
    q = tuple(q0)
    here = forward(arm, q)
    error = distance(here, p)
    J = jacobian(arm, q)
    radius = max_step
    trace = [Iterate(0, q, here, error)]
    while error > tolerance:
        if len(trace) > max_iterations:
            raise Unreachable(
                "{}: no solution after {} iterations from {} deg, still {:.3g} cm"
                " away; choose another start or point".format(
                    point_text(p), max_iterations, pose_text(q0), error
                )
            )
        e = [wanted - is_ for wanted, is_ in zip(p, here)]
        dq = _clamped(damped_solve(J, e, max(0.1 * error, MIN_DAMPING)), radius)
        if _sideways_only(J, e):
            dq = min(
                _escape_steps(arm, J, radius),
                key=lambda step: distance(forward(arm, _added(q, step)), p),
            )
        trial = _added(q, dq)
        reached = forward(arm, trial)
        dp = [after - before for after, before in zip(reached, here)]
        if distance(reached, p) < error:
            q, here, error = trial, reached, distance(reached, p)
            radius = min(2 * radius, max_step)
        else:
            radius /= 4
        stuck = radius < MIN_RADIUS_SHARE * max_step
        J = jacobian(arm, q) if stuck else update(J, q, dq, dp)
        trace.append(Iterate(len(trace), q, here, error))
    return Solution(turned_into_limits(arm, p, q), trace)


def _sideways_only(J, e):
    # type: (Matrix, Vector) -> bool
    """Return whether no joint moves the tip towards the goal: |J^T e| << |J| |e|."""
    slope = sum(dot(column, e) ** 2 for column in zip(*J))
    return slope <= 1e-12 * sum(dot(row, row) for row in J) * dot(e, e)


def _escape_steps(arm, J, radius):
    # type: (Arm, Matrix, float) -> List[List[float]]
    """Return steps (rad) away from a saddle: stretched or folded, the goal on the arm's line.

    There the gradient J^T e vanishes, and so does every damped step; but two steps help in second
    order: bending the last joint in the null space of J, and turning the whole arm.
    """
    side = chain_of(arm).up * (1.0 if arm.elbow == "up" else -1.0)
    bend = [0.0] * (len(J[0]) - 1) + [side]
    held = damped_solve(J, [dot(row, bend) for row in J], MIN_DAMPING)
    bend = [b - h for b, h in zip(bend, held)]
    greatest = max(map(abs, bend))
    return [[b * radius / greatest for b in bend], [side * radius] + [0.0] * (len(J[0]) - 1)]


def _added(q, dq):
    # type: (Pose, Vector) -> FixedPose
    """Return q + dq, rad."""
    return tuple(angle + d for angle, d in zip(q, dq))


def _clamped(dq, radius):
    # type: (List[float], float) -> List[float]
    """Return dq (rad), scaled so that no joint changes by more than `radius`."""
    greatest = max(map(abs, dq))
    return [d * radius / greatest for d in dq] if greatest > radius else dq
