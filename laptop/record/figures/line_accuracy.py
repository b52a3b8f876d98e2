"""Accuracy of a drawing: the ink against the paths that were wanted.

Pure but for `write_trace`.  Rows of a record are anything with the attributes `t` (s), `q` (tuple
of rad), `x`, `y`, `z` (cm; z None in the plane) and `pen` (0 or 1); a wanted path is a sequence of
points (x, y) or (x, y, z), cm, that are joined by straight lines and dense where it bends.  Lengths
are cm, deviations mm.
"""

import functools
import itertools
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from shared.arm_description import ArmError

Points = Sequence[Sequence[float]]
"""Points (n, 2) or (n, 3), cm."""

MAX_BOUNCE_TIME = 0.05
"""Longest time off the paper that counts as a bounce of the pen, s; lifting takes longer."""

INK_SPACING = 0.02
"""Greatest distance between two points of an ink, cm, however fast the pen went."""

MATCH_POINTS = 24
"""Number of points along path and ink that stand for them when they are matched."""

JUMP_COST = 0.05
"""Cost of a jump: cm of distance, per cm from a point's place on the path to the expected one.

It keeps the place from jumping to another branch where a path crosses or touches itself."""

SETTLING_ANGLE = math.radians(3)
"""Greatest motion of a joint that comes to rest at the end of its backlash, rad."""


class BadWantedPath(ArmError, ValueError):
    """A wanted path that is none."""


@dataclass(frozen=True, eq=False)
class Measure:
    """One wanted path against the ink drawn for it.

    Attributes:
        greatest_mm: greatest distance of the ink from the path, from its segments: ink that cuts a
            corner or runs on past the end counts.
        rms_mm: the same as root mean square over the ink's length, not over time, so that resting
            at the ends does not dilute it.
        start_mm: from where the path starts to where the ink does.
        end_mm: from where the path ends to where the ink does.
        missed_mm: greatest distance of the path from the ink: a part was left out.
        seconds: time with the pen down.
        length_cm: length of the path.
        ink_cm: length of the ink.
        lateral: rows (cm along the path, mm of deviation), in the order of drawing; positive to the
            left of the path's direction, in space always; places before the start are negative.
        floor_mm: least deviation that the arm's encoders allow, where the caller knows it.
    """

    greatest_mm: float
    rms_mm: float
    start_mm: float
    end_mm: float
    missed_mm: float
    seconds: float
    length_cm: float
    ink_cm: float
    lateral: np.ndarray
    floor_mm: float | None = None

    def as_dict(self) -> dict[str, float | None]:
        """Return all numbers but the profile, rounded to 4 decimals, for JSON."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        del values["lateral"]
        return {name: None if v is None else round(float(v), 4) for name, v in values.items()}


def pen_down_runs(rows: Iterable[Any]) -> list[list[Any]]:
    """Return the rows with the pen down, split where it was lifted, in order of time."""
    runs: list[list[Any]] = []
    for row in rows:
        if row.pen:
            if not runs or row.t - runs[-1][-1].t > MAX_BOUNCE_TIME + 1e-9:
                runs.append([])
            runs[-1].append(row)
    return runs


def has_content(rows: Sequence[Any], wanted: Sequence[Points]) -> bool:
    """Return True if there is a wanted path, ink, or an arm that has moved."""
    # (The ink of an arm without a pen motor has no beginning: its pen is never up.)
    if len(wanted) or len({row.pen for row in rows}) > 1:
        return True
    joints = zip(*(row.q for row in rows), strict=True)
    return any(max(angles) - min(angles) > SETTLING_ANGLE for angles in joints)


def measure(rows: Iterable[Any], wanted: Sequence[Points]) -> list[Measure | None]:
    """Measure the ink in `rows` against each wanted path; None for a path that was not drawn.

    Raises:
        BadWantedPath: a wanted path without points, or with one that has not as many finite
            numbers as the ink's.
    """
    runs = pen_down_runs(rows)
    size = len(place(runs[0][0])) if runs else None
    paths = [_checked(number, path, size) for number, path in enumerate(wanted, 1)]
    inks = [np.array([place(row) for row in run], dtype=float) for run in runs]
    return [
        None if k is None else _measured(path, inks[k], runs[k][-1].t - runs[k][0].t)
        for path, k in zip(paths, match(paths, inks), strict=True)
    ]


def place(row: Any) -> tuple[float, ...]:
    """Return the place of the tip, cm: x and y, in space also z."""
    return (row.x, row.y) if row.z is None else (row.x, row.y, row.z)


def match(paths: Sequence[np.ndarray], inks: Sequence[np.ndarray]) -> list[int | None]:
    """Return for each path the index of its ink, or None; no ink serves two paths.

    They belong together in order of time.  Two are exchanged as long as that makes the sum of mean
    distances smaller (2-opt), so a missing or further stroke, or another order, does no harm.  A
    path wanted twice keeps its order.
    """
    n = max(len(paths), len(inks))
    table = np.zeros((n, n))  # a missing path or ink costs nothing
    if len(paths) and len(inks):
        thin_paths = [_resampled(path) for path in paths]
        thin_inks = [_resampled(ink) for ink in inks]
        to_path = [distances(np.concatenate(thin_inks), path) for path in thin_paths]
        to_ink = [distances(np.concatenate(thin_paths), ink) for ink in thin_inks]
        table[: len(paths), : len(inks)] = (
            np.reshape(to_path, (len(paths), len(inks), -1)).mean(axis=2)
            + np.reshape(to_ink, (len(inks), len(paths), -1)).mean(axis=2).T
        ) / 2
    distance = table.tolist()
    order = list(range(n))
    exchanged = True
    while exchanged:
        exchanged = False
        for i, j in itertools.combinations(range(n), 2):
            now = distance[i][order[i]] + distance[j][order[j]]
            if distance[i][order[j]] + distance[j][order[i]] < now - 1e-9:
                order[i], order[j] = order[j], order[i]
                exchanged = True
    return [k if k < len(inks) else None for k in order[: len(paths)]]


def write_trace(
    file: str | os.PathLike[str], rows: Sequence[Any], angles: Sequence[str] | None = None
) -> None:
    """Write the record as CSV: `t,q1,..,qn,x,y,pen` (in space x,y,z) in s, rad, cm and 0 or 1.

    Equal records give equal bytes.  An empty one gives the header of a two-joint arm.

    Args:
        file: where to.
        rows: the record.
        angles: names of the angles, in place of q1 to qn.

    Raises:
        OSError: as the system says it; the file may then be there in part.
    """
    joints = len(rows[0].q) if rows else 2
    axes = "xyz" if rows and rows[0].z is not None else "xy"
    if angles is None:
        angles = [f"q{number}" for number in range(1, joints + 1)]
    names = ["t", *angles, *axes, "pen"]
    with open(file, "w", encoding="ascii", newline="\n") as out:
        out.write(",".join(names) + "\n")
        for row in rows:
            turned = "".join(f"{angle:.6f}," for angle in row.q)
            tip = "".join(f"{value:.5f}," for value in place(row))
            out.write(f"{row.t:.4f},{turned}{tip}{int(row.pen)}\n")


def _checked(number: int, path: Points, size: int | None) -> np.ndarray:
    try:
        points = np.array(path, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    sizes = (2, 3) if size is None else (size,)
    fits = points.ndim == 2 and points.shape[1] in sizes and len(points)
    if not fits or not np.isfinite(points).all():
        raise BadWantedPath(
            f"wanted path {number} is not a list of points of {' or '.join(map(str, sizes))} finite"
            " numbers each; give [[x, y], ...] in cm"
        )
    return points


def _measured(path: np.ndarray, ink: np.ndarray, seconds: float) -> Measure:
    points = refined(ink)
    steps = _steps(points)
    along, deviation = _profile(points, path)
    weights = (np.append(steps, 0.0) + np.insert(steps, 0, 0.0)) / 2
    mean_square = np.average(deviation**2, weights=weights if len(steps) else None)
    return Measure(
        greatest_mm=10 * float(np.abs(deviation).max()),
        rms_mm=10 * float(np.sqrt(mean_square)),
        start_mm=10 * float(np.linalg.norm(ink[0] - path[0])),
        end_mm=10 * float(np.linalg.norm(ink[-1] - path[-1])),
        missed_mm=10 * float(distances(refined(path), ink).max()),
        seconds=float(seconds),
        length_cm=float(_steps(path).sum()),
        ink_cm=float(steps.sum()),
        lateral=np.column_stack([along, 10 * deviation]),
    )


def _profile(points: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return place along the path and (in the plane signed) distance of an ink's points, cm."""
    if len(path) == 1:
        path = np.repeat(path, 2, axis=0)
    lengths = _steps(path)
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    expected = 0.0
    along, deviation = np.empty(len(points)), np.empty(len(points))
    strides = np.concatenate([[0.0], _steps(points)])
    for chunk in _chunks(len(points), len(lengths)):
        distance, share, side = _segments(points[chunk], path)
        nearest = distance.min(axis=1)
        places = starts + np.clip(share, 0, 1) * lengths
        for k, i in enumerate(range(chunk.start, chunk.stop)):
            expected += strides[i]
            j = int(np.argmin(distance[k] + JUMP_COST * np.abs(places[k] - expected)))
            along[i] = expected = places[k, j]
            if (j == 0 and share[k, j] < 0) or (j == len(lengths) - 1 and share[k, j] > 1):
                along[i] = starts[j] + share[k, j] * lengths[j]  # before the start, past the end
            # Beside a line in space there is no left and right.
            deviation[i] = nearest[k] if path.shape[1] == 3 else np.copysign(nearest[k], side[k, j])
    return along, deviation


def _segments(points: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compare each point with each segment of `path`.

    Returns:
        Three arrays, points x segments: distance, cm; the foot's place as a share of the segment,
        below 0 and above 1 beyond its ends; the side, positive on the left as seen from above.
    """
    starts, vector = path[:-1].T, np.diff(path, axis=0)
    square = np.maximum((vector**2).sum(axis=1), 1e-18)
    # Coordinate by coordinate: numpy is slow at sums along an axis of two or three.
    offset = [p[:, None] - start for p, start in zip(points.T, starts, strict=True)]
    share = functools.reduce(np.add, map(np.multiply, offset, vector.T)) / square
    foot = np.clip(share, 0, 1)
    miss = [o - foot * v for o, v in zip(offset, vector.T, strict=True)]
    side = vector[:, 0] * offset[1] - vector[:, 1] * offset[0]
    return np.sqrt(functools.reduce(np.add, map(np.square, miss))), share, side


def distances(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Return the distance of each point from a polyline, cm."""
    if len(path) == 1:
        return np.linalg.norm(points - path[0], axis=1)
    chunks = _chunks(len(points), len(path))
    return np.concatenate([_segments(points[chunk], path)[0].min(axis=1) for chunk in chunks])


def _chunks(rows: int, columns: int) -> list[slice]:
    """Return slices of `rows` so short that a table with that many columns stays small."""
    size = max(1, 250_000 // columns)
    return [slice(k, min(k + size, rows)) for k in range(0, rows, size)]


def _steps(points: np.ndarray) -> np.ndarray:
    """Return the distance from each point to the next, cm."""
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def refined(points: np.ndarray) -> np.ndarray:
    """Return the same polyline with points at most INK_SPACING from each other, none twice."""
    points = points[np.concatenate([[True], _steps(points) > 1e-9])]
    counts = np.maximum(1, np.ceil(_steps(points) / INK_SPACING)).astype(int)
    first = np.cumsum(counts) - counts
    share = (np.arange(counts.sum()) - np.repeat(first, counts)) / np.repeat(counts, counts)
    places = np.append(np.repeat(np.arange(len(counts)), counts) + share, len(counts))
    return np.column_stack([np.interp(places, np.arange(len(points)), c) for c in points.T])


def _resampled(points: np.ndarray) -> np.ndarray:
    """Return the same polyline with MATCH_POINTS points evenly along it."""
    places = np.concatenate([[0.0], np.cumsum(_steps(points))])
    even = np.linspace(0.0, places[-1], MATCH_POINTS)
    return np.column_stack([np.interp(even, places, c) for c in points.T])
