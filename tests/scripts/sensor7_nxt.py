#!/usr/bin/env python3
"""Sensors of the NXT: the ports have to be told what they are."""
import time

from ev3dev2 import DeviceNotFound
from ev3dev2.port import LegoPort
from ev3dev2.sensor import INPUT_1, INPUT_2, INPUT_3, list_sensors
from ev3dev2.sensor.lego import LightSensor, SoundSensor, UltrasonicSensor

for port in (INPUT_1, INPUT_2):
    p = LegoPort(port)
    p.mode = 'auto'
    time.sleep(1)
    print(p.status, p.driver_name, [s.driver_name for s in list_sensors(address=port)])
try:
    SoundSensor(INPUT_2)
except DeviceNotFound:
    print('not before it is told')
for port, driver in ((INPUT_1, 'lego-nxt-light'), (INPUT_2, 'lego-nxt-sound')):
    LegoPort(port).mode = 'nxt-analog'
    LegoPort(port).set_device = driver
light, sound, us = LightSensor(INPUT_1), SoundSensor(INPUT_2), UltrasonicSensor(INPUT_3)
print('light', light.reflected_light_intensity, light.ambient_light_intensity)
quiet = sound.sound_pressure
start = time.time()
while sound.sound_pressure < 60:
    time.sleep(0.01)
print('clap after {:.1f}, quiet {:.1f}, low {:.1f}'.format(
    time.time() - start, quiet, sound.sound_pressure_low))
print('far', us.distance_centimeters, us.units)
