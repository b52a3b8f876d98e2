"""What gravity does to the joints: the torque on each, and the side of the backlash it presses on.

Pure.  Weights are lumped: each link's, with all it carries but the next link, where that balances.
"""

from robot.motion import kinematics

MYPY = False
if MYPY:
    from typing import List, Sequence, Tuple  # noqa: F401

    from robot.motion.backlash import Sides  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

G = 9.81
"""m/s^2."""


class Gravity(object):
    """The pull on one arm.

    Args:
        arm: shared.arm_description.Arm; joints of no mass are carried without weight.
        g: m/s^2.
        preloads: whether `preload_sides` counts on the weight to take up the backlash.
        known: whether `torques` tells of the weight; else it tells of none.

    Attributes:
        loaded: whether the arm has any weight.
    """

    def __init__(self, arm, g=G, preloads=True, known=True):
        # type: (Arm, float, bool, bool) -> None
        # Of a joint whose own weight is not told, the next one's is not all that it carries.
        self._rubs = [joint.friction if joint.mass else float("inf") for joint in arm.joints]
        self._arm = arm
        self._moments, beyond = [], 0.0  # type: List[float], float
        for joint in reversed(arm.joints):
            weight = joint.mass * g * 0.01
            self._moments.insert(0, weight * joint.centre + beyond * joint.link)
            beyond += weight
        self.loaded = any(joint.mass for joint in arm.joints)
        self._preloads = preloads
        self._known = known

    def torques(self, q):
        # type: (Pose) -> List[float]
        """The torque on each joint at `q` (rad), Nm: minus the gradient of the potential energy."""
        return self._pull(q) if self._known and self.loaded else [0.0] * len(q)

    def _pull(self, q):
        # type: (Pose) -> List[float]
        return kinematics.pull(self._arm, q, self._moments)

    def preload_sides(self, q):
        # type: (Pose) -> Tuple[int, ...]
        """Per joint, the side to which gravity presses the backlash at `q`: +1 or -1.

        0 where it does not: without weight, or where friction holds the link as it is left.  A link
        that is pulled in the negative direction lies on its motor as if pushed in the positive one.
        """
        if not (self.loaded and self._preloads):
            return (0,) * len(q)
        return tuple(
            [
                0 if -rubs <= torque <= rubs else (-1 if torque > 0 else 1)
                for torque, rubs in zip(self._pull(q), self._rubs)
            ]
        )

    def sides(self, q, sides):
        # type: (Pose, Sides) -> Tuple[float, ...]
        """Where the backlash lies at rest at `q` if it was left as in `sides`."""
        return tuple(
            preload_sides or side for preload_sides, side in zip(self.preload_sides(q), sides)
        )
