"""Gravity at the joints: the torque on each, and the side of the backlash that it closes.  Pure.

Masses are lumped: each link's, with all that it carries but the next link, at its centre of mass.
The torque on joint k is minus the gradient of the potential energy U, tau_k = -dU/dq_k (Siciliano
et al., Robotics, 2009, section 7.1).  Once |tau_k| exceeds the joint's friction, the link lies on
its motor by its weight, whichever way the motor turns.
"""

from robot.motion import kinematics

MYPY = False
if MYPY:
    from typing import List, Sequence, Tuple  # noqa: F401

    from robot.motion.backlash import Sides  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

G = 9.81
"""Acceleration of gravity, m/s^2."""


class Gravity(object):
    """The torques of gravity on one arm.

    Args:
        arm: shared.arm_description.Arm; a joint without mass has no weight.
        g: acceleration of gravity, m/s^2.
        preloads: whether `preload_sides` counts on the weight to take up the backlash.
        known: whether `torques` returns the weight's; else it returns zeros.

    Attributes:
        loaded: whether the arm has any weight.
    """

    def __init__(self, arm, g=G, preloads=True, known=True):
        # type: (Arm, float, bool, bool) -> None
        # A joint whose own mass is unknown carries more than the next one's.
        self._friction = [joint.friction if joint.mass else float("inf") for joint in arm.joints]
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
        """Return the torque on each joint at `q` (rad), Nm; zeros where it is unknown."""
        return self._pull(q) if self._known and self.loaded else [0.0] * len(q)

    def _pull(self, q):
        # type: (Pose) -> List[float]
        """Return the torque on each joint at `q` (rad), Nm."""
        return kinematics.pull(self._arm, q, self._moments)

    def preload_sides(self, q):
        # type: (Pose) -> Tuple[int, ...]
        """Return per joint the side of the backlash that gravity closes at `q` (rad): +1 or -1.

        0 where it closes none: without weight, or where friction holds the link.  A link that is
        pulled in the negative direction lies on its motor as if pushed in the positive one.
        """
        if not (self.loaded and self._preloads):
            return (0,) * len(q)
        return tuple(
            [
                0 if -friction <= torque <= friction else (-1 if torque > 0 else 1)
                for torque, friction in zip(self._pull(q), self._friction)
            ]
        )

    def sides(self, q, sides):
        # type: (Pose, Sides) -> Tuple[float, ...]
        """Return the side of the backlash per joint at rest at `q` (rad), last left at `sides`."""
        return tuple(
            preload_sides or side for preload_sides, side in zip(self.preload_sides(q), sides)
        )
