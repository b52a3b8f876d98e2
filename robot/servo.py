"""One decision of visual servoing: from what was seen to where the joints go, and the verdict.

Pure: no clock, no socket, no motor.

    q   joint angles, rad (n)
    s   image features, px (m): u and v of every camera in turn, or those of Rows;  s_star  where
        they shall be
    e   s - s_star
    J   image Jacobian ds/dq, px/rad (m x n)

`look`: the arm stands, is measured, decides, moves (Servo, ReportServo).  `stream`: it decides
while it moves (Stream, around a Servo).
"""

import bisect
import itertools
import math
import random
from collections import namedtuple
from operator import add, itemgetter, mul, sub

from robot.image_jacobian import (
    ChainModel,
    LinearPicture,
    LocalJacobian,
    Picture,
    back_substituted,
    cholesky,
    dot,
    forward_substituted,
)
from robot.motion import kinematics
from robot.motion.kinematics import Singular, broyden_update, damped_solve, solve
from robot.motion.online_trajectory import Moving

CONVERGED, UNREACHABLE, LIMIT, SINGULAR = "converged", "unreachable", "limit", "singular"

# Measuring

FEW, MANY = 6, 12
"""Frames of a measurement; where noise might decide whether it has arrived, up to MANY."""

MEDIAN = math.pi / 2
"""Variance of a median of normal noise, over that of a mean."""

SIGMA, LEAST_SIGMA = 1.0, 0.2
"""Noise of a frame before it is known, and the least that is believed, px."""

SCATTERED = 3.0
"""Frames that scatter so much more than usual are not enough yet."""

IN_MOTION = 2.0
"""A frame that was taken in motion is doubted by so much more, px: the shutter, the two clocks."""

STRAIGHT = 0.2
"""Three frames in motion belong together if the middle one is off their line by no more than this
share of the way (and noise)."""

JOINT_ERROR = 0.35
"""Standard deviation of a motor's angle, counts (degrees); of the joint's play, it is a tenth."""

CONTENT = 0.7
"""Share of the tolerance at which it ends; what is off by more is corrected once."""

# Exploring and stepping

EXPLORE = math.radians(8)
"""Size of a joint's exploring step, rad."""

UNSEEN = 3.0
"""An exploring step that moves the marker by fewer standard deviations shows nothing."""

SAME = 6.0
"""Cameras see the same if the condition of the image by space (greatest over least singular value)
is more: two less than 15 degrees apart, most often, and none that are 30 degrees apart."""

FLAT_VIEW = "seen by {}, the tip may be off along the line of sight; look from another side, too"

FIRST_STEP, LEAST_STEP, MOST_STEP = (math.radians(x) for x in (35, 3, 60))
"""Trust region: the greatest step of a joint, rad."""

WAY = 150.0
"""With J of one place alone, a goal farther off is gone for by way-points, px."""

AGREES, DISAGREES = 0.3, 0.6
"""Share of a step that was predicted wrongly, below and above which the region grows or shrinks."""

CAUTION = 0.1
"""Weight of what is not known of J, beside the error that is to be made small."""

TELLING = 6.0
"""A step that moved the marker by less, in standard deviations, tells nothing of the models."""

FORGET = 0.6
"""Weight of the newest step in how wrong a model was lately."""

MARGIN = math.radians(1)
"""Distance kept from joint limits, rad: nobody knows the play exactly."""

SHARP, FLAT = 0.25, 0.05
"""A pose is searched no finer than this, px^2."""

# Giving up

FAR = 30.0
"""Two starts that end equally far off, and by more than this (px), end where the arm ends."""

NEAR = 3.0
"""Tolerances within which a goal is near."""

IMPROVED, STAGNANT, STAGNANT_NEAR = 0.9, 4, 10
"""So many moves (more where it is near) without the error falling to this share of the best:
start elsewhere."""

CLEARLY = 0.7
"""Another posture must leave over no more than this share of the error."""

STALLED, HOPELESS = 0.9, 2
"""A course stalls that leaves over more than this share of the error; so many may on the way to a
goal, with a model that is right lately, before all is explored anew; then it is out of reach,
unless there is another posture to try."""

STARTS = (0.2, 0.5, 0.8), (0.25, 0.75)
"""Where in their ranges joints begin to be searched for another posture: up to two, and more."""

GLANCES, FINALISTS = 3, 2
"""Each start is followed for so many steps; so many that are then the best, to their ends."""

MOST_RESTARTS, ALIKE = 4, 3
"""After so many starts from elsewhere, or so many that end equally far off, the goal counts as out
of reach."""

DIVERGED, DIVERGING = 1.3, 3
"""So many moves in a row with the error beyond this many times the best: explore anew."""

SURPRISE = 25.0
"""A step predicted by all models so wrongly, px, and by more than half: the world has changed."""

View = namedtuple("View", "camera s goal variance frames")
View.__doc__ = """What one camera has measured while the arm stood.

s, goal    px;  variance  of each element of s, px^2;  frames  that it took
"""

Decision = namedtuple("Decision", "action q verdict reason")
Decision.__doc__ = """What to do.

action   "explore" | "move" | "restart": go to q (rad); "end": with a verdict and its reason
"""


class Rows(object):
    """Which rows of the image count: u and v of every camera, or some of them.

    `stereo`: all of them.  `xyz`: as the report has it, u and v of the first camera and, of the
    second one, the row that tells what the first does not see.

    Args:
        kind: one of shared.orders.ROWS.
        joints: how many the rows must determine.
        third: "u" | "v" of the second camera; None: as exploring shows.
    """

    BOTH, NONE = slice(0, 2), slice(0, 0)
    ONE = {"u": slice(0, 1), "v": slice(1, 2)}

    def __init__(self, kind, joints, third=None):
        self._joints = joints
        self._all = kind == "stereo"
        self._third = third
        self._chosen = {}  # camera: slice

    def of(self, camera):
        """The slice of (u, v) of a camera that counts."""
        if self._all or not self._chosen:
            return self.BOTH
        return self._chosen.get(camera, self.NONE)

    def choose(self, J):
        """Settle on three rows, once that is possible.

        Args:
            J: {camera: its image Jacobian (2 x n), px/rad}, of the cameras that have been explored.
        """
        if self._all or self._chosen or len(J) < 2:
            return
        first, second = sorted(J)[:2]
        third = self.ONE.get(self._third)
        if third is None:
            # Of the second camera's rows, the one with more that is not in the span of the first's.
            left = [length(_rejected(row, J[first])) for row in J[second]]
            third = self.ONE["u" if left[0] > left[1] else "v"]
        self._chosen = {first: self.BOTH, second: third}

    def values(self, by_camera):
        """What counts of {camera: a value for u and one for v}, of all cameras in turn."""
        return [x for camera in sorted(by_camera) for x in by_camera[camera][self.of(camera)]]

    def names(self, cameras):
        """As "A.u"."""
        return self.values({camera: (camera + ".u", camera + ".v") for camera in cameras})

    def count(self, cameras):
        """How many of these cameras' rows count."""
        parts = [self.of(camera) for camera in cameras]
        return sum([part.stop - part.start for part in parts])

    def suffice(self, cameras):
        """Whether there are as many as joints."""
        return self.count(cameras) >= self._joints


def _rejected(row, others):
    """What is left of a row (n) without what lies in the span of two others."""
    basis = []
    for other in list(others) + [row]:
        left = list(other)
        for unit in basis:
            share = dot(left, unit)
            left = [a - share * u for a, u in zip(left, unit)]
        size = length(left)
        if size > 0:
            basis.append([a / size for a in left])
    return left


def length(e):
    """Euclidean."""
    return math.sqrt(sum(map(mul, e, e)))


def apart(a, b):
    """Greatest difference of two lists of angles, rad."""
    return max(map(abs, map(sub, a, b)))


def median(values):
    """Of a list of numbers."""
    values = sorted(values)
    half = len(values) // 2
    return values[half] if len(values) % 2 else (values[half - 1] + values[half]) / 2


def robust_mean(frames):
    """Median of what was seen, after far-off frames were left out.

    Args:
        frames: list of s, px.

    Returns:
        (s, standard deviation of a frame by the median absolute deviation, frames kept)
    """
    middle = [median(column) for column in zip(*frames)]
    columns = list(zip(*frames))
    sigma = sum(1.4826 * median([abs(x - m) for x in c]) for c, m in zip(columns, middle))
    sigma /= len(middle)
    limit = max(3 * sigma, 3.0)
    kept = [f for f in frames if max(abs(x - m) for x, m in zip(f, middle)) <= limit] or frames
    return tuple(median(column) for column in zip(*kept)), sigma, len(kept)


def condition(J):
    """Greatest over least singular value of J (m x n, m >= n); inf where the least is 0.

    By Hestenes' one-sided rotations (1958).
    """
    columns = [list(column) for column in zip(*J)]
    for _ in range(30):
        turned = False
        for i in range(len(columns)):
            for j in range(i + 1, len(columns)):
                a, b = columns[i], columns[j]
                aa, bb, ab = dot(a, a), dot(b, b), dot(a, b)
                if abs(ab) <= 1e-12 * math.sqrt(aa * bb):
                    continue
                turned = True
                angle = 0.5 * math.atan2(2 * ab, aa - bb)
                c, s = math.cos(angle), math.sin(angle)
                columns[i] = [c * x + s * y for x, y in zip(a, b)]
                columns[j] = [c * y - s * x for x, y in zip(a, b)]
        if not turned:
            break
    sizes = [length(column) for column in columns]
    return max(sizes) / min(sizes) if min(sizes) > 0 else float("inf")


def best_pose(picture, goal, start, low, high, here, caution, iterations=12):
    """The joint angles in the box low..high at which the goal is expected to be nearest.

    Makes |s(q) - goal|^2 + (q - here)' caution (q - here) least, by Levenberg and Marquardt; a
    joint that would leave the box is set to its wall, and the others are solved again for what that
    leaves over (active set).

    Args:
        picture: image_jacobian.Picture.
        start, low, high, here: rad.
        caution: n x n, px^2/rad^2: covariance of s per square radian away from `here`.

    Returns:
        (q, distance that is left, px)
    """
    *_, found = descent(picture, goal, start, low, high, here, caution, iterations)
    return found


def descent(picture, goal, start, low, high, here, caution, iterations=12):
    """Iterate over the steps of `best_pose`: (q, distance that is left, px), from the start on."""

    def cost(q):  # plain loops: with so few numbers, they are fastest
        total, e, pull = 0.0, [], []
        for wanted, y in zip(goal, picture.predict(q)):
            e.append(wanted - y)
            total += e[-1] * e[-1]
        away = list(map(sub, q, here))
        for row, x in zip(caution, away):
            pull.append(sum(map(mul, row, away)))
            total += pull[-1] * x
        return total, e, pull

    q = list(map(min, map(max, start, low), high))
    least, e, pull = cost(q)
    damping = 1e-4
    yield q, length(e)
    for _ in range(iterations):
        columns = list(zip(*picture.jacobian(q)))
        H, downhill, trace = [], [], 0.0
        for k, a in enumerate(columns):
            row = list(caution[k][: k + 1])
            for j in range(k + 1):
                row[j] += sum(map(mul, a, columns[j]))
            H.append(row)
            downhill.append(sum(map(mul, a, e)) - pull[k])
            trace += row[k]
        extra = damping * trace + 1e-9
        for row in H:
            row[-1] += extra
        there = _step_in_box(H, downhill, q, low, high)
        costs, e_there, pull_there = cost(there)
        if costs < least:
            gained = least - costs
            q, least, e, pull = there, costs, e_there, pull_there
            damping = max(damping / 8, 1e-6)
            yield q, length(e)
            if costs < SHARP or gained < SHARP + FLAT * costs:
                return
        else:
            damping *= 16
            if damping > 100:
                return
            yield q, length(e)


def _step_in_box(H, b, q, low, high):
    """q + x with H x = b for a positive definite H (its lower triangle), kept in the box."""
    there = list(map(add, q, _solve_definite(H, b)))
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
        x = _solve_definite([[H[i][k] for k in free if k <= i] for i in free], left)
        for k, d in zip(free, x):
            there[k] = min(max(q[k] + d, low[k]), high[k])
        inside = [k for k, d in zip(free, x) if low[k] <= q[k] + d <= high[k]]
        if len(inside) == len(free):
            break
        free = inside
    return there


def _solve_definite(H, b):
    if len(b) == 2:  # most often by far, and several times as fast
        (a,), (c, d) = H
        det = a * d - c * c
        return [(d * b[0] - c * b[1]) / det, (a * b[1] - c * b[0]) / det]
    L = cholesky(H)
    return back_substituted(L, forward_substituted(L, b))


class Measure(object):
    """Collects frames of an arm that stands until they are enough; the median, robustly."""

    def __init__(self, tolerance, rows):
        self._sigmas = {}
        self._tolerance = tolerance
        self._rows = rows

    def sigma_of(self, camera):
        """Noise of a frame of a camera, px."""
        return self._sigmas.get(camera, SIGMA)

    @property
    def sigma(self):
        """The same of the noisiest camera."""
        return max(self._sigmas.values()) if self._sigmas else SIGMA

    def views(self, frames):
        """[View], or None while more frames are needed.

        Args:
            frames: {camera: [(t, s, goal)]} in order of time, all since the arm stands.
        """
        if not frames or min(len(seen) for seen in frames.values()) < FEW:
            return None
        views, spreads = [], {}
        scattered = False
        for camera in sorted(frames):
            s, spread, kept = robust_mean([s for _, s, _ in frames[camera]])
            usual = self.sigma_of(camera)
            variance = MEDIAN * max(usual, LEAST_SIGMA) ** 2 / kept
            views.append(View(camera, s, frames[camera][-1][2], variance, len(frames[camera])))
            spreads[camera] = min(max(spread, LEAST_SIGMA), SCATTERED * usual)
            scattered = scattered or spread > SCATTERED * usual
        off = length(error_of(views, self._rows))
        enough = min(view.frames for view in views) >= MANY
        doubtful = abs(off - self._tolerance) < 2 * math.sqrt(sum(v.variance for v in views))
        if (doubtful or scattered) and not enough:
            return None
        for camera in spreads:
            usual = self.sigma_of(camera)
            self._sigmas[camera] = usual + 0.3 * (spreads[camera] - usual)
        return views


class ReportMeasure(object):
    """The report's: 20 points over 2 s, their mean; with `robust` their median."""

    POINTS, PERIOD = 20, 0.1

    def __init__(self, robust=False):
        self.sigma = SIGMA
        self._robust = robust

    def views(self, frames):
        """As Measure.views."""
        views = []
        for camera in sorted(frames):
            points, due = [], None
            for t, s, _ in frames[camera]:
                if due is None or t >= due - 1e-6:
                    points.append(s)
                    due = t + self.PERIOD if due is None else due + self.PERIOD
            if len(points) < self.POINTS:
                return None
            columns = list(zip(*points))
            s = [median(c) if self._robust else sum(c) / len(c) for c in columns]
            views.append(View(camera, tuple(s), frames[camera][-1][2], 0.1, len(points)))
        return views or None


def error_of(views, rows):
    """e = s - s_star, the Rows that count of all cameras in turn, px."""
    return rows.values({view.camera: tuple(map(sub, view.s, view.goal)) for view in views})


class ReportServo(object):
    """The report's algorithm, to the letter (Broyden with gamma = 1, steps of 10, 5 and 2 degrees).

    What it leaves open: the exploring steps are of 10 degrees and not taken back; dx is the step as
    it was commanded, of which a joint limit may have taken some; at the tolerance it ends; the
    cameras that it begins with are those that it needs.

    Args:
        joints: of the arm's description.
        tolerance: px.
        rows: Rows; all if None.
        robust: measure by medians.

    Attributes:
        using: the model in use, for the log.  J: px/rad, None at first.
        rows: Rows.
    """

    EXPLORE = math.radians(10)
    FAR, NEAR = 30.0, 15.0
    STEPS = tuple(math.radians(x) for x in (10, 5, 2))

    def __init__(self, joints, tolerance, rows=None, robust=False):
        self.using, self.J = "report", None
        self.rows = rows or Rows("stereo", len(joints))
        self.measure = ReportMeasure(robust)
        self.cameras = None
        self._low = [joint.lower for joint in joints]
        self._high = [joint.upper for joint in joints]
        self._tolerance = tolerance
        self._columns = []  # of J as explored, by camera
        self._seen = self._dx = self._x = None

    def suffices(self, cameras):
        """As Servo.suffices."""
        if self.cameras is None:
            return self.rows.suffice(cameras)
        return set(self.cameras) <= set(cameras)

    def glimpse(self, camera, q, s, only=None):
        """What is seen in motion is not used."""

    def decide(self, q, views):
        """As Servo.decide."""
        if self.cameras is None:
            self.cameras = [view.camera for view in views]
        views = [view for view in views if view.camera in self.cameras]
        n = len(q)
        self._x = list(q) if self._x is None else self._x
        seen = {view.camera: view.s for view in views}
        before, self._seen = self._seen, seen
        if before is not None and self.J is None:
            self._columns.append(
                {
                    camera: [(a - b) / self.EXPLORE for a, b in zip(seen[camera], before[camera])]
                    for camera in seen
                }
            )
            if len(self._columns) == n:
                J = {c: tuple(zip(*[column[c] for column in self._columns])) for c in seen}
                self.rows.choose(J)
                self.cameras = [c for c in self.cameras if self.rows.count([c])]
                self.J, before = tuple(self.rows.values(J)), None
        e = error_of(views, self.rows)
        if length(e) < self._tolerance or not any(e):
            return Decision("end", None, CONVERGED, "")
        if self.J is None:
            dx = [self.EXPLORE * (k == len(self._columns)) for k in range(n)]
            return self._step("explore", dx)
        if before is not None:
            dy = map(sub, self.rows.values(seen), self.rows.values(before))
            self.J = broyden_update(self.J, self._dx, list(dy))
        try:
            wanted = [-x for x in e]
            square = len(self.J) == n
            dx = solve(self.J, wanted) if square else damped_solve(self.J, wanted, 0.0)
        except Singular:
            return Decision("end", None, SINGULAR, "the Jacobian has no inverse")
        mu = self.STEPS[0 if length(e) >= self.FAR else 1 if length(e) >= self.NEAR else 2]
        return self._step("move", [mu * d / length(dx) for d in dx])

    def _step(self, action, dx):
        self._dx = dx
        moved = [a + d for a, d in zip(self._x, dx)]
        box = zip(moved, self._low, self._high)
        self._x = [min(max(a, low), high) for a, low, high in box]
        return Decision(action, list(self._x), None, "")


class JointHistory(object):
    """Where the joints were: a picture is of the past.

    Args:
        seconds: how long it is kept.
    """

    def __init__(self, seconds=2.0):
        self._seconds = seconds
        self._times, self._angles = [], []

    def add(self, t, q):
        """The joints are at q (rad) at time t (s); earlier times than the last are left out."""
        if self._times and t <= self._times[-1]:
            return
        self._times.append(t)
        self._angles.append(tuple(q))
        if t - self._times[0] > 1.5 * self._seconds:
            old = max(0, bisect.bisect(self._times, t - self._seconds) - 1)
            del self._times[:old]
            del self._angles[:old]

    def at(self, t):
        """q at time t, rad, between the neighbours in time; None before the first."""
        k = bisect.bisect(self._times, t)
        if k == 0:
            return None
        if k == len(self._times):
            return self._angles[-1]
        share = (t - self._times[k - 1]) / (self._times[k] - self._times[k - 1])
        return tuple(a + share * (b - a) for a, b in zip(self._angles[k - 1], self._angles[k]))

    @property
    def last(self):
        """(t, q) of the newest entry, or None."""
        return (self._times[-1], self._angles[-1]) if self._times else None


class Goal(object):
    """Where a goal marker is in one camera's picture, also while the arm hides it."""

    WINDOW, LATELY = 30, 22
    """Sightings that tell whether it moves, and those that tell how fast."""
    MOVES = 6.0
    """A goal slower than this stands, px/s."""
    LATELY_SEEN = 0.3
    """For so long is it known where a goal is that moves, s."""
    HIDES, CLEAR = 50.0, 0.9
    """So near to the tip (px) a standing goal may be half hidden; believed only if so confident."""
    REFRESHED, STANDING = 0.1, 0.3
    """What was worked out from sightings is good for so long, of a goal that moves and of one that
    stands, s: to do so takes a third of a tick."""

    def __init__(self):
        self._velocity = (0.0, 0.0)
        self._seen = []
        self._place = None
        self._refreshed_at = -math.inf

    @property
    def velocity(self):
        """px/s; zeros while it stands."""
        self._refresh()
        return self._velocity

    @property
    def moving(self):
        """Whether it moves, and is not only noisy."""
        return any(self.velocity)

    def add(self, t, g, confidence, s):
        """It was seen at g (px) at time t (s), the tip at s."""
        unclear = confidence < self.CLEAR and self._seen and not any(self._velocity)
        if unclear and length([a - b for a, b in zip(g, s)]) < self.HIDES:
            return
        self._seen.append((t, g))
        del self._seen[: -self.WINDOW]

    def _refresh(self):
        """Work out place and velocity anew, where it is time for that."""
        good = self.STANDING if not any(self._velocity) else self.REFRESHED
        if len(self._seen) <= self.WINDOW / 2:
            good = 0.0
        if not self._seen or self._seen[-1][0] - self._refreshed_at < good:
            return
        self._refreshed_at = self._seen[-1][0]
        third = len(self._seen) // 3
        velocity = (0.0,) * len(self._seen[0][1])
        if third >= 5:
            t0, early = _middle(self._seen[:third])
            t1, late = _middle(self._seen[-third:])
            velocity = [(b - a) / (t1 - t0) for a, b in zip(early, late)]
        if length(velocity) < self.MOVES:
            self._velocity = (0.0,) * len(velocity)
            self._place = _middle(self._seen)
        else:
            self._fit(velocity)

    def _fit(self, velocity):
        """A line through the last sightings that lie near the one by medians."""
        lately = self._seen[-self.LATELY :]
        t0, place = _middle(lately)
        off = [
            length([x - y - v * (t - t0) for x, y, v in zip(g, place, velocity)]) for t, g in lately
        ]
        limit = max(3 * median(off), 3.0)
        kept = [seen for seen, far in zip(lately, off) if far <= limit]
        n = len(kept)
        t0 = sum(t for t, _ in kept) / n
        columns = list(zip(*(g for _, g in kept)))
        times = [t - t0 for t, _ in kept]
        spread = dot(times, times) or 1.0
        self._velocity = tuple(dot(times, column) / spread for column in columns)
        self._place = t0, [sum(c) / n for c in columns]

    @property
    def latest(self):
        """Where it was seen last, px; None if it never was."""
        return self._seen[-1][1] if self._seen else None

    def at(self, t):
        """Where it is at time t, px; None if it was never seen, or moves and was not lately."""
        self._refresh()
        if self._place is None:
            return None
        t0, place = self._place
        if not any(self._velocity):
            return tuple(place)
        if t - self._seen[-1][0] > self.LATELY_SEEN:
            return None
        return tuple([x + v * (t - t0) for x, v in zip(place, self._velocity)])


def _middle(seen):
    """Medians of the times and of the places of sightings."""
    return median([t for t, _ in seen]), [median(c) for c in zip(*(g for _, g in seen))]


def stacked(pictures):
    """One Picture of several cameras, their rows in turn.

    Args:
        pictures: [(Picture, slice of its rows that counts, their weight)].
    """
    first, rows, weight = pictures[0]
    if len(pictures) == 1 and rows == Rows.BOTH and weight == 1.0:
        return first
    if all(isinstance(picture, LinearPicture) for picture, _, _ in pictures):
        W, offset = [], []
        for picture, rows, weight in pictures:
            W += [[weight * a for a in w] for w in picture.W[rows]]
            offset += [weight * o for o in picture.offset[rows]]
        return first.at_once(W, offset)

    def predict(q):
        return [w * y for picture, rows, w in pictures for y in picture.predict(q)[rows]]

    def jacobian(q):
        return tuple(
            [
                [w * a for a in row]
                for picture, rows, w in pictures
                for row in picture.jacobian(q)[rows]
            ]
        )

    return Picture(predict, jacobian)


def models_of(method, arm):
    """{name: a function of a camera's name that makes its model}."""

    def local(noise_aware):
        return lambda camera: LocalJacobian(2, len(arm.joints), noise_aware)

    if method == "broyden":
        return {"broyden": local(False)}
    if method == "kalman":
        return {"kalman": local(True)}
    links = [joint.link for joint in arm.joints]
    return {"kalman": local(True), "chain": lambda camera: ChainModel(2, arm.chain, links)}


class Servo(object):
    """Look, then move: models learn how the image moves, the one that was right lately decides.

    Args:
        arm: shared.arm_description.Arm.
        models: {name: function of a camera's name that makes its model}, see models_of.
        tolerance: px.
        seed: draws where to start anew.
        known: the models need no exploring.
        rows: Rows; all if None.

    Attributes:
        using: name of the model that made the last step; None when exploring.
        J: of that model, px/rad, its rows those that count; None before there is one.
        rows: Rows.
        cameras: those that it goes by.
        measure: has `views(frames)`.
    """

    def __init__(self, arm, models, tolerance, seed=0, known=False, rows=None):
        self.using, self.J = None, None
        self._arm = arm
        self._n = len(arm.joints)
        self.rows = rows or Rows("stereo", self._n)
        self.measure = Measure(tolerance, self.rows)
        self._low = [joint.lower + MARGIN for joint in arm.joints]
        self._high = [joint.upper - MARGIN for joint in arm.joints]
        self._joint_variance = [
            (JOINT_ERROR * math.radians(1) / joint.gear) ** 2 + (0.1 * joint.backlash) ** 2
            for joint in arm.joints
        ]
        self._tolerance = tolerance
        self._make, self._names = models, sorted(models)
        self._local = next((name for name in self._names if name != "chain"), "chain")
        self._models = {}  # (name, camera): model
        self.cameras = []
        self._looks = {}  # camera: how often it was looked through since exploring began
        self._wrong = dict.fromkeys(models, 0.5)
        self._region = FIRST_STEP
        self._luck = random.Random(seed)
        self._known = known
        self._explored = [known] * self._n
        self._glimpsed = {}
        self._begin()
        self._q, self._seen = None, {}  # where it was looked from, and what was seen, by camera
        self._pictures, self._blurs = {}, {}  # by (name, camera)

    def _begin(self):
        """On the way to a goal."""
        self._best, self._stagnant, self._diverging = None, 0, 0
        self._stuck_at = []
        self._bound = None  # where it is on its way to, rad
        self._stalled = 0
        self._checked = False  # by exploring anew, that it is out of reach
        self._postures = []  # that have been tried, rad
        self._refined = False
        self._flat = False  # has it once been found that the cameras see the same?

    # Learning

    def _model(self, name, camera):
        if (name, camera) not in self._models:
            self._models[name, camera] = self._make[name](camera)
        return self._models[name, camera]

    def suffices(self, cameras):
        """Whether what these cameras see determines where the joints go."""
        return self.rows.suffice(cameras)

    def _known_through(self, camera):
        """Whether every joint has been moved before the eyes of a camera."""
        return self._known or self._looks.get(camera, 0) > self._n

    def glimpse(self, camera, q, s, only=None):
        """Learn from a frame that was taken in motion, when the joints were at q.

        All models do, or `only` the one of this name.  Each frame waits for the next one: what does
        not lie between its neighbours is left out.
        """
        frames = self._glimpsed.setdefault(camera, [])
        frames.append((q, s))
        del frames[:-3]
        if len(frames) < 3:
            return
        (_, before), (q, s), (_, after) = frames
        way = [b - a for a, b in zip(before, after)]
        off = length([x - (a + b) / 2 for a, x, b in zip(before, s, after)])
        sigma = self.measure.sigma_of(camera)
        if off > STRAIGHT * length(way) + 4 * sigma + IN_MOTION:
            return
        for name in (only,) if only else self._names:
            variance = sigma**2 + IN_MOTION**2 + self._blur(name, camera)
            self._model(name, camera).observe(q, s, variance, standing=False)

    def _blur(self, name, camera):
        """What the joints' own uncertainty makes of a row of this camera, px^2."""
        if (name, camera) not in self._blurs:
            picture = self._pictures.get((name, camera))
            if picture is None:
                return 4.0
            columns = zip(*picture.jacobian(self._q))
            self._blurs[name, camera] = sum(
                sum(map(mul, c, c)) / len(c) * w for c, w in zip(columns, self._joint_variance)
            )
        return self._blurs[name, camera]

    def _look_from(self, q, views):
        """Take in a measurement; the pictures are from here from now on."""
        for view in views:
            for name in self._names:
                model = self._model(name, view.camera)
                model.observe(q, view.s, view.variance + self._blur(name, view.camera))
                self._pictures[name, view.camera] = model.seen_from(q, view.s)
        self._blurs = {}

    def _judge(self, q, seen):
        """How well the step that led here was predicted: of which model, and in what region."""
        before = {camera: self._seen[camera] for camera in self.cameras if camera in self._seen}
        cameras = sorted(set(before) & set(seen))
        moved = length([x for c in cameras for x in map(sub, seen[c], before[c])])
        if moved < TELLING * self.measure.sigma:
            return
        missed = {}
        for name in self._names:
            predicted = {c: self._pictures[name, c].predict(q) for c in cameras}
            missed[name] = length([x for c in cameras for x in map(sub, predicted[c], seen[c])])
            wrong = min(missed[name] / moved, 2.0)
            self._wrong[name] += FORGET * (wrong - self._wrong[name])
        if self.using is None:
            return
        step = apart(q, self._q)
        wrong = missed[self.using] / moved
        if wrong > DISAGREES:
            self._region = max(LEAST_STEP, step / 2)
        elif wrong < AGREES:
            self._region = min(MOST_STEP, max(self._region, 2 * step))
        if min(missed.values()) > max(SURPRISE, 0.5 * moved):
            for model in self._models.values():
                model.doubt_all()

    # Deciding

    def decide(self, q, views):
        """What to do now that the arm stands at q (rad) and `views` ([View]) is what is seen.

        Returns:
            Decision
        """
        q = list(q)
        seen = {view.camera: view.s for view in views}
        if self._q is not None and all(self._explored):
            self._judge(q, seen)
        self._look_from(q, views)
        self._choose_cameras(q, views)
        unknown = self._q is None or self._known or not all(self._explored)
        self._q, self._seen = q, seen
        self._glimpsed = {}
        used = [view for view in views if view.camera in self.cameras]
        goal = self._together({view.camera: view.goal for view in used})
        off = length(error_of(used, self.rows))
        there = off < self._tolerance * (1 if self._refined else CONTENT)
        if there:
            if not unknown and self._sees_flat():
                if self._flat:
                    reason = FLAT_VIEW.format(" and ".join(self.cameras))
                    return Decision("end", None, SINGULAR, reason)
                self._flat = True  # false sightings may say so, too: look again
                return self._explore_anew(q, goal, views)
            self._begin()  # should the goal move on
            return Decision("end", None, CONVERGED, "")
        if not unknown and self.using is None and not self._marker_moved(q):
            return Decision("end", None, SINGULAR, "the marker does not move when the joints do")
        self._refined = self._refined or off < self._tolerance
        if not all(self._explored):
            return self._explore(q, goal)
        self._note_progress(off)
        near = self._best < NEAR * self._tolerance
        if self._stagnant >= (STAGNANT_NEAR if near else STAGNANT):
            return self._restart()
        if self._diverging >= DIVERGING and not self._known:
            return self._explore_anew(q, goal, views)
        return self._move(q, goal, off, views)

    def _choose_cameras(self, q, views):
        """Of those that see: those that are known well enough, or all if these are too few."""
        cameras = [view.camera for view in views]
        for camera in cameras:
            self._looks[camera] = self._looks.get(camera, 0) + 1
        known = [camera for camera in cameras if self._known_through(camera)]
        self.rows.choose({c: self._pictures[self._in_use(), c].jacobian(q) for c in known})
        if self.rows.suffice(known):
            cameras = known
        elif all(self._explored):
            self._explored = [False] * self._n  # before the eyes of those that have come since
        if self.cameras and not set(cameras) & set(self.cameras):
            self._begin()
        self.cameras = cameras
        # Of cameras that see unequally well, each counts by its noise.
        noise = [max(self.measure.sigma_of(camera), LEAST_SIGMA) for camera in cameras]
        self._weights = {c: min(noise) / sigma for c, sigma in zip(cameras, noise)}

    def _together(self, by_camera):
        """Of what cameras say of their u and v: all that counts, by its weight, in turn."""
        cameras = [camera for camera in self.cameras if camera in by_camera]
        return self.rows.values({c: [self._weights[c] * x for x in by_camera[c]] for c in cameras})

    def _go(self, action, q):
        """The Decision to go to q, as far as the limits allow."""
        return Decision(action, list(map(min, map(max, q, self._low), self._high)), None, "")

    def _note_progress(self, off):
        if self._best is None or off < IMPROVED * self._best:
            self._best, self._stagnant = off, 0
        else:
            self._stagnant += 1
        self._diverging = self._diverging + 1 if off > DIVERGED * self._best + SURPRISE else 0

    def _marker_moved(self, q):
        """Whether exploring has shown that any joint moves the marker."""
        columns = zip(*self._picture(self._local).jacobian(q))
        return max(map(length, columns)) * EXPLORE > UNSEEN * self.measure.sigma

    def _sees_flat(self):
        """Whether several cameras see all but the same, and leave the depth untold.

        Only the chain knows more than its last few steps have told.
        """
        if len(self.cameras) == 1 or "chain" not in self._make:
            return False
        C = self.rows.values({c: self._models["chain", c].by_space() for c in self.cameras})
        return condition(C) > SAME

    def _explore(self, q, goal):
        """Move a joint of which nothing is known; those that are known go on meanwhile."""
        self.using = None
        k = self._explored.index(False)
        to = list(q)
        middle = (self._low[k] + self._high[k]) / 2
        to[k] += math.copysign(EXPLORE, middle - q[k])
        if any(self._explored) and self._local != "broyden":
            # (Plain Broyden would lay what the new joint does to the charge of all that moved.)
            name = self._local
            reach = [FIRST_STEP / 2 * known for known in self._explored]
            low = [max(wall, a - r) for wall, a, r in zip(self._low, to, reach)]
            high = [min(wall, a + r) for wall, a, r in zip(self._high, to, reach)]
            caution = self._caution(name)
            caution[k] = [0.0] * self._n
            for row in caution:
                row[k] = 0.0
            to, _ = best_pose(self._picture(name), goal, to, low, high, to, caution)
        self._explored[k] = True
        return self._go("explore", to)

    def _explore_anew(self, q, goal, views):
        """What is known of the image does not lead to the goal: it may have moved."""
        for model in self._models.values():
            model.doubt_all()
        self._look_from(q, views)
        self._forget_exploring()
        self._looks = {view.camera: 1 for view in views}
        self._best, self._diverging, self._bound = None, 0, None
        return self._explore(q, goal)

    def _forget_exploring(self):
        self._explored = [self._known] * self._n
        self._looks.clear()

    def _restart(self):
        self._stuck_at.append(self._best)
        alike = [off for off in self._stuck_at if abs(off - self._best) < 0.1 * self._best]
        far = self._best > FAR
        if len(self._stuck_at) > MOST_RESTARTS or (far and len(alike) == ALIKE):
            return Decision(
                "end", None, UNREACHABLE, "no nearer than {:.1f} px".format(min(self._stuck_at))
            )
        return self._start_from(
            self._posture([self._luck.uniform(0.25, 0.75) for _ in range(self._n)])
        )

    def _start_from(self, q):
        """Go there, and begin as if nothing were known for certain."""
        self.using = None
        self._best, self._stagnant, self._region, self._bound = None, 0, FIRST_STEP, None
        self._forget_exploring()
        for model in self._models.values():
            model.doubt_all()
        return self._go("restart", q)

    def _other_posture(self, q):
        """One not yet tried in which the tip would be where it is, or nearly, rad; or None.

        Two joints have two, and _best_posture has looked for both; in space it would have to know
        what half a turn of the base away looks like.
        """
        if self._n < 3:
            return None
        self._postures.append(q)
        q = map(min, map(max, q, self._low), self._high)
        others = kinematics.branches(self._arm, kinematics.forward(self._arm, tuple(q)))
        others = [q for q in others if min(apart(q, p) for p in self._postures) > FIRST_STEP]
        return others[0] if others else None

    def _picture(self, name):
        """Of all that counts, as _together."""
        return stacked(
            [(self._pictures[name, c], self.rows.of(c), self._weights[c]) for c in self.cameras]
        )

    def _caution(self, name):
        total = [[0.0] * self._n for _ in range(self._n)]
        for camera in self.cameras:
            rows, weight = self.rows.count([camera]), self._weights[camera]
            for row, other in zip(total, self._models[name, camera].covariance()):
                for j, value in enumerate(other):
                    row[j] += rows * CAUTION * weight * weight * value
        return total

    def _move(self, q, goal, off, views):
        name = min(self._names, key=self._wrong.get)
        self.using = name
        picture, caution = self._picture(name), self._caution(name)
        J = {c: self._pictures[name, c].jacobian(q) for c in self.cameras}
        self.J = tuple(self.rows.values(J))
        if name == "chain":
            to, left = self._course(picture, goal, q, caution)
            if left > max(self._tolerance, STALLED * off):
                # Caution keeps it here, or geometry does: what if all were known?
                known = [[0.0] * self._n] * self._n
                here = best_pose(picture, goal, q, self._low, self._high, q, known)
                to, left = self._best_posture(picture, goal, q, known, here, left)
                self._stalled += 1
                hopeless = self._stalled > HOPELESS and left > self._tolerance
                if hopeless and self._wrong[name] < DISAGREES:
                    if not (self._checked or self._known):
                        self._checked = True
                        return self._explore_anew(q, goal, views)
                    other = self._other_posture(q)
                    if other is None:
                        return self._out_of_reach(to, left)
                    self._stalled = 0
                    return self._start_from(other)
                if apart(to, q) > FIRST_STEP:
                    self._best = float("inf")  # on the way there it may be farther off
            self._bound = to
            greatest = apart(to, q)
            if greatest > self._region:
                to = [b + (a - b) * self._region / greatest for a, b in zip(to, q)]
        else:
            low = [max(wall, a - self._region) for wall, a in zip(self._low, q)]
            high = [min(wall, a + self._region) for wall, a in zip(self._high, q)]
            nearer = min(1.0, WAY / off)
            here = self._together(self._seen)
            point = [y + nearer * (g - y) for y, g in zip(here, goal)]
            to, _ = best_pose(picture, point, q, low, high, q, caution)
        if self._best < NEAR * self._tolerance:
            # To and fro without end: the play is not what it is said to be.
            gain = 1.0 / (1.0 + 0.5 * self._stagnant)
            to = [a + gain * (b - a) for a, b in zip(q, to)]
        return self._go("move", to)

    def _out_of_reach(self, to, left):
        for joint, a, low, high in zip(self._arm.joints, to, self._low, self._high):
            if min(a - low, high - a) < MARGIN:
                reason = "the {} is at its limit, {:.0f} px short".format(joint.name, left)
                return Decision("end", None, LIMIT, reason)
        return Decision("end", None, UNREACHABLE, "the arm ends {:.0f} px short".format(left))

    def _posture(self, shares):
        """Joint angles by their shares of their ranges, rad."""
        box = zip(self._low, self._high, shares)
        return [low + (high - low) * share for low, high, share in box]

    def _course(self, picture, goal, q, caution):
        """(q, px left over): straight to the goal, or on to where it is bound for, or anywhere."""
        box = self._low, self._high, q, caution
        to, left = best_pose(picture, goal, q, *box)
        if left <= self._tolerance:
            return to, left
        if self._bound is None:
            return self._best_posture(picture, goal, q, caution, (to, left), left)
        other, less = best_pose(picture, goal, self._bound, *box)
        return (other, less) if less < left - 1 else (to, left)

    def _best_posture(self, picture, goal, q, caution, best, left):
        """Of the best from here, and those from all over the joints' ranges; see CLEARLY."""
        box = self._low, self._high, q, caution
        begun = [
            best_pose(picture, goal, self._posture(shares), *box, iterations=GLANCES)
            for shares in itertools.product(STARTS[self._n > 2], repeat=self._n)
        ]
        begun.sort(key=itemgetter(1))
        for start, _ in begun[:FINALISTS]:
            to, off = best_pose(picture, goal, start, *box)
            if off < min(best[1], max(self._tolerance, CLEARLY * left)):
                best = to, off
        return best

    def picture(self, camera, q, s):
        """What is known of a camera that sees s with the joints at q: see models."""
        return self._models[self._in_use(), camera].seen_from(q, s)

    def shape(self, camera):
        """How the image of a camera changes with the joints, as far as known: see models."""
        return self._models[self._in_use(), camera].shape()

    def refit(self):
        """Bring the shapes up to what was learned: an iterator, each step a slice of the work."""
        for camera in self.cameras:
            for _ in self._models[self._in_use(), camera].refit():
                yield

    def _in_use(self):
        return "chain" if "chain" in self._make else self.using or self._names[0]

    def together(self, sights, t):
        """(Picture, goal at time t, its velocity), of all that counts.

        Args:
            sights: {camera: Stream's sight}.
        """
        cameras = [camera for camera in self.cameras if camera in sights]
        parts = [
            (sights[c].shape.moved(sights[c].offset), self.rows.of(c), self._weights[c])
            for c in cameras
        ]
        goal = {
            c: [x + v * (t - sights[c].t) for x, v in zip(sights[c].goal, sights[c].speed)]
            for c in cameras
        }
        speed = {c: sights[c].speed for c in cameras}
        return stacked(parts), self._together(goal), self._together(speed)

    def nearing(self, picture, goal, q):
        """The steps from `q` (rad) to where the joints should be: see `descent`."""
        known = [[0.0] * self._n] * self._n
        return descent(picture, goal, q, self._low, self._high, q, known)


_Sight = namedtuple("_Sight", "t shape offset goal speed")


class Stream(object):
    """Steers by what is seen while the arm moves: every picture is of the joints at its own time.

    Set-points are absolute, so the delay of the camera does not act on the loop; only a goal that
    moves is predicted.  A control tick either takes in frames (`see`) or aims anew (`reaim`), which
    is a step or two of a search: on the way there are many.

    Args:
        servo: Servo, whose models have been explored.

    Attributes:
        still_since: since when the joints are where they are, s.
    """

    FEWEST, MOST, NEAR = 5, 12, math.radians(4)
    """The last FEWEST frames, and up to MOST with the joints within NEAR (rad) of where they are,
    say by their median by how much the model is off."""
    REAIM, STILL = math.radians(1.5), math.radians(0.7)
    """An aim so near to the last one is the same; a joint that stays within STILL stands, rad."""
    STALE = 0.3
    """What a camera has not seen for so long is not gone by, s."""
    STEPS = 4
    """Of the search for a better aim, in one control tick."""

    def __init__(self, servo):
        self._servo = servo
        self.still_since = None

    def begin(self, q):
        """The first aim, rad."""
        self._aim, self._drift, self._aimed_at = tuple(q), None, None
        self._better = list(q)  # than the aim, so far
        self._recent = {}
        self._sights = {}
        self._seen_at = self._seen_from = None  # the newest frame that has not been aimed by
        self._search = None
        self._still_at = self.still_since = None
        self._confirmed = False

    def see(self, frame, goal):
        """Take in a Frame; `goal` is the Goal that it is for, None if that is a fixed pixel."""
        if frame.q is None or frame.camera not in self._servo.cameras:
            return
        shape = self._servo.shape(frame.camera)
        recent = self._recent.setdefault(frame.camera, [])
        if recent and recent[-1][2] is not shape:
            recent[:] = [(q, s, shape, self._missed(shape, q, s)) for q, s, _, _ in recent[-4:]]
        missed = self._missed(shape, frame.q, frame.s)
        recent.append((frame.q, frame.s, shape, missed))
        del recent[: -self.MOST]
        near = [
            off
            for k, (q, _, _, off) in enumerate(recent, 1)
            if k > len(recent) - self.FEWEST or apart(q, frame.q) < self.NEAR
        ]
        offset = [median(column) for column in zip(*near)]
        where = frame.goal if goal is None else goal.at(frame.t)
        speed = (0.0, 0.0) if goal is None else goal.velocity
        self._sights[frame.camera] = _Sight(frame.t, shape, offset, where, speed)
        self._seen_at, self._seen_from = frame.t, frame.q

    @staticmethod
    def _missed(shape, q, s):
        return list(map(sub, s, shape.predict(list(q))))

    def reaim(self):
        """Go by what was seen since the last time, if anything: a step or two on the way there."""
        if self._search is None and not self._begin_search():
            return
        steps, picture, speed, t = self._search
        for _ in range(self.STEPS):
            found = next(steps, None)
            if found is None:
                self._search = None
                self._settle_on(self._better, picture, speed, t)
                return
            self._better = found[0]

    def _begin_search(self):
        """Look for a better aim, if that is possible."""
        t, self._seen_at = self._seen_at, None
        if t is None:
            return False
        sights = {c: sight for c, sight in self._sights.items() if t - sight.t < self.STALE}
        if not self._servo.suffices(sorted(sights)):
            return False
        picture, wanted, speed = self._servo.together(sights, t)
        start = self._seen_from
        if self._drift is not None:
            start = [a + v * (t - self._aimed_at) for a, v in zip(self._aim, self._drift)]
        self._search = self._servo.nearing(picture, wanted, list(start)), picture, speed, t
        return True

    def _settle_on(self, q, picture, speed, t):
        """Make it the aim, unless it is all but the same."""
        if any(speed):
            J = picture.jacobian(q)
            size = math.sqrt(sum([dot(row, row) for row in J]))
            self._aim, self._drift = q, damped_solve(J, speed, 0.05 * size)
            self._aimed_at, self._confirmed = t, False
            return
        self._drift = None
        if apart(q, self._aim) > self.REAIM:
            self._aim, self._confirmed = q, False
        elif self.still_since is not None and t > self.still_since:
            self._confirmed = True

    def refit(self):
        """As Servo.refit."""
        return self._servo.refit()

    def aim(self, t, q):
        """Where the joints should be at time t, rad or Moving; None: stand and look."""
        if self._still_at is None or apart(q, self._still_at) > self.STILL:
            self._still_at, self.still_since, self._confirmed = q, t, False
        if self._drift is not None:
            late = t - self._aimed_at
            return Moving([a + v * late for a, v in zip(self._aim, self._drift)], self._drift)
        there = apart(q, self._aim) < 2 * self.REAIM
        if there and self._confirmed and t - self.still_since > 0.1:
            return None
        return self._aim
