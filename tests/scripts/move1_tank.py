#!/usr/bin/env python3
"""All ways that MoveTank drives, also with speeds in all units, and a MotorSet of medium motors."""
import time

from ev3dev2.motor import (
    MediumMotor, MotorSet, MoveTank, OUTPUT_A, OUTPUT_B, OUTPUT_C, OUTPUT_D, SpeedDPM, SpeedDPS,
    SpeedNativeUnits, SpeedPercent, SpeedRPM, SpeedRPS)

tank = MoveTank(OUTPUT_B, OUTPUT_C)
tank.on_for_seconds(SpeedPercent(20), SpeedRPS(0.5), 1)
tank.on_for_degrees(SpeedDPS(300), SpeedDPS(150), 360)
tank.on_for_rotations(SpeedRPM(60), SpeedRPM(-60), 1)
print('at rest', not tank.is_running, 'held', tank.is_holding)
tank.on(SpeedNativeUnits(200), SpeedDPM(12000))
time.sleep(1)
print('runs', tank.is_running)
tank.off(brake=False)
time.sleep(0.5)
print(tank.left_motor.position, tank.right_motor.position)
tank.reset()
print(tank.left_motor.position, tank.right_motor.position)
tools = MotorSet({OUTPUT_A: MediumMotor, OUTPUT_D: MediumMotor})
tools.set_polarity('inversed', motors=[tools.motors[OUTPUT_D]])
tools.run_to_abs_pos(position_sp=180, speed_sp=400, stop_action='hold')
tools.wait_until_not_moving(timeout=3000)
time.sleep(0.3)
print([motor.position for _, motor in sorted(tools.motors.items())])
