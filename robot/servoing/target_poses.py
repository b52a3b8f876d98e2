"""Target poses of the joints by a model of the image, within the limits.  Pure."""

import math

from robot.motion import kinematics
from robot.servoing.linear_algebra import distance
from robot.servoing.pose_search import MAX_LEFTOVER_SHARE, best_pose, best_posture
from robot.servoing.progress import FIRST_STEP
from shared.verdicts import LIMIT, UNREACHABLE

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, LinearImageModel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.pose_search import Target, Walls  # noqa: F401
    from robot.servoing.progress import Progress  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

LIMIT_MARGIN = math.radians(1)
"""Distance kept from joint limits, rad: the backlash is not exactly known."""


class TargetPoses(object):
    """The target poses of one arm.

    Args:
        arm: shared.arm_description.Arm.
        tolerance: px.

    Attributes:
        box: (least, greatest) angles of the joints, rad.
    """

    def __init__(self, arm, tolerance):
        # type: (Arm, float) -> None
        self._arm, self._tolerance = arm, tolerance
        self.box = (
            [joint.lower + LIMIT_MARGIN for joint in arm.joints],
            [joint.upper - LIMIT_MARGIN for joint in arm.joints],
        )

    def inside(self, q):
        # type: (Pose) -> List[float]
        """Return the joint angles in the box that are next to q, rad (n)."""
        low, high = self.box
        return list(map(min, map(max, q, low), high))

    def choose(self, image, goal, q, penalty, error, progress):
        # type: (LinearImageModel, Features, List[float], Matrix, float, Progress) -> Target
        """Return the target straight to the goal, the one under way, or another posture.

        Args:
            image: as for best_pose.
            goal: as for best_pose.
            q: where the joints are, rad (n).
            penalty: as for best_pose.
            error: length of e there, px.
            progress: Progress, which stores the target under way, and whether it is a detour.

        Returns:
            (q, px left over)
        """
        straight = best_pose(image, goal, q, self.box, q, penalty)
        left = straight[1]
        target_pose = progress.target_pose
        bearable = max(self._tolerance, MAX_LEFTOVER_SHARE * error)
        if left <= (self._tolerance if target_pose else bearable):
            return straight
        if target_pose is None:
            target = best_posture(
                image, goal, q, self.box, straight, left, self._tolerance, penalty
            )
        else:
            target = best_pose(image, goal, target_pose, self.box, q, penalty)
            if target[1] >= left - 1:
                target = straight
            left = target[1]
            if left > bearable and self._at_wall(target[0]):
                # The model has learned since, and may know a better one.
                target = best_posture(
                    image, goal, q, self.box, target, left, self._tolerance, penalty
                )
        progress.target_pose = target[0]
        progress.detours = target is not straight
        return target

    def _at_wall(self, q):
        # type: (Pose) -> bool
        """Return whether a joint of q (rad) is at a wall of the box."""
        return any(not low < a < high for a, low, high in zip(q, *self.box))

    def other_posture(self, q, tried):
        # type: (Pose, List[Pose]) -> Optional[Pose]
        """Return one not yet tried in which the tip would be where it is, or nearly, rad; or None.

        Two joints have two, and best_posture has looked for both; in space it would have to know
        what half a turn of the base away looks like.

        Args:
            q: where the joints are, rad (n).
            tried: joint angles of those that were, rad; q is added.
        """
        if len(q) < 3:
            return None
        tried.append(q)
        tip = kinematics.forward(self._arm, tuple(self.inside(q)))
        for other in kinematics.branches(self._arm, tip):
            if min(distance(other, p) for p in tried) > FIRST_STEP:
                return other
        return None

    def out_of_reach(self, q, left):
        # type: (Pose, float) -> Tuple[str, str]
        """Return (verdict, reason) where the best target, q (rad), leaves over `left` (px)."""
        for joint, a, low, high in zip(self._arm.joints, q, *self.box):
            if min(a - low, high - a) < LIMIT_MARGIN:
                return LIMIT, "the {} is at its limit, {:.0f} px short".format(joint.name, left)
        return UNREACHABLE, "the arm ends {:.0f} px short".format(left)
