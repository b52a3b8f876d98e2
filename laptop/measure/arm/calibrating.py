"""The arm goes through poses, few first, then the most informative, until its numbers are known."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from laptop.measure.arm.arm_fit import ArmFit, BadIdentification, RestSights, TouchSight, fit_arm
from laptop.measure.arm.arm_model import ArmModel
from laptop.measure.arm.arm_result import check_signs, check_square
from laptop.measure.arm.fault_hypotheses import explain
from laptop.measure.arm.pose_plan import (
    ApproachedPose,
    approach_turn,
    choose,
    information_of,
    joint_states_at,
    ordered,
    pose_job,
    scouts,
)
from laptop.measure.run_data import MEDIAN_NOISE, MeasuringRig, RunData
from laptop.see.markers.finders.board import BoardView, find_board
from laptop.see.table.camera_fit import Calibration
from laptop.see.table.camera_report import shift_since

SCOUT_POSES, BATCH_POSES = 12, 10
"""Number of poses before anything is known, and from one fit to the next."""
MAX_DURATION = 180.0
"""Longest duration on the brick, s: no new poses begin that would exceed it."""
LINK_TARGET = 0.001
"""Standard uncertainties that are good enough: of a link, a share, ..."""
ANGLE_TARGET = math.radians(0.1)
"""... of a zero and a backlash, rad."""
MIN_PICTURES = 3
"""Fewest pictures in which a marker must be seen at a rest."""
MIN_BOARD_SHARE = 0.6
"""Least share of the board's markers that must be seen."""
MIN_CONTRAST = 40.0
"""Least contrast between dark and bright of a picture, of 255."""
MAX_EDGE_SPREAD = 5.0
"""Greatest standard deviation of a picture's sharpest edges, px."""
APPROACH_TIME = 4.0
"""Time for which the arm moves before the first rest, about, s."""
MIN_SCOUT_SHARE = 0.5
"""Least share of the scouts in which the marker must be seen."""


@dataclass(frozen=True, eq=False)
class Identified:
    """Result of an identification.

    fit      of all rests
    rests    all of them
    poses    where they were wanted
    times    of the rests, s since the first job began
    seconds  on the brick
    """

    fit: ArmFit
    rests: RestSights
    poses: list[ApproachedPose]
    times: np.ndarray
    seconds: float


class CalibrationSetup(NamedTuple):
    """Setup of a calibration.

    rig      the arm before its cameras
    camera   calibrated by the board
    touches  of a hand, before the arm moves
    check    raises ArmError if camera or board has moved since
    """

    rig: MeasuringRig
    camera: Calibration
    touches: Sequence[TouchSight]
    check: Callable[[], None]


def identify(
    rig: MeasuringRig,
    model: ArmModel,
    touches: Sequence[TouchSight] = (),
    report: Callable[[str], None] = lambda line: None,
    longest: float = MAX_DURATION,
) -> Identified:
    """Let an arm go through poses before its cameras, and fit its numbers.

    Raises:
        BadIdentification: what was seen does not fit; what is to blame is named.
        ArmError: the arm or a camera fails.
    """
    arm = model.arm
    rests: RestSights | None = None
    poses: list[ApproachedPose] = []
    times: list[float] = []
    seconds, at = 0.0, tuple(joint.home for joint in arm.joints)
    following = ordered(arm, scouts(arm, SCOUT_POSES), at)
    fit = None
    while following:
        run, standard = _visit(rig, model, following)
        rests, poses = (rests + standard if rests else standard), poses + following
        rest_times = [row.t for row in run.rows if row.rest]
        first = run.rows[0].t if run.rows else 0.0
        start = min(first, rest_times[0]) - APPROACH_TIME
        times += [seconds + t - start for t in rest_times]
        seconds += rest_times[-1] - start
        at = following[-1].q
        if fit is None:
            _check_seen(rests)
        fit = fit_arm(model, rests, touches)
        check_signs(fit)
        check_square(fit)
        why = explain(fit, len(poses), times)
        if why:
            raise BadIdentification(why)
        is_precise, wanted = _precision(fit)
        report(
            f"{len(poses)} poses, {seconds:.0f} s: left over {fit.rms:.2f} px; links known to "
            f"{_worst(fit, 'link', 10):.2f} mm, backlash to "
            f"{_worst(fit, 'backlash', 180 / math.pi):.2f} deg"
        )
        per_pose = seconds / len(poses)
        count = min(BATCH_POSES, int((longest - seconds) / per_pose))
        if is_precise or count < 2:
            break
        pixel = float(np.nanmedian([np.nanmedian(s) for s in rests.sigma.values()]))
        information = information_of(fit)
        following = ordered(
            arm, choose(fit.model, fit.state, information, wanted, count, pixel), at
        )
    assert fit
    assert rests
    return Identified(fit, rests, poses, np.array(times), seconds)


def go_home(rig: MeasuringRig) -> None:
    """Bring the arm to its home pose, as its file has it, so that its zero can be taken over.

    Raises:
        ArmError: the arm or a camera fails.
    """
    arm = rig.arm
    sides = tuple(
        1 if joint.home - approach_turn(joint.backlash) > joint.lower else -1
        for joint in arm.joints
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "home.job"
        pose_job(arm, [ApproachedPose(tuple(joint.home for joint in arm.joints), sides)], file)
        rig.measure(file)


class MarkerUnseen(BadIdentification):
    """The arm's marker was seen too seldom; why, a look at the picture may tell."""


def seen_board(image: np.ndarray) -> BoardView:
    """Return the board in a picture, BGR; refuse one by which no arm can be measured.

    Raises:
        BadIdentification: too little of it is seen.
    """
    view = find_board(image)
    if view is None:
        check_sharp(image)
    return check_board(view)


def check_unmoved(found: Calibration, image: np.ndarray) -> None:
    """Refuse a blurred picture, or one that shows that camera or board has moved since.

    Where the arm hides the board, nobody knows.

    Args:
        found: the camera, calibrated by the board.
        image: BGR, (height, width, 3).

    Raises:
        BadIdentification: so it is.
    """
    check_sharp(image)
    view = find_board(image)
    if view is not None and (shift := shift_since(found, view)).moved:
        raise BadIdentification(f"{shift}; nothing was written")


def check_sharp(image: np.ndarray) -> None:
    """Refuse a picture, BGR, in which nothing can be seen.

    Raises:
        BadIdentification: it is even, or blurred.
    """
    grey = cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (0, 0), 1.0).astype(float)
    dark, bright = np.percentile(grey, [1, 99])
    if bright - dark < MIN_CONTRAST:
        raise BadIdentification(
            f"the picture is nearly even ({dark:.0f} to {bright:.0f} of 255): give it light, and "
            "take the cap off the camera; nothing was written"
        )
    across, down = np.gradient(grey, axis=1), np.gradient(grey, axis=0)
    paths = (across, down, (across + down) / math.sqrt(2), (across - down) / math.sqrt(2))
    steepest = min(float(np.percentile(np.abs(path), 99.9)) for path in paths)
    # An edge that is spread like a normal distribution: its height over its greatest slope.
    spread = (bright - dark) / max(steepest, 1e-3) / math.sqrt(2 * math.pi)
    if spread > MAX_EDGE_SPREAD:
        raise BadIdentification(
            f"the picture is blurred: no edge in it is sharper than {2.5 * spread:.0f} px; focus, "
            "fasten the camera, and give it more light; nothing was written"
        )


def check_board(view: BoardView | None) -> BoardView:
    """Return the view; refuse a board of which too little is seen for an arm to be measured by it.

    Raises:
        BadIdentification: so it is.
    """
    if view is None:
        raise BadIdentification(
            "no marker of the printed board is seen: lay it flat within the arm's reach, sharp "
            "and lit, and let the camera see it (brickservo markers --board makes one); nothing "
            "was written"
        )
    seen, every = len(view.numbers), len(view.board.numbers)
    if seen < MIN_BOARD_SHARE * every:
        raise BadIdentification(
            f"{seen} of the board's {every} markers are seen, and "
            f"{math.ceil(MIN_BOARD_SHARE * every)} are the least to measure an arm by: "
            "uncover it, and turn the arm aside; nothing was written"
        )
    return view


def _visit(
    rig: MeasuringRig, model: ArmModel, poses: Sequence[ApproachedPose]
) -> tuple[RunData, RestSights]:
    """Let the arm go to poses; what was seen there."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "poses.job"
        pose_job(model.arm, poses, file)
        run = rig.measure(file)
    pixels, sigma = {}, {}
    for name in model.cameras:
        seen = run.rests(name)
        if len(seen.q) != len(poses):
            raise BadIdentification(
                f"the brick has logged {len(seen.q)} rests, and there were {len(poses)} poses; "
                "do it again"
            )
        few = seen.seen < MIN_PICTURES
        if 2 * np.count_nonzero(few & (seen.seen > 0)) > len(few):
            raise BadIdentification(
                f"camera {name} saw the marker, but in fewer than {MIN_PICTURES} pictures a rest "
                f"at {np.count_nonzero(few)} of {len(few)} poses: it takes some 6 pictures a "
                "second; give it more light, or fewer pixels (--frame-size of track); nothing was "
                "written"
            )
        places = seen.pixel.copy()
        places[few] = np.nan
        noise = float(np.nanmedian(seen.sigma)) if np.isfinite(seen.sigma).any() else np.nan
        pixels[name] = places
        sigma[name] = MEDIAN_NOISE * noise / np.sqrt(np.maximum(seen.seen, 1))
        sigma[name] = np.where(np.isfinite(sigma[name]), sigma[name], 1.0)
    return run, RestSights(joint_states_at(model.arm, poses, run), pixels, sigma)


def _check_seen(rests: RestSights) -> None:
    for name, pixels in rests.pixels.items():
        seen = int(np.isfinite(pixels).all(axis=1).sum())
        if seen < MIN_SCOUT_SHARE * len(pixels):
            raise MarkerUnseen(
                f"camera {name} saw the marker in {seen} of {len(pixels)} poses that lie all over "
                "what the arm can reach: it is out of the picture, hidden or blurred; let the "
                "camera see all of the table, or make the joints' limits narrower in the arm's "
                "file; nothing was written"
            )


def _precision(fit: ArmFit) -> tuple[bool, dict[str, float]]:
    """Return whether all that poses can determine is precise enough, and the wanted precision."""
    wanted = {}
    for k, joint in enumerate(fit.model.arm.joints):
        if not (fit.model.spatial and k == 0):
            wanted[f"{joint.name}.link"] = LINK_TARGET * joint.link
        wanted[f"{joint.name}.backlash"] = ANGLE_TARGET
        if k:
            wanted[f"{joint.name}.zero"] = ANGLE_TARGET
    return all(fit.sigma(name) <= limit for name, limit in wanted.items()), wanted


def _worst(fit: ArmFit, key: str, unit: float) -> float:
    return unit * max(
        fit.sigma(f"{joint.name}.{key}")
        for k, joint in enumerate(fit.model.arm.joints)
        if not (key == "link" and fit.model.spatial and k == 0)
    )
