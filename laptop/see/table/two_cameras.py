"""Places of markers in space, by two cameras whose poses on one board are known.

A camera knows that by the board; or, if it does not see it, by the tip's own moves: the joints tell
where the tip is, and a camera over the board how the arm stands there.  Sights of two cameras are
compared at one moment: between two pictures of the second one, it is where it went straight on.
"""

from __future__ import annotations

import math
import re
import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from laptop.see.camera.frames import Frame
from laptop.see.markers.view import BoardPlace
from laptop.see.serve.joint_track import Joints, marker_place
from laptop.see.serve.observation_csv import PairedPlace
from laptop.see.serve.tip_track import TipTrack
from laptop.see.table.board_watch import BoardWatch
from laptop.see.table.camera_model import CameraModel, triangulate
from laptop.see.table.moves_fit import (
    MIN_PLACES,
    ArmPoseFit,
    BadMoves,
    MovesFit,
    check_moves,
    fit_arm_pose,
    fit_moves,
)
from shared.arm_description import Arm
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

Sights = Mapping[str, tuple[float, float, float] | None]
"""(u, v, confidence) by marker; None: it was not seen."""

MAX_GAP = 0.15
"""Longest gap between two pictures across which a marker's place is interpolated, s."""
MAX_PLACE_AGE = 1.0
"""Time for which a place is reported, s."""
MAX_WAITING = 32
"""Greatest number of pictures of the first camera that wait for the second."""
CELL_SIZE = 1.5
"""Side of the cubes in each of which the sample with the slowest tip is stored, cm."""
MAX_SPEED = 250.0
"""Greatest speed of a usable tip, px/s: pictures are not timed to the millisecond."""
REFIT_GROWTH = 1.3
"""Growth of the number of places after which the camera is fitted anew, as a factor."""
MOVED_PX, MOVED_PLACES = 10.0, 6
"""Residual, px, and number of consecutive places with it, by which the camera has moved."""


class _TipSample(NamedTuple):
    """One place of the marker: by the joints, and in the pictures of two cameras.

    speed  of it in either picture, px/s
    point  in the arm's frame, (3,), cm
    over   pixel of the camera that knows the board
    other  of the one that does not
    """

    speed: float
    point: tuple[float, ...]
    over: tuple[float, float]
    other: tuple[float, float]


class TwoCameras:
    """Placer of markers by the first two cameras with a known pose; thread-safe.

    Args:
        watches: of the board, by camera name.
        arm: whose tip moves, or None: it is not known.
        joints: tells its joints, and when.
        report: gives people a line.

    Attributes:
        latest: the last place of each marker.
    """

    def __init__(
        self,
        watches: Mapping[str, BoardWatch],
        arm: Arm | None,
        joints: Joints,
        report: Callable[[str], None],
    ) -> None:
        self.latest: dict[str, PairedPlace] = {}
        self._watches, self._arm, self._joints, self._report = watches, arm, joints, report
        self._tracks: dict[str, dict[str, TipTrack]] = {name: {} for name in watches}
        self._sizes: dict[str, tuple[int, int]] = {}
        self._waiting: dict[str, deque[tuple[int, float, Sights]]] = {
            name: deque(maxlen=MAX_WAITING) for name in watches
        }
        self._reports: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=MAX_WAITING)
        self._by_moves = {name: _ByMoves() for name in watches}
        self._versions: dict[str, int] = {}
        self._t = -math.inf  # of the newest picture, s
        self._lock = threading.Lock()

    def see(self, camera: str, frame: Frame, markers: Sights) -> list[PairedPlace]:
        """Add a camera's markers; return the new places of markers in space."""
        with self._lock:
            height, width = frame.image.shape[:2]
            self._sizes[camera] = width, height
            self._t = max(self._t, frame.t)
            for name, seen in markers.items():
                if seen and seen[2] >= LEAST_CONFIDENCE:
                    track = self._tracks[camera].setdefault(name, TipTrack())
                    track.add(frame.t, (seen[0], seen[1]))
            self._waiting[camera].append((frame.index, frame.t, markers))
            self._notice_moves()
            self._learn()
            new = self._pair()
            self.latest.update({pair.marker: pair for pair in new})
            return new

    def camera(self, name: str) -> CameraModel | None:
        """Return a camera's model on the board; None: its pose is unknown."""
        watch = self._watches[name]
        if watch.calibration and not watch.why:
            return watch.calibration.camera
        fit = self._by_moves[name].fit
        # A camera that has seen the board is found by the board alone.
        return fit.camera if fit and not watch.calibration else None

    # Two webcams have no common shutter.  With the newest picture of each, a tip at 250 px/s would
    # be compared with itself a thirtieth of a second later, 8 px on, which triangulation takes for
    # another height.  So every frame bears the time at which it was taken, and what the first
    # camera sees at t is compared with the second's straight line between its sightings about t,
    #     p(t) = p0 + (t - t0) / (t1 - t0) (p1 - p0),
    # which an acceleration a takes off by a (t1 - t0)^2 / 8 at the most, the error of linear
    # interpolation.  Pictures wait until the other camera has got beyond them, instead of going on
    # from its last two: an extrapolation over one more interval is up to eight times as far off,
    # and draws every turn too wide.  Where the sightings are too far apart in time, no
    # place is reported.
    def _pair(self) -> list[PairedPlace]:
        """Return the places of markers in the pictures that both cameras have got beyond."""
        known = {name: model for name in self._watches if (model := self.camera(name))}
        if len(known) < 2:
            for waiting in self._waiting.values():
                waiting.clear()
            self.latest.clear()
            return []
        (one, first), (other, second) = list(known.items())[:2]
        new = []
        waiting, tracks = self._waiting[one], self._tracks[other]
        last = max((track.last for track in tracks.values()), default=-math.inf)
        while waiting and waiting[0][1] <= last:
            index, t, markers = waiting.popleft()
            for name, seen in markers.items():
                interpolated = tracks[name].at(t, MAX_GAP) if name in tracks else None
                if not (seen and seen[2] >= LEAST_CONFIDENCE and interpolated):
                    continue
                pixels = np.array([seen[:2]]), np.array([interpolated[0]])
                ((x, y, z),), (gap,) = triangulate(first, second, *pixels)
                if math.isfinite(x):
                    place = BoardPlace(float(x), float(y), float(z))
                    both = f"{one}+{other}"
                    new.append(PairedPlace(index, t, name, seen[2], place, float(gap), both))
        return new

    # By the tip's own moves

    def _notice_moves(self) -> None:
        """Reset the calibrations by motion when a camera was calibrated anew."""
        versions = {name: watch.version for name, watch in self._watches.items()}
        if any(self._versions.get(name, 0) not in (0, versions[name]) for name in versions):
            self._by_moves = {name: _ByMoves() for name in self._watches}
            self._reports.clear()
        self._versions = versions

    def _learn(self) -> None:
        """Sample the tip by joints and cameras, for the cameras that do not see the board."""
        if self._arm is None:
            return
        reported = self._joints()
        if reported and len(reported[1]) == len(self._arm.joints) and reported not in self._reports:
            self._reports.append((reported[0], tuple(reported[1])))
        known = [n for n, w in self._watches.items() if w.calibration and not w.why]
        unknown = [n for n, w in self._watches.items() if not w.calibration]
        if not known or not unknown:
            self._reports.clear()
            return
        over = known[0]
        tracks = {n: self._tracks[n].get(EFFECTOR) for n in (over, *unknown)}
        while self._reports:
            t, q = self._reports[0]
            if any(track is None or track.last < t for track in tracks.values()):
                return  # pictures come later
            self._reports.popleft()
            above = tracks[over].at(t, MAX_GAP)  # type: ignore[union-attr]
            for name in unknown:
                beside = tracks[name].at(t, MAX_GAP)  # type: ignore[union-attr]
                if above and beside:
                    point = (*marker_place(self._arm, q), 0.0)[:3]
                    speed = max(above[1], beside[1])
                    self._add(name, over, _TipSample(speed, point, above[0], beside[0]))

    def _add(self, name: str, over: str, sample: _TipSample) -> None:
        by_moves = self._by_moves[name]
        if sample.speed > MAX_SPEED:
            return
        if by_moves.has_moved(sample):
            self._by_moves[name] = by_moves = _ByMoves()
            self._report(f"camera {name} has moved: it is not known until the tip has moved about")
        if not by_moves.add(sample):
            return
        calibration = self._watches[over].calibration
        assert calibration
        try:
            by_moves.refit(calibration.camera, self._sizes[name])
        except BadMoves as problem:
            if by_moves.is_unreported(str(problem)):
                self._report(
                    f"camera {name} does not see the board, and is not known yet: {problem}"
                )
            return
        fit = by_moves.fit
        if fit and by_moves.is_unreported("known"):
            self._report(
                f"camera {name} does not see the board: by the tip's own moves it stands "
                f"{fit.camera.position[2]:.1f} cm above it; {fit.places} places are missed by "
                f"{fit.rms:.2f} px, {fit.rms_mm:.2f} mm (RMS)"
            )

    def lines(self) -> list[str]:
        """Return lines of status: where markers are in space, as far as that is known."""
        with self._lock:
            fresh = [pair for pair in self.latest.values() if self._t - pair.t < MAX_PLACE_AGE]
        parts = [
            f"{pair.marker} at {pair.place}, the lines of sight miss by {10 * pair.gap:.1f} mm"
            for pair in fresh
        ]
        if fresh:
            return [f"{fresh[0].cameras}: {', '.join(parts)}"]
        unknown = [name for name in self._watches if self.camera(name) is None]
        if len(self._watches) - len(unknown) > 1:
            return []
        return [f"no places in space: where camera {' and '.join(unknown)} stands is not known yet"]


class _ByMoves:
    """Samples and fit of one camera that does not see the board."""

    def __init__(self) -> None:
        self.fit: MovesFit | None = None
        self._samples: dict[tuple[int, ...], _TipSample] = {}
        self._arm_pose: ArmPoseFit | None = None
        self._fitted = 0
        self._far = 0
        self._reported: set[str] = set()

    def has_moved(self, sample: _TipSample) -> bool:
        """Return whether the last samples are all seen elsewhere than the fit has them."""
        if self.fit is None or self._arm_pose is None:
            return False
        point = self._arm_pose.on_board(np.array([sample.point]))
        off = math.dist(self.fit.camera.project(point)[0], sample.other)
        self._far = self._far + 1 if off > MOVED_PX else 0
        return self._far >= MOVED_PLACES

    def add(self, sample: _TipSample) -> bool:
        """Add a sample; return whether there are enough new ones to fit."""
        key = tuple(math.floor(x / CELL_SIZE) for x in sample.point)
        known = self._samples.get(key)
        if known is None or sample.speed <= known.speed:
            self._samples[key] = sample
        count = len(self._samples)
        return count >= max(MIN_PLACES, REFIT_GROWTH * self._fitted) and count > self._fitted

    def refit(self, over: CameraModel, size: tuple[int, int]) -> None:
        """Fit the camera to all samples.

        Args:
            over: the camera that knows the board.
            size: of this one's pictures, px.

        Raises:
            BadMoves: that is not possible.
        """
        samples = list(self._samples.values())
        self._fitted = len(samples)
        points = np.array([sample.point for sample in samples])
        seen = np.array([sample.other for sample in samples])
        check_moves(points, seen, size)
        arm_pose = fit_arm_pose(over, points, np.array([sample.over for sample in samples]))
        self.fit, self._arm_pose = fit_moves(arm_pose.on_board(points), seen, size), arm_pose

    def is_unreported(self, what: str) -> bool:
        """Return whether no such line was reported yet, whatever its numbers."""
        kind = re.sub(r"\d+", "", what)
        new = kind not in self._reported
        self._reported.add(kind)
        return new
