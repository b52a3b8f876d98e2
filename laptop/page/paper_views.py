"""Views of the paper in the cameras' pictures, learned from cameras and brick."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from laptop.page.board_mapping import BoardMapping
from laptop.page.camera_feed import CameraFeed
from laptop.page.marker_height import HEIGHT_LIMITS_MM, DrawingArm, MarkerHeight
from laptop.page.table_mapping import TableMapping, TableView
from laptop.see.serve.joint_track import JointTrack, marker_place, marker_shift
from laptop.see.serve.pipeline import Point
from laptop.see.serve.server_state import ServerState as LinkState
from laptop.see.serve.tip_track import TipTrack
from robot.motion import kinematics
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

MIN_SHIFT = 1.0
"""Least shift of the arm's places in a view that is shown anew, px."""


class PaperViews:
    """Learns where the paper is in each camera's picture.

    Args:
        drawing_arm: that is seen; of one that is not known nothing is learned.
        cameras: feeds by camera name.

    Attributes:
        mappings, boards: what the tip's moves and a board tell, by camera.
        is_flat: the arm moves in a plane, so that its marker's height counts.
    """

    def __init__(self, drawing_arm: DrawingArm, cameras: Mapping[str, CameraFeed]) -> None:
        arm, height, memory = drawing_arm
        self._arm, self._cameras, self._memory = arm, cameras, memory
        reach = kinematics.reach(arm)[1] if arm else 1.0
        self.is_flat = arm is not None and kinematics.coordinates(arm) == 2
        self._probes = reach * np.array([(0.5, 0.5), (0.8, 0.0), (0.5, -0.5)])
        self.mappings = {name: TableMapping(reach) for name in cameras}
        self.boards = {name: BoardMapping(feed.watcher.place_at) for name, feed in cameras.items()}
        self._versions = dict.fromkeys(cameras, 0)  # of the calibrations by a board
        self._tracks = {name: TipTrack() for name in cameras}
        self._joints = JointTrack()
        self._last_status: object = None
        # Times, s, and the marker's places by the joints, cm, until the frames of that time arrive.
        self._pairs: dict[str, deque[tuple[float, Sequence[float]]]] = {
            name: deque(maxlen=32) for name in cameras
        }
        self._shown: dict[str, tuple[TableView | None, int]] = {}
        self._given_height = (
            height or self._touched() or (memory.read() if memory else MarkerHeight())
        )
        self._lay_paper()

    # The marker's height

    @property
    def height(self) -> MarkerHeight:
        """Height of the marker over the paper, given or found; of an arm in space there is none."""
        if not self.is_flat or self._given_height.cm is not None:
            return self._given_height
        for board in self.boards.values():
            if board.view and board.height is not None:
                source = "found by the board and the tip's moves"
                return MarkerHeight(board.height, source, board.height_sigma)
        return MarkerHeight()

    def set_height(self, mm: float | None) -> str:
        """Set the marker's height that a user typed, mm; None: unknown."""
        if not self.is_flat:
            return (
                "an arm in space needs no height of its marker: its moves tell where the paper is"
            )
        if mm is not None and not HEIGHT_LIMITS_MM[0] <= mm <= HEIGHT_LIMITS_MM[1]:
            low, high = HEIGHT_LIMITS_MM
            return f"marker's height {mm:g} mm: from {low:g} to {high:g} mm"
        self._given_height = (
            MarkerHeight() if mm is None else MarkerHeight(mm / 10, "as typed here")
        )
        self._lay_paper()
        return self._memory.write(self._given_height.cm) if self._memory else ""

    def _touched(self) -> MarkerHeight | None:
        """Return the marker's height by the touched crosses, if that is known."""
        reported = (feed.watcher.marker_height for feed in self._cameras.values())
        cm = next((height for height in reported if height is not None), None)
        return None if cm is None else MarkerHeight(cm, "by the touched crosses")

    def _lay_paper(self) -> None:
        height = self._given_height.cm if self.is_flat else None
        for name, mapping in self.mappings.items():
            mapping.lay_paper(height)
            self.boards[name].lay_paper(height)

    # Views

    def view(self, camera: str) -> TableView | None:
        """Return where the paper is in a camera's picture, if that is known.

        Of an arm in a plane it is that in which the marker rides over the paper, until the marker's
        height is known.
        """
        if camera not in self.mappings or self._cameras[camera].watcher.placing[1]:
            return None
        return self.boards[camera].view or self.mappings[camera].view

    def views(self) -> dict[str, TableView]:
        """Return the views of all cameras of which one is known."""
        found = {name: self.view(name) for name in self.mappings}
        return {name: view for name, view in found.items() if view}

    def unmapped(self) -> dict[str, str]:
        """Return why there is no view, by camera."""
        return {
            name: self._cameras[name].watcher.placing[1] or mapping.why
            for name, mapping in self.mappings.items()
            if self.view(name) is None
        }

    def pen_places(self, camera: str, pixels: np.ndarray, shifts: np.ndarray) -> np.ndarray:
        """Return where the pen was, (n, 2), cm in the arm's frame; nan where that is not known.

        It is measured in the plane in which the marker rides, whatever its height.

        Args:
            camera: its name.
            pixels: of the marker, (n, 2).
            shifts: from the pen to the marker, cm, (n, 2 or 3).
        """
        for mapping in (self.mappings[camera], self.boards[camera]):
            if (places := mapping.pen(pixels, shifts)) is not None:
                return places
        return np.full((len(pixels), 2), math.nan)

    def marker_shift(self, t: float) -> Sequence[float] | None:
        """Return the vector from the pen to the marker at a time, s, cm; None: unknown (yet)."""
        if self._arm is None:
            return 0.0, 0.0, 0.0
        if not any(self._arm.marker_offset):
            return (0.0,) * kinematics.coordinates(self._arm)
        q = self._joints.at(t)
        return q and marker_shift(self._arm, q)

    def have_changed(self) -> bool:
        """Return True if a view has changed since the last call."""
        changed = False
        for name, mapping in self.mappings.items():
            view, moved = self.view(name), mapping.moved
            before, moved_before = self._shown.get(name, (None, 0))
            if moved != moved_before or self._differ(before, view):
                self._shown[name] = view, moved
                changed = True
        return changed

    def _differ(self, one: TableView | None, other: TableView | None) -> bool:
        if one is None or other is None or one.is_paper != other.is_paper:
            return one is not other
        if one.source != other.source:
            return True
        distance = np.hypot(*(one.to_picture(self._probes) - other.to_picture(self._probes)).T)
        return bool(np.nanmax(np.append(distance, 0.0)) > MIN_SHIFT)

    # At every heartbeat

    def sample_tips(self) -> dict[str, tuple[float, Point]]:
        """Sample the tip in the cameras' frames; return its time, s, and pixel by camera."""
        tips = {}
        for name, feed in self._cameras.items():
            view = feed.watcher.view
            seen = view and view.found.get(EFFECTOR)
            if view and seen and seen.confidence >= LEAST_CONFIDENCE:
                tips[name] = view.frame.t, (seen.u, seen.v)
                self._tracks[name].add(*tips[name])
        return tips

    def learn(self, link: LinkState, now: float) -> None:
        """Add pairs of the marker's place by the joints, and by the cameras.

        Args:
            link: the brick's last status.
            now: s.
        """
        self._notice_moves()
        status = link.status
        if self._arm and status and status is not self._last_status:
            self._last_status = status
            if len(status.q) == len(self._arm.joints):
                t = now - (link.status_age or 0.0) - link.status_lag
                self._joints.add(t, status.q)
                for pairs in self._pairs.values():
                    pairs.append((t, marker_place(self._arm, status.q)))
        for name, pairs in self._pairs.items():
            track = self._tracks[name]
            while pairs and pairs[0][0] <= track.last:
                t, p = pairs.popleft()
                view = self._cameras[name].watcher.view
                if view and (found := track.at(t)) is not None:
                    height, width = view.frame.image.shape[:2]
                    self.mappings[name].add(p, *found, (width, height))
                    self.boards[name].add(p, *found, (width, height))

    def _notice_moves(self) -> None:
        """Reset the mappings of a camera that was calibrated anew: it or the board has moved."""
        for name, feed in self._cameras.items():
            version, _ = feed.watcher.placing
            if version != self._versions[name]:
                self.boards[name].forget()
                if self._versions[name]:
                    self.mappings[name].forget()
                self._versions[name] = version
