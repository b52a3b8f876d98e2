#!/usr/bin/env python3
"""Sorts bricks on a belt by colour; a medium motor throws the red ones out."""
import time

from ev3dev2.motor import LargeMotor, MediumMotor, OUTPUT_A, OUTPUT_D, SpeedPercent
from ev3dev2.sensor.lego import ColorSensor

belt, thrower = LargeMotor(OUTPUT_A), MediumMotor(OUTPUT_D)
cs = ColorSensor()
white = cs.reflected_light_intensity
cs.calibrate_white()
print('white', white, cs.rgb, cs.ambient_light_intensity)
seen = []
belt.on(SpeedPercent(20))
end = time.time() + 7
while time.time() < end:
    name = cs.color_name
    if name not in ('NoColor', 'White') and (not seen or seen[-1] != name):
        seen.append(name)
        if name == 'Red':
            thrower.on_for_degrees(SpeedPercent(50), 90)
    time.sleep(0.05)
belt.off()
print(*seen)
print('thrown', round(thrower.position / 90))
print('raw', cs.raw, 'hsv {:.2f}'.format(cs.hsv[0]))
