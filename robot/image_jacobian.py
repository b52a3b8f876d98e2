"""How the image moves when the joints move, learned while it happens: no camera is calibrated.

Pure.  One model stands for the rows that are seen together (u and v of one camera), for any number
of joints; several cameras are several models.

    q   joint angles, rad (n)
    s   image features, px (m)
    J   image Jacobian ds/dq, px/rad: m rows, n columns

Every model has the same door: `observe` takes in what was seen at which joint angles; `seen_from`
gives what is known at this moment, as a Picture that later observations do not change; `shape` the
same but for its place in the image, which costs less;
`covariance` says how little that is, of J there; `doubt_all` is for when the world has changed.
"""

import math
from collections import namedtuple
from operator import mul, sub

from robot.motion.kinematics import broyden_update

UNKNOWN = 2000.0
"""Standard deviation of an element of J before anything was seen, and the greatest, px/rad."""

LEAST_DOUBT = 0.5
"""The least: it never freezes, px/rad."""

BENDING = 0.7
"""By which share of itself J may change per radian of joint motion."""

SEEN = 400.0
"""Standard deviation of how far, in px, the sum of the links' directions can move the marker."""

ODD = 25.0
"""The same of each link by itself: length, zero and lens may be off, px."""

OFFSET = 1e4
"""The same of where the base is seen, px."""

FAR = 2.3
"""A key-frame is doubted by so many px per rad of distance from the arm: perspective and lens."""

APART, MOST_KEYS = math.radians(2.5), 24
"""Key-frames nearer to one another (rad, every joint) are one; so many are held."""

ROBUST = 3.0
"""Residuals beyond so many standard deviations count ever less (Geman and McClure)."""

ROUND = 16
"""After every so manieth fit the key-frames are weighed anew: it makes little difference, and costs
more than all the rest."""

REWEIGH = 4
"""The same of fits while the arm moves."""

TERMS = 5
"""For each so many terms, one key-frame that was seen in motion may wait for the next fit: a fit of
15 terms takes longer than a control tick on the brick, and must not be due in every one."""

SLICE = 600
"""Multiplications, or so, in a slice of a fit that is done while the arm moves."""

TELLS = 4.0
"""Plain Broyden learns from steps of at least so many standard deviations in the image."""

MOVED = 40.0
"""What was seen before the world changed is doubted by so many px from then on."""


def dot(a, b):
    """Inner product."""
    return sum(map(mul, a, b))


def _trust(excess):
    """Weight of a residual by its square, as a share of what is still believed."""
    return 1.0 if excess <= 1 else (1.0 + excess) ** -2


def cholesky(N):
    """Rows of the lower triangle L with L L' = N, for a positive definite N (its lower part)."""
    L = []
    for _ in _growing(L, N):
        pass
    return L


def _growing(L, N):
    """Give the empty list L the rows of the same, one in each step."""
    for row in N:
        new, left = [], row[len(L)]
        for value, other in zip(row, L):
            for a, b in zip(new, other):
                value -= a * b
            value /= other[-1]
            left -= value * value
            new.append(value)
        new.append(math.sqrt(left))
        L.append(new)
        yield


def forward_substituted(L, b):
    """y with L y = b."""
    y = []
    for row, value in zip(L, b):
        for a, known in zip(row, y):
            value -= a * known
        y.append(value / row[-1])
    return y


def back_substituted(L, y):
    """x with L' x = y."""
    x = list(y)
    for i in range(len(L) - 1, -1, -1):
        row = L[i]
        x[i] = known = x[i] / row[-1]
        for j in range(i):
            x[j] -= row[j] * known
    return x


class Picture(namedtuple("Picture", "predict jacobian")):
    """What a model knows at one moment, seen from one pose.

    predict(q)   s that will be seen at q, px
    jacobian(q)  J there, px/rad
    """

    __slots__ = ()


class LinearPicture(object):
    """A Picture that is linear in the terms of a chain: s = W terms(q) + offset.

    Args:
        chain: of _CHAINS.
        joints: how many.
        W: m rows, px.
        offset: m, px.
    """

    def __init__(self, chain, joints, W, offset):
        self._chain, self._joints = chain, joints
        self.W, self.offset = W, offset
        self._q = self._terms = self._J = None  # where it was asked for last, which it is again

    def at_once(self, W, offset):
        """One of other rows, by the same chain."""
        return LinearPicture(self._chain, self._joints, W, offset)

    def moved(self, offset):
        """The same, elsewhere in the image."""
        return LinearPicture(self._chain, self._joints, self.W, offset)

    def _at(self, q):
        if self._q != q:
            self._q, self._terms, self._J = list(q), self._chain.terms(q), None

    def predict(self, q):
        """As Picture's."""
        self._at(q)
        terms = self._terms
        return [sum(map(mul, w, terms), o) for w, o in zip(self.W, self.offset)]

    def jacobian(self, q):
        """As Picture's."""
        self._at(q)
        if self._J is None:
            columns = self._chain.slopes(self._terms, self._joints)
            self._J = tuple([[sum(map(mul, w, column)) for column in columns] for w in self.W])
        return self._J


class LocalJacobian(object):
    """J by Broyden's update, plain or weighed against the noise.

    With `noise_aware`, J is the state of a Kalman filter whose measurements are the pairs (dq, ds)
    (Qian and Su 2002): the gain is Broyden's 1 on long moves and falls to 0 on moves that noise
    outweighs, and every direction has a doubt of its own.  Without, it is Broyden's update (1965).

    Args:
        rows, joints: m, n.
        noise_aware: see above.

    Attributes:
        J: a tuple of rows; zeros at first.
    """

    def __init__(self, rows, joints, noise_aware=True):
        self.J = tuple((0.0,) * joints for _ in range(rows))
        self._P = [[UNKNOWN**2 * (i == j) for j in range(joints)] for i in range(joints)]
        self._noise_aware = noise_aware
        self._last = None

    def observe(self, q, s, variance, standing=True):
        """Learn from the step that led here from what was observed before.

        Args:
            variance: of each element of s, px^2.
            standing: whether the arm stood; plain Broyden takes nothing else.
        """
        if not (standing or self._noise_aware):
            return
        if self._last is not None:
            q_before, s_before, variance_before = self._last
            dq, ds = list(map(sub, q, q_before)), list(map(sub, s, s_before))
            if any(dq) and (self._noise_aware or self._tells(dq, ds, variance + variance_before)):
                self._update(dq, ds, variance + variance_before)
        self._last = tuple(q), tuple(s), variance

    def _tells(self, dq, ds, variance):
        """Whether a step is long enough for plain Broyden, which takes noise for truth."""
        expected = [dot(row, dq) for row in self.J]
        return max(dot(ds, ds), dot(expected, expected)) > TELLS**2 * variance

    def _update(self, dq, ds, variance):
        P, n = self._P, len(dq)
        square = dot(dq, dq)
        if self._noise_aware:
            size = 0.0
            for row in self.J:
                size += sum(map(mul, row, row))
            bent = BENDING**2 * square * size / len(self.J)
            for k in range(n):
                P[k][k] = min(P[k][k] + bent, UNKNOWN**2)
            along = [dot(row, dq) for row in P]
            expected = dot(dq, along) + variance
            missed = [moved - dot(row, dq) for row, moved in zip(self.J, ds)]
            excess = dot(missed, missed) / (len(missed) * expected * ROBUST**2)
            weight = _trust(excess)
            gain = [weight * a / expected for a in along]
            self.J = tuple(
                [tuple([a + r * g for a, g in zip(row, gain)]) for row, r in zip(self.J, missed)]
            )
        else:
            self.J = broyden_update(self.J, dq, ds)
            along = [dot(row, dq) for row in P]
            gain = [d / square for d in dq]
        # (I - gain dq') P, and for a gain that is not Kalman's the same from the right
        P = [[p - g * a for p, a in zip(row, along)] for row, g in zip(P, gain)]
        if not self._noise_aware:
            along = [dot(row, dq) for row in P]
            P = [[p - a * g for p, g in zip(row, gain)] for row, a in zip(P, along)]
        for k in range(n):
            P[k][k] = max(P[k][k], LEAST_DOUBT**2)
        self._P = P

    def seen_from(self, q, s):
        """The Picture of an arm that is at q, where s is seen."""
        J = self.J

        def predict(there):
            dq = list(map(sub, there, q))
            return [sum(map(mul, row, dq), y) for y, row in zip(s, J)]

        return Picture(predict, lambda there: J)

    def refit(self):
        """There is nothing to fit."""
        return iter(())

    def shape(self):
        """The Picture but for its place in the image."""
        return straight(self.J)

    def covariance(self):
        """Of each row of J, n x n, (px/rad)^2."""
        return [list(row) for row in self._P]

    def doubt_all(self):
        """The camera was moved, or the like: J is kept, but half of it may be wrong."""
        size = sum(dot(row, row) for row in self.J) / len(self.J)
        for k in range(len(self._P)):
            self._P[k][k] = max(self._P[k][k], 0.25 * size)
        self._last = None


def _planar_terms(q):
    """1, and the cosine and sine of every link's heading: in a planar chain the angles add up."""
    terms, heading = [1.0], 0.0
    for angle in q:
        heading += angle
        terms.append(math.cos(heading))
        terms.append(math.sin(heading))
    return terms


def _planar_slopes(terms, joints):
    """d terms / dq, one list per joint: joint k turns its own link and those after it."""
    turned = [0.0] * len(terms)
    for i in range(1, len(terms), 2):
        turned[i], turned[i + 1] = -terms[i + 1], terms[i]
    return [[0.0] * (2 * k + 1) + turned[2 * k + 1 :] for k in range(joints)]


def _planar_axes(links):
    """The place of the tip along each axis of space, as coefficients of the terms."""
    ahead, aside = [0.0], [0.0]
    for link in links:
        ahead += [link, 0.0]
        aside += [0.0, link]
    return [ahead, aside]


def _spatial_terms(q):
    """The terms of the links that pitch, each by itself and times cosine and sine of the yaw."""
    around = 1.0, math.cos(q[0]), math.sin(q[0])
    return [a * b for a in _planar_terms(q[1:]) for b in around]


def _spatial_slopes(terms, joints):
    """d terms / dq, one list per joint: the yaw turns its two factors, a pitch the others."""
    pitched, (one, cos, sin) = terms[::3], terms[:3]
    slopes = [[a * b for a in pitched for b in (0.0, -sin, cos)]]
    for slope in _planar_slopes(pitched, joints - 1):
        slopes.append([a * b for a in slope for b in (one, cos, sin)])
    return slopes


def _spatial_axes(links):
    """As _planar_axes: out from the base's axis, ahead and aside; and upwards."""
    out, up = _planar_axes(links[1:])
    return [
        [a * b for a in axis for b in around]
        for axis, around in ((out, (0.0, 1.0, 0.0)), (out, (0.0, 0.0, 1.0)), (up, (1.0, 0.0, 0.0)))
    ]


def _precision(axes):
    """Of the terms' coefficients, px^-2, before anything was seen; the lower triangle.

    Each axis of space may be seen in any way (SEEN px along the whole arm); each term by itself
    deviates from that (ODD).  The inverse of ODD^2 I + SEEN^2 sum u u', the u being orthogonal unit
    vectors (Sherman and Morrison 1950); a constant offset may be anything.
    """
    units = []
    for axis in axes:
        whole = math.sqrt(dot(axis, axis))
        units.append([a / whole for a in axis])
    share = SEEN**2 / (ODD**2 + SEEN**2)
    precision = [[1 / OFFSET**2]]
    for i in range(1, len(axes[0])):
        precision.append(
            [0.0]
            + [
                ((i == j) - share * sum(u[i] * u[j] for u in units)) / ODD**2
                for j in range(1, i + 1)
            ]
        )
    return precision


_Chain = namedtuple("_Chain", "terms slopes axes")
_CHAINS = {
    "planar": _Chain(_planar_terms, _planar_slopes, _planar_axes),
    "spatial": _Chain(_spatial_terms, _spatial_slopes, _spatial_axes),
}


_STRAIGHT = _Chain(
    list,
    lambda terms, joints: [[float(i == k) for i in range(joints)] for k in range(joints)],
    None,
)
"""Joints of which nothing is known but J: the image is linear in their angles."""


def straight(J):
    """A shape (see above) that is linear in the joints' angles, px."""
    return LinearPicture(_STRAIGHT, len(J[0]), J, [0.0] * len(J))


class _Key(object):
    """A key-frame: what was seen at one pose.

    products  what a weight of 1 would add to the normal equations
    weight    with which it is in them
    """

    __slots__ = ("q", "terms", "s", "variance", "products", "weight")

    def __init__(self, q, terms, s, variance):
        self.q, self.terms, self.s, self.variance = q, terms, s, variance
        self.weight = 0.0
        products = [a * b for i, a in enumerate(terms, 1) for b in terms[:i]]
        self.products = products + [a * y for y in s for a in terms]


class ChainModel(object):
    """The image as a linear function of the sines and cosines of a chain of revolute joints.

    A revolute joint moves an image point on a projected circle (Ruf, Horaud and others: visual
    control by projective kinematics); so s = W terms(q), where W holds camera and link lengths.  W
    is fitted to key-frames by least squares: each is weighed by its noise, by its distance from the
    arm, which takes up perspective and lens, and by how well it agreed with the fit before.  The
    lengths of the description are no more than a prior.

    Args:
        rows: m.
        chain: kind of the arm's chain.
        links: their lengths, cm.
    """

    def __init__(self, rows, chain, links):
        self._rows = rows
        self._joints = len(links)
        self._chain = _CHAINS[chain]
        self._axes = self._chain.axes(links)
        precision = _precision(self._axes)
        size = len(precision)
        whole = size * (size + 1) // 2
        # The normal equations: the lower triangle row by row, then the right sides.
        self._prior = self._sums = sum(precision, []) + [0.0] * (rows * size)
        self._triangle = [slice(i * (i + 1) // 2, (i + 1) * (i + 2) // 2) for i in range(size)]
        self._sides = [slice(whole + k * size, whole + (k + 1) * size) for k in range(rows)]
        self._keys = []
        self._fits = self._refits = 0
        self._fitted = self._shape = None  # W
        self._waiting, self._patience = 0, max(1, size // TERMS)  # key-frames that are not in W

    def observe(self, q, s, variance, standing=True):
        """Keep what was seen as a key-frame, in place of one that is nearly the same.

        Args:
            variance: of each element of s, px^2.
            standing: what was seen in motion does not replace what is known better.
        """
        near = []
        for key in self._keys:
            for a, b in zip(key.q, q):
                if not -APART < a - b < APART:
                    break
            else:
                near.append(key)
        if near and not standing and min(key.variance for key in near) <= variance:
            return
        self._keys.append(_Key(tuple(q), self._chain.terms(q), tuple(s), variance))
        self._weigh(self._keys[-1], 1 / variance)
        for key in near or self._keys[:-MOST_KEYS]:
            self._weigh(key, 0.0)
            self._keys.remove(key)
        self._waiting += self._patience if standing else 1

    def seen_from(self, q, s):
        """The Picture of an arm that is at q, where s is seen."""
        W = self._fit(q)
        here = self._chain.terms(q)
        self._slopes = self._chain.slopes(here, self._joints)
        offset = [y - sum(map(mul, w, here)) for y, w in zip(s, W)]
        return LinearPicture(self._chain, self._joints, W, offset)

    def refit(self):
        """Fit anew if there is enough that is new: an iterator, each step a slice of the work."""
        if self._fitted is not None and self._waiting < self._patience:
            return
        sums, self._waiting = self._sums, 0
        L, W, work = [], [], 0
        for _ in _growing(L, [sums[part] for part in self._triangle]):
            work += len(L) ** 2
            if work > SLICE:
                work = 0
                yield
        for side in self._sides:
            work += len(L) ** 2
            if work > SLICE:
                work = 0
                yield
            W.append(back_substituted(L, forward_substituted(L, sums[side])))
        self._L, self._fitted = L, W
        self._refits += 1
        if self._refits % REWEIGH == 0:
            q = self._keys[-1].q
            deserved = [(key, self._deserved(key, q, W)) for key in self._keys]
            yield
            for key, weight in deserved:
                if key.weight:  # it has not been left out meanwhile
                    self._weigh(key, weight)
                    work += 2 * len(self._sums)
                    if work > SLICE:
                        work = 0
                        yield
            self._waiting = self._patience

    def shape(self):
        """The Picture but for its place in the image, as last fitted; the same as long as that."""
        if self._fitted is None or self._shape is None or self._shape.W is not self._fitted:
            W = self._fitted or self._fit(self._keys[-1].q)
            self._shape = LinearPicture(self._chain, self._joints, W, [0.0] * self._rows)
        return self._shape

    def _weigh(self, key, weight):
        """Let a key-frame count for so much in the normal equations."""
        more = weight - key.weight
        self._sums = [total + more * p for total, p in zip(self._sums, key.products)]
        key.weight = weight

    def _fit(self, q):
        """W (m x terms) by least squares."""
        W = self._fitted
        if W is None or self._waiting >= self._patience:
            sums = self._sums
            self._L = L = cholesky([sums[part] for part in self._triangle])
            W = [back_substituted(L, forward_substituted(L, sums[side])) for side in self._sides]
            self._fitted, self._waiting = W, 0
        self._fits += 1
        if self._fits % ROUND == 0 and self._keys:
            self._weigh_all(q, W)
        return W

    def _weigh_all(self, q, W):
        """By how well they agree with W, and by their distance from q.

        Together: weighed one by one, what is right would be doubted before what is false is.
        """
        for key in self._keys:
            key.weight = self._deserved(key, q, W)
        weights = [key.weight for key in self._keys]
        columns = zip(*[key.products for key in self._keys])
        self._fitted = None
        self._sums = [p + sum(map(mul, weights, column)) for p, column in zip(self._prior, columns)]

    def _deserved(self, key, q, W):
        """The weight of a key-frame."""
        doubt = key.variance
        for a, b in zip(key.q, q):
            doubt += FAR**2 * (a - b) * (a - b)
        terms, excess = key.terms, 0.0
        for off, w in zip(key.s, W):
            for a, b in zip(w, terms):
                off -= a * b
            excess += off * off
        return _trust(excess / (doubt * self._rows * ROBUST**2)) / doubt

    def covariance(self):
        """Of each row of J, n x n, (px/rad)^2, where it was last seen from."""
        # slope' N^-1 slope, from one side: N^-1 = L'^-1 L^-1
        halves = [forward_substituted(self._L, slope) for slope in self._slopes]
        return [[sum(map(mul, a, b)) for b in halves] for a in halves]

    def by_space(self):
        """How the image moves with the tip's place in space, px/cm: m rows, W along the axes."""
        W = self._fit(self._keys[-1].q)
        return [[dot(w, axis) / dot(axis, axis) for axis in self._axes] for w in W]

    def doubt_all(self):
        """The camera was moved, or the like: what was seen before counts little from now on."""
        for key in self._keys:
            key.variance += MOVED**2
            self._weigh(key, 1 / key.variance)
        self._fitted = None
