"""All that a program of one's own imports of BrickServo; loaded only when it is used.

    from robot.api import Clock, Driver, RobotArm, find_arm, read_arm

To import all of it would take the brick seconds. Editors and type checkers see no name before it is
used; for them the block under MYPY says where each comes from.
"""

import importlib
import sys
import types

MYPY = False  # which a type checker takes for true
if MYPY:
    from robot.clock import Clock as Clock
    from robot.drawing import Driver as Driver
    from robot.ev3.battery import Battery as Battery
    from robot.motion.arm import RobotArm as RobotArm
    from robot.motion.checked import NotChecked as NotChecked
    from robot.motion.control_loop import Stalled as Stalled
    from robot.motion.control_loop import TooSlow as TooSlow
    from robot.motion.kinematics import Unreachable as Unreachable
    from robot.motion.kinematics import forward as forward
    from robot.motion.kinematics import inverse as inverse
    from robot.motion.kinematics import jacobian as jacobian
    from robot.motion.online_trajectory import STOP as STOP
    from robot.motion.online_trajectory import Moving as Moving
    from robot.motion.zero import NotHomed as NotHomed
    from robot.servoing.loop import RunTerms as RunTerms
    from robot.servoing.loop import VisualServoing as VisualServoing
    from robot.servoing.report_servo import ReportServo as ReportServo
    from robot.servoing.rows import Rows as Rows
    from robot.servoing.run_reporter import RunReporter as RunReporter
    from robot.servoing.run_reporter import Verdict as Verdict
    from robot.servoing.runs import make_servo as make_servo
    from robot.servoing.servo import Servo as Servo
    from robot.servoing.stream import Stream as Stream
    from robot.tracker_address import find_tracker as find_tracker
    from robot.tracking import TrackingClient as TrackingClient
    from robot.turtle_graphics import Turtle as Turtle
    from shared.arm_description import ArmError as ArmError
    from shared.arm_description import find_arm as find_arm
    from shared.arm_description import read_arm as read_arm

MODULES = {
    "robot.clock": ("Clock",),
    "robot.ev3.battery": ("Battery",),
    "robot.drawing": ("Driver",),
    "robot.motion.arm": ("RobotArm",),
    "robot.motion.checked": ("NotChecked",),
    "robot.motion.control_loop": ("Stalled", "TooSlow"),
    "robot.motion.kinematics": ("Unreachable", "forward", "inverse", "jacobian"),
    "robot.motion.online_trajectory": ("STOP", "Moving"),
    "robot.motion.zero": ("NotHomed",),
    "robot.servoing.loop": ("RunTerms", "VisualServoing"),
    "robot.servoing.report_servo": ("ReportServo",),
    "robot.servoing.rows": ("Rows",),
    "robot.servoing.runs": ("make_servo",),
    "robot.servoing.servo": ("Servo",),
    "robot.servoing.stream": ("Stream",),
    "robot.servoing.run_reporter": ("RunReporter", "Verdict"),
    "robot.tracker_address": ("find_tracker",),
    "robot.tracking": ("TrackingClient",),
    "robot.turtle_graphics": ("Turtle",),
    "shared.arm_description": ("ArmError", "find_arm", "read_arm"),
}
"""Names by the modules that define them."""

__all__ = sorted(name for names in MODULES.values() for name in names)


class _Api(types.ModuleType):
    def __getattr__(self, name):
        # type: (str) -> object
        for room, names in MODULES.items():
            if name in names:
                value = getattr(importlib.import_module(room), name)
                setattr(self, name, value)
                return value
        raise AttributeError("robot.api has no {}; it has {}".format(name, ", ".join(__all__)))

    def __dir__(self):
        # type: () -> list[str]
        return __all__


sys.modules[__name__].__class__ = _Api
