"""Bring the tip to where camera A sees the pixel (400, 200).

Try it with `brickservo simulate --scene "" servo.py`,
on the brick with `brickservo brick run servo.py`; there `brickservo track` runs on the laptop.
"""

from robot.api import Clock, RobotArm, RunTerms, TrackingClient, VisualServoing
from robot.api import find_arm, find_tracker, make_servo, read_arm

description, clock = read_arm(find_arm("planar")), Clock()
arm = RobotArm(description, clock)
arm.load_zero()
client = TrackingClient(*find_tracker(), clock=clock)
servo, stream = make_servo(description, "chain", "look", tolerance=5)
try:
    verdict = VisualServoing(arm, client, clock, servo, RunTerms({"A": (400, 200)})).run()
    print(verdict.word, verdict.error, verdict.moves)
finally:
    client.close()
    arm.park()
