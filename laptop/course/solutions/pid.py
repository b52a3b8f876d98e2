#!/usr/bin/env python3
"""Handout 2: a PID controller for the elbow, with bare python-ev3dev2.

A solution.  Angles are degrees, duty cycles percent.
"""

import time

from ev3dev2.motor import OUTPUT_A, OUTPUT_B, LargeMotor

# -> KP, KI, KD = 0.0, 0.0, 0.0  # TODO 1: find them; begin with KP alone
KP, KI, KD = 3.0, 6.0, 0.15
# <-
TARGETS = (40, -20, 10)  # where the elbow shall go, one after the other
STAY, PERIOD = 3.0, 0.02  # s at each of them, and of one round


def control(error, integral, rate):
    # type: (float, float, float) -> float
    """Return the duty cycle: error in deg, its integral in deg s, its rate in deg/s."""
    # -> return 0.0  # TODO 2
    return KP * error + KI * max(-12.0, min(12.0, integral)) + KD * rate
    # <-


def main():
    # type: () -> None
    """Go from target to target."""
    shoulder, elbow = LargeMotor(OUTPUT_A), LargeMotor(OUTPUT_B)
    shoulder.stop(stop_action="hold")
    start = elbow.position
    elbow.run_direct(duty_cycle_sp=0)
    try:
        for target in TARGETS:
            integral = 0.0
            last = target - (elbow.position - start)
            before = begin = time.monotonic()
            while time.monotonic() - begin < STAY:
                now = time.monotonic()
                dt = max(now - before, 0.001)
                error = target - (elbow.position - start)
                integral += error * dt
                duty = control(error, integral, (error - last) / dt)
                elbow.duty_cycle_sp = int(max(-100, min(100, duty)))
                last, before = error, now
                time.sleep(max(0.0, now + PERIOD - time.monotonic()))
            print("target {}: at {}".format(target, elbow.position - start))
    finally:
        elbow.stop(stop_action="brake")
        shoulder.stop(stop_action="brake")


if __name__ == "__main__":
    main()
