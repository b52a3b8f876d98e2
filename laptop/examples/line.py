"""Draw a straight line from (10, 0) to (5, 10), in cm from the shoulder's axis.

Try it with `brickservo simulate line.py`, on the brick with `brickservo brick run line.py`.
"""

from robot.api import Clock, Driver, RobotArm, find_arm, read_arm

arm = RobotArm(read_arm(find_arm("planar")), Clock())
arm.load_zero()  # believes the remembered zero, or raises NotHomed
try:
    Driver(arm).draw_line((10, 0), (5, 10))  # method="steps" for the Jacobian steps
finally:
    arm.park()  # stops every motor; arm.park(low=True) lets an arm in space go low first
