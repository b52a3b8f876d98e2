#!/usr/bin/env python3
"""Counts bumps of the touch sensor, and how long the longest was."""
import time

from ev3dev2.sensor.lego import TouchSensor

ts = TouchSensor()
bumps, longest = 0, 0.0
while ts.wait_for_pressed(timeout_ms=3000):
    pressed = time.time()
    ts.wait_for_released()
    longest = max(longest, time.time() - pressed)
    bumps += 1
print('bumps', bumps)
print('longest {:.1f}'.format(longest))
