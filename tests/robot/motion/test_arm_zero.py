"""How long an arm believes its zero: not after a stall, a reset, nor another arm's moves."""

import contextlib
import functools

import pytest
from rig import degrees, far, switched_on

from robot.ev3.brick_lock import BrickInUse
from robot.motion.control_loop import Stalled
from robot.motion.trajectory import JointMove
from robot.motion.zero import NotHomed

MOVES = {
    "go_to": lambda robot: robot.go_to(degrees(0, 0)),
    "reach": lambda robot: robot.reach(degrees(0, 0)),
    "step_to": lambda robot: robot.step_to(degrees(0, 0)),
    "move_pen": lambda robot: robot.move_pen(0.5),
}
each_move = pytest.mark.parametrize("move", MOVES.values(), ids=MOVES)


@pytest.fixture
def rig(tmp_path):
    with switched_on(tmp_path) as rig:
        yield rig


def driven(rig):
    """How often a motor was told to turn, so far."""
    return sum(text.startswith("run") for _, _, _, text in rig.writes)


def refuses(rig, kind, act, *messages):
    """Return True if `act()` is refused as told, nothing being driven."""
    before, q = driven(rig), rig.q
    with pytest.raises(rig.its(kind)) as error:
        act()
    assert "\n" not in str(error.value)
    assert all(word in str(error.value) for word in messages), error.value
    return driven(rig) == before and far(rig.q, q) < 0.01


def stalled(rig):
    """A robot whose elbow was blocked on its way and is free again, all at rest."""
    robot = rig.robot()
    rig.world.at(0.3, lambda: rig.brick.jam("B"))
    with pytest.raises(rig.its(Stalled)):
        robot.go_to(degrees(0, 90))
    for drive in rig.brick.plant.drives.values():
        (drive.link or drive).jammed = False
    rig.world.sleep(1)
    return robot


@each_move
def test_after_a_stall_nothing_moves_and_the_stall_is_the_cause(rig, move):
    robot = stalled(rig)
    messages = (
        "the elbow (port B) does not turn",
        "since then the zero is in doubt",
        "home it first",
    )
    assert refuses(rig, NotHomed, lambda: move(robot), *messages)
    assert refuses(rig, NotHomed, robot.load_zero, *messages)
    robot.park()
    assert refuses(rig, NotHomed, robot.load_zero, *messages)


def test_homed_after_a_stall_it_moves_again(rig):
    robot = stalled(rig)
    robot.home(seek=True, say=str)
    robot.go_to(degrees(10, 20))
    assert far(rig.q, degrees(10, 20)) < 2.1
    robot.park()
    robot.load_zero()


@each_move
@pytest.mark.parametrize("parks", [True, False])
def test_a_reset_while_a_program_waits_is_noticed_before_anything_moves(rig, move, parks):
    """Another program, started from the brick's menu and ended there, resets all motors."""
    robot = rig.robot()
    robot.go_to(degrees(20, 30))
    robot.park()
    if not parks:
        robot = rig.robot()
    rig.brick.reset_motors()
    assert refuses(rig, NotHomed, lambda: move(robot), "motor A reads 0", "reset since", "home")
    assert refuses(rig, NotHomed, robot.load_zero, "motor A reads 0", "home")


@pytest.mark.parametrize("ends", ["well", "by an error"])
def test_once_motors_are_given_back_nothing_moves_without_a_zero(tmp_path, ends):
    """Homing and the check of the mounting borrow them before there is one."""
    with switched_on(tmp_path, homed=False) as rig:
        robot = rig.robot(awake=False)
        with contextlib.suppress(KeyError), robot.lend_motors(zero_needed=False):
            if ends == "by an error":
                raise KeyError
        move = rig.its(JointMove)([0.0], [0.5], [1.0])
        for motor in robot.joints:
            turn = functools.partial(robot.move_motor, motor, move)
            assert refuses(rig, NotHomed, turn, "not been homed", "home")


def test_an_arm_led_by_hand_is_no_reset(rig):
    first = rig.robot()
    first.go_to(degrees(20, 30))
    first.park()
    robot = rig.robot()
    for port in "AB":
        rig.brick.motors[port].write("stop_action", "coast")
        rig.brick.motors[port].write("command", "stop")
    for drive, angle in zip(rig.brick.plant.joints, degrees(0, 60)):
        drive.link.angle = angle
    rig.world.sleep(0.5)
    robot.go_to(degrees(10, 50))
    assert far(rig.q, degrees(10, 50)) < 2.1


@each_move
def test_while_one_arm_of_a_program_is_not_parked_no_other_one_moves(rig, move):
    first, second = rig.robot(), rig.robot()
    first.go_to(degrees(20, 30))
    rig.world.sleep(0.5)  # held, it may still turn by a hair
    messages = "another RobotArm of this program", "call its park()"
    assert refuses(rig, BrickInUse, lambda: move(second), *messages)
    assert refuses(rig, BrickInUse, second.load_zero, *messages)
    first.park()
    second.load_zero()
    second.go_to(degrees(10, 10))
    assert far(rig.q, degrees(10, 10)) < 2.1
    assert refuses(rig, BrickInUse, lambda: move(first), *messages)


def test_nor_in_the_midst_of_its_motion(rig):
    first, second = rig.robot(), rig.robot()
    with pytest.raises(rig.its(BrickInUse)):
        first.go_to(degrees(20, 30), on_tick=lambda t, q: second.go_to(degrees(-30, 0)))
    assert rig.brick.driven() == []
    assert far(rig.q, (0, 0)) < 2


def test_who_homes_anew_need_not_park_an_arm_that_is_forgotten(rig):
    rig.robot().go_to(degrees(20, 30))
    second = rig.robot(awake=False)
    second.home(seek=True, say=str)
    second.go_to(degrees(10, 10))
    assert far(rig.q, degrees(10, 10)) < 2.1


@each_move
def test_an_arm_whose_file_was_edited_since_is_told_so_before_it_moves(rig, move):
    shoulder, elbow = rig.arm.joints
    edited = rig.arm._replace(joints=(shoulder._replace(home=0.2), elbow))
    robot = rig.robot(awake=False)
    robot.zero = type(robot.zero)(edited, rig.state_folder)
    assert refuses(rig, NotHomed, lambda: move(robot), "its shoulder.home was", "home it first")
