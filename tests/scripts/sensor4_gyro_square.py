#!/usr/bin/env python3
"""Drives a square, turning by the gyro; then once more along its first side, kept by the gyro."""
from ev3dev2.motor import MoveSteering, MoveTank, OUTPUT_B, OUTPUT_C, SpeedPercent, follow_for_ms
from ev3dev2.sensor import INPUT_2
from ev3dev2.sensor.lego import GyroSensor

gyro = GyroSensor(INPUT_2)
gyro.calibrate()
steering = MoveSteering(OUTPUT_B, OUTPUT_C)
for side in range(4):
    steering.on_for_rotations(0, SpeedPercent(40), 1.5)
    steering.on(100, SpeedPercent(10))
    while gyro.angle < 90 * (side + 1) - 1:
        pass
    steering.off()
print('turned', gyro.angle, gyro.circle_angle())
tank = MoveTank(OUTPUT_B, OUTPUT_C)
tank.gyro = gyro
tank.gyro.reset()
tank.follow_gyro_angle(
    kp=6, ki=0, kd=1, speed=SpeedPercent(30), target_angle=0, follow_for=follow_for_ms, ms=2000
)
angle, rate = gyro.angle_and_rate
print('kept', angle, rate)
tank.turn_right(SpeedPercent(10), 180)
print('about', gyro.angle)
