#!/usr/bin/env python3
"""A rover that the infrared remote control drives, one wheel each side; the beacon ends it."""
import time

from ev3dev2.motor import LargeMotor, OUTPUT_B, OUTPUT_C
from ev3dev2.sensor.lego import InfraredSensor

left, right = LargeMotor(OUTPUT_B), LargeMotor(OUTPUT_C)
ir = InfraredSensor()
told = []


def drive(motor, speed):
    def act(pressed):
        told.append((motor is left, speed, pressed))
        motor.run_forever(speed_sp=speed) if pressed else motor.stop(stop_action='brake')
    return act


ir.on_channel1_top_left = drive(left, 300)
ir.on_channel1_bottom_left = drive(left, -300)
ir.on_channel1_top_right = drive(right, 300)
ir.on_channel1_bottom_right = drive(right, -300)
while not ir.beacon():
    ir.process()
    time.sleep(0.01)
print('told', len(told))
for motor in (left, right):
    motor.stop()
print(round(left.position, -2), round(right.position, -2))
