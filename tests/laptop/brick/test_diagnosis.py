"""`doctor`: each line is fine or says what to do, by what is broken on purpose."""

import sys

import pytest

from laptop.brick import BrickProblem, diagnosis
from shared.arm_description import find_arm, read_arm

PLANAR = read_arm(find_arm("planar"))
NOW = 1.7e9
WELL = {
    "python": "3.5.3",
    "library": "2.1.0",
    "kernel": "4.14.117-ev3dev-2.3.5-ev3",
    "memory": 30.0,
    "load": 0.4,
    "cores": 1,
    "others": [],
    "room": 900.0,
    "battery": 7.6,
    "time": NOW + 4,
    "host": "ev3dev",
    "connection": "10.42.0.1 50000 10.42.0.3 22",
    "motors": {
        "A": {"kind": "large", "position": 3},
        "B": {"kind": "large", "position": -4},
        "C": {"kind": "medium", "position": 0},
    },
    "problem": None,
}


def advice(**changed):
    """What -> advice of each line that is not fine."""
    found = diagnosis.judge({**WELL, **changed}, PLANAR, NOW)
    return {one.what: one.advice for one in found if one.advice}


def test_a_brick_that_is_well_has_nothing_to_do():
    found = diagnosis.judge(WELL, PLANAR, NOW)
    assert [str(one) for one in found if not str(one).endswith(": fine")] == []
    assert "network   ev3dev, at 10.42.0.3 for 10.42.0.1: fine" in map(str, found)
    assert "port B    large motor at -4 counts, elbow: fine" in map(str, found)


@pytest.mark.parametrize(
    ("changed", "what", "words"),
    [
        ({"python": "3.4.2"}, "python", "older than 3.5"),
        ({"library": None}, "ev3dev2", "write the card anew"),
        ({"library": "2.0.0~beta5"}, "ev3dev2", "older than 2.1"),
        ({"memory": 3.0}, "memory", "end other programs"),
        ({"room": 1.0}, "card", "delete files of yours"),
        ({"load": 1.9, "others": [(7, "python3 x.py")]}, "load", "busy"),
        ({"battery": 6.2}, "battery", "charge it"),
        ({"battery": None}, "battery", "python-ev3dev2"),
        ({"time": 0.0}, "clock", "sudo date -s @1700000000"),
        ({"problem": "ImportError: No module named 'ev3dev2'"}, "motors", "python-ev3dev2"),
    ],
)
def test_what_is_not_well_says_what_to_do(changed, what, words):
    assert list(advice(**changed)) == [what]
    assert words in advice(**changed)[what]


def test_a_kernel_without_motors_is_no_bricks():
    assert "kernel" in advice(kernel="6.1.0-amd64", motors={})
    assert advice(kernel="6.1.0-amd64") == {}


def test_a_motor_that_is_missing_or_another_one_is_told_by_its_port():
    motors = {**WELL["motors"], "A": {"kind": "medium", "position": 0}}
    del motors["B"]
    assert advice(motors=motors) == {
        "port A": "the planar arm has a large motor there, its shoulder; plug that in there",
        "port B": "the planar arm has its elbow there, a large motor; look at the cable",
    }


def test_facts_of_another_program_are_refused():
    with pytest.raises(BrickProblem, match="library is not told; is it a brick of yours"):
        diagnosis.judge({"python": "3.5.3"}, PLANAR, NOW)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"python": 5}, "python is 5; it must be a text"),
        ({"time": 10**400}, "time is 1000.*; it must be a number from"),
        ({"memory": float("inf")}, "memory is inf; it must be"),
        ({"load": float("nan")}, "load is nan; it must be"),
        ({"cores": 0}, "cores is 0; it must be"),
        ({"room": True}, "room is True; it must be"),
        ({"battery": "8"}, "battery is '8'; it must be"),
        ({"others": [[1]]}, "others is of another kind; it must be a list of programs"),
        ({"others": 7}, "others is 7; it must be a list of programs"),
        ({"motors": {"A": {"kind": "large"}}}, "motors is of another kind"),
        ({"motors": {"A": {"kind": "large", "position": 1e300}}}, "motors is of another kind"),
        ({"motors": {str(k): {} for k in range(65)}}, "it must be a table of motors"),
    ],
)
def test_what_cannot_be_so_is_told(changed, words):
    with pytest.raises(BrickProblem, match=words):
        diagnosis.judge({**WELL, **changed}, PLANAR, NOW)


def test_what_a_brick_tells_makes_no_line_of_its_own():
    steer = "a\x1b[2K\rb\nport A: fine"
    reported = {**WELL, "host": steer, "kernel": f"ev3dev {steer}", "others": [[7, steer]]}
    found = [str(line) for line in diagnosis.judge(reported, PLANAR, NOW)]
    assert all(line.isprintable() for line in found)
    assert any("a [2K b port A: fine" in line for line in found)


def test_the_emulated_brick_is_told_of_over_ssh(ssh_brick):
    _, out, errors = ssh_brick.run("doctor")
    for line in (
        "ev3dev2   2.1.0.post1: fine",
        "battery   8.00 V: fine",
        "port A    large motor at 0 counts, shoulder: fine",
        "port C    medium motor at 0 counts, pen: fine",
    ):
        assert line in out.splitlines(), out + errors
    assert "none is there, " in out
    assert ssh_brick.python_starts == ["-"]


@pytest.mark.long
def test_motors_that_a_hand_turns_count(ssh_brick):
    # (What there is beside it, it looks at first: that takes the longer the more runs here.)
    ssh_brick.emulate("--fault", "push:A@20")
    status, out, _ = ssh_brick.run("doctor", "--motors")
    assert status == 1
    assert "port A    counts 19 by hand: fine" in out
    assert "port B    has not counted: if you have turned it, change its cable" in out


@pytest.mark.long
def test_a_cable_that_comes_off_by_hand_is_told(ssh_brick):
    ssh_brick.emulate("--fault", "unplug:A@12", "--fault", "push:B@15")
    status, out, _ = ssh_brick.run("doctor", "--motors")
    assert status == 1
    assert "port A    its motor came off meanwhile: push its cable in, and look again" in out
    assert "port B    counts 19 by hand: fine" in out


@pytest.mark.long
@pytest.mark.parametrize(
    ("library", "line"),
    [
        (None, "ev3dev2   there is no python-ev3dev2: write the card anew"),
        ("2.0.0", "ev3dev2   2.0.0: older than 2.1; write the card anew"),
    ],
)
def test_a_missing_or_old_library_is_named(ssh_brick, library, line):
    packages = ssh_brick.folder / "packages"
    if library:
        (packages / "ev3dev2").mkdir(parents=True)
        (packages / "ev3dev2" / "__init__.py").touch()
        (packages / "ev3dev2" / "version.py").write_text(f"__version__ = '{library}'\n")
    python = ssh_brick.folder / "bin" / "python3"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={packages} exec {sys.executable} -S "$@"\n')
    status, out, errors = ssh_brick.run("doctor")
    assert status == 1
    assert line in out, out + errors
    assert "motors    " in out


@pytest.mark.long
def test_a_computer_without_python_is_no_brick(ssh_brick):
    ssh_brick.take_python_away()
    status, _, errors = ssh_brick.run("doctor")
    assert status == 1
    assert "the brick cannot tell how it is: there is no python3; write the card anew" in errors
