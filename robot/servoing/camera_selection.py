"""Selection of cameras: which the servo uses, the weight of each, which saw which joints move.

Pure.
"""

from robot.servoing.image_model import stacked
from robot.servoing.measurement import MIN_SIGMA

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Mapping, Sequence, Tuple, TypeVar  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel  # noqa: F401
    from robot.servoing.rows import Rows  # noqa: F401
    from robot.servoing.stream import Sight  # noqa: F401

    _T = TypeVar("_T")


class CameraSelection(object):
    """The cameras of a run.

    Args:
        rows: Rows.
        joints: how many.
        known: the models need no exploring.

    Attributes:
        used: the cameras in use.
        weights: {camera: weight}: of unequal ones, each by its noise.
    """

    def __init__(self, rows, joints, known=False):
        # type: (Rows, int, bool) -> None
        self._rows = rows
        self._joints = joints
        self._known = known
        self.used, self.weights = [], {}  # type: Sequence[str], Dict[str, float]
        # Camera: how often it has measured since exploring began.
        self._samples = {}  # type: Dict[str, int]
        self._explored = [known] * joints

    def forget(self):
        # type: () -> None
        """Count no joint as explored any more."""
        self._explored = [self._known] * self._joints
        self._samples.clear()

    def sample(self, cameras, motions):
        # type: (Sequence[str], int) -> List[str]
        """Count a measurement of these cameras; return those that have seen every joint move.

        Args:
            cameras: that have measured.
            motions: number of motions in which every joint is explored.
        """
        for camera in cameras:
            self._samples[camera] = self._samples.get(camera, 0) + 1
        return [c for c in cameras if self._known or self._samples[c] > motions]

    def choose(self, cameras, known, sigma_of):
        # type: (Sequence[str], Sequence[str], Callable[[str], float]) -> bool
        """Go by the cameras that are known well enough, or by all if these are too few.

        Args:
            cameras: that have measured.
            known: those of them that `sample` has returned.
            sigma_of: gives a camera's noise, px.

        Returns:
            Whether none of them was in use.
        """
        if self._rows.suffice(known):
            cameras = known
        elif self.explored:
            self._explored = [False] * self._joints  # before the eyes of those that have come since
        others = bool(self.used) and not set(cameras) & set(self.used)
        self.used = cameras
        noise = [max(sigma_of(camera), MIN_SIGMA) for camera in cameras]
        self.weights = {c: min(noise) / sigma for c, sigma in zip(cameras, noise)}
        return others

    @property
    def explored(self):
        # type: () -> bool
        """Whether every joint has been moved."""
        return all(self._explored)

    def explored_all(self):
        # type: () -> None
        """Count every joint as explored."""
        self._explored = [True] * self._joints

    def explored_by(self, cameras):
        # type: (Sequence[str]) -> None
        """Count every joint as explored, before the eyes of these cameras."""
        self.explored_all()
        for camera in cameras:
            self._samples[camera] = self._joints

    def next_joint(self):
        # type: () -> Tuple[int, List[bool]]
        """Return (the joint that is explored next, which joints were explored before)."""
        before = list(self._explored)
        k = before.index(False)
        self._explored[k] = True
        return k, before

    def parts(self, by_camera):
        # type: (Mapping[str, _T]) -> List[Tuple[_T, slice, float]]
        """Return [(value, slice of its rows that counts, weight)] of the cameras in use."""
        return [
            (by_camera[c], self._rows.of(c), self.weights[c]) for c in self.used if c in by_camera
        ]

    def together(self, by_camera):
        # type: (Mapping[str, Features]) -> List[float]
        """Return all that counts of {camera: its u and v}, by its weight, in turn."""
        return [weight * x for pair, rows, weight in self.parts(by_camera) for x in pair[rows]]

    def moving(self, sights, t):
        # type: (Mapping[str, Sight], float) -> Tuple[LinearImageModel, List[float], List[float]]
        """Return (image model, goal at time t, its velocity), of all that counts.

        Args:
            sights: {camera: Stream's sight}.
            t: s.
        """
        images = {c: sight.shape.moved(sight.offset) for c, sight in sights.items()}
        goal = {
            c: [x + v * (t - sight.t) for x, v in zip(sight.goal, sight.speed)]
            for c, sight in sights.items()
        }
        speed = {c: sight.speed for c, sight in sights.items()}
        return (
            stacked(self.parts(images)), self.together(goal), self.together(speed)
        )  # fmt: skip
