#!/usr/bin/env python3
"""Handout 4: to a goal that the camera sees, without knowing where the camera stands.

A solution.  In the image px, angles rad.
"""

import math

from robot.api import Clock, RobotArm, TrackingClient, find_arm, find_tracker, read_arm

TEST_MOVE = math.radians(8)  # of each joint, to see how the image follows
LONGEST_STEP = math.radians(10)
NEAR_ENOUGH, MOST_STEPS = 4.0, 30  # px


def first_jacobian(moved):
    # type: (list[list[float]]) -> list[list[float]]
    """Return [[du/dq1, du/dq2], [dv/dq1, dv/dq2]], px/rad.

    moved  [[u, v], [u, v]]: by how many px the tip moved when joint 1, joint 2 turned by TEST_MOVE
    """
    # -> return [[1.0, 0.0], [0.0, 1.0]]  # TODO 1
    (u1, v1), (u2, v2) = moved
    return [[u1 / TEST_MOVE, u2 / TEST_MOVE], [v1 / TEST_MOVE, v2 / TEST_MOVE]]
    # <-


def step(J, e):
    # type: (list[list[float]], list[float]) -> list[float]
    """Return the joints' step dq that takes the error e = s - s_star away: dq = -J^-1 e."""
    # -> return [0.0, 0.0]  # TODO 2
    (a, b), (c, d) = J
    det = a * d - b * c
    return [-(d * e[0] - b * e[1]) / det, -(a * e[1] - c * e[0]) / det]
    # <-


def broyden_update(J, dq, ds):
    # type: (list[list[float]], list[float], list[float]) -> list[list[float]]
    """Return J corrected by one step: dq was made, and the tip moved by ds px."""
    # -> return J  # TODO 3: as in handout 1
    square = dq[0] ** 2 + dq[1] ** 2
    return [
        [a + (d - row[0] * dq[0] - row[1] * dq[1]) * x / square for a, x in zip(row, dq)]
        for row, d in zip(J, ds)
    ]
    # <-


def look(client, arm, goal=None):
    # type: (TrackingClient, RobotArm, list[float] | None) -> tuple[list[float], list[float]]
    """Return tip and goal, px: the middle one of five pictures of an arm that stands.

    goal  where it was, in case that the arm hides it now
    """
    arm.clock.sleep(0.3)
    tips, goals = [], []  # type: list[tuple[float, float]], list[tuple[float, float]]
    until = arm.clock.now() + 10
    while len(tips) < 5 or not (goals or goal):
        if arm.clock.now() > until:
            raise SystemExit("tip or goal are not seen: {}".format(client.why or "look at them"))
        for seen in client.poll(timeout=0.2).values():
            tip, place = seen.markers.get("effector"), seen.markers.get("goal")
            if tip and tip[2] >= 0.5:  # the third is the confidence
                tips.append(tip[:2])
            if place and place[2] >= 0.9:
                goals.append(place[:2])
    return middle(tips), middle(goals) if goals or goal is None else goal


def middle(points):
    # type: (list[tuple[float, float]]) -> list[float]
    """Return the median of points, in u and in v."""
    return [sorted(values)[len(values) // 2] for values in zip(*points)]


def turn(arm, dq):
    # type: (RobotArm, list[float]) -> list[float]
    """Turn the joints by dq, but no joint by more than LONGEST_STEP; return what was done."""
    share = min(1.0, LONGEST_STEP / max(1e-9, max(map(abs, dq))))
    joints = arm.description.joints
    before = arm.angles()
    wanted = [
        max(joint.lower, min(joint.upper, angle + share * d))
        for joint, angle, d in zip(joints, before, dq)
    ]
    arm.go_to(wanted, speed=0.3)
    return [a - b for a, b in zip(wanted, before)]


def main():
    # type: () -> None
    """Two test moves, then step by step to the goal."""
    clock = Clock()
    arm = RobotArm(read_arm(find_arm("planar")), clock)
    arm.load_zero()
    client = TrackingClient(*find_tracker(), clock=clock)
    try:
        arm.go_to([0.2, 1.0])  # bent: a stretched arm is singular
        s, goal = look(client, arm)
        moved = []
        for dq in ([TEST_MOVE, 0.0], [0.0, TEST_MOVE]):
            turn(arm, dq)
            now, goal = look(client, arm, goal)
            moved.append([now[0] - s[0], now[1] - s[1]])
            s = now
        J = first_jacobian(moved)
        for number in range(1, MOST_STEPS + 1):
            e = [s[0] - goal[0], s[1] - goal[1]]
            print("{}: {:.1f} px off".format(number, math.hypot(*e)))
            if math.hypot(*e) < NEAR_ENOUGH:
                break
            dq = turn(arm, step(J, e))
            now, goal = look(client, arm, goal)
            if any(dq):
                J = broyden_update(J, dq, [now[0] - s[0], now[1] - s[1]])
            s = now
    finally:
        client.close()
        arm.park()


if __name__ == "__main__":
    main()
