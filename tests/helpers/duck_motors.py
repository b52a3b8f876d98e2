"""Motors of a kind that derives from nothing: they have what `robot.ev3.motor.Motor` names.

`pytest --motors=duck` runs all that moves an arm with them; what they lack would show.
"""

import importlib.machinery


def kind_of(motor, inner):
    """A class that has what the interface `motor` names, and does it by an `inner` one."""

    class DuckMotor:
        __slots__ = ("_inner",)

        def __init__(self, *args):
            self._inner = inner(*args)

    def method(name):
        return lambda self, *args: getattr(self._inner, name)(*args)

    for name in vars(motor):
        if not name.startswith("_") and name != "ATTRIBUTES":
            setattr(DuckMotor, name, method(name))
    for name in motor.ATTRIBUTES:
        setattr(DuckMotor, name, property(
            lambda self, name=name: getattr(self._inner, name),
            lambda self, value, name=name: setattr(self._inner, name, value),
        ))  # fmt: skip
    return DuckMotor


def install():
    """From now on, whoever imports the motors of an arm gets them of this kind."""
    loader = importlib.machinery.SourceFileLoader
    execute = loader.exec_module

    def exec_module(self, module):
        execute(self, module)
        if module.__name__ == "robot.motion.arm_motors":
            from robot.ev3.motor import Motor

            kind = kind_of(Motor, module.JointMotor)
            module.ArmMotors.__init__.__defaults__ = (kind,)

    loader.exec_module = exec_module
