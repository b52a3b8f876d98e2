"""Placing of the arm in its home pose by hand: the pose is described, and waited for."""

import math

from robot.asking import Person
from robot.ev3 import battery
from robot.motion import kinematics
from shared.arm_keys import PULLED_DOWN, SEEK_BEYOND

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

HERE_ADVICE = "; or say home --here if the arm stands in its home pose"
"""Advice where no person can answer."""


def home_pose(description):
    # type: (Arm) -> str
    """Return the home pose in words, as one can find it with a ruler."""
    joints = description.joints
    tip = kinematics.forward(description, [joint.home for joint in joints])
    stretched = all(joint.home == 0 for joint in joints)
    return "{}{}, the tip at {} cm".format(
        ", ".join("{} {:g}".format(one.name, round(math.degrees(one.home), 1)) for one in joints),
        " deg (stretched straight ahead)" if stretched else " deg",
        ",".join("{:.1f}".format(value + 0.0) for value in tip),
    )


def place(arm, clock, person=None):
    # type: (RobotArm, Clock, Optional[Person]) -> None
    """Release the joints, wait until a person has put them at home, and hold them.

    Args:
        arm: robot.motion.arm.RobotArm.
        clock: has `now()` and `sleep(seconds)`.
        person: asking.Person; whoever started the program if None.

    Raises:
        BatteryFlat: nothing is let go.
        NobodyAnswers: nor will anybody; all is held.
    """
    battery.check(clock)
    person = person or Person(clock)
    with arm.lend_motors(zero_needed=False):
        if arm.description.chain in PULLED_DOWN:
            person.confirm("Take the arm in your hand: the motors let go of it.", HERE_ADVICE)
        for motor in arm.joints:
            motor.coast()
        person.confirm(
            "Put the arm by hand in its home pose, to {:.0f} degrees: {}.".format(
                math.degrees(SEEK_BEYOND), home_pose(arm.description)
            ),
            HERE_ADVICE,
        )
        arm.motors.hold(arm.joints)
