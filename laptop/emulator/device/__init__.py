"""Devices on the brick: motors, sensors, screen and buttons, and the arm behind the encoders.

In go the description of an arm, the plant's constants, orders for sensors and buttons, and the
accesses of a script to files of sysfs.  Out come the texts of those files, and a record of the true
motion.  All of it runs on one world's clock, in s.  Begin with `brick`, which puts it together:

brick           the arm, its drivers and their sysfs; faults
stepping        the steps of its time: physics, drivers, record
tacho_motor     the motor driver: commands, states, speed regulation; `encoder` counts
motor_and_link  physics of one motor, its gear, backlash and link
plant           the arm of such drives, gravity, pen and paper; `wheels`: a rolling robot
sysfs           where python-ev3dev2's device files lead to emulated devices
peripherals     sensors, buttons, LEDs, battery, programs and screen
"""
