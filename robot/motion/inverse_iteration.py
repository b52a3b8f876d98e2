"""Inverse kinematics by iteration: Newton's and Broyden's method, damped.  Pure.

For comparison: what moves the arm takes the closed form, `kinematics.inverse`.  The letters are
those of kinematics.
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
"""Keeps a singular J solvable and does not slow down a regular one, cm/rad."""

MIN_RADIUS_SHARE = 0.1
"""With a trust radius below this share of the greatest step, J is computed, not learned."""


if MYPY:
    Solution = NamedTuple("Solution", [("q", FixedPose), ("trace", List["Iterate"])])
else:
    Solution = record("Solution", "q trace")
Solution.__doc__ = "What an iteration found: q, rad, and its trace, a list of Iterate from q0 on."

if MYPY:
    Iterate = NamedTuple(
        "Iterate", [("iteration", int), ("q", FixedPose), ("p", FixedPoint), ("error_cm", float)]
    )
else:
    Iterate = record("Iterate", "iteration q p error_cm")
Iterate.__doc__ = "One pose of an iteration: number, q in rad, p in cm, distance to the goal in cm."


def newton_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    # type: (Arm, Point, Pose, float, int, float) -> Solution
    """Newton's method from q0 to the pose whose tip is at p: Solution(q, trace).

    Each step solves J dq = e with the Jacobian of the pose it starts from, damped where J is nearly
    singular (Levenberg-Marquardt; Wampler 1986 for arms) and no longer than a trust radius.

    tolerance       of the tip's position, cm
    max_iterations  after which Unreachable is raised
    max_step        greatest change of any joint in one step, rad
    Limits do not bend the way there; raises Unreachable where its end is outside them.
    """

    def exact(J, q, dq, dp):
        # type: (Matrix, Pose, Vector, Vector) -> Matrix
        return jacobian(arm, q)

    return _iterate(arm, p, q0, exact, tolerance, max_iterations, max_step)


def broyden_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    # type: (Arm, Point, Pose, float, int, float) -> Solution
    """Broyden's method: as `newton_inverse`, but the Jacobian is learned on the way, not computed.

    J is computed at q0; from then on each step corrects it by the rank-one update that changes it
    least while explaining what the step did (Broyden 1965). Rejected steps correct it, too: they
    teach the most. Where only tiny steps help, if any, it is computed again.
    From far off that may take more than 100 iterations, though for fewer than 1 start in 1000.
    """

    def learned(J, q, dq, dp):
        # type: (Matrix, Pose, Vector, Vector) -> Matrix
        return broyden_update(J, dq, dp)

    return _iterate(arm, p, q0, learned, tolerance, max_iterations, max_step)


def _iterate(arm, p, q0, update, tolerance, max_iterations, max_step):
    # type: (Arm, Point, Pose, JacobianUpdate, float, int, float) -> Solution
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
        # Damping that fades with the error keeps the end of the way quadratic
        dq = _clamped(damped_solve(J, e, max(0.1 * error, MIN_DAMPING)), radius)
        if _sideways_only(J, e):
            dq = min(
                _ways_out(arm, J, radius),
                key=lambda way: distance(forward(arm, _added(q, way)), p),
            )
        there = _added(q, dq)
        reached = forward(arm, there)
        dp = [after - before for after, before in zip(reached, here)]
        if distance(reached, p) < error:
            q, here, error = there, reached, distance(reached, p)
            radius = min(2 * radius, max_step)
        else:
            radius /= 4
        stuck = radius < MIN_RADIUS_SHARE * max_step
        J = jacobian(arm, q) if stuck else update(J, q, dq, dp)
        trace.append(Iterate(len(trace), q, here, error))
    return Solution(turned_into_limits(arm, p, q), trace)


def _sideways_only(J, e):
    # type: (Matrix, Vector) -> bool
    """Whether no joint moves the tip towards the goal: J^T e vanishes against |J| |e|."""
    slope = sum(dot(column, e) ** 2 for column in zip(*J))
    return slope <= 1e-12 * sum(dot(row, row) for row in J) * dot(e, e)


def _ways_out(arm, J, radius):
    # type: (Arm, Matrix, float) -> List[List[float]]
    """Steps out of a tie: stretched out or folded, with the goal straight ahead or behind.

    There every joint moves the tip sideways only, but two ways lead on in the second order: bending
    the last joint while the others hold the tip (what is left of its motion where J sees none), and
    turning the whole arm.
    """
    side = chain_of(arm).up * (1.0 if arm.elbow == "up" else -1.0)
    bend = [0.0] * (len(J[0]) - 1) + [side]
    held = damped_solve(J, [dot(row, bend) for row in J], MIN_DAMPING)
    bend = [b - h for b, h in zip(bend, held)]
    greatest = max(map(abs, bend))
    return [[b * radius / greatest for b in bend], [side * radius] + [0.0] * (len(J[0]) - 1)]


def _added(q, dq):
    # type: (Pose, Vector) -> FixedPose
    return tuple(angle + d for angle, d in zip(q, dq))


def _clamped(dq, radius):
    # type: (List[float], float) -> List[float]
    greatest = max(map(abs, dq))
    return [d * radius / greatest for d in dq] if greatest > radius else dq
