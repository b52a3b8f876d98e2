#!/usr/bin/env python3
"""The library's own robots: a tank with a remote control, and one that balances on two wheels."""
import sys
import threading
import time

from ev3dev2.control.GyroBalancer import GyroBalancer
from ev3dev2.control.rc_tank import RemoteControlledTank
from ev3dev2.motor import OUTPUT_B, OUTPUT_C

if sys.argv[1] == 'tank':
    tank = RemoteControlledTank(OUTPUT_B, OUTPUT_C, speed=300)
    threading.Timer(5, lambda: setattr(tank.remote, 'process', sys.exit)).start()
    try:
        tank.main()
    except SystemExit:
        tank.off()
    print('driven', round(tank.left_motor.position, -2), round(tank.right_motor.position, -2))
else:
    robot = GyroBalancer()
    robot.balance()
    time.sleep(7)
    robot.move_forward(seconds=1)
    print('wheels', robot.motor_left.position, robot.motor_right.position)
    robot.stop()
    time.sleep(3)
    robot.stop_balance.set()
    time.sleep(0.1)
    print('threads', threading.active_count())
    robot.shutdown()
