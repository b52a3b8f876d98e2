"""What is said of an error that ended a script: each cause has its own sentence, or none."""

import importlib
import os
import subprocess
import sys

import pytest
from places import ROOT

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.host import advice
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World


@pytest.fixture
def run(tmp_path, capsys):
    """Run source text on a bare brick: (status, lines on stdout, what simulate says of it)."""

    def run(source):
        script = tmp_path / "mine.py"
        script.write_text(source)
        brick = EmulatedBrick(World(), None, extra={"A": "large"})
        status = run_script(brick, str(script)).status
        out, err = capsys.readouterr()
        reported = [line for line in err.splitlines() if line.startswith("simulate: ")]
        return status, out.splitlines(), reported

    return run


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("from pybricks.hubs import EV3Brick", "this script is for Pybricks, another firmware"),
        ("#!/usr/bin/env pybricks-micropython\nimport media", "this script is for Pybricks"),
        ("from spike import Motor", "spike is for another brick of LEGO's"),
        ("import serial", "serial is on a brick's card, but this computer has none for the "
         "emulated brick: install pyserial for the Python that runs simulate; what it talks to"),
        ("import rpyc", "rpyc is on a brick's card, but this computer has none for the emulated "
         "brick: install rpyc for the Python that runs simulate"),
        ("from ev3dev2.motor import LargeMotor\nLargeMotor('outB')",
         "plugged in: outA lego-ev3-l-motor, in1"),
        ("open('/sys/class/tacho-motor/motor0/position')", "in /sys/class/tacho-motor there is "
         "motor9; a device has another number after each plugging: look for its address"),
        ("open('/sys/class/dc-motor/motor0/command')", "in /sys/class/dc-motor there is nothing: "
         "see --plug"),
    ],
)  # fmt: skip
def test_the_cause_is_said_in_one_sentence(run, monkeypatch, source, message):
    for name in ("serial", "rpyc"):
        monkeypatch.setitem(sys.modules, name, None)
    status, _, reported = run(source)
    assert status == 1
    assert [line[: len("simulate: " + message)] for line in reported] == ["simulate: " + message]


@pytest.mark.parametrize(
    "source",
    [
        "import tyme",
        "import ev3dev3",
        "from ev3dev2 import motors",
        "from ev3dev2.motor import Motors",
        "import robot.motor",
        "import serial.nowhere",
        "open('/sys/class/tacho-motor/motor9/pos')",
        "open('/nowhere')",
        "raise ModuleNotFoundError",
        "try: import pybricks\nexcept ImportError: raise SystemExit(1)",
    ],
)
def test_of_other_errors_nothing_is_said(run, monkeypatch, source):
    monkeypatch.setitem(sys.modules, "serial", type(sys)("serial"))
    status, _, reported = run(source)
    assert (status, reported) == (1, [])


def test_the_older_library_is_named_where_it_is_not_installed(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "ev3dev", None)
    assert run("from ev3dev.ev3 import *")[2] == ["simulate: " + advice.OLDER]


@pytest.mark.skipif(sys.version_info < (3, 10), reason="it is told by sys.stdlib_module_names")
def test_what_only_this_computer_has_is_said_and_imported(run, tmp_path, monkeypatch):
    status, out, reported = run("import numpy, json, ev3dev2.motor\nprint(numpy.sqrt(4.0) == 2)\n")
    assert (status, out) == (0, ["True"])
    assert reported == [
        "simulate: mine.py imports numpy, which this computer has and a brick has not: there the "
        "import fails"
    ]
    (tmp_path / "click.py").write_text("")
    assert run("import click, PIL, helper_that_is_nowhere\n")[2] == []


@pytest.mark.parametrize("package", [False, True], ids=["file", "folder"])
@pytest.mark.parametrize("name", ["robot", "shared", "laptop"])
def test_a_module_of_ones_own_comes_before_one_of_ours(run, tmp_path, name, package):
    place = tmp_path / name / "__init__.py" if package else tmp_path / (name + ".py")
    place.parent.mkdir(exist_ok=True)
    place.write_text("MINE = 5\n")
    source = (
        f"import {name}, time\nfrom ev3dev2.motor import LargeMotor\nfrom ev3dev2.sound import "
        f"Sound\nLargeMotor('outA').on_for_degrees(50, 90)\nSound().beep()\nprint({name}.MINE)\n"
    )
    assert run(source) == (0, ["5"], [])
    assert __import__(name).__file__.startswith(str(ROOT))


def test_the_emulator_goes_on_beside_a_laptop_of_ones_own(tmp_path, capsys):
    (tmp_path / "laptop.py").write_text("")
    (tmp_path / "mine.py").write_text("import laptop, time\ntime.sleep(1)\n")
    brick, found = EmulatedBrick(World(), None), []
    name = "laptop.emulator.host.world"
    brick.world.at(0.5, lambda: found.append(importlib.import_module(name)))
    assert run_script(brick, str(tmp_path / "mine.py")).status == 0
    assert found == [sys.modules[name]]


@pytest.mark.parametrize("name", ["robot", "shared", "laptop"])
def test_a_module_of_ours_that_ones_own_hides_is_named(run, tmp_path, name):
    (tmp_path / (name + ".py")).write_text("")
    assert run(f"import {name}.motion\n")[2] == [
        f"simulate: {name}.py beside the script is what it imports as {name}, as on a brick, and "
        f"so BrickServo's own {name} is hidden: give yours another name, or leave {name}.motion out"
    ]


@pytest.mark.skipif(sys.version_info < (3, 10), reason="the laptop's commands need Python 3.10")
@pytest.mark.parametrize("name", ["robot", "shared", "time"])
def test_the_folder_that_one_is_in_hides_nothing_from_the_laptops_commands(tmp_path, name):
    (tmp_path / (name + ".py")).write_text("print('mine')\n")
    process = subprocess.Popen(
        [sys.executable, "-m", "laptop", "simulate", "--help"],
        cwd=str(tmp_path),
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    out, errors = process.communicate()
    assert (process.returncode, errors) == (0, b"")
    assert b"mine" not in out
