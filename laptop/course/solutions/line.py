#!/usr/bin/env python3
"""Handout 3: a straight line, by the inverse of the Jacobian.

A solution.  Lengths are cm, angles rad, times s.
"""

import math
import time

from ev3dev2.motor import OUTPUT_A, OUTPUT_B, OUTPUT_C, LargeMotor, MediumMotor

from robot.api import find_arm, forward, inverse, jacobian, read_arm

ARM = read_arm(find_arm("planar"))
START, END = (16.0, -4.0), (8.0, 12.0)
SPEED, PERIOD = 4.0, 0.03  # of the tip, and of one round
GAIN = 4.0  # how hard an error is corrected, 1/s


def joint_speeds(q, p_wanted, v_wanted):
    # type: (list[float], list[float], list[float]) -> list[float]
    """Return [dq1, dq2], rad/s, that move the tip as wanted.

    q         joint angles now
    p_wanted  where the tip should be now, cm
    v_wanted  how fast it should go, cm/s
    """
    # -> # TODO: this goes straight in the joints' angles, and so bows on the paper. Use
    # -> # dq = J^-1 (v_wanted + GAIN (p_wanted - p)) with J = jacobian(ARM, q), p = forward(ARM, q)
    # -> first, last = inverse(ARM, START), inverse(ARM, END)
    # -> seconds = math.hypot(END[0] - START[0], END[1] - START[1]) / SPEED
    # -> return [(b - a) / seconds for a, b in zip(first, last)]
    (a, b), (c, d) = jacobian(ARM, q)
    p = forward(ARM, q)
    x, y = (v + GAIN * (w - is_) for v, w, is_ in zip(v_wanted, p_wanted, p))
    det = a * d - b * c
    return [(d * x - b * y) / det, (a * y - c * x) / det]
    # <-


def main():
    # type: () -> None
    """Go to the start, lower the pen, and draw."""
    motors = LargeMotor(OUTPUT_A), LargeMotor(OUTPUT_B)
    pen = MediumMotor(OUTPUT_C)
    zero = [motor.position for motor in motors]  # the arm stands stretched

    def angles():
        # type: () -> list[float]
        return [math.radians(m.position - z) for m, z in zip(motors, zero)]

    seconds = math.hypot(END[0] - START[0], END[1] - START[1]) / SPEED
    v = [(b - a) / seconds for a, b in zip(START, END)]
    try:
        # From behind, so that the play is taken up in the direction of the line.
        behind = [a - 0.2 * d for a, d in zip(START, v)]
        for point, speed in ((behind, 60), (START, 20)):
            for motor, z, angle in zip(motors, zero, inverse(ARM, point)):
                motor.on_to_position(speed / 10.5, round(z + math.degrees(angle)), block=False)
            time.sleep(3)
        pen.on_for_degrees(30, 60)
        begin = time.monotonic()
        while True:
            t = time.monotonic() - begin
            if t >= seconds:
                break
            wanted = [a + d * t for a, d in zip(START, v)]
            for motor, dq in zip(motors, joint_speeds(angles(), wanted, v)):
                motor.run_timed(
                    speed_sp=max(-600, min(600, round(math.degrees(dq)))),
                    time_sp=200,  # it stops by itself if this program does
                    stop_action="hold",
                )
            time.sleep(max(0.0, begin + t + PERIOD - time.monotonic()))
        for motor in motors:
            motor.stop(stop_action="hold")
        time.sleep(0.3)
        pen.on_for_degrees(30, -60)
        print("the tip is at ({:.1f}, {:.1f})".format(*forward(ARM, angles())))
    finally:
        for motor in motors:
            motor.stop(stop_action="brake")
        pen.stop(stop_action="brake")


if __name__ == "__main__":
    main()
