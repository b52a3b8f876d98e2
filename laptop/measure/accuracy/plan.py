"""The test's cube, its poses and paths, and the jobs by which an arm goes there.

After ISO 9283:1998: a cube with edges along the arm's axes; in it a plane with five poses, P1
in its middle, P2 to P5 on its diagonals, a tenth of their length from the ends.  An arm in the
plane has a square for its cube.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from laptop.drawing import reach
from laptop.measure.accuracy.crossings import CirclePath, CommandedPath, StraightPath
from robot.motion import kinematics, trajectory
from shared import job
from shared.arm_description import Arm, ArmError

CUBE_SIDES = (2.0, 60.0)
"""Least and greatest side of the cube, cm."""
CYCLES = (3, 100)
CENTRE_STEP, SIDE_PROBES = 1.0, 9
"""Step of the search for the cube's centre, cm, and points tried along each of its sides."""
HALVINGS = 8
SIDE_STEP = 0.5
"""Step to which a side that is found is rounded down, cm."""
POSE_INSET = 0.1
"""Share of a diagonal between its end and a pose."""
CIRCLE_RADIUS = 0.4
"""Radius of the circle, in sides: its diameter is 80 % of one."""
SPEED_SHARES = (1.0, 0.5, 0.1)
"""Shares of the arm's drawing speed at which paths are tested."""
POSE_ORDER = (5, 4, 3, 2, 1)
"""Order of the poses in a cycle."""
MULTIDIRECTIONAL_POSES = (1, 2, 4)
"""Poses that are approached from several directions."""
DISTANCE_POSES = (2, 4)
"""Poses whose distance is measured."""
POSE_REST, PATH_REST = 1.0, 0.3
"""Rest of the arm at a pose, and after a path, s."""
LOG_PERIOD = 0.1
"""Period of the brick's log along a path, s."""
SETTLING_TIME = 2.0
"""Time that a stroke takes beside its motion and its rest, about, s."""
POSE_CYCLES_PER_PATH_CYCLE = 3
"""Ratio of pose cycles to path cycles: the standard has 30 and 10."""


class BadAccuracyPlan(ArmError, ValueError):
    """A test that this arm cannot do."""


@dataclass(frozen=True)
class PlannedMotion:
    """One motion of the test.

    what    "pose", "direction" or "path"
    number  of the pose (1 to 5) or of the direction or path (from 0 on)
    pose    number of the pose to which a direction leads, else 0
    share   of the arm's drawing speed
    points  of its path, (n, d), cm
    """

    what: str
    number: int
    pose: int
    share: float
    points: np.ndarray


@dataclass(frozen=True, eq=False)
class AccuracyPlan:
    """All that is to be done.

    arm     as described
    elbow   posture in which all of it is done
    side    of the cube, cm
    centre  of the cube, (d,), cm
    cycles  of poses
    """

    arm: Arm
    elbow: str
    side: float
    centre: np.ndarray
    cycles: int = 30

    @property
    def path_cycles(self) -> int:
        """Number of cycles of each path."""
        return max(CYCLES[0], round(self.cycles / POSE_CYCLES_PER_PATH_CYCLE))

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors along the sides of the poses' plane, (2, d), which need not be square."""
        if len(self.centre) == 2:
            return np.eye(2)
        return np.array([[1, 0, 1] / np.sqrt(2), [0, 1, 0]])

    @property
    def sides(self) -> np.ndarray:
        """Sides of the poses' plane along its axes, (2,), cm; in space one is a diagonal."""
        long = math.sqrt(2) if len(self.centre) == 3 else 1.0
        return self.side * np.array([long, 1.0])

    @property
    def poses(self) -> np.ndarray:
        """P1 to P5, (5, d), cm."""
        half = (0.5 - POSE_INSET) * self.sides
        corners = np.array([(0, 0), (-1, -1), (1, -1), (1, 1), (-1, 1)]) * half
        return np.asarray(self.centre + corners @ self.axes)

    def pose(self, number: int) -> np.ndarray:
        """Return the commanded position of a pose, from 1 on, (d,), cm."""
        return np.asarray(self.poses[number - 1])

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors of the approaches, (d + 1, d).

        They sum up to nothing, so that each joint comes to the pose from both sides.
        """
        if len(self.centre) == 2:
            angles = 2 * math.pi * np.arange(3) / 3
            return np.column_stack([np.cos(angles), np.sin(angles)])
        return np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / math.sqrt(3)

    @property
    def paths(self) -> dict[str, CommandedPath]:
        """The paths by name."""
        return {
            "line": StraightPath(self.pose(2), self.pose(4)),
            "circle": CirclePath(self.centre, CIRCLE_RADIUS * self.side, *self.axes),
        }

    def parts(self) -> dict[str, list[PlannedMotion]]:
        """Return the strokes of each part of the test; each part is one job."""
        parts = {"poses": list(self._pose_strokes()), "directions": list(self._directed())}
        for share in SPEED_SHARES:
            parts[f"paths at {100 * share:.0f} %"] = [
                PlannedMotion("path", number, 0, share, path.points())
                for number, path in enumerate(self.paths.values())
                for _ in range(self.path_cycles)
            ]
        return parts

    def _pose_strokes(self) -> Iterator[PlannedMotion]:
        at = POSE_ORDER[-1]
        for _ in range(self.cycles):
            for number in POSE_ORDER:
                points = np.array([self.pose(at), self.pose(number)])
                yield PlannedMotion("pose", number, 0, 1.0, points)
                at = number

    def _directed(self) -> Iterator[PlannedMotion]:
        begin = POSE_INSET * self.side
        for _, pose in itertools.product(range(self.cycles), MULTIDIRECTIONAL_POSES):
            for number, direction in enumerate(self.directions):
                end = self.pose(pose)
                points = np.array([end - begin * direction, end])
                yield PlannedMotion("direction", number, pose, 1.0, points)

    def seconds(self) -> float:
        """Return how long the arm is at it, about, s.

        Raises:
            kinematics.Unreachable: a motion of it cannot be had.
        """
        return sum(self._planned(motions)[1] for motions in self.parts().values())

    def write_job(self, file: Path, name: str, motions: Sequence[PlannedMotion]) -> job.JobHeader:
        """Write the job of a part.

        Raises:
            kinematics.Unreachable: a motion of it cannot be had.
            job.BadJob, OSError: it cannot be written.
        """
        strokes, seconds = self._planned(motions)
        header: job.JobHeader = job.header_of(
            self.arm, f"accuracy: {name}", self.arm.speed, strokes, 0.0, round(seconds, 1)
        )._replace(log=LOG_PERIOD, rest=rest_of(motions))
        job.write_job(str(file), header, strokes)
        return header

    def _planned(self, motions: Sequence[PlannedMotion]) -> tuple[list[job.Stroke], float]:
        """Return the strokes of a job and how long it takes, about, s."""
        strokes, t = [], 0.0
        planned: dict[tuple[bytes, float], tuple[list[trajectory.PieceNumbers], float, float]] = {}
        for motion in motions:
            key = (motion.points.tobytes(), motion.share)
            if key not in planned:  # each is done many times
                points = [tuple(p) for p in motion.points.tolist()]
                trajectories = trajectory.plan(
                    self.arm, [points], motion.share * self.arm.speed, self.elbow
                )
                cm = float(np.linalg.norm(np.diff(motion.points, axis=0), axis=1).sum())
                took = sum(piece.duration for piece in trajectories)
                planned[key] = (
                    [piece.numbers() for piece in trajectories],
                    round(cm, 3),
                    took,
                )
            pieces, cm, took = planned[key]
            strokes.append(job.Stroke("", cm, round(t, 2), pieces))
            t += took + rest_of(motions) + SETTLING_TIME
        return strokes, t


def rest_of(motions: Sequence[PlannedMotion]) -> float:
    """Return how long the arm stands after each motion of a part, s."""
    return PATH_REST if motions[0].what == "path" else POSE_REST


def plan_accuracy(
    arm: Arm,
    cycles: int = 30,
    side: float | None = None,
    centre: tuple[float, ...] | None = None,
) -> AccuracyPlan:
    """Find room for the test's cube, and plan the test.

    Args:
        arm: as described.
        cycles: of poses.
        side: of the cube, cm; None: as large as the arm reaches easily.
        centre: of the cube, cm; None: where it has most room.

    Raises:
        BadAccuracyPlan: there is no room for it.
    """
    if not CYCLES[0] <= cycles <= CYCLES[1]:
        raise BadAccuracyPlan(f"{cycles} cycles: give {CYCLES[0]} to {CYCLES[1]}")
    if side is not None and not CUBE_SIDES[0] <= side <= CUBE_SIDES[1]:
        raise BadAccuracyPlan(
            f"a cube of {side:g} cm: give {CUBE_SIDES[0]:g} to {CUBE_SIDES[1]:g} cm"
        )
    d = kinematics.coordinates(arm)
    if centre is not None and (len(centre) != d or not np.isfinite(centre).all()):
        raise BadAccuracyPlan(
            f"centre {','.join(f'{c:g}' for c in centre)}: give {d} numbers, "
            f"{'x,y' if d == 2 else 'x,y,z'} in cm, for the arm {arm.name}"
        )
    largest, elbow, middle = _room(arm, d, centre)
    what = "square" if d == 2 else "cube"
    where = "anywhere" if centre is None else f"at {','.join(f'{c:g}' for c in centre)} cm"
    advice = "give another --at" if centre is not None else "give a smaller --size"
    if largest < (side or CUBE_SIDES[0]):
        wanted = f" of {side:g} cm" if side else ""
        raise BadAccuracyPlan(
            f"the arm {arm.name} has no room for a test {what}{wanted} {where}: its largest there "
            f"is {largest:.1f} cm; {advice}"
        )
    return AccuracyPlan(
        arm,
        elbow,
        side or max(CUBE_SIDES[0], SIDE_STEP * math.floor(largest / SIDE_STEP)),
        middle,
        cycles,
    )


def _room(arm: Arm, d: int, centre: tuple[float, ...] | None) -> tuple[float, str, np.ndarray]:
    """Return (side, posture, centre) of the largest cube, ahead of the arm or where it is given."""
    _, outer = kinematics.reach(arm)
    steps = np.arange(CENTRE_STEP, outer, CENTRE_STEP)
    if centre is not None:
        centres = [np.array(centre, float)]
    elif d == 2:
        centres = [np.array([x, 0.0]) for x in steps]
    else:
        centres = [np.array([x, 0.0, z]) for x in steps for z in steps]
    postures = (arm.elbow, *(other for other in reach.POSTURES if other != arm.elbow))
    best = (0.0, postures[0], centres[0])
    for posture in postures:
        for middle in centres:
            if not _fits(arm, middle, best[0] + CENTRE_STEP / 4, posture):
                continue
            low, high = best[0] + CENTRE_STEP / 4, 2 * outer
            for _ in range(HALVINGS):
                half = (low + high) / 2
                low, high = (half, high) if _fits(arm, middle, half, posture) else (low, half)
            best = (low, posture, middle)
        if best[0] >= CUBE_SIDES[0]:
            break  # the arm's own posture, if it has any room
    return best


def _fits(arm: Arm, middle: np.ndarray, side: float, posture: str) -> bool:
    """Return whether an arm comes easily to all of a cube, above the table."""
    along = side * np.linspace(-0.5, 0.5, SIDE_PROBES)
    points = middle + np.array(list(itertools.product(along, repeat=len(middle))))
    if len(middle) == 3 and points[:, 2].min() < 0:
        return False
    q = reach.joint_angles(arm, points, posture, reach.EASY_MARGIN, reach.EASY_SINGULARITY)
    return bool(np.isfinite(q).all())
