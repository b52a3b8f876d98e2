#!/usr/bin/env python3
"""A thread watches the touch sensor and the main thread swings until it is pressed."""
import threading
import time

from ev3dev2.motor import LargeMotor, OUTPUT_A, SpeedPercent
from ev3dev2.sensor import INPUT_1
from ev3dev2.sensor.lego import TouchSensor


class Watcher(threading.Thread):
    def __init__(self):
        threading.Thread.__init__(self)
        self.daemon = True
        self.ts = TouchSensor(INPUT_1)
        self.pressed = threading.Event()
        self._stop_time = None

    def run(self):
        while not self.ts.is_pressed:
            time.sleep(0.02)
        self._stop_time = time.time()
        self.pressed.set()


motor = LargeMotor(OUTPUT_A)
home = motor.position
watcher = Watcher()
watcher.start()
began = time.time()
swings = 0
try:
    while not watcher.pressed.is_set():
        motor.on_to_position(SpeedPercent(20), home + (20 if swings % 2 == 0 else -20))
        swings += 1
finally:
    motor.off()
watcher.join()
print('swings', swings)
print('pressed after {:.1f}'.format(watcher._stop_time - began))
