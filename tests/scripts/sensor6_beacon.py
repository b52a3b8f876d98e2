#!/usr/bin/env python3
"""Turns towards the beacon on channel 2 and follows it until it is near; else it looks ahead."""
import time

from ev3dev2.motor import MoveSteering, OUTPUT_B, OUTPUT_C
from ev3dev2.sensor import INPUT_4
from ev3dev2.sensor.lego import InfraredSensor

ir = InfraredSensor(INPUT_4)
drive = MoveSteering(OUTPUT_B, OUTPUT_C)
print('ahead', ir.proximity, 'on channel 1', ir.heading_and_distance())
lost = 0
while True:
    heading, distance = ir.heading_and_distance(channel=2)
    if distance is None:
        lost += 1
        drive.off()
    elif distance < 10:
        break
    else:
        drive.on(max(-100, min(100, heading * 2)), 20)
    time.sleep(0.05)
drive.off()
print('lost', lost > 0, 'near', distance, 'at', heading)
