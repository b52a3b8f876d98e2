#!/usr/bin/env python3
"""MoveTank follows the edge of a line."""
from ev3dev2.motor import (
    LineFollowErrorLostLine, MoveTank, OUTPUT_B, OUTPUT_C, SpeedDPS, follow_for_ms)
from ev3dev2.sensor.lego import ColorSensor

tank = MoveTank(OUTPUT_B, OUTPUT_C)
tank.cs = ColorSensor()
print('light', tank.cs.reflected_light_intensity)
try:
    tank.follow_line(
        kp=4, ki=0, kd=1, speed=SpeedDPS(200), target_light_intensity=45, follow_left_edge=False,
        white=85, off_line_count_max=30, follow_for=follow_for_ms, ms=20000)
    print('followed')
except LineFollowErrorLostLine:
    tank.stop()
    print('lost')
