"""Two programs that want the same motors: the second is refused, and nothing of it moves.

The other program is a real process; what is refused runs as a whole program on an emulated brick.
"""

import pytest
from lock_holder import NAME, LockHolders
from places import ROBOT, ROOT
from refusals import in_one_line
from rig import Shell
from waiting import PATIENCE

MOVING = [
    ("line", "10,0", "5,10"),
    ("move", "12,6"),
    ("home", "--seek"),
    ("home", "--here"),
    (),
]


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    (tmp_path / "state").mkdir()
    monkeypatch.setenv("BRICKSERVO_LOCK", str(tmp_path / "motors"))
    return Shell(tmp_path / "state", monkeypatch, capsys)


@pytest.fixture
def other(tmp_path, shell):
    """Another program, which may move the shell's motors."""
    with LockHolders(tmp_path, tmp_path / "motors") as holders:
        yield holders.begin()


def stood(shell, before):
    """Whether nothing has moved, and what is on file is as before."""
    return not shell.busy and shell.writes == [] and shell.on_file() == before


@pytest.mark.short(every=5)
@pytest.mark.parametrize("args", MOVING, ids=lambda args: " ".join(args) or "nothing")
def test_the_second_says_who_may_move_and_moves_nothing(shell, other, args):
    before = shell.on_file()
    shown = shell.run(*args)
    assert shown.status == 1
    assert in_one_line(shown.err, "driver.py: " + NAME, str(other.pid), "running for", "--take")
    assert stood(shell, before)
    other.kill()
    other.wait(PATIENCE)
    assert shell.run(*args).status == 0


def test_what_moves_nothing_is_free_to_look(shell, other):
    before = shell.on_file()
    assert shell.run("where").status == 0
    assert shell.run("inverse", "10,0").status == 0
    assert stood(shell, before)


def test_where_an_arm_stands_that_another_program_moves_is_said_to_be_its(shell, other):
    """By the file alone, the last program would have ended without parking."""
    shell.state.save({"A": 0, "B": 0, "C": 0}, None)
    shown = shell.run("where")
    assert shown.status == 1
    assert in_one_line(shown.err, NAME, str(other.pid), "may be moving the motors")
    other.kill()
    other.wait(PATIENCE)
    assert in_one_line(shell.run("where").err, "without parking")


def test_an_order_that_makes_no_sense_takes_nothing_over(shell, other):
    for args in (("--take", "line", "10,0", "99,0"), ("--take", "fly"), ("--take", "where")):
        shell.run(*args)
    assert other.poll() is None


def test_the_death_of_a_program_frees_its_motors(shell):
    killed = shell.run("line", "10,0", "5,10", kill_at=3.0)
    assert killed.status == 137
    assert shell.motion(0) > 5
    shown = shell.run("home", "--here")
    assert (shown.status, shown.err) == (0, "")


OWN = """
import sys
sys.path.insert(0, {root!r})
from robot.api import Clock, RobotArm, find_arm, read_arm

arm = RobotArm(read_arm(find_arm("planar")), Clock())
arm.load_zero()
try:
    {moves}
finally:
    arm.park()
    print("the end")
"""


@pytest.mark.parametrize(
    "moves",
    [
        "arm.go_to([0.5, 0.5])",
        "arm.home(here=True)",
        "arm.step_to([0.1, 0.1])",
        "arm.move_pen(0.5)",
    ],
)
def test_a_script_of_ones_own_need_not_know(shell, other, tmp_path, moves):
    before = shell.on_file()
    script = tmp_path / "own.py"
    script.write_text(OWN.format(root=str(ROOT), moves=moves))
    outcome, out, err = shell.type(str(script))
    assert outcome.status == 1
    assert out == "the end\n"
    assert err.splitlines()[-1].startswith("robot.ev3.brick_lock.BrickInUse: " + NAME)
    assert stood(shell, before)
    other.kill()
    other.wait(PATIENCE)
    assert shell.type(str(script))[0].status == 0


def test_bench_and_servo_are_refused_likewise(shell, other, tmp_path):
    before = shell.on_file()
    for script, args in (
        ("bench_brick.py", ["planar", "--move", "--json", str(tmp_path / "brick.json")]),
        ("visual_servoing.py", ["127.0.0.1:9", "--code", "ABCDEFGHJKMN"]),
        ("visual_servoing.py", ["127.0.0.1:9", "--code", "ABCDEFGHJKMN", "--wait"]),
    ):
        outcome, _, err = shell.type(str(ROBOT / script), *args)
        assert outcome.status == 1
        assert in_one_line(err, script + ": " + NAME, str(other.pid), "--take")
    assert stood(shell, before)
