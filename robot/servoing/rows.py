"""Rows of the image that count.  Pure."""

from robot.servoing.linear_algebra import dot, length

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Dict, Iterable, List, Mapping, Optional, Sequence, TypeVar  # noqa: F401

    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    _T = TypeVar("_T")


class Rows(object):
    """The rows of the image that count: u and v of every camera, or some of them.

    `stereo`: all of them.  `xyz`: as the report has it, u and v of the first camera and, of the
    second one, the row that tells what the first does not see.

    Args:
        kind: one of shared.run_options.ROWS.
        joints: how many the rows must determine.
        third: "u" | "v" of the second camera; None: as exploring shows.
    """

    BOTH, NONE = slice(0, 2), slice(0, 0)
    """Slices of (u, v): all and none."""
    ONE = {"u": slice(0, 1), "v": slice(1, 2)}
    """Slices of (u, v) by their names."""

    def __init__(self, kind, joints, third=None):
        # type: (str, int, Optional[str]) -> None
        self._joints = joints
        self._all = kind == "stereo"
        self._third = third
        self._chosen = {}  # type: Dict[str, slice]  # camera: slice

    def of(self, camera):
        # type: (str) -> slice
        """Return the slice of (u, v) of a camera that counts."""
        if self._all or not self._chosen:
            return self.BOTH
        return self._chosen.get(camera, self.NONE)

    def choose(self, J):
        # type: (Mapping[str, Matrix]) -> None
        """Settle on three rows, once that is possible.

        Args:
            J: {camera: its image Jacobian (2 x n), px/rad}, of the cameras that have been explored.
        """
        if self._all or self._chosen or len(J) < 2:
            return
        first, second = sorted(J)[:2]
        third = self.ONE[self._third] if self._third else None
        if third is None:
            # Of the second camera's rows, the one with more that is not in the span of the first's.
            left = [length(_rejected(row, J[first])) for row in J[second]]
            third = self.ONE["u" if left[0] > left[1] else "v"]
        self._chosen = {first: self.BOTH, second: third}

    def values(self, by_camera):
        # type: (Mapping[str, Sequence[_T]]) -> List[_T]
        """Return what counts of {camera: a value for u and one for v}, of all cameras in turn."""
        return [x for camera in sorted(by_camera) for x in by_camera[camera][self.of(camera)]]

    def names(self, cameras):
        # type: (Iterable[str]) -> List[str]
        """Return the names of the rows that count, such as "A.u"."""
        return self.values({camera: (camera + ".u", camera + ".v") for camera in cameras})

    def count(self, cameras):
        # type: (Iterable[str]) -> int
        """Return how many of these cameras' rows count."""
        parts = [self.of(camera) for camera in cameras]
        return sum([part.stop - part.start for part in parts])

    def suffice(self, cameras):
        # type: (Iterable[str]) -> bool
        """Return whether there are as many as joints."""
        return self.count(cameras) >= self._joints


def _rejected(row, others):
    # type: (Vector, Matrix) -> List[float]
    """Return a row (n) without its component in the span of two others."""
    basis = []  # type: List[List[float]]
    for other in list(others) + [row]:
        left = list(other)
        for unit in basis:
            share = dot(left, unit)
            left = [a - share * u for a, u in zip(left, unit)]
        size = length(left)
        if size > 0:
            basis.append([a / size for a in left])
    return left
