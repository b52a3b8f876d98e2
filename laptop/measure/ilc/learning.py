"""Iterative learning control: joint offsets from what a camera saw of the last trial.  Pure.

Update law (S. Arimoto, S. Kawamura and F. Miyazaki, 1984; survey: D. Bristow, M. Tharayil and
A. Alleyne, 2006), with offsets u and errors e along the path s in trial k:

    u_{k+1}(s) = u_k(s) - J^+(s) Q e_k(s)

J^+ is the pseudoinverse of the tip's Jacobian, Q a smoothing filter.  The trials repeat the same
path from the same rest, so errors of links, backlash and gravity repeat, too, and can be learned.
If the true Jacobian is (1 + D) J, an error that Q passes shrinks by |D| in each trial.  It
converges for |D| < 1, and a model that is wrong by 15 % suffices.  Where Q is 0, nothing is learned
and nothing builds up: dynamics that the model lacks would make narrow waves grow from trial to
trial.  A feedback law within one trial would need the camera's delay to be short beside the motion.

Q smooths errors across the path a little, along it more: a tip that is late has not left its path.
At the ends the tip stands, and there the error along the path counts in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laptop.measure.ilc.piece_path import PiecePath
from laptop.measure.ilc.tracks import PieceTrack
from robot.jobs.learned import MAX_ACCELERATION

KNOT_SPACING, KNOT_COUNTS = 0.2, (9, 120)
"""Distance between the knots of offsets, about, cm; least and greatest number of them."""

ACROSS_WAVELENGTH = 2.5
"""Wavelength whose amplitude smoothing halves, cm: of errors across the path."""

ALONG_WAVELENGTH = 6.0
"""The same along the path, cm: a tip that is a moment late has not left it."""

END_LENGTH = 2.0
"""Length of path for which the error along it counts at the ends, cm."""

TUKEY_LIMIT = 4.0
"""Residual beyond which a sight does not count, standard deviations (Tukey's biweight)."""

MIN_SIGHTS = 6
"""Fewest sights of a piece from which it is learned by itself."""

REWEIGHTINGS = 5
"""Number of iterations of the reweighted least squares."""

ACCELERATION_SHARE, MAX_SOFTENINGS = 0.8, 12
"""Share of the brick's greatest acceleration that offsets use; and greatest number of steps of
smoothing until they do."""

INITIAL_NOISE = 0.05
"""Noise of sights before anything is known of it, cm (standard deviation)."""

BACKLASH_SIGMA = np.radians(1.0)
"""Error of half a described backlash, rad (standard deviation)."""

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""


@dataclass(frozen=True, eq=False)
class TrajectoryError:
    """Error of the tip on a piece, at as many places as there are offsets.

    Attributes:
        s: arc length along the path, cm, (n,).
        across: to the left of the path, smoothed, cm, (n,).
        along: ahead on it, smoothed more, cm, (n,).
        backlash_error: error of each joint's described backlash, half of the difference, rad,
            (joints,).
        noise: standard deviation of single sights about that, cm.
        sigma: standard deviation of `across` by that noise, cm.
    """

    s: np.ndarray
    across: np.ndarray
    along: np.ndarray
    backlash_error: np.ndarray
    noise: float
    sigma: float

    @property
    def mean_square(self) -> float:
        """Mean square of the error, over its length and its ends, cm^2."""
        ends = float((self.along[[0, -1]] ** 2).mean())
        return float((self.across**2).mean()) + ends * min(1.0, END_LENGTH / self.s[-1])

    @property
    def greatest(self) -> float:
        """Distance across, or at an end, cm."""
        ends = np.hypot(self.along[[0, -1]], self.across[[0, -1]])
        return float(max(np.abs(self.across).max(), ends.max()))


# The projector across the path.  With t the unit tangent of the path at s, an error e splits into
#     e_along = t t^T e    and    e_across = (I - t t^T) e,
# two orthogonal projectors (G. Strang, Linear Algebra and Its Applications).  In the plane the
# second is n n^T with the normal n to the left of t, so both parts are signed numbers, ahead . e
# and left . e.  The reference at the same time is the obvious choice, but a tip that is late by dt
# then errs by v dt, though it is on its path.  So the place s is first moved by the smoothed part
# along the path, and the error across is taken from there.  This is the contour error of machine
# tools (Y. Koren, 1980).


def trajectory_error(piece: PiecePath, track: PieceTrack) -> TrajectoryError:
    """Return the trajectory error of a track on its piece."""
    knots = none(piece).s
    error = track.p - piece.at(track.s, piece.p)
    ahead = (error * piece.at(track.s, piece.ahead)).sum(axis=1)
    along, *_ = _smoothed(knots, track.s, ahead, np.zeros((len(ahead), 0)), ALONG_WAVELENGTH)
    # A tip that is late or early was farther back or ahead on its path, not beside it.
    delay = ahead - np.interp(track.s, knots, along)
    contour = np.clip(track.s + np.where(track.standing == 0, delay, 0.0), 0.0, piece.length)
    error = track.p - piece.at(contour, piece.p)
    left = piece.at(contour, piece.left)
    # What a joint's backlash makes that is wider or narrower than described.
    backlash_error = np.einsum(
        "nk,nkj,nj->nj", left, *(piece.at(contour, x) for x in (piece.turns, piece.sides))
    )
    smooth, wide, noise, sigma = _smoothed(
        knots, contour, (error * left).sum(axis=1), backlash_error, ACROSS_WAVELENGTH
    )
    turned = _by_backlash_error(piece, knots, wide)
    across = smooth + (turned * _units(piece.at(knots, piece.left))).sum(axis=1)
    return TrajectoryError(knots, across, along, wide, noise, sigma)


def _by_backlash_error(piece: PiecePath, s: np.ndarray, backlash_error: np.ndarray) -> np.ndarray:
    """Return what backlash that is wrongly described makes of the tip's place, (n, 2), cm."""
    return np.einsum(
        "nkj,nj->nk", piece.at(s, piece.turns), piece.at(s, piece.sides) * backlash_error
    )


def stroke_errors(
    pieces: Sequence[PiecePath], seen: Sequence[PieceTrack]
) -> list[TrajectoryError] | None:
    """Return the trajectory errors of a stroke's pieces; None if too little was seen of them.

    A piece of which too little was seen was missed as its neighbours were where they meet it.
    """
    known = {
        k: trajectory_error(piece, track)
        for k, (piece, track) in enumerate(zip(pieces, seen, strict=True))
        if len(track.s) >= MIN_SIGHTS
    }
    if not known:
        return None
    sigma = max(error.sigma for error in known.values())
    out = []
    for k, piece in enumerate(pieces):
        if k in known:
            out.append(known[k])
            continue
        before = max((n for n in known if n < k), default=None)
        after = min((n for n in known if n > k), default=None)
        ends = [
            _vector(pieces[n], known[n], end)
            for n, end in ((before, -1), (after, 0))
            if n is not None
        ]
        out.append(_bridged(piece, ends[0], ends[-1], sigma))
    return out


def _vector(piece: PiecePath, error: TrajectoryError, end: int) -> np.ndarray:
    """Return the trajectory error at an end, 0 or -1, (2,), cm."""
    return np.asarray(error.across[end] * piece.left[end] + error.along[end] * piece.ahead[end])


def _bridged(piece: PiecePath, begin: np.ndarray, end: np.ndarray, sigma: float) -> TrajectoryError:
    """Return a trajectory error that goes from one vector to another."""
    knots = none(piece).s
    share = (knots / piece.length)[:, None]
    error = begin * (1 - share) + end * share
    across = (error * _units(piece.at(knots, piece.left))).sum(axis=1)
    along = (error * _units(piece.at(knots, piece.ahead))).sum(axis=1)
    return TrajectoryError(knots, across, along, np.zeros(piece.turns.shape[2]), 0.0, sigma)


def _smoothed(
    knots: np.ndarray, s: np.ndarray, values: np.ndarray, others: np.ndarray, wave: float
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Smooth values (n,) at s, after Whittaker 1923, without those that are far off.

    Args:
        knots: where the smooth values are to be, cm.
        s: where the values are.
        values: (n,), cm.
        others: (n, m), columns that may be part of the values beside what is smooth.
        wave: of this length, cm, loses half.

    Returns:
        The smooth values at the knots; how much of each column is in the values, (m,); the standard
        deviation of a value about both, and that of the smooth ones, cm.
    """
    spacing, count = knots[1], len(knots)
    k = np.clip((s / spacing).astype(int), 0, count - 2)
    share = s / spacing - k
    design = np.zeros((len(s), count + others.shape[1]))
    rows = np.arange(len(s))
    design[rows, k], design[rows, k + 1] = 1 - share, share
    design[:, count:] = others
    # What stands at an end tells of that end alone.
    moving = np.count_nonzero((s > 0) & (s < knots[-1]))
    stiff = np.zeros((design.shape[1],) * 2)
    stiff[:count, :count] = _stiffness(knots, wave) * max(moving, 1) / knots[
        -1
    ] * spacing + 1e-9 * np.eye(count)
    weights, noise = np.ones(len(s)), INITIAL_NOISE
    for _ in range(REWEIGHTINGS):
        stiff[range(count, len(stiff)), range(count, len(stiff))] = (noise / BACKLASH_SIGMA) ** 2
        inverse = np.linalg.inv(design.T @ (weights[:, None] * design) + stiff)
        found = inverse @ (design.T @ (weights * values))
        left = values - design @ found
        noise = max(MAD_TO_SIGMA * float(np.median(np.abs(left))), 1e-4)
        weights = np.clip(1 - (left / (TUKEY_LIMIT * noise)) ** 2, 0.0, None) ** 2
    spread = (inverse @ (design.T * weights))[:count]
    sigma = float(np.sqrt((spread**2).sum(axis=1).mean())) * noise
    return found[:count], found[count:], noise, sigma


def _stiffness(knots: np.ndarray, wave: float) -> np.ndarray:
    """Return what bends cost values at knots that each count 1, if this wave is to be halved.

    A wave sin(k s) bends by k^2: to leave it as it is costs as much as to leave it out.
    """
    curvature = np.diff(np.eye(len(knots)), 2, axis=0) / knots[1] ** 2
    return (wave / (2 * np.pi)) ** 4 * curvature.T @ curvature


@dataclass(frozen=True, eq=False)
class Offsets:
    """Offsets of each joint along a piece.

    Attributes:
        s: arc length along the path, cm, (n,).
        q: (n, joints), rad.
    """

    s: np.ndarray
    q: np.ndarray

    @property
    def greatest(self) -> float:
        """Greatest offset of any joint, rad."""
        return float(np.abs(self.q).max())

    def numbers(self) -> tuple[list[float], list[list[float]]]:
        """Return them as shared.job.Stroke has them: s, cm, and by joint, rad."""
        return [round(s, 4) for s in self.s.tolist()], np.round(self.q.T, 6).tolist()


def none(piece: PiecePath) -> Offsets:
    """Return the offsets of a piece of which nothing is learned."""
    count = int(np.clip(np.ceil(piece.length / KNOT_SPACING) + 1, *KNOT_COUNTS))
    return Offsets(np.linspace(0.0, piece.length, count), np.zeros((count, piece.turns.shape[2])))


def corrected(piece: PiecePath, offsets: Offsets, error: TrajectoryError) -> Offsets:
    """Return offsets that take off a trajectory error."""
    # Backlash is taken off the joints' angles as it makes them wrong, the rest as a place is.
    backlash_error = _by_backlash_error(piece, error.s, error.backlash_error)
    left, ahead = (_units(piece.at(error.s, units)) for units in (piece.left, piece.ahead))
    along = error.along - (backlash_error * ahead).sum(axis=1)
    correction = (error.across - (backlash_error * left).sum(axis=1))[:, None] * left
    correction += along[:, None] * ahead
    turned = np.einsum("njk,nk->nj", piece.at(error.s, piece.back), correction)
    turned += piece.at(error.s, piece.sides) * error.backlash_error
    return Offsets(offsets.s, offsets.q - turned)


def _units(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def softened(
    piece: PiecePath, offsets: Offsets, limit: float = ACCELERATION_SHARE * MAX_ACCELERATION
) -> Offsets:
    """Return offsets smoothed until they ask no joint for more acceleration, rad/s^2."""
    speed = np.gradient(piece.s, piece.t)
    speeds, accelerations = (
        piece.at(offsets.s, speed),
        np.abs(piece.at(offsets.s, speed * np.gradient(speed, piece.s))),
    )
    q, wave = offsets.q, ACROSS_WAVELENGTH
    for _ in range(MAX_SOFTENINGS):
        slopes = np.gradient(q, offsets.s, axis=0)
        curvatures = np.abs(np.gradient(slopes, offsets.s, axis=0))
        # (A cubic between two knots may bend half as much again as the points do.)
        needed = 1.5 * curvatures * speeds[:, None] ** 2 + np.abs(slopes) * accelerations[:, None]
        if needed.max() <= limit:
            break
        smoother = np.eye(len(q)) + _stiffness(offsets.s, wave)
        q, wave = np.linalg.solve(smoother, offsets.q), 1.3 * wave
    return Offsets(offsets.s, q)


def joined(pieces: Sequence[Offsets], spread: float = 1.0) -> list[Offsets]:
    """Return the offsets of a stroke's pieces so that no joint jumps from one to the next.

    Args:
        pieces: in order.
        spread: so far from where they meet what they differ by is shared out, cm.
    """
    out = [Offsets(piece.s, piece.q.copy()) for piece in pieces]
    for before, after in zip(out, out[1:], strict=False):
        half = (after.q[0] - before.q[-1]) / 2
        for piece, path, sign in ((before, before.s[-1] - before.s, 1), (after, after.s, -1)):
            reach = min(spread, piece.s[-1] / 2)
            x = np.clip(1 - path / reach, 0.0, 1.0)
            piece.q[:] += sign * (x * x * (3 - 2 * x))[:, None] * half
    return out
