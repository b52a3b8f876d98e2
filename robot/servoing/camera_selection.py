"""Which cameras the servo goes by, how much each counts, and which joints they have seen move.

Pure.
"""

from robot.servoing.image_model import stacked
from robot.servoing.measurement import MIN_SIGMA


class CameraSelection(object):
    """The cameras of a run.

    Args:
        rows: Rows.
        joints: how many.
        known: the models need no exploring.

    Attributes:
        used: the cameras that it goes by.
        weights: {camera: by how much what it sees counts}: of unequal ones, each by its noise.
    """

    def __init__(self, rows, joints, known=False):
        self._rows = rows
        self._joints = joints
        self._known = known
        self.used, self.weights = [], {}
        self._looks = {}  # camera: how often it was looked through since exploring began
        self._explored = [known] * joints

    def forget(self):
        """Nothing counts as explored any more."""
        self._explored = [self._known] * self._joints
        self._looks.clear()

    def look(self, cameras):
        """Take in that these were looked through; those that have seen every joint move."""
        for camera in cameras:
            self._looks[camera] = self._looks.get(camera, 0) + 1
        return [c for c in cameras if self._known or self._looks[c] > self._joints]

    def choose(self, cameras, known, sigma_of):
        """Go by those that are known well enough, or by all if these are too few.

        Args:
            cameras, known: that were looked through, as `look` has it.
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
        """Whether every joint has been moved."""
        return all(self._explored)

    def next_joint(self):
        """(the joint that is explored next, which joints were explored before)."""
        before = list(self._explored)
        k = before.index(False)
        self._explored[k] = True
        return k, before

    def parts(self, by_camera):
        """[(its value, the slice of its rows that counts, its weight)] of the cameras in use."""
        return [
            (by_camera[c], self._rows.of(c), self.weights[c]) for c in self.used if c in by_camera
        ]

    def together(self, by_camera):
        """Of {camera: its u and v}: all that counts, by its weight, in turn."""
        return [weight * x for pair, rows, weight in self.parts(by_camera) for x in pair[rows]]

    def moving(self, sights, t):
        """(image model, goal at time t, its velocity), of all that counts.

        Args:
            sights: {camera: Stream's sight}.
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
