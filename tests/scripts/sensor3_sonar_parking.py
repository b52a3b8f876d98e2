#!/usr/bin/env python3
"""Drives up to a wall, slower the nearer it is, and parks 10 cm before it."""
import time

from ev3dev2.motor import MoveTank, OUTPUT_B, OUTPUT_C, SpeedPercent
from ev3dev2.sensor.lego import UltrasonicSensor

us = UltrasonicSensor()
tank = MoveTank(OUTPUT_B, OUTPUT_C)
print('inches {:.1f}'.format(us.distance_inches))
while True:
    ahead = us.distance_centimeters - 10
    if ahead < 0.3:
        break
    speed = SpeedPercent(max(4, min(40, ahead * 2)))
    tank.on(speed, speed)
    time.sleep(0.02)
tank.off()
time.sleep(0.5)
print('parked {:.1f}'.format(us.distance_centimeters_ping))
print('heard', us.other_sensor_present)
