"""All that a program of one's own imports of BrickServo; loaded only when it is used.

    from robot.api import Clock, Driver, RobotArm, find_arm, read_arm

To import all of it would take the brick seconds.
"""

import importlib
import sys
import types

ROOMS = {
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
"""The names, by the modules where they live."""

__all__ = sorted(name for names in ROOMS.values() for name in names)


class _Api(types.ModuleType):
    def __getattr__(self, name):
        for room, names in ROOMS.items():
            if name in names:
                value = getattr(importlib.import_module(room), name)
                setattr(self, name, value)
                return value
        raise AttributeError("robot.api has no {}; it has {}".format(name, ", ".join(__all__)))

    def __dir__(self):
        return __all__


sys.modules[__name__].__class__ = _Api
