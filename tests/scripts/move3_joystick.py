#!/usr/bin/env python3
"""MoveJoystick: the stick ahead, to the right, back, and half ahead to the left."""
import time

from ev3dev2.motor import MoveJoystick, OUTPUT_B, OUTPUT_C

stick = MoveJoystick(OUTPUT_B, OUTPUT_C)
for x, y in ((0, 50), (50, 0), (0, -50), (-25, 25)):
    stick.on(x, y, radius=100)
    time.sleep(1)
    print(x, y, *[round(m.speed / 10.5, -1) for m in (stick.left_motor, stick.right_motor)])
stick.off()
