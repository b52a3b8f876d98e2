"""Any kind of motor may stand where the brick's own does."""

import inspect

import pytest
from duck_motors import kind_of
from rig import Rig, degrees

from robot.ev3.motor import Motor
from robot.ev3.motors import JointMotor
from robot.motion.arm_motors import ArmMotors
from robot.motion.control_loop import Stalled
from robot.motion.joint_controller import GAINS


def public(kind):
    """Names of what a class lets others do."""
    return {name for name in vars(kind) if not name.startswith("_") and name != "ATTRIBUTES"}


def test_the_interface_is_what_the_bricks_own_motors_have():
    assert public(Motor) | {"device"} == public(JointMotor)
    for name in public(Motor):
        ours, its = (list(inspect.signature(getattr(kind, name)).parameters) for kind in
                     (Motor, JointMotor))  # fmt: skip
        assert ours == its, name


def duck(rig, description, clock):
    """An ArmMotors of motors that derive from nothing."""
    kind = kind_of(Motor, rig.its(JointMotor))
    return rig.its(ArmMotors)(description, clock, GAINS, lambda line: None, kind=kind)


def test_an_arm_of_another_kind_of_motors_goes_where_it_is_told(tmp_path):
    rig = Rig(tmp_path)
    with rig.running():
        motors = duck(rig, rig.arm, rig.clock)
        rig.robot(motors=motors).go_to(degrees(30, 40))
    assert rig.q == pytest.approx(degrees(30, 40), abs=0.02)


def test_halt_stops_motors_of_another_kind(tmp_path):
    rig = Rig(tmp_path)
    with rig.running():
        motors = duck(rig, rig.arm, rig.clock)
        robot = rig.robot(motors=motors)
        rig.brick.jam("B")
        with pytest.raises(rig.its(Stalled)):
            robot.go_to(degrees(30, 90))
    for port in "AB":
        last = {name: text for _, at, name, text in rig.writes if at == port}
        assert (last["command"], last["stop_action"]) == ("stop", "hold"), port
