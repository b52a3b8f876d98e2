#!/usr/bin/env python3
"""Handout 1: from a point to the joints' angles, by Newton's method and by Broyden's.

A solution.  Lengths are cm, angles rad.
"""

import math

from robot.api import Clock, RobotArm, find_arm, read_arm

L1, L2 = 11.3, 9.5  # the links
START = [0.6, 0.9]  # where each search begins
GOALS = [(14, 9), (4, 15), (16, -4), (13, -7)]
NEAR_ENOUGH, MOST_STEPS = 0.001, 50


def forward(q):
    # type: (list[float]) -> list[float]
    """Return the tip [x, y] at the joint angles q = (q1, q2)."""
    # -> return [0.0, 0.0]  # TODO 1: both links, see the page
    first, second = q[0], q[0] + q[1]
    return [
        L1 * math.cos(first) + L2 * math.cos(second),
        L1 * math.sin(first) + L2 * math.sin(second),
    ]
    # <-


def jacobian(q):
    # type: (list[float]) -> list[list[float]]
    """Return [[dx/dq1, dx/dq2], [dy/dq1, dy/dq2]] at q, cm/rad."""
    # -> return [[1.0, 0.0], [0.0, 1.0]]  # TODO 2: differentiate forward
    x, y = forward(q)
    second = q[0] + q[1]
    return [[-y, -L2 * math.sin(second)], [x, L2 * math.cos(second)]]
    # <-


def newton_step(J, e):
    # type: (list[list[float]], list[float]) -> list[float]
    """Return the step dq for which J dq = e; e is what is missing, goal - tip."""
    # -> return [0.0, 0.0]  # TODO 3: two equations, two unknowns; beware of det J = 0
    (a, b), (c, d) = J
    det = a * d - b * c
    if abs(det) < 1e-6:
        det = 1e-6
    return [(d * e[0] - b * e[1]) / det, (a * e[1] - c * e[0]) / det]
    # <-


def broyden_update(J, dq, dp):
    # type: (list[list[float]], list[float], list[float]) -> list[list[float]]
    """Return J corrected by one step: dq was made, and the tip moved by dp."""
    # -> return J  # TODO 4: J + (dp - J dq) dq^T / (dq^T dq)
    square = dq[0] ** 2 + dq[1] ** 2
    return [
        [a + (d - row[0] * dq[0] - row[1] * dq[1]) * x / square for a, x in zip(row, dq)]
        for row, d in zip(J, dp)
    ]
    # <-


def search(goal, q, exact):
    # type: (tuple[float, float], list[float], bool) -> list[list[float]]
    """Return the poses from q to the goal: by Newton's method if exact, else by Broyden's."""
    poses, J = [list(q)], jacobian(q)
    while len(poses) <= MOST_STEPS:
        tip = forward(q)
        e = [goal[0] - tip[0], goal[1] - tip[1]]
        if math.hypot(*e) < NEAR_ENOUGH:
            break
        dq = [max(-0.5, min(0.5, d)) for d in newton_step(J, e)]  # no wild steps
        q = [q[0] + dq[0], q[1] + dq[1]]
        after = forward(q)
        if exact:
            J = jacobian(q)
        elif any(dq):
            J = broyden_update(J, dq, [after[0] - tip[0], after[1] - tip[1]])
        poses.append(q)
    return poses


def main():
    # type: () -> None
    """Let the arm go to each goal, and say how many steps the search took."""
    arm = RobotArm(read_arm(find_arm("planar")), Clock())
    arm.load_zero()
    try:
        for goal in GOALS:
            newton, broyden = search(goal, START, True), search(goal, START, False)
            print("{}: Newton {} steps, Broyden {}".format(goal, len(newton) - 1, len(broyden) - 1))
            arm.go_to(newton[-1])
            arm.clock.sleep(0.5)
    finally:
        arm.park()


if __name__ == "__main__":
    main()
