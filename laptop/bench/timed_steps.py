"""The classic lab's own program, a reference for the bench beside the report's method `steps`.

It is made from that program's behaviour; no code of it is here.  Joint steps go by
the inverse Jacobian as in `steps`, but by the clock: every PERIOD the joint angles are read and the
next step is commanded, whether or not the one before has settled.  The direction is always that
from the line's start to its end: a deviation sideways is not corrected.

Letters: `q` joint angles rad, `dq` a step, `J` the Jacobian cm/rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from shared.arm_description import ArmError

SPEED = 0.05
"""Speed of both motors, as a share of their greatest."""

PERIOD = 0.2
"""Period from one reading to the next, s."""

STEP, MIN_STEP = math.radians(5), math.radians(1)
"""Size of a step, and least size that is halved, rad."""

HALVING_DISTANCE, END_DISTANCE = 10.0, 2.0
"""Distances from the line's end within which steps are halved, and the method ends, cm."""

TIME_LIMIT = 60.0
"""Longest time of a line before it counts as stuck, s."""


class Law(NamedTuple):
    """Details in which the program's description and its behaviour differ.

    halved: within HALVING_DISTANCE each step is half the last one, until one is MIN_STEP or less.
    along_all: STEP is the length of dq; else that of its greatest element.
    truncates: a part of a count is dropped; else it is rounded.
    stop_action: of the motors after a step.
    """

    halved: bool
    along_all: bool
    truncates: bool
    stop_action: str


LAWS = {
    "timed steps": Law(halved=False, along_all=True, truncates=True, stop_action="coast"),
    "timed steps, halved": Law(halved=True, along_all=False, truncates=False, stop_action="hold"),
}
"""Laws by name.  The second is the program as it is described.

The program itself, run on the emulated brick (planar arm, elbow down, 2 degrees of backlash,
cpu=0), drew the three lines 4.1, 5.8 and 5.4 mm off and 18.0, 16.7 and 11.3 mm short, in 3.0, 5.4
and 3.7 s.  Halved steps take two to four times as long; the first
law, found among some 700 by these figures, comes closest to all of them."""


def step_size(law: Law, size: float, left: float) -> float:
    """Return the next step's size, rad, after one of `size`, with `left` cm to go."""
    return size / 2 if law.halved and left < HALVING_DISTANCE and size > MIN_STEP else size


def joint_step(
    law: Law, jacobian: Sequence[Sequence[float]], direction: Sequence[float], size: float
) -> np.ndarray:
    """Return dq = J^-1 direction, scaled to `size`, rad; the direction's length does not count.

    Raises:
        np.linalg.LinAlgError: J has no inverse.
    """
    dq = np.linalg.solve(jacobian, direction)
    return dq * size / (np.linalg.norm(dq) if law.along_all else np.abs(dq).max())


def whole_counts(law: Law, counts: float) -> int:
    """Return whole counts, as a motor takes them."""
    return int(counts) if law.truncates else round(counts)


def draw_line(program: Any, driver: Any, start: Any, end: Any, law: Law) -> None:
    """Draw a line in the plane, cm.

    Args:
        program: laptop.emulator.host.program.Program, on the emulated brick.
        driver: its robot.driver.Driver.
        start: (x, y), cm.
        end: the same.
        law: of the steps.

    Raises:
        ArmError: the start is out of reach, a step leads past a joint's limits, or it gets stuck.
        np.linalg.LinAlgError: the arm is stretched or folded.
    """
    robot, clock = driver.arm, program.clock
    arm, kinematics = robot.description, program["robot.motion.kinematics"]
    robot.go_to(kinematics.inverse(arm, start, driver.elbow))
    driver.pen_down()
    motors = [program["ev3dev2.motor"].LargeMotor("out" + joint.port) for joint in arm.joints]
    for joint, motor in zip(robot.joints, motors, strict=True):
        joint.disengage()
        motor.speed_sp = int(SPEED * motor.max_speed)
        motor.stop_action = law.stop_action
    size, until = STEP, clock.now() + TIME_LIMIT
    while True:
        q = [joint.angle() for joint in robot.joints]  # without regard to backlash
        left = math.dist(end, kinematics.forward(arm, q))
        if left <= END_DISTANCE:
            break
        if clock.now() > until:
            raise ArmError(f"still {left:.1f} cm from the end after {TIME_LIMIT:g} s; it got stuck")
        size = step_size(law, size, left)
        dq = joint_step(law, kinematics.jacobian(arm, q), np.subtract(end, start), size)
        kinematics.check_limits(arm.joints, q + dq)
        for joint, motor, angle in zip(robot.joints, motors, dq, strict=True):
            motor.position_sp = whole_counts(law, joint.in_counts(angle))
            motor.run_to_rel_pos()
        clock.sleep(PERIOD)
    driver.pen_up()
