"""The brick itself, by python-ev3dev2, which is named nowhere else in robot.

In go ports ("A" .. "D", "in1" .. "in4"), joint angles (rad) and speeds (rad/s). Out come encoder
readings, battery voltage, presses of buttons and touch sensors. Begin with `motors`.

motors        JointMotor: radians at the joint <-> motor counts, and what stops a motor
motor         the interface of such a motor, for other kinds of motors
brick_lock    the right to move the motors, for one program at a time
battery       its voltage, and whether it is flat
buttons, touch_sensor   switches that a person presses
library       whether python-ev3dev2 is there, and where it finds motors
"""
