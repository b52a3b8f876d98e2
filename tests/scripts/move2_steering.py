#!/usr/bin/env python3
"""MoveSteering: straight on, a curve, on one wheel, and on the spot."""
import time

from ev3dev2.motor import MoveSteering, OUTPUT_B, OUTPUT_C, SpeedRPM

drive = MoveSteering(OUTPUT_B, OUTPUT_C)


def turned():
    time.sleep(0.5)
    at = drive.left_motor.position, drive.right_motor.position
    drive.reset()
    return at


drive.on_for_rotations(0, SpeedRPM(60), 2)
print('straight', *turned())
drive.on_for_degrees(25, 30, 400)
print('curve', *turned())
drive.on_for_degrees(-50, 30, 360)
print('one wheel', *turned())
drive.on_for_seconds(100, 20, 1)
print('on the spot', *turned())
drive.on(-100, 20)
time.sleep(1)
drive.off()
print('back', *turned())
