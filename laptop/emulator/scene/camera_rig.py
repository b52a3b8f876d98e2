"""The cameras that watch one arm, and the truth about what they see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.workcell import cameras
from shared.arm_description import Arm

Vector = tuple[float, ...]
_FREE_COORDINATES = {"planar": 2, "spatial": 3}
"""Number of coordinates of the tip that the joints move, by the kind of chain."""
_NEWTON_STEPS = 12
"""Number of Newton's steps: they converge long before."""


class CameraRig(dict[str, Scene]):
    """Cameras that watch one arm, by name.

    Args:
        arm: its description.
        text: of the scene.
    """

    def __init__(self, arm: Arm, text: str) -> None:
        names = cameras(arm, text)
        super().__init__({name: Scene(arm, read_scene(text, name)) for name in names})
        self.arm = arm
        self.text = text
        self._first = self[names[0]]

    def centre(self, marker: str, q: Sequence[float] | None = None) -> np.ndarray:
        """Return the place of a marker (3,), cm, with the joints at q (rad; at home if None)."""
        home = [joint.home for joint in self.arm.joints]
        return self._first.centres(home if q is None else q)[marker]

    def truth(self, q: Sequence[float], marker: str = "effector") -> Vector:
        """Return the pixels of a marker in all pictures: u and v of each."""
        return tuple(value for scene in self.values() for value in scene.truth(q)[marker])

    def visible(self, q: Sequence[float], marker: str = "effector") -> float:
        """Return the part of a marker, 0 .. 1, seen by the camera that sees least of it."""
        return min(scene.visible(q)[marker] for scene in self.values())

    def project(self, place: Sequence[float]) -> np.ndarray:
        """Return the pixels of a place (x, y, z), cm, in all pictures: u and v of each."""
        return np.concatenate([s.project(np.array([place]))[0] for s in self.values()])

    def place_at(self, pixels: Sequence[float], marker: str) -> Vector:
        """Return the place (x, y, z), cm, that is seen at these pixels.

        In the plane one camera does, which knows how high a marker is; in space it takes two.
        """
        at_home = self.centre(marker)
        known = at_home[_FREE_COORDINATES[self.arm.chain] :]

        def seen(free: Vector) -> np.ndarray:
            return self.project([*free, *known])

        start = self.centre("effector")[: 3 - len(known)] / 2
        return (*map(float, solve(seen, tuple(start), pixels)), *map(float, known))


def solve(function: Callable[[Vector], Any], x: Vector, wanted: Sequence[float]) -> Vector:
    """Solve function(x) = wanted from x on, by Newton's method."""
    for _ in range(_NEWTON_STEPS):
        rest = np.array(wanted) - function(x)
        x = tuple(x + np.linalg.lstsq(slope(function, x), rest, rcond=None)[0])
    return x


def slope(function: Callable[[Vector], Any], x: Vector) -> np.ndarray:
    """Return the Jacobian of a function at x, by central differences."""
    steps = 1e-4 * np.eye(len(x))
    ends = [(function(tuple(x + d)), function(tuple(x - d))) for d in steps]
    return np.stack([np.subtract(*pair) for pair in ends], axis=1) / 2e-4
