"""Bring the tip to a pixel by a law of one's own: the lab report's, its steps twice as large.

Try it with `brickservo simulate --scene "" bold_servo.py`,
on the brick with `brickservo brick run bold_servo.py`; there `brickservo track` runs on the laptop.
"""

from robot.api import Clock, ReportServo, RobotArm, RunTerms, TrackingClient, VisualServoing
from robot.api import find_arm, find_tracker, read_arm


class BoldServo(ReportServo):
    """The report's law; its steps are of 20, 10 and 4 degrees."""

    STEP_SIZES = tuple(2 * size for size in ReportServo.STEP_SIZES)


description, clock = read_arm(find_arm("planar")), Clock()
arm = RobotArm(description, clock)
arm.load_zero()
client = TrackingClient(*find_tracker(), clock=clock)
servo = BoldServo(description.joints, tolerance=5)
try:
    verdict = VisualServoing(arm, client, clock, servo, RunTerms({"A": (400, 200)})).run()
    print(verdict.word, verdict.error, verdict.moves)
finally:
    client.close()
    arm.park()
