"""The test on an emulated arm before emulated cameras, and the truth about it.

Cameras are calibrated by photographs of the printed board, with all errors that this leaves; they
see the arm through the lens that they truly have.  The truth is the emulator's own record.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from laptop.emulator.scene.board_photographs import CameraPose, Lens, draw_lens, photograph
from laptop.measure.accuracy import accuracy_test
from laptop.measure.accuracy.accuracy_test import AccuracyResult
from laptop.measure.accuracy.plan import AccuracyPlan, PlannedMotion
from laptop.measure.accuracy.sighting import ArmSighting, BadSighting, BoardArmPose, Places
from laptop.measure.accuracy.truth import in_nearest_frame, true_places
from laptop.measure.emulated_rig import EmulatedRig
from laptop.measure.run_data import RunData
from laptop.see.markers.finders.board import find_board
from laptop.see.table.camera_fit import calibrate
from robot.motion import kinematics
from shared.arm_description import Arm

PIXEL_NOISE = 0.03
"""Noise of a marker in one picture, px, as the tracker has it in rendered pictures."""
FPS = 30.0
"""Frame rate, pictures per second, as webcams give them."""
CAMERA_DISTANCE = {2: 48.0, 3: 62.0}
"""Distance of the cameras from the test's cube, cm, by the number of the arm's coordinates."""
CAMERA_DIRECTIONS = {2: ((20.0, 180.0),), 3: ((30.0, 200.0), (50.0, 80.0))}
"""Tilt from the vertical and azimuth of each camera, degrees, by the same number."""
MARKER_HEIGHT = {2: 2.5, 3: 0.0}
"""Height of the marker over the tip, cm, by the same number."""
FOCAL_LENGTH = 600.0
"""Focal length of a camera at just that distance, px; longer ones stand farther off."""
BOARD_TILTS = tuple((tilt, turn) for tilt in (35.0, 20.0) for turn in (60.0, 180.0, 300.0)) + (
    (0.0, 0.0),
)
"""Tilt and turn of the board for each photograph, degrees; in the last one it lies."""
MAX_BOARD_TILT = 55.0
"""Greatest tilt at which a board is photographed, degrees; else it is held towards the camera."""
MIN_MARKER_SHARE = 0.5
"""Least share of the board's markers in a photograph that is used."""
BAR_LENGTH = 100.0
"""Measured length of the board's bar, mm."""


class LensCamera:
    """A camera as it truly is; points are in the arm's frame.

    Args:
        lens, camera_pose: over the board.
        arm_pose: how the arm stands there.
    """

    def __init__(self, lens: Lens, camera_pose: CameraPose, arm_pose: BoardArmPose) -> None:
        self._lens, self._camera_pose, self._arm_pose = lens, camera_pose, arm_pose

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3), cm."""
        c, s = math.cos(self._arm_pose.turn), math.sin(self._arm_pose.turn)
        on_board = points.copy()
        on_board[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]]) + self._arm_pose.base
        return self._camera_pose.pixels(self._lens, on_board)


def calibrated_cameras(
    arm: Arm, middle: np.ndarray, seed: int
) -> tuple[dict[str, LensCamera], ArmSighting, BoardArmPose]:
    """Draw cameras that see the test's cube, and calibrate them by the board that lies there.

    Returns:
        The cameras as they are, what is known of them, and how the arm stands on the board.
    """
    rng = np.random.default_rng([seed, 51])
    turn = math.pi / 2 * rng.integers(4) + math.radians(rng.uniform(-2, 2))
    c, s = math.cos(turn), math.sin(turn)
    # The board's origin lies below the cube's middle.
    base = -np.array([[c, -s], [s, c]]) @ middle[:2]
    arm_pose = BoardArmPose(turn, (float(base[0]), float(base[1])))
    d = kinematics.coordinates(arm)
    cameras, models = {}, {}
    for number, (tilt, azimuth) in enumerate(CAMERA_DIRECTIONS[d]):
        lens = draw_lens(seed + number)
        azimuth += rng.uniform(-8, 8)
        camera_poses = [
            CameraPose.looking(
                CAMERA_DISTANCE[d] * lens.focal / FOCAL_LENGTH,
                math.radians(tilt + (more if tilt + more <= MAX_BOARD_TILT else -more)),
                turn + math.radians(azimuth + aside),
                0.0,
                (0.0, 0.0),
            )
            for more, aside in BOARD_TILTS
        ]
        views = []
        for k, camera_pose in enumerate(camera_poses):
            view = find_board(photograph(lens, camera_pose, seed=[seed, 52, number, k]))
            if view and len(view.numbers) >= MIN_MARKER_SHARE * len(view.board.numbers):
                views.append(view)
            elif k == len(camera_poses) - 1:
                raise BadSighting(f"seed {seed}: the camera does not see the board; take another")
        cameras["AB"[number]] = LensCamera(lens, camera_poses[-1], arm_pose)
        models["AB"[number]] = calibrate(views, BAR_LENGTH).camera
    return cameras, ArmSighting(arm, models, MARKER_HEIGHT[d]), arm_pose


def measure_emulated(
    plan: AccuracyPlan,
    built: Arm | None = None,
    plant: str = "",
    noise: float = PIXEL_NOISE,
    seed: int = 1000,
    fit: bool = False,
    on_part: Callable[[str, int, int], None] = lambda part, number, count: None,
) -> tuple[AccuracyResult, dict[str, float]]:
    """Do the test by an emulated arm before emulated cameras.

    Args:
        plan: of the test.
        built: the arm as it is; None: as described.
        plant: text of the plant's constants.
        noise: of the marker in one picture, px.
        seed: of all chance.
        fit: how the arm stands on the board is not known.
        on_part: as for `accuracy_test.measure`.

    Returns:
        What the cameras tell, and the true criteria by name, mm; of a pose that was fitted the
        true ones are, too, in the frame that is nearest to the poses.
    """
    arm = plan.arm
    cameras, sighting, true_pose = calibrated_cameras(arm, plan.centre, seed)
    rig = EmulatedRig(arm, built, plant, cameras, sighting.height, noise, FPS, seed)
    truth: list[tuple[PlannedMotion, Places]] = []

    def add_truth(motions: list[PlannedMotion], run: RunData) -> None:
        truth.extend(true_places(rig.last.record, motions, run))

    arm_pose = None if fit else true_pose
    result = accuracy_test.measure(rig, plan, sighting, arm_pose, on_part, add_truth)
    if fit:
        truth = in_nearest_frame(truth)
    return result, accuracy_test.plain(plan, accuracy_test.collect(plan, truth))
