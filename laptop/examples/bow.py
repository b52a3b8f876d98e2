"""Draw a smooth bow, and above it two lines that meet at a corner.

Try it with `brickservo simulate bow.py`, on the brick with `brickservo brick run bow.py`.
"""

from robot.api import Clock, Driver, RobotArm, find_arm, read_arm

bow = [(8 + k / 20, 3 + (k - 60) ** 2 / 900) for k in range(121)]
arm = RobotArm(read_arm(find_arm("planar")), Clock())
arm.load_zero()
try:
    Driver(arm).draw([bow, [(8, 9), (12, 9), (12, 10)]])
finally:
    arm.park()
