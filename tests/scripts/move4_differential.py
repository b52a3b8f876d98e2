#!/usr/bin/env python3
"""MoveDifferential: distances, arcs, turns and coordinates, with the odometry in a thread."""
import math
import time

from ev3dev2.motor import MoveDifferential, OUTPUT_B, OUTPUT_C, SpeedRPM
from ev3dev2.wheel import Wheel

STUD = 8


class MyTire(Wheel):
    def __init__(self):
        Wheel.__init__(self, 56, 28)


robot = MoveDifferential(OUTPUT_B, OUTPUT_C, MyTire, 15 * STUD)


def here(what):
    time.sleep(0.5)
    print(what, round(robot.x_pos_mm / 10, 1), round(robot.y_pos_mm / 10, 1),
          round(math.degrees(robot.theta)) % 360)


robot.odometry_start()
robot.on_for_distance(SpeedRPM(50), 200)
here('ahead')
robot.on_arc_right(SpeedRPM(40), 150, 236)
here('arc')
robot.turn_left(SpeedRPM(30), 90)
here('left')
robot.turn_to_angle(SpeedRPM(30), 180)
here('west')
robot.on_to_coordinates(SpeedRPM(50), 0, 0)
here('home')
robot.odometry_stop()
