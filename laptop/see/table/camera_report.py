"""Description of a calibration: its data, its uncertainty, and its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from laptop.see.markers.finders.board import BoardView
from laptop.see.table.camera_fit import MAX_BLUR, BadCalibration, Calibration

UNSURE_FOCAL = 0.04
"""Relative standard deviation of the focal length above which it is called unknown."""
SURE_VIEWS = 3
"""Number of different views below which a focal length may be wrong by more than is reported: fewer
cannot tell that a picture was cropped or squeezed."""
DISC_HEIGHT = 3.0
"""Usual height of a disc over the paper, by which its error is shown, cm."""
MOVED_PX = 0.5
MOVED_RMS = 5.0
"""RMS displacement, px, or in multiples of the model's, below which nothing has moved."""


def describe(calibration: Calibration) -> list[str]:
    """Return lines for people on a calibration."""
    camera, board = calibration.camera, calibration.board
    every = len(board.numbers)
    counts = sorted(set(calibration.markers))
    seen = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    focal, sigmas = camera.lens[0], np.sqrt(np.diag(camera.covariance))
    away, tilt = camera.position[2], math.degrees(camera.tilt)
    on_table, above = (10 * calibration.point_sigma(h) for h in (0.0, DISC_HEIGHT))
    lines = [
        f"board {board.paper}: {seen} of {every} markers in {_views(calibration)}; "
        f"the model misses them by {calibration.rms:.3f} px, {calibration.rms_mm:.3f} mm (RMS)",
        f"camera: {away:.1f} cm above the table, {tilt:.0f} degrees from straight down",
        f"lens: focal length {focal:.0f} px +- {100 * calibration.focal_sigma:.2g} %, "
        f"k1 {camera.lens[3]:.3f} +- {sigmas[3]:.3f}, k2 {camera.lens[4]:.3f} +- {sigmas[4]:.3f}",
        f"a point on the table is sure to {on_table:.2f} mm or better (sigma), "
        f"one {DISC_HEIGHT:g} cm above it to {above:.2f} mm"
        + ", if the print is true"
        * (calibration.bar is None),
        f"parallax: what is 1 cm above the table seems up to {10 * parallax(calibration):.1f} mm "
        "from where it is, unless its height is given",
    ]
    if calibration.bar is None:
        lines.append(
            "scale: as printed.  The picture cannot tell whether the print is true: "
            "measure the bar and give its length, --bar 97"
        )
    else:
        lines.append(f"scale: the bar is {calibration.bar:g} mm long, as measured")
    return lines + warnings(calibration)


def _views(calibration: Calibration) -> str:
    count = len(calibration.markers)
    return f"{count} view{'s' * (count > 1)}"


def warnings(calibration: Calibration) -> list[str]:
    """Return lines on what could be better."""
    lines = []
    every = len(calibration.board.numbers)
    if (seen := calibration.markers[-1]) < every:
        lines.append(
            f"{every - seen} of {every} markers are covered, blurred or outside: "
            f"the {seen} that are seen are enough"
        )
    if calibration.left_out:
        lines.append(
            f"{calibration.left_out} markers are not where the board has them, and were left out: "
            "is another sheet in the picture, or the paper bent?"
        )
    if calibration.alike:
        pictures = len(calibration.markers) + calibration.alike
        lines.append(
            f"{pictures} pictures show {_views(calibration)}: those that show the same count once; "
            "move the camera or the board between pictures"
        )
    if len(calibration.markers) < SURE_VIEWS:
        lines.append(
            "the focal length is little more than a guess, which matters above the table, and "
            f"holds for whole, unscaled pictures only: take {SURE_VIEWS} views or more, the board "
            "tilted by 30 degrees to different sides"
        )
    elif calibration.focal_sigma > UNSURE_FOCAL:
        lines.append(
            "the focal length is little more than a guess, which matters above the table: "
            "add a picture of the board tilted by 30 degrees"
        )
    if calibration.blur > MAX_BLUR:
        lines.append(
            f"the picture is blurred: edges are spread by {calibration.blur:.1f} px (sigma); "
            "focus, hold still, or give it more light"
        )
    return lines


def parallax(calibration: Calibration, height: float = 1.0) -> float:
    """Return the greatest shift, cm, of a thing at a height, cm, taken to lie on the board."""
    width, high = (side / 2 for side in calibration.board.middle)
    corners = np.array([(x, y, height) for x in (-width, width) for y in (-high, high)])
    seen = calibration.camera.to_table(calibration.camera.project(corners))
    off = np.linalg.norm(seen - corners[:, :2], axis=1)
    return float(np.max(off, where=np.isfinite(off), initial=0.0))


@dataclass(frozen=True)
class Shift:
    """Displacement of the board against where it was.

    px     median over its markers
    mm     the same on the table
    moved  it is more than can be measured wrong
    """

    px: float
    mm: float
    moved: bool

    def __str__(self) -> str:
        if not self.moved:
            return f"camera and board are where they were, to {self.px:.2f} px, {self.mm:.2f} mm"
        return (
            f"the camera or the board has moved since by {self.px:.1f} px, {self.mm:.1f} mm "
            "(which of them, the picture cannot tell): calibrate again"
        )


def shift_since(calibration: Calibration, view: BoardView) -> Shift:
    """Compare where the board is seen now with where the calibration has it.

    Args:
        calibration: of this camera.
        view: what it sees now.

    Raises:
        BadCalibration: it is of another board, or of pictures of another size.
    """
    if view.size != calibration.camera.size or view.board != calibration.board:
        was, now = calibration, view
        raise BadCalibration(
            f"board {now.board.paper} in a picture of {now.size[0]}x{now.size[1]}; calibrated with "
            f"board {was.board.paper} at {was.camera.size[0]}x{was.camera.size[1]}: calibrate again"
        )
    points = calibration.scale * view.points
    px = np.linalg.norm(view.pixels - calibration.camera.project(points), axis=1)
    mm = 10 * np.linalg.norm(calibration.camera.to_table(view.pixels) - points[:, :2], axis=1)
    median = float(np.median(px))
    limit = max(MOVED_PX, MOVED_RMS * calibration.rms)
    return Shift(median, float(np.median(mm)), not median < limit)
