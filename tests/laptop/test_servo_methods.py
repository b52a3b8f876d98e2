"""A method of servoing stands in one table, and each door has it."""

import re
import subprocess
import sys

import pytest
from places import ROOT

from laptop.bench import servo_scenarios
from laptop.record.report import method as report_method
from laptop.record.run import SERVO
from robot import servoing_commands
from robot.servoing.rows import Rows
from robot.servoing.runs import make_servo
from shared.arm_description import find_arm, read_arm
from shared.messages import Start
from shared.run_options import METHODS, MODES, SERVO_METHODS, InvalidRunOptions, check_options

ONE_MORE = """
import sys, types
from shared import run_options
law = sys.modules["my_law"] = types.ModuleType("my_law")
law.make = lambda method, arm, tolerance, rows, seed: (method, tolerance)
run_options.SERVO_METHODS += (
    run_options.ServoMethod("mine", "my_law:make", False, "by heart", "", "It knows J by heart."),
)
run_options.METHODS = tuple(method.name for method in run_options.SERVO_METHODS)

from laptop.bench.servo_scenarios import methods_of
from laptop.record.report import method
from robot.servoing.runs import make_servo
from robot.servoing_commands import _parser
from shared.arm_description import find_arm, read_arm
from shared.messages import Start

assert make_servo(read_arm(find_arm("planar")), "mine", "look", 5.0)[0] == ("mine", 5.0)
run_options.check_options(Start("mine", run_options.usual_mode("mine")), 2)
assert _parser().parse_args(["--method", "mine"]).method == "mine"
assert "mine" in methods_of("nominal")
method.formula = lambda tex: tex
*_, step = method.method([], ["servo"], ["mine"])
assert (step.title, step.text) == ("Step (method mine)", "It knows J by heart.")
try:
    from laptop.page.cards.drive import CHOICE_HELP
except ImportError:  # the page is not installed
    pass
else:
    assert "mine: by heart" in CHOICE_HELP[0]
"""
"""A program that registers a method, and finds it behind each door."""


@pytest.mark.parametrize("method", SERVO_METHODS, ids=METHODS)
def test_each_door_has_the_method(method, monkeypatch):
    name = method.name
    assert servoing_commands._parser().parse_args(["--method", name]).method == name
    assert name in servo_scenarios.METHODS
    monkeypatch.setattr(report_method, "formula", lambda tex: tex)
    told = list(report_method.method([], [SERVO], [name]))[1:]
    assert any(f"(method {name})" in step.title for step in told)
    assert set(method.paragraphs.split()) <= set(report_method.PARAGRAPHS)
    assert method.help
    page = ROOT / "laptop" / "docs" / "how-to" / "go-to-a-goal.md"
    assert re.search(rf"^\|.*`--method`.*`{name}`", page.read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("arm", ["planar", "spatial"])
@pytest.mark.parametrize("method", SERVO_METHODS, ids=METHODS)
def test_each_method_makes_its_servo(method, arm, mode):
    options = Start(method=method.name, mode=mode)
    if mode == "stream" and not method.streams:
        with pytest.raises(InvalidRunOptions, match="looks, then moves"):
            check_options(options, 2)
    else:
        check_options(options, 2)
    servo, stream = make_servo(read_arm(find_arm(arm)), method.name, mode, 5.0)
    assert isinstance(servo.rows, Rows)
    assert (stream is not None) == (mode == "stream" and method.streams)


def test_one_more_takes_a_line_of_the_table():
    subprocess.run([sys.executable, "-c", ONE_MORE], cwd=ROOT, check=True)
