#!/usr/bin/env python3
"""Lab 1: move the arm back and forth in every way the motor offers."""
from time import sleep

from ev3dev2.motor import OUTPUT_A, OUTPUT_B, LargeMotor, SpeedDPS, SpeedPercent

shoulder = LargeMotor(OUTPUT_A)
elbow = LargeMotor(OUTPUT_B)

shoulder.reset()
elbow.reset()
elbow.position = 0

# one after the other
shoulder.on_for_degrees(SpeedPercent(20), 45)
sleep(0.5)
print("after on_for_degrees", shoulder.position)
elbow.on_for_degrees(SpeedPercent(15), -30, brake=True, block=True)
sleep(0.5)
print("elbow", elbow.degrees)

# both at once
shoulder.on_to_position(SpeedDPS(90), 0, brake=True, block=False)
elbow.on_to_position(SpeedDPS(60), 0, block=False)
shoulder.wait_while('running', timeout=5000)
elbow.wait_until_not_moving(timeout=5000)
sleep(0.5)
print("home", shoulder.position, elbow.position)

# for a while
shoulder.on_for_seconds(SpeedPercent(10), 0.5)
shoulder.run_forever(speed_sp=-100)
while shoulder.position > 5:
    sleep(0.01)
shoulder.stop(stop_action='hold')
sleep(0.3)
print("stopped", shoulder.is_holding)
shoulder.off(brake=False)
elbow.off(brake=False)
