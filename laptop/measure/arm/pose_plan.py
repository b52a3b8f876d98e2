"""Poses that are most informative about an arm's numbers, and the job that goes there.

Each candidate is a pose and the side from which each joint comes to it, upwards or downwards: on
that the flank depends on which its link rests.  They are taken one by one, each the one by which
the variances of what is asked, in units of what is good enough, fall most (A-optimal design,
greedily).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from laptop.measure.arm.arm_fit import DERIVATIVE_STEP, ArmFit
from laptop.measure.arm.arm_model import ArmModel, JointStates, encoder_sigma, slopes
from laptop.measure.run_data import RunData
from robot.motion import kinematics
from robot.motion.gravity import Gravity
from shared import job
from shared.arm_description import Arm, ArmError

NAME = "calibrate"
ACCELERATION = math.radians(75)
"""Acceleration of each joint, rad/s^2: so low that a link stays on the flank by which it is
pushed."""
APPROACH_ANGLE = math.radians(4)
"""Angle over which each joint approaches a pose in one direction, rad, beside its backlash."""
APPROACH_SPEED = math.radians(40)
"""Greatest speed of a joint in that approach, rad/s."""
LOG_PERIOD = 0.03
"""Period of the brick's log of its motors, s: they may go back at the end of a motion."""
REST_TIME = 1.0
"""Rest of the arm at each pose, s."""
LIMIT_MARGIN = math.radians(3)
CLEARANCE = 2.0
"""Least height of an arm's tip and elbow over the table in space, cm."""
ANGLE_COUNTS = {2: 9, 3: 6}
"""Number of candidate angles of each joint, by the number of joints."""
EDGE_MARGIN = 12.0
"""Least distance of a marker from the picture's edge, px."""


@dataclass(frozen=True)
class ApproachedPose:
    """Pose of the joints, rad, and direction of approach of each: +1 upwards, -1 downwards."""

    q: tuple[float, ...]
    sides: tuple[int, ...]


class NoPose(ArmError, ValueError):
    """The arm's limits leave no room to be calibrated in."""


def candidates(arm: Arm) -> list[ApproachedPose]:
    """Return a grid of all that the joints can reach, approached from all sides.

    Raises:
        NoPose: there is nothing.
    """
    ranges = []
    for joint in arm.joints:
        room = approach_turn(joint.backlash) + LIMIT_MARGIN
        if joint.upper - joint.lower < 3 * room:
            raise NoPose(
                f"the {joint.name} has {math.degrees(joint.upper - joint.lower):.0f} degrees "
                f"between its limits, and {math.degrees(3 * room):.0f} are the least for poses "
                "that tell something; widen lower and upper in the arm's file if it can go there"
            )
        ranges.append(
            np.linspace(joint.lower + room, joint.upper - room, ANGLE_COUNTS[len(arm.joints)])
        )
    found = []
    for q in itertools.product(*ranges):
        for sides in itertools.product((1, -1), repeat=len(q)):
            pose = ApproachedPose(tuple(map(float, q)), sides)
            if _is_clear(arm, pose.q) and _is_clear(arm, start_of(arm, pose)):
                found.append(pose)
    if not found:
        raise NoPose("within its limits the arm is always low over the table; widen them")
    return found


def approach_turn(backlash: float) -> float:
    """Return by how much a joint turns in one direction before it stands, rad."""
    return APPROACH_ANGLE + backlash


def start_of(arm: Arm, pose: ApproachedPose) -> tuple[float, ...]:
    """Return where the approach to a pose begins, rad."""
    return tuple(
        angle - side * approach_turn(joint.backlash)
        for joint, angle, side in zip(arm.joints, pose.q, pose.sides, strict=True)
    )


def _is_clear(arm: Arm, q: Sequence[float]) -> bool:
    points = kinematics.joint_positions(arm, q)
    return len(points[-1]) == 2 or min(point[2] for point in points[1:]) > CLEARANCE


def scouts(arm: Arm, count: int) -> list[ApproachedPose]:
    """Return poses that lie far apart, for when nothing is known of camera and board.

    Each next one is the farthest from all before; the sides of their approach take turns.
    """
    all_poses = candidates(arm)
    sides = list(itertools.product((1, -1), repeat=len(arm.joints)))
    middle = np.array([(joint.lower + joint.upper) / 2 for joint in arm.joints])
    poses = np.array(sorted({pose.q for pose in all_poses}))
    allowed = {(pose.q, pose.sides) for pose in all_poses}
    chosen = [int(np.argmin(np.abs(poses - middle).max(axis=1)))]
    while len(chosen) < min(count, len(poses)):
        far = np.abs(poses[:, None] - poses[chosen]).max(axis=2).min(axis=1)
        chosen.append(int(np.argmax(far)))
    found = []
    for k, index in enumerate(chosen):
        q = tuple(map(float, poses[index]))
        orders = [sides[(k + n) % len(sides)] for n in range(len(sides))]
        found.append(ApproachedPose(q, next(order for order in orders if (q, order) in allowed)))
    return found


def choose(
    model: ArmModel,
    state: np.ndarray,
    information: np.ndarray,
    wanted: dict[str, float],
    count: int,
    pixel_sigma: float,
) -> list[ApproachedPose]:
    """Return the next most informative poses, of those that a camera sees.

    Args:
        model: with its cameras.
        state: all numbers, as they are known.
        information: of all numbers so far, (m, m), the priors' included.
        wanted: by the number's name, the standard uncertainty that is good enough.
        count: of poses.
        pixel_sigma: of a marker at rest, px.
    """
    all_poses = candidates(model.arm)
    rows = sensitivities(model, state, joint_states_at(model.arm, all_poses), pixel_sigma)
    weights = np.zeros(len(model.names))
    for name, sigma in wanted.items():
        weights[model.index(name)] = 1 / sigma**2
    covariance = np.linalg.inv(information)
    chosen: list[int] = []
    for _ in range(count):
        spread = rows @ covariance  # (n, r, m)
        inner = np.linalg.inv(np.eye(rows.shape[1]) + spread @ rows.transpose(0, 2, 1))
        gain = np.einsum("nim,nij,njm,m->n", spread, inner, spread, weights)
        gain[chosen] = -1.0
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        chosen.append(best)
        covariance = covariance - spread[best].T @ inner[best] @ spread[best]
    return [all_poses[k] for k in chosen]


def sensitivities(
    model: ArmModel, state: np.ndarray, joint_states: JointStates, pixel_sigma: float
) -> np.ndarray:
    """Whitened derivatives (n, 2 cameras, m) of what is seen; 0 where nothing is.

    Args:
        model: with its cameras.
        state: all numbers.
        joint_states: how the joints stand.
        pixel_sigma: px.
    """
    parts = []
    free = model.spread > 0
    steps = np.where(free, DERIVATIVE_STEP * np.minimum(model.spread, 1.0), 1.0)
    sigma_e = encoder_sigma(model.arm)
    for name, camera in model.cameras.items():
        pixels = model.pixels(state, name, joint_states)
        size = np.array(camera.size)
        seen = ((pixels > EDGE_MARGIN) & (pixels < size - EDGE_MARGIN)).all(axis=1)
        derivative = slopes(partial(_pixels, model, name, joint_states), state, steps)
        derivative[..., ~free] = 0.0
        through = model.by_encoders(state, name, joint_states) * sigma_e
        noise = through @ through.transpose(0, 2, 1) + pixel_sigma**2 * np.eye(2)
        white = np.linalg.inv(np.linalg.cholesky(noise)) @ derivative
        white[~seen] = 0.0
        parts.append(white)
    return np.concatenate(parts, axis=1)


def _pixels(model: ArmModel, name: str, joint_states: JointStates, state: np.ndarray) -> np.ndarray:
    return model.pixels(state, name, joint_states)


def ordered(
    arm: Arm, poses: Sequence[ApproachedPose], begin: Sequence[float]
) -> list[ApproachedPose]:
    """Return poses in an order in which little time goes by between them, from a pose on."""
    left, at, found = list(poses), tuple(begin), []
    while left:
        nearest = min(
            left, key=lambda p: max(abs(a - b) for a, b in zip(start_of(arm, p), at, strict=True))
        )
        left.remove(nearest)
        found.append(nearest)
        at = nearest.q
    return found


def pose_job(arm: Arm, poses: Sequence[ApproachedPose], file: Path) -> job.JobHeader:
    """Write the job that goes to poses, the pen up, and rests at each.

    Raises:
        BadJob, OSError: it cannot be written.
    """
    strokes, t = [], 0.0
    for pose in poses:
        begin = start_of(arm, pose)
        piece = joint_path(begin, pose.q)
        strokes.append(job.Stroke("", round(piece[1][-1][0] + 1.0, 3), round(t, 2), [piece]))
        t += piece[0][-1] + REST_TIME + 2.0
    header: job.JobHeader = job.header_of(arm, NAME, arm.speed, strokes, 0.0, t)
    header = header._replace(log=LOG_PERIOD, rest=REST_TIME)
    job.write_job(str(file), header, strokes)
    return header


def joint_path(
    begin: Sequence[float], end: Sequence[float]
) -> tuple[list[float], list[Any], list[float]]:
    """Return a piece of a stroke, joints in step: trapezoidal speed, low acceleration.

    Its length is an angle, that of the joint which turns most, so its speed is rad/s.
    """
    turns = [b - a for a, b in zip(begin, end, strict=True)]
    largest = max(abs(turn) for turn in turns)
    rise = min(APPROACH_SPEED**2 / (2 * ACCELERATION), largest / 2)
    top = math.sqrt(2 * ACCELERATION * rise)
    marks = (
        [0.0, rise, largest - rise, largest] if largest > 2 * rise + 1e-9 else [0.0, rise, largest]
    )
    speeds = [0.0, top, top, 0.0] if len(marks) == 4 else [0.0, top, 0.0]
    times, segments = [0.0], []
    for a, b, v, w in zip(marks, marks[1:], speeds, speeds[1:], strict=False):
        dt = 2 * (b - a) / (v + w)
        times.append(round(times[-1] + dt, 6))
        cubics = [
            [round(first + turn * a / largest, 8), round(turn / largest, 8), 0.0, 0.0]
            for first, turn in zip(begin, turns, strict=True)
        ]
        segments.append((round(v, 6), round((w - v) / dt, 6), cubics, None))
    return times, segments, [round(q, 8) for q in end]


def information_of(fit: ArmFit) -> np.ndarray:
    """Return the information matrix of all numbers, (m, m), after a fit."""
    free = np.diag(fit.covariance) > 0
    found = np.diag(np.where(free, 0.0, 1e18))
    found[np.ix_(free, free)] = np.linalg.inv(fit.covariance[np.ix_(free, free)])
    return found


def joint_states_at(
    arm: Arm, poses: Sequence[ApproachedPose], run: RunData | None = None
) -> JointStates:
    """Return how the joints stand at poses: as they are wanted, or as a run has measured.

    A link rests on the flank by which it was pushed; where gravity pulls, on that on which it lies.
    """
    gravity = Gravity(arm)
    pressed = np.array([gravity.preload_sides(pose.q) for pose in poses], float)
    pushed = np.array([pose.sides for pose in poses], float)
    sides = np.where(pressed != 0, pressed, pushed)
    e = np.array([pose.q for pose in poses])
    back = np.zeros(e.shape)
    if run:
        moved: list[tuple[float, ...]] = []
        at = 0
        for row in run.rows:
            if not row.rest:
                moved.append(row.q)
                continue
            e[at] = row.q
            if moved:
                # In motion the brick's observer tells more than the count at rest does.
                back[at] = (pushed[at] * (np.array(moved) - row.q)).max(axis=0)
            moved, at = [], at + 1
        back[pressed != 0] = 0.0
    return JointStates(e, sides, back)
