"""Where the tip is, which joint angles bring it there, and how fast one changes with the other.

Pure: numbers in, numbers out; no motor, no file, no clock. Plain Python, because on the brick a
2 x 2 solve costs less without numpy than the way into it.

    q   joint angles, rad, from the base outwards, one for each joint of the arm
    p   position of the tip, cm, in the base frame: x forward, y left, and in space z up.  The
        origin: planar, the shoulder's axis; spatial, the base's axis at the height of the paper
    J   Jacobian dp/dq, cm/rad, a tuple of rows: len(p) x len(q)
    e   what is missing, p_wanted - p, cm

A chain of joints is one entry in `_CHAINS`; everything else here works for any of them.
"""

import itertools
import math

from shared.arm_description import ArmError
from shared.record import record

TURN = 2 * math.pi

# Rounding must not push a pose at full reach, or on a limit, out of it. Both are far below what an
# encoder count (0.017 rad, about 0.3 cm at the tip) can show.
REACH_SLACK = 1e-9  # cm
LIMIT_SLACK = 1e-6  # rad: near full reach the elbow angle grows with the root of the rounding error

LEAST_DAMPING = 1e-3  # cm/rad: keeps a singular J solvable, does not slow down a regular one
RESTART = 0.1  # of the greatest step: with a smaller trust radius, J is computed, not learned

SMALLEST_PIVOT = 1e-13  # relative to the greatest element of the matrix
_NO_SOLUTION = (
    "the equations are singular (pivot {:.3g}); move the arm away from its stretched or folded pose"
)


class Unreachable(ArmError, ValueError):
    """A point that the arm cannot reach, or an iteration that did not find it."""


class Singular(ArmError, ArithmeticError):
    """A system of equations without exactly one solution, as at a singular pose."""


Solution = record("Solution", "q trace")
Solution.__doc__ = "What an iteration found: q, rad, and its trace, a list of Iterate from q0 on."

Iterate = record("Iterate", "iteration q p error_cm")
Iterate.__doc__ = "One pose of an iteration: number, q in rad, p in cm, distance to the goal in cm."


# ---- for every chain


def forward(arm, q):
    """Position p of the tip, cm, at the joint angles q, rad."""
    return joint_positions(arm, q)[-1]


def joint_positions(arm, q):
    """Positions, cm, of every joint from the base outwards and of the tip: len(q) + 1 points."""
    return _chain(arm).positions(arm, q)


def jacobian(arm, q):
    """J = dp/dq at q, cm/rad, as a tuple of rows."""
    return _chain(arm).jacobian(arm, q)


def pull(arm, q, moments):
    """What weights on the links do to each joint at q: minus the gradient of their energy.

    moments  per joint: each link's weight times the distance at which it balances (cm), and times
             its link's length for all that the next joint carries
    In the unit of the weights times cm.
    """
    return _chain(arm).pull(q, moments)


def singularity(arm, q):
    """How far q is from a singular pose, without unit: 0 at one, 1 at the best pose of the arm.

    Manipulability |det J| (Yoshikawa 1985) over its greatest value, which for two links in a plane
    is l1 l2, so that this is |sin q2|; in space times how far the tip is from the base's axis, as a
    share of its reach, since there the base moves nothing.
    """
    return _chain(arm).singularity(arm, q)


def scale(arm, q):
    """Over how long a way of the tip the joint angles bend, cm: 0 at a singular pose."""
    return _chain(arm).scale(arm, q)


def coordinates(arm):
    """How many numbers a point of this arm has: 2 in the plane, 3 in space."""
    return _chain(arm).coordinates


def reach(arm):
    """Least and greatest distance of the tip from the shoulder that the links allow, cm."""
    upper, fore = arm.joints[-2].link, arm.joints[-1].link
    return abs(upper - fore), upper + fore


def branches(arm, p):
    """Every q within the joint limits that brings the tip to p; the arm's preferred elbow first.

    The list is empty where only the limits forbid p; raises Unreachable where the links do. Where
    the tip would stand on the shoulder's axis, the shoulder's angle is arbitrary and one is given.
    """
    solutions = _solutions(arm, p)
    found = []
    for elbow in _elbows(arm):
        for solution in solutions[elbow]:
            found += (q for q in _within_limits(arm, solution) if q not in found)
    return found


def inverse(arm, p, elbow=None, near=None):
    """The q within the joint limits that brings the tip to p (cm).

    elbow  "up" | "down": only that branch. None: any
    near   q, rad: the solution whose greatest joint travel from there is least. None: the arm's
           preferred elbow goes first, and of solutions a turn apart the one nearest to home
    Raises Unreachable where the links or the limits forbid p.
    """
    solutions = _solutions(arm, p)
    if near is not None:
        _check_pose(arm, near)
    candidates = []
    for branch in [elbow] if elbow else _elbows(arm):
        if branch not in solutions:
            raise ArmError("elbow = {}: must be one of {}".format(elbow, ", ".join(_elbows(arm))))
        for solution in solutions[branch]:
            candidates += _within_limits(arm, solution)
        if candidates and near is None:
            break
    if not candidates:
        raise _forbidden(
            arm,
            p,
            [
                ("elbow " + branch, solution)
                for branch in ([elbow] if elbow else _elbows(arm))
                for solution in solutions[branch]
            ],
        )
    start = near if near is not None else [joint.home for joint in arm.joints]
    return min(candidates, key=lambda q: _travel(start, q))


def nearest(arm, p, q):
    """As `inverse` with `near`, in less time where that is near indeed."""
    best, least = None, math.pi
    for poses in _solutions(arm, p, q).values():
        for pose in poses:
            there, greatest = [], 0.0
            for angle, last in zip(pose, q):
                way = angle - last
                if not -math.pi < way < math.pi:
                    way -= TURN * round(way / TURN)
                there.append(last + way)
                if way > greatest or -way > greatest:
                    greatest = abs(way)
            if greatest < least:
                best, least = there, greatest
    for joint, angle in zip(arm.joints, best or ()):
        if not joint.lower <= angle <= joint.upper:
            best = None
    return inverse(arm, p, near=q) if best is None else tuple(best)


# ---- inverse by iteration


def newton_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    """Newton's method from q0 to the pose whose tip is at p: Solution(q, trace).

    Each step solves J dq = e with the Jacobian of the pose it starts from, damped where J is nearly
    singular (Levenberg-Marquardt; Wampler 1986 for arms) and no longer than a trust radius.

    tolerance       of the tip's position, cm
    max_iterations  after which Unreachable is raised
    max_step        greatest change of any joint in one step, rad
    Limits do not bend the way there; raises Unreachable where its end is outside them.
    """

    def exact(J, q, dq, dp):
        return jacobian(arm, q)

    return _iterate(arm, p, q0, exact, tolerance, max_iterations, max_step)


def broyden_inverse(arm, p, q0, tolerance=1e-6, max_iterations=100, max_step=0.5):
    """Broyden's method: as `newton_inverse`, but the Jacobian is learned on the way, not computed.

    J is computed at q0; from then on each step corrects it by the rank-one update that changes it
    least while explaining what the step did (Broyden 1965). Rejected steps correct it, too: they
    teach the most. Where only tiny steps help, if any, it is computed again.
    From far off that may take more than 100 iterations, though for fewer than 1 start in 1000.
    """

    def learned(J, q, dq, dp):
        return broyden_update(J, dq, dp)

    return _iterate(arm, p, q0, learned, tolerance, max_iterations, max_step)


def broyden_update(J, dq, dp):
    """J + (dp - J dq) dq^T / (dq^T dq), as a tuple of rows; dq must not be zero."""
    square = sum(d * d for d in dq)
    return tuple(
        tuple(a + (moved - _dot(row, dq)) * d / square for a, d in zip(row, dq))
        for row, moved in zip(J, dp)
    )


def _iterate(arm, p, q0, update, tolerance, max_iterations, max_step):
    _check_point(arm, p)
    _check_pose(arm, q0)
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
                    _shown(p), max_iterations, _degrees(q0), error
                )
            )
        e = [wanted - is_ for wanted, is_ in zip(p, here)]
        # Damping that fades with the error keeps the end of the way quadratic
        dq = _clamped(damped_solve(J, e, max(0.1 * error, LEAST_DAMPING)), radius)
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
        stuck = radius < RESTART * max_step
        J = jacobian(arm, q) if stuck else update(J, q, dq, dp)
        trace.append(Iterate(len(trace), q, here, error))
    return Solution(_settled(arm, p, q), trace)


def _sideways_only(J, e):
    """Whether no joint moves the tip towards the goal: J^T e vanishes against |J| |e|."""
    slope = sum(_dot(column, e) ** 2 for column in zip(*J))
    return slope <= 1e-12 * sum(_dot(row, row) for row in J) * _dot(e, e)


def _ways_out(arm, J, radius):
    """Steps out of a tie: stretched out or folded, with the goal straight ahead or behind.

    There every joint moves the tip sideways only, but two ways lead on in the second order: bending
    the last joint while the others hold the tip (what is left of its motion where J sees none), and
    turning the whole arm.
    """
    side = _chain(arm).up * (1.0 if arm.elbow == "up" else -1.0)
    bend = [0.0] * (len(J[0]) - 1) + [side]
    held = damped_solve(J, [_dot(row, bend) for row in J], LEAST_DAMPING)
    bend = [b - h for b, h in zip(bend, held)]
    greatest = max(map(abs, bend))
    return [[b * radius / greatest for b in bend], [side * radius] + [0.0] * (len(J[0]) - 1)]


def _added(q, dq):
    return tuple(angle + d for angle, d in zip(q, dq))


def _settled(arm, p, q):
    """q, moved by full turns into the limits, to the nearest place where they allow it."""
    candidates = _within_limits(arm, q)
    if not candidates:
        raise _forbidden(arm, p, [("the pose found", q)])
    return min(candidates, key=lambda found: _travel(q, found))


def _clamped(dq, radius):
    greatest = max(map(abs, dq))
    return [d * radius / greatest for d in dq] if greatest > radius else dq


# ---- small dense systems


def solve(J, b, damping=0.0):
    """x with J x = b, for a square J; with damping > 0, and then for any shape, `damped_solve`.

    Gaussian elimination with partial pivoting. Raises Singular when a pivot vanishes against the
    greatest element of J.
    """
    if damping:
        return damped_solve(J, b, damping)
    n = len(b)
    if n == 2:
        return _solve_two(J, b)
    if n == 3:
        return _solve_three(J, b)
    rows = [list(row) + [value] for row, value in zip(J, b)]
    least = SMALLEST_PIVOT * max(abs(a) for row in J for a in row)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        if not abs(rows[k][k]) > least:  # worded so that NaN ends here, too
            raise Singular(_NO_SOLUTION.format(rows[k][k]))
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] -= factor * rows[k][j]
    x = [0.0] * n
    for k in reversed(range(n)):
        known = sum(rows[k][j] * x[j] for j in range(k + 1, n))
        x[k] = (rows[k][n] - known) / rows[k][k]
    return x


def _solve_two(J, b):
    """By Cramer's rule: what is solved most often by far."""
    (a, c), (d, f) = J
    det = a * f - c * d
    if not abs(det) > SMALLEST_PIVOT * max(abs(a), abs(c), abs(d), abs(f)) ** 2:
        raise Singular(_NO_SOLUTION.format(det))
    return [(b[0] * f - c * b[1]) / det, (a * b[1] - b[0] * d) / det]


def _solve_three(J, b):
    """The same: by the cross products of the columns."""
    (a, d, g), (e, h, k), (f, i, m) = J
    u, v, w = b
    hm, ig, di = h * m - k * i, i * g - d * m, d * k - g * h
    det = a * hm + e * ig + f * di
    if not abs(det) > SMALLEST_PIVOT * max([abs(x) for row in J for x in row]) ** 3:
        raise Singular(_NO_SOLUTION.format(det))
    return [
        (u * hm + v * ig + w * di) / det,
        (u * (k * f - e * m) + v * (a * m - g * f) + w * (g * e - a * k)) / det,
        (u * (e * i - h * f) + v * (d * f - a * i) + w * (a * h - d * e)) / det,
    ]


def damped_solve(J, e, damping):
    """x that makes |J x - e|^2 + damping^2 |x|^2 least, for a J of any shape.

    x = (J^T J + damping^2 I)^-1 J^T e, or the same with J J^T where J has fewer rows than columns.
    damping has the unit of J. With damping 0, this is the least-squares or the shortest solution,
    and Singular is raised where J has not full rank.
    """
    columns = tuple(zip(*J))
    wide = len(J) < len(columns)
    vectors = J if wide else columns
    square = [[_dot(a, b) for b in vectors] for a in vectors]
    for i in range(len(square)):
        square[i][i] += damping * damping
    if wide:
        y = solve(square, e)
        return [_dot(column, y) for column in columns]
    return solve(square, [_dot(column, e) for column in columns])


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b))


# ---- the planar chain: every axis upright, the angles add up along the chain


def _joined(joints, q, x, y):
    """Links joined in one plane, the first at (x, y): every joint and the end."""
    heading, positions = 0.0, [(x, y)]
    for joint, angle in zip(joints, q):
        link = joint.link
        heading += angle
        x += link * math.cos(heading)
        y += link * math.sin(heading)
        positions.append((x, y))
    return positions


def _planar_positions(arm, q):
    return _joined(arm.joints, q, 0.0, 0.0)


def _planar_jacobian(arm, q):
    """A turn about an upright axis moves the tip across its lever arm (geometric Jacobian)."""
    if len(q) == 2:
        upper, fore = arm.joints
        heading, (first, second) = q[0], q
        ahead, aside = fore.link * math.cos(first + second), fore.link * math.sin(first + second)
        x, y = upper.link * math.cos(heading) + ahead, upper.link * math.sin(heading) + aside
        return (-y, -aside), (x, ahead)
    positions = _planar_positions(arm, q)
    x, y = positions.pop()
    return (
        tuple([joint_y - y for _, joint_y in positions]),
        tuple([x - joint_x for joint_x, _ in positions]),
    )


def _planar_pull(q, moments):
    return [0.0] * len(q)


def _planar_solutions(arm, p, near):
    return {branch: [pose] for branch, pose in _bent(arm, p, p).items()}


def _bent(arm, point, p):
    """How two links bend to a point of their plane, seen from the first one's axis.

    By the cosine rule, with half angles: the tangent form keeps its digits at full reach and at the
    hole, where acos loses half.

    Returns:
        {"up": (heading of the first, bend > 0 of the second), "down": the same with bend < 0}
    """
    upper, fore = arm.joints[-2].link, arm.joints[-1].link
    hole, outer = reach(arm)
    far = math.hypot(*point)
    if not hole - REACH_SLACK <= far <= outer + REACH_SLACK:
        where, advice = (
            ("out of reach", "nearer")
            if far > outer
            else ("in the hole in the middle", "farther out")
        )
        raise Unreachable(
            "{} is {:.6g} cm from the shoulder, {}: the links reach from {:.6g} to"
            " {:.6g} cm; choose a point {}".format(_shown(p), far, where, hole, outer, advice)
        )
    bend = 2 * math.atan2(
        math.sqrt(max(0.0, (outer - far) * (outer + far))),
        math.sqrt(max(0.0, (far - hole) * (far + hole))),
    )
    heading = math.atan2(point[1], point[0])
    inside = math.atan2(fore * math.sin(bend), upper + fore * math.cos(bend))
    return {"up": (heading - inside, bend), "down": (heading + inside, -bend)}


def _planar_singularity(arm, q):
    return abs(math.sin(q[1]))


def _planar_scale(arm, q):
    return 0.5 * reach(arm)[1] * math.sin(q[1]) ** 2


# ---- the spatial chain: the base turns about an upright axis, shoulder and elbow pitch about level
# ones.  Pitch is counted upwards from level; the base's link is the height of the shoulder.


def _spatial_profile(arm, q):
    """In the upright plane in which the arm is: (distance from the base's axis, height), cm."""
    return [(0.0, 0.0)] + _joined(arm.joints[1:], q[1:], 0.0, arm.joints[0].link)


def _spatial_positions(arm, q):
    ahead, aside = math.cos(q[0]), math.sin(q[0])
    return [(out * ahead, out * aside, height) for out, height in _spatial_profile(arm, q)]


def _spatial_jacobian(arm, q):
    """Each joint moves the tip across its lever arm (geometric Jacobian)."""
    ahead, aside = math.cos(q[0]), math.sin(q[0])
    profile = _spatial_profile(arm, q)
    out, height = profile.pop()
    columns = [(-out * aside, out * ahead, 0.0)]
    for joint_out, joint_height in profile[1:]:
        outwards = joint_height - height
        columns.append((outwards * ahead, outwards * aside, out - joint_out))
    return tuple(zip(*columns))


def _spatial_pull(q, moments):
    torques, heading = [0.0], 0.0
    for k in range(1, len(q)):
        heading += q[k]
        pulled = -moments[k] * math.cos(heading)
        for inner in range(1, k):
            torques[inner] += pulled
        torques.append(pulled)
    return torques


def _spatial_solutions(arm, p, near):
    """Facing the point, and bent over backwards to it."""
    x, y, z = p
    yaw, out = math.atan2(y, x), math.hypot(x, y)
    solutions = {"up": [], "down": []}
    # Facing the point, the elbow is above where it is bent down; from behind, where it is bent up.
    ways = [(0.0, out, "down"), (math.pi, -out, "up")]
    if near:
        ways = ways[:1] if _spatial_out(arm, near) > 0 else ways[1:]
    for turned, reached, above in ways:
        poses = _bent(arm, (reached, z - arm.joints[0].link), p)
        for bent, pitches in poses.items():
            solutions["up" if bent == above else "down"].append((yaw + turned,) + pitches)
    return solutions


def _spatial_out(arm, q):
    """How far the tip is from the base's axis, cm; negative: behind it."""
    _, upper, fore = arm.joints
    return upper.link * math.cos(q[1]) + fore.link * math.cos(q[1] + q[2])


def _spatial_singularity(arm, q):
    return abs(math.sin(q[2]) * _spatial_out(arm, q)) / reach(arm)[1]


def _spatial_scale(arm, q):
    return min(0.5 * reach(arm)[1] * math.sin(q[2]) ** 2, abs(_spatial_out(arm, q)))


# A chain: positions(arm, q), jacobian(arm, q), pull(q, moments), solutions(arm, p, near) as
# _solutions, singularity(arm, q), scale(arm, q), the number of coordinates of p, how many
# joints are below the shoulder, and the sign of the elbow's angle in the branch "up".
_Chain = record(
    "_Chain", "positions jacobian pull solutions singularity scale coordinates below up"
)
_CHAINS = {
    "planar": _Chain(
        _planar_positions,
        _planar_jacobian,
        _planar_pull,
        _planar_solutions,
        _planar_singularity,
        _planar_scale,
        coordinates=2,
        below=0,
        up=1,
    ),
    "spatial": _Chain(
        _spatial_positions,
        _spatial_jacobian,
        _spatial_pull,
        _spatial_solutions,
        _spatial_singularity,
        _spatial_scale,
        coordinates=3,
        below=1,
        up=-1,
    ),
}


def _chain(arm):
    try:
        return _CHAINS[arm.chain]
    except KeyError:
        raise ArmError(
            "{}: no kinematics for chain = {}; use one of {}".format(
                arm.file, arm.chain, ", ".join(sorted(_CHAINS))
            )
        ) from None


# ---- limits


def _solutions(arm, p, near=None):
    """{branch: [q]}, limits aside; of those that face two ways, only the way `near` (rad) does."""
    _check_point(arm, p)
    return _chain(arm).solutions(arm, p, near)


def _check_point(arm, p):
    size = coordinates(arm)
    # Squares must stay finite, too
    usable = len(p) == size
    for c in p:
        usable = usable and -1e100 < c < 1e100
    if not usable:
        raise Unreachable(
            "{}: a point is {} finite numbers, cm; give such a point".format(_shown(p), size)
        )


def _check_pose(arm, q):
    if len(q) != len(arm.joints) or not all(map(math.isfinite, q)):
        raise ArmError(
            "{} deg: a pose is {} finite angles; give such a pose".format(
                _degrees(q), len(arm.joints)
            )
        )


def _elbows(arm):
    return ("up", "down") if arm.elbow == "up" else ("down", "up")


def _within_limits(arm, q):
    """Every q that differs from this one by full turns and is within the joint limits."""
    return list(itertools.product(*(_turned(joint, angle) for joint, angle in zip(arm.joints, q))))


def _turned(joint, angle):
    first = math.ceil((joint.lower - LIMIT_SLACK - angle) / TURN)
    last = math.floor((joint.upper + LIMIT_SLACK - angle) / TURN)
    return [min(max(angle + k * TURN, joint.lower), joint.upper) for k in range(first, last + 1)]


def _forbidden(arm, p, poses):
    """The Unreachable that says, for each (name, q), which joint would break which limit."""
    reasons = []
    for name, q in poses:
        joint, angle = next(
            (joint, angle) for joint, angle in zip(arm.joints, q) if not _turned(joint, angle)
        )
        # Of the turns, the one that comes nearest to what is allowed
        middle = (joint.lower + joint.upper) / 2
        angle -= TURN * round((angle - middle) / TURN)
        side, limit = ("lower", joint.lower) if angle < middle else ("upper", joint.upper)
        reasons.append(
            "{} needs {} at {:.2f} deg, limit {} = {:.2f} deg".format(
                name, joint.name, math.degrees(angle), side, math.degrees(limit)
            )
        )
    return Unreachable(
        "{} is within reach of the links but not of the joint limits ({}); choose"
        " another point".format(_shown(p), "; ".join(reasons))
    )


# ---- wording and distances


def distance(a, b):
    """Of two points, cm."""
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def _travel(q, to):
    """The greatest way of any joint, which is what takes the time."""
    return max(abs(a - b) for a, b in zip(q, to))


def _shown(p):
    return "({}) cm".format(", ".join("{:.6g}".format(c) for c in p))


def _degrees(q):
    return "({})".format(", ".join("{:.1f}".format(math.degrees(angle)) for angle in q))
