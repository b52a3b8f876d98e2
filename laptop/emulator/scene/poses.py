"""Sources of the poses that a synthetic camera shows: a function, a record, or a live arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from laptop.emulator.live import NO_RUN, History, Pose, PoseReader
from shared.arm_description import Arm


class Poses(Protocol):
    """A camera's source of poses."""

    @property
    def notes(self) -> list[str]:
        """Notes for people on what is shown."""

    def __call__(self, t: float) -> Pose:
        """Return the pose at t, s on the camera's clock."""

    def close(self) -> None:
        """Release the source."""


class ScriptedPoses:
    """Poses from a function; no ink.

    Args:
        arm: Arm.
        angles: t, s -> q, rad.
    """

    def __init__(self, arm: Arm, angles: Callable[[float], Sequence[float]]) -> None:
        self.notes: list[str] = []
        self._arm, self._angles = arm, angles

    def __call__(self, t: float) -> Pose:
        """Return the pose of the function at t, s."""
        return Pose(self._arm, tuple(self._angles(t)), [])

    def close(self) -> None:
        """Release nothing, as nothing is held."""


class RecordedPoses:
    """The poses of an emulated brick in this process; t is its world's time.

    Args:
        brick: laptop.emulator.device.brick.EmulatedBrick.
    """

    def __init__(self, brick: Any) -> None:
        self._brick = brick
        self._history = History(brick.arm)
        self._taken = 0
        self.notes: list[str] = []

    def __call__(self, t: float) -> Pose:
        """Return the true pose at t, s."""
        record = self._brick.record
        for sample in record[self._taken :]:
            self._history.append(sample.t, sample.q, sample.pen)
        self._taken = len(record)
        pose = self._history.at(t)
        assert pose is not None, "a brick's record begins with where it stands"
        return pose

    def close(self) -> None:
        """Release nothing, as nothing is held."""


class LivePoses:
    """The poses of the arm that runs in real time in another process, or of one at home.

    Args:
        arm: shown as long as none runs.
        folder: see `live.PoseReader`.
    """

    def __init__(self, arm: Arm, folder: str | None = None) -> None:
        self.reader = PoseReader(folder)
        self._resting = Pose(arm, tuple(joint.home for joint in arm.joints), [])

    def __call__(self, t: float) -> Pose:
        """Return the true pose at t, s on the world's clock."""
        self.reader.poll()
        return self.reader.at(t) or self._resting

    def close(self) -> None:
        """Stop following the arm."""
        self.reader.close()

    @property
    def notes(self) -> list[str]:
        """Notes for people on what is shown."""
        reader = self.reader
        if reader.header is None:
            return [NO_RUN, reader.refused] if reader.refused else [NO_RUN]
        name = reader.header["script"]
        if reader.alive:
            return [f"shows {name}, process {reader.header['pid']}"]
        return [f"{name} has ended; the arm stays where it was"]
