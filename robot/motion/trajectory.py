"""A path becomes joint set-points in time; and the report's Jacobian steps.

Pure: no I/O, no clock.  A *stroke* is a tuple of points (x, y) or, in space, (x, y, z), cm, so
close together where it bends that straight lines between them will do; the tip moves along it
without stopping.  Corners lie between strokes.  What is curved lies at one height z.  Letters: `q`
joint angles rad, `dq` a step, `p` a tip position cm, `J` the Jacobian cm/rad.
"""

import bisect
import math
from collections import namedtuple

from robot.motion import kinematics
from shared.arm_description import ArmError

SPACING = 0.05
"""Distance between set-points along a stroke, cm."""

SPEED_UP = 0.2
"""Time in which the tip reaches its speed at the least, s."""

JOINT_ACCELERATION = math.radians(200)
"""Greatest of a joint, rad/s^2: a link slowed harder would run ahead through its play."""

LONGEST_ARC = 200.0
"""Between two points, cm."""

TAKE_UP = 0.14
"""Least time to cross a joint's play, s."""

TAKE_UP_SPEED = math.radians(109)
"""Mean speed of a motor's shaft crossing the play, rad/s: faster, it would knock the link away."""

PRESSED_EVERY = 0.04
"""How often along a motion it is asked where gravity presses, s."""

STEP_SIZE = math.radians(5)
"""The report's length of a joint step, rad."""

ARRIVED = 1.0
"""The report's steps end this close to the goal, cm."""


class BadPath(ArmError, ValueError):
    """A path that is not a path: too few points, points that coincide, numbers that are none."""


def _checked(points, fewest, what):
    points = [tuple(map(float, point)) for point in points]
    if len(points) < fewest:
        raise BadPath("{} needs at least {} points, not {}".format(what, fewest, len(points)))
    for point in points:
        if not all(math.isfinite(value) for value in point):
            raise BadPath(
                "{} has the point ({}), which is not a place; give finite numbers in cm".format(
                    what, ", ".join(map(str, point))
                )
            )
    for a, b in zip(points, points[1:]):
        if kinematics.distance(a, b) < 1e-6:
            raise BadPath(
                "{} has the point ({}) twice in a row; leave one out".format(what, _numbers(a))
            )
    return points


def _numbers(point):
    return ", ".join("{:g}".format(value) for value in point)


def _height(points, what):
    """What comes after x and y: () in the plane, else the one z of all points."""
    if len({point[2:] for point in points}) > 1:
        raise BadPath(
            "{} lies at one height, not at {}; give one z".format(
                what, " and ".join(_numbers(point[2:]) for point in points)
            )
        )
    return tuple(points[0][2:])


def polyline(points):
    """The strokes through `points`, straight from each to the next; a line is two points."""
    points = _checked(points, 2, "a line")
    return [(a, b) for a, b in zip(points, points[1:])]


def line_from(start, angle, length):
    """The stroke from `start` in the level direction `angle` (rad from x, counter-clockwise)."""
    if not length > 0:
        raise BadPath("a line of length {:g} cm is none; give more than 0".format(length))
    way = (length * math.cos(angle), length * math.sin(angle)) + (0.0,) * (len(start) - 2)
    return polyline([start, tuple(a + b for a, b in zip(start, way))])


def rectangle(corner, opposite):
    """The four strokes of an upright rectangle, from `corner` round to it again."""
    height = _height([corner, opposite], "a rectangle")
    (x0, y0), (x1, y1) = corner[:2], opposite[:2]
    if x0 == x1 or y0 == y1:
        raise BadPath(
            "a rectangle from ({:g}, {:g}) to ({:g}, {:g}) is none; give opposite corners".format(
                x0, y0, x1, y1
            )
        )
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    return polyline([corner + height for corner in corners])


def circle(centre, radius):
    """The stroke once round `centre`, counter-clockwise, from the point nearest to the base."""
    if not (radius > 0 and math.isfinite(radius)):
        raise BadPath("a circle of radius {:g} cm is none; give more than 0".format(radius))
    _checked([centre], 1, "a circle")
    start = math.atan2(-centre[1], -centre[0])
    n = max(24, int(math.ceil(2 * math.pi * radius / SPACING)))
    return [
        tuple(
            (
                centre[0] + radius * math.cos(start + 2 * math.pi * k / n),
                centre[1] + radius * math.sin(start + 2 * math.pi * k / n),
            )
            + tuple(centre[2:])
            for k in range(n + 1)
        )
    ]


def arc(points):
    """The smooth stroke through n >= 3 points.

    Between two points it fades from the circle through them and the point before to the circle
    through them and the point after; so points of one circle give that circle, points of a line
    that line.
    """
    points = _checked(points, 3, "an arc")
    height = _height(points, "an arc")
    points = [point[:2] for point in points]
    out = [points[0]]
    last = len(points) - 2
    for i in range(last + 1):
        a, b = points[i], points[i + 1]
        before = _Circle(points[i - 1], a, b) if i > 0 else None
        after = _Circle(a, b, points[i + 2], first=True) if i < last else None
        length = max(c.length for c in (before, after) if c)
        if length > LONGEST_ARC:
            raise BadPath(
                "the arc near ({:g}, {:g}) would be {:.0f} cm long, more than {:g} is no drawing; "
                "give its points in order".format(a[0], a[1], length, LONGEST_ARC)
            )
        n = max(2, int(math.ceil(length / SPACING)))
        for k in range(1, n + 1):
            t = k / float(n)
            if before and after:
                p, r = before.at(t), after.at(t)
                out.append((p[0] + t * (r[0] - p[0]), p[1] + t * (r[1] - p[1])))
            else:
                out.append((before or after).at(t))
    return [tuple(point + height for point in out)]


class _Circle(object):
    """One piece of the circle through three points: from b to c, or from a to b if `first`."""

    def __init__(self, a, b, c, first=False):
        self.start, self.end = (a, b) if first else (b, c)
        ux, uy = b[0] - a[0], b[1] - a[1]
        vx, vy = c[0] - a[0], c[1] - a[1]
        cross = ux * vy - uy * vx
        self.centre = None
        chord = math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])
        self.length = chord
        if abs(cross) < 1e-9 * max(1.0, ux * ux + uy * uy + vx * vx + vy * vy):
            return
        uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
        self.centre = (
            a[0] + (vy * uu - uy * vv) / (2 * cross),
            a[1] + (ux * vv - vx * uu) / (2 * cross),
        )
        turn = math.copysign(2 * math.pi, cross)
        self.angle = self._angle(self.start)
        sweep = (self._angle(self.end) - self.angle) % turn
        self.radius = math.hypot(a[0] - self.centre[0], a[1] - self.centre[1])
        self.sweep = sweep
        self.length = abs(sweep) * self.radius

    def _angle(self, p):
        return math.atan2(p[1] - self.centre[1], p[0] - self.centre[0])

    def at(self, t):
        if self.centre is None:
            return tuple(a + t * (b - a) for a, b in zip(self.start, self.end))
        angle = self.angle + t * self.sweep
        return (
            self.centre[0] + self.radius * math.cos(angle),
            self.centre[1] + self.radius * math.sin(angle),
        )


Setpoint = namedtuple("Setpoint", "q q_dot p")
"""Where the joints should be (rad), how fast (rad/s), and the tip (cm)."""


class Trajectory(object):
    """Joint set-points in time along one stroke.

    Attributes:
        duration: s.
        start, end: joint angles there, rad.
        directions: per joint, the sign of its first motion (0: it does not move).
        reversals: per joint, the times (s) at which it turns round.
    """

    def __init__(self, points, joints, times, speeds):
        self._p = points
        self._q = joints
        self._t = times
        self._v = speeds
        self.duration = times[-1]
        self.start, self.end = joints[0], joints[-1]
        self.directions, self.reversals = self._turns()

    def _turns(self):
        directions, reversals = [], []
        for j in range(len(self._q[0])):
            sign, turns = 0, []
            for i, (a, b) in enumerate(zip(self._q, self._q[1:])):
                step = b[j] - a[j]
                if abs(step) < 1e-9:
                    continue
                now = 1 if step > 0 else -1
                if not sign:
                    directions.append(now)
                elif now != sign:
                    turns.append(self._t[i])
                sign = now
            if not sign:
                directions.append(0)
            reversals.append(tuple(turns))
        return tuple(directions), tuple(reversals)

    def at(self, t):
        """The Setpoint at time `t` (s); before the start and after the end it stands still."""
        times = self._t
        if t >= self.duration:
            return Setpoint(self.end, (0.0,) * len(self.end), self._p[-1])
        if t <= 0:
            return Setpoint(self.start, (0.0,) * len(self.end), self._p[0])
        i = bisect.bisect_left(times, t) - 1
        span = times[i + 1] - times[i]
        # Constant acceleration between set-points: the fraction of the way, and its rate.
        dt = t - times[i]
        v0, v1 = self._v[i], self._v[i + 1]
        way = (v0 + v1) * span / 2
        f = (v0 * dt + (v1 - v0) * dt * dt / (2 * span)) / way
        rate = (v0 + (v1 - v0) * dt / span) / way
        return Setpoint(
            tuple(a + f * (b - a) for a, b in zip(self._q[i], self._q[i + 1])),
            tuple(rate * (b - a) for a, b in zip(self._q[i], self._q[i + 1])),
            tuple(a + f * (b - a) for a, b in zip(self._p[i], self._p[i + 1])),
        )


class JointMove(object):
    """A move of all joints together from rest to rest, wherever that takes the tip.

    Each joint's way is the quintic with speed and acceleration 0 at both ends.  For the rest it
    is used like a Trajectory.

    Args:
        start, end: joint angles, rad.
        fastest: greatest speed per joint, rad/s.
        acceleration: greatest of any joint, rad/s^2.
    """

    def __init__(self, start, end, fastest, acceleration=JOINT_ACCELERATION):
        self.start, self.end = tuple(start), tuple(end)
        duration = 0.0
        for a, b, top in zip(start, end, fastest):
            way = abs(b - a)
            # The quintic's peaks: 1.875 way / T and 5.774 way / T^2.
            duration = max(duration, 1.875 * way / top, math.sqrt(5.774 * way / acceleration))
        self.duration = duration
        self.before = 0.0
        signs = tuple((b > a) - (b < a) for a, b in zip(start, end))
        self.directions, self.reversals = signs, ((),) * len(signs)

    def at(self, t):
        """The Setpoint at time `t`, s; its `p` is None."""
        x = min(max(t / self.duration, 0.0), 1.0) if self.duration else 1.0
        way = x * x * x * (10 + x * (6 * x - 15))
        rate = 30 * x * x * (1 - x) * (1 - x) / self.duration if self.duration else 0.0
        return Setpoint(
            tuple(a + way * (b - a) for a, b in zip(self.start, self.end)),
            tuple(rate * (b - a) for a, b in zip(self.start, self.end)),
            None,
        )

    def rested(self, t):
        """Per joint, for how long it has been standing at time `t`, s; negative: it moves."""
        return [t - self.duration] * len(self.start)


class TakingUpBacklash(object):
    """What the motors must do for the links to follow a trajectory in spite of play.

    A link pushed in the positive direction lags its motor by half the play, in the negative
    direction it leads.  The play is crossed before the start where the first direction differs from
    where the play lies, and around every reversal, where the link all but stands.  Where gravity
    presses a link on its motor, whichever way that goes, the play lies as it is pressed; and it is
    crossed where gravity lets go or takes over.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motion: Trajectory or JointMove.
        sides: per joint, where the play lies at the start: +1, -1, or between (0: the middle).
        pressed: from the links' angles (rad) to the side, per joint, on which gravity presses the
            play, 0: none; None: it presses on none.

    Attributes:
        duration: s, from the start of the motion; `at` begins at -before.
        before: s of taking up before the motion starts.
        sides: where the play lies at the end.
    """

    def __init__(self, joints, motion, sides, pressed=None):
        self._motion = motion
        self.duration = motion.duration
        self._crossings = []
        self.sides = []
        self.before = 0.0
        for joint, side, wanted in zip(joints, sides, _wanted_sides(motion, pressed)):
            play = joint.backlash
            time = take_up_time(joint)
            crossings = []
            _, now = wanted[0]
            if now and now != side and play:
                self.before = max(self.before, time)
                crossings.append((-time, time, now - side))
            now = now or side
            for t, then in wanted[1:]:
                if not then or then == now:
                    continue
                crossings.append((t - time / 2, time, then - now))
                now = then
                if pressed and play:  # gravity takes over anywhere, also at the very ends
                    self.before = max(self.before, time / 2 - t)
                    self.duration = max(self.duration, t + time / 2)
            self._crossings.append((play / 2, side, crossings))
            self.sides.append(now)
        self.sides = tuple(self.sides)

    def at(self, t):
        """The Setpoint of the motors' side at time `t` (s); its `p` is the tip's."""
        set_point = self._motion.at(t)
        q, q_dot = [], []
        for angle, speed, (half, side, crossings) in zip(
            set_point.q, set_point.q_dot, self._crossings
        ):
            side, rate = crossed(t, side, crossings)
            q.append(angle + half * side)
            q_dot.append(speed + half * rate)
        return Setpoint(tuple(q), tuple(q_dot), set_point.p)

    def sides_at(self, t):
        """Per joint, where the play lies at time `t` (s): from -1 to +1."""
        return tuple(crossed(t, side, crossings)[0] for _, side, crossings in self._crossings)

    def rested(self, t):
        """Per joint, for how long it has been standing at time `t`, s; negative: it moves."""
        return [t - self.duration] * len(self.sides)


def _wanted_sides(motion, pressed):
    """Per joint, where the play is to lie from when on: (s, +1, -1 or 0: as it lies), from 0 on."""
    times = {0.0}.union(*motion.reversals)
    if pressed:
        times.update(PRESSED_EVERY * k for k in range(int(motion.duration / PRESSED_EVERY) + 1))
    out = [[] for _ in motion.directions]
    for t in sorted(times):
        held = pressed(motion.at(t).q) if pressed else (0,) * len(out)
        for wanted, side, direction, turns in zip(out, held, motion.directions, motion.reversals):
            turned = sum(turn <= t for turn in turns)
            wanted.append((t, side or direction * (-1) ** turned))
    return out


def take_up_time(joint):
    """How long a joint's motor takes to cross the play, s."""
    return max(TAKE_UP, joint.backlash * joint.gear / TAKE_UP_SPEED)


def crossed(t, side, crossings):
    """Where the play lies at time `t`, and how fast that changes, 1/s.

    Args:
        side: where it lay before.
        crossings: (begin, time, step) of each.
    """
    rate = 0.0
    for begin, time, step in crossings:
        x = min(max((t - begin) / time, 0.0), 1.0)
        side += step * x * x * (3 - 2 * x)
        rate += step * 6 * x * (1 - x) / time
    return side, rate


def spread(stroke):
    """The stroke's points at most SPACING apart, ends and given points included, at least three."""
    out = [tuple(stroke[0])]
    for a, b in zip(stroke, stroke[1:]):
        n = int(math.ceil(kinematics.distance(a, b) / SPACING))
        n = max(n, 2 if len(stroke) == 2 else 1)
        for k in range(1, n + 1):
            out.append(tuple(u + (v - u) * k / float(n) for u, v in zip(a, b)))
    return out


def joint_path(arm, points, elbow=None):
    """Joint angles along `points` (cm, close together), within reach and limits, without a leap.

    Args:
        elbow: "up" | "down"; None tries the arm's own branch, then the other.

    Returns:
        As many tuples of angles, rad.

    Raises:
        kinematics.Unreachable: naming the first point that cannot be had.
    """
    first_error = None
    for branch in (elbow,) if elbow else (arm.elbow, "down" if arm.elbow == "up" else "up"):
        try:
            return _follow_branch(arm, points, kinematics.inverse(arm, points[0], elbow=branch))
        except kinematics.Unreachable as error:
            first_error = first_error or error
    raise first_error


def _follow_branch(arm, points, q):
    joints = [q]
    for p in points[1:]:
        q = kinematics.inverse(arm, p, near=q)
        leap = max(abs(a - b) for a, b in zip(q, joints[-1]))
        if leap > math.radians(45):
            raise kinematics.Unreachable(
                "at ({}) cm the arm would have to swing a joint by {:.0f} deg to stay within its "
                "limits; draw the line in two, or choose the other elbow".format(
                    ", ".join("{:.2f}".format(value) for value in p), math.degrees(leap)
                )
            )
        joints.append(q)
    return joints


def plan(arm, strokes, speed=None, elbow=None):
    """The timed Trajectories along the strokes of one drawing, on one branch throughout.

    Args:
        strokes: each begins where the one before ends; points in cm.
        speed: greatest speed of the tip, cm/s; the arm's own if None.
        elbow: "up" | "down" | None, see joint_path.

    Raises:
        kinematics.Unreachable: a point is out of reach or past a limit; nothing has moved.
    """
    for stroke in strokes:
        # Before a line to the moon is cut into set-points.
        kinematics.inverse(arm, stroke[0])
        kinematics.inverse(arm, stroke[-1])
    spaced = [spread(stroke) for stroke in strokes]
    joints = joint_path(arm, [p for points in spaced for p in points], elbow)
    out = []
    for points in spaced:
        out.append(_timed(arm, points, joints[: len(points)], speed or arm.speed))
        joints = joints[len(points) :]
    return out


def _timed(arm, points, joints, speed):
    """Trapezoidal speed, slowed where a joint would be too fast.

    Forward and backward pass over the greatest admissible speed along the path, after Bobrow,
    Dubowsky and Gibson 1985, with the limits taken as constants.
    """
    ds = [kinematics.distance(a, b) for a, b in zip(points, points[1:])]
    slopes = [[(b - a) / d for a, b in zip(q0, q1)] for q0, q1, d in zip(joints, joints[1:], ds)]
    fastest = [joint.max_speed for joint in arm.joints]
    caps = [
        min([speed] + [top / abs(s) for top, s in zip(fastest, slope) if s]) for slope in slopes
    ]
    n = len(points)
    v = [0.0] + [min(a, b) for a, b in zip(caps, caps[1:])] + [0.0]
    for i in range(1, n - 1):
        bends = [abs(b - a) / ((ds[i - 1] + ds[i]) / 2) for a, b in zip(slopes[i - 1], slopes[i])]
        # Leave half of a joint's acceleration to the speeding up and slowing down.
        bend = max(bends)
        if bend:
            v[i] = min(v[i], math.sqrt(JOINT_ACCELERATION / 2 / bend))
    along = [
        min([speed / SPEED_UP] + [JOINT_ACCELERATION / 2 / abs(s) for s in slope if s])
        for slope in slopes
    ]
    for i in range(n - 1):
        v[i + 1] = min(v[i + 1], math.sqrt(v[i] ** 2 + 2 * along[i] * ds[i]))
    for i in range(n - 2, -1, -1):
        v[i] = min(v[i], math.sqrt(v[i + 1] ** 2 + 2 * along[i] * ds[i]))
    times = [0.0]
    for i, d in enumerate(ds):
        times.append(times[-1] + 2 * d / (v[i] + v[i + 1]))
    return Trajectory(points, joints, times, v)


def jacobian_step(arm, q, dy):
    """The report's joint step: dx = J^-1 dy, scaled to a length of STEP_SIZE.

    Args:
        q: joint angles, rad.
        dy: the line's whole displacement, cm, as fixed at its start.

    Returns:
        dq, rad.

    Raises:
        kinematics.Unreachable: the arm is stretched or folded; no joint step leads that way.
    """
    J = kinematics.jacobian(arm, q)
    if kinematics.singularity(arm, q) < 1e-6:
        raise kinematics.Unreachable(
            "the Jacobian has no inverse at joint angles {} deg; start the line elsewhere".format(
                ", ".join("{:.1f}".format(math.degrees(angle)) for angle in q)
            )
        )
    dq = kinematics.solve(J, dy)
    length = math.sqrt(sum(a * a for a in dq))
    return tuple(a * STEP_SIZE / length for a in dq)


def has_arrived(start, goal, p):
    """Whether the report's steps are over: within ARRIVED of the goal, or past it."""
    if kinematics.distance(goal, p) <= ARRIVED:
        return True
    return sum((x - g) * (g - s) for x, g, s in zip(p, goal, start)) >= 0
