"""Watch for the board in a camera's pictures, and for motions of either.

While they do, pixels are places on the board.  A look at a few markers, where they must be, is
cheap; the whole picture is searched only where these are not there.  Then they are covered, or the
picture is blurred, or something has moved.  What has moved gives no places until it stands again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import islice

import numpy as np

from laptop.see.markers.finders.board import BoardView, find_again, find_board
from laptop.see.markers.view import BoardPlace
from laptop.see.serve.joint_track import Joints
from laptop.see.table.arm_pose import ArmPose
from laptop.see.table.camera_fit import MAX_BLUR, BadCalibration, Calibration, calibrate
from laptop.see.table.camera_report import describe, shift_since
from shared.messages import EFFECTOR

SEARCH_PERIOD = 10
"""Number of pictures from one search for the board to the next, while its place is not known."""
CHECK_PERIOD = 50
"""Number of pictures from one check of some of its markers to the next, once it is known."""
CHECKED_MARKERS = 3
"""Number of markers that are checked, each time others."""
MIN_SEEN = 2
"""Least number of markers by which a motion is judged."""
MAX_PAUSE = 8
"""Longest pause between two full searches while the board is covered, in check periods."""
GOOD_SHARE = 0.5
"""Share of the board's markers with which a picture is taken at once."""
MAX_SEARCHES = 5
"""Number of searches after which the best picture so far is taken."""
MAX_REST_MOTION = 0.3
"""Greatest motion of a board that stands between two searches, px (median)."""
BLURRED_SHARE = 3.0
"""Displacement in a blurred picture, in sigmas of the blur, from which something has moved
nevertheless."""


class BoardWatch:
    """Placer of markers on the board of one camera, once seen; see `pipeline.TablePlacer`.

    Args:
        bar: length of the printed bar as measured, mm, or None.
        heights: of markers over the table, cm, by name; others lie on it.
        name: of the camera.
        report: gives people a line.
        stand: how the arm stands on the board, or None: that is not known.
        joints: tells how its joints stood last.
        alone: this camera alone places markers; if not, only together with another one.

    Attributes:
        calibration: of the camera, or None as long as the board was not seen.
        version: rises with each new calibration: what was placed by another one is no more true.
        why: why nothing is placed though the board was seen before, for people, or "".
        height: of the arm's marker over the table, cm; None: not known.
    """

    def __init__(
        self,
        bar: float | None,
        heights: Mapping[str, float],
        name: str,
        report: Callable[[str], None],
        arm_pose: ArmPose | None = None,
        joints: Joints = lambda: None,
        alone: bool = True,
    ) -> None:
        self._arm_pose, self._joints, self._alone = arm_pose, joints, alone
        self.calibration: Calibration | None = None
        self.version = 0
        self.why = ""
        self._bar, self._heights, self._name, self._report_line = bar, heights, name, report
        self.height = heights.get(EFFECTOR)
        self._pictures = 0
        self._reported: set[str] = set()
        self._begin()

    def _begin(self) -> None:
        """Reset the search for a board at rest."""
        self._search_count = 0
        self._best: BoardView | None = None
        self._last: BoardView | None = None

    def update(self, image: np.ndarray) -> None:
        """Search or check the board in a picture (BGR, uint8), at intervals."""
        due = self._pictures % SEARCH_PERIOD == 0
        self._pictures += 1
        if self.calibration is None:
            if due:
                self._calibrate(find_board(image))
        elif self.why:
            if due:
                self._recalibrate(find_board(image), self.calibration)
        elif self._pictures >= self._next_check:
            self._check_markers(image, self.calibration)

    # Until it is known

    def _calibrate(self, view: BoardView | None) -> None:
        """Add a view, and calibrate as soon as one shows enough markers."""
        if view and (self._best is None or len(view.numbers) > len(self._best.numbers)):
            self._best = view
        if self._best is None:
            return
        self._search_count += 1
        if len(self._best.numbers) < GOOD_SHARE * len(self._best.board.numbers):
            if self._search_count < MAX_SEARCHES:
                return
            self._search_count = 0
        try:
            found = calibrate([self._best], self._bar)
        except BadCalibration as problem:
            self._best = None
            self._report(f"no place on the board yet: {problem}")
            return
        lines = describe(found)
        if self.why:
            lines = [f"calibrated anew, places in cm go on: {lines[0]}"]
            if self._arm_pose and self.version == 1:
                lines.append(
                    "the pen's place is not told any more: it may be the board that has moved "
                    "before the arm; touch its crosses anew, or, if it was the camera, start anew"
                )
        # First the calibration, then that it holds: others read both.
        self.calibration = found
        self.version += 1
        self._mark_in_place()
        for line in lines:
            self._report_line(f"camera {self._name}: {line}")

    def _mark_in_place(self) -> None:
        """Confirm that camera and board are where they were calibrated."""
        self.why = ""
        self._unseen = 0
        self._next_check = self._pictures + CHECK_PERIOD
        self._begin()

    # Once it is known

    def _check_markers(self, image: np.ndarray, known: Calibration) -> None:
        """Check some markers' places; if they differ, search the whole board."""
        self._next_check = self._pictures + CHECK_PERIOD
        board, numbers = known.board, list(known.board.numbers)
        start = self._pictures // CHECK_PERIOD * CHECKED_MARKERS
        order = [numbers[(start + 7 * k) % len(numbers)] for k in range(len(numbers))]
        corners = {n: known.camera.project(known.scale * board.square(n)) for n in order}
        found = {n: quad for n, quad in corners.items() if np.isfinite(quad).all()}
        left = iter(found.items())
        seen = 0
        while some := dict(islice(left, CHECKED_MARKERS)):
            view = find_again(image, board, some)
            if view is None:
                continue
            if shift_since(known, view).moved:
                break
            seen += len(view.numbers)
            if seen >= MIN_SEEN:
                self._mark_in_place()
                return
        self._search_board(find_board(image), known)

    def _search_board(self, view: BoardView | None, known: Calibration) -> None:
        """Distinguish a board that is covered from one that has moved."""
        off, moved = self._view_fault(view, known)
        if moved:
            self._begin()
            self._last = view
            self._pictures = 1  # the next search is soon
            self.why = f"{off}; places in cm go on once it stands again"
            self._report_line(f"camera {self._name}: {self.why}")
        elif off:
            self._unseen += 1
            self._next_check = self._pictures + CHECK_PERIOD * min(self._unseen, MAX_PAUSE)
            if self._unseen > 1:
                self._report(
                    f"{off}: whether it has moved is not seen; places in cm are told as if it had "
                    "not"
                )
        else:
            self._mark_in_place()

    def _view_fault(self, view: BoardView | None, known: Calibration) -> tuple[str, bool]:
        """Return the trouble with a view, "" for none, and whether something moved."""
        if view is None or len(view.numbers) < MIN_SEEN:
            return "the board is covered, blurred, or outside of the picture", False
        try:
            shift = shift_since(known, view)
        except BadCalibration:
            return f"another board lies there now ({view.board.paper})", True
        if view.blur > MAX_BLUR and shift.px < BLURRED_SHARE * view.blur:
            return "the picture is blurred", False
        if shift.moved:
            return f"camera or board has moved, by {shift.px:.1f} px, {shift.mm:.1f} mm", True
        return "", False

    def _recalibrate(self, view: BoardView | None, known: Calibration) -> None:
        """Handle a view after a motion: the board may be back, still moving, or at rest."""
        off, moved = self._view_fault(view, known)
        if not off:
            self._mark_in_place()
            self._report_line(
                f"camera {self._name}: camera and board are back where they were; places in cm go "
                "on"
            )
            return
        still = moved and view and self._last and _distance(view, self._last) < MAX_REST_MOTION
        if not still or (view and view.blur > MAX_BLUR):
            self._begin()
            self._last = view if moved else None
            return
        self._last = view
        self._calibrate(view)

    def place(self, marker: str, pixel: tuple[float, float]) -> tuple[float, float] | None:
        """Return a marker's place on the board, (x, y), cm; None: unknown.

        Args:
            marker: its name.
            pixel: of its centre, (u, v).
        """
        return self.place_at(pixel, self._heights.get(marker, 0.0))

    def place_at(self, pixel: tuple[float, float], height: float) -> tuple[float, float] | None:
        """Return the place over the board, (x, y), cm, of what a pixel shows; None: unknown.

        Args:
            pixel: (u, v).
            height: over the table, cm.
        """
        known = self.calibration
        if known is None or self.why:
            return None
        x, y = known.camera.to_table(np.array([pixel]), height)[0]
        return (float(x), float(y)) if np.isfinite(x) else None

    def board_place(self, marker: str, pixel: tuple[float, float]) -> BoardPlace | None:
        """Return a marker's place on the board, for people: of the tip it is the pen's place.

        Args:
            marker: its name.
            pixel: of its centre, (u, v).
        """
        at = self.place(marker, pixel) if self._alone else None
        if at is None or self._arm_pose is None:
            return at and BoardPlace(*at)
        if self.version > 1:  # the board may have moved before the arm
            return None if marker == EFFECTOR else BoardPlace(*at)
        if marker == EFFECTOR:
            reported = self._joints()
            at = self._arm_pose.pen(at, reported[1] if reported else None)
        return at and BoardPlace(*at, arm=self._arm_pose.in_arm(at))

    def _report(self, line: str) -> None:
        if line not in self._reported:
            self._reported.add(line)
            self._report_line(f"camera {self._name}: {line}")


def _distance(one: BoardView, other: BoardView) -> float:
    """Return the median distance of the markers that both show, px; inf: there are none."""
    if one.size != other.size:
        return np.inf
    ours, theirs = (
        dict(zip(view.numbers, view.pixels.reshape(-1, 4, 2), strict=True)) for view in (one, other)
    )
    both = ours.keys() & theirs.keys()
    away = [np.linalg.norm(ours[number] - theirs[number], axis=1) for number in both]
    return float(np.median(away)) if away else np.inf
