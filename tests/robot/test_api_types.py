"""What editors and type checkers are told of what people import: where it lives, and what it takes.

The brick, and so an old Python, reads nothing of this.
"""

import ast
import inspect
import re
import subprocess
import sys

import pytest
from places import ROBOT, ROOT

from robot import api

try:
    import mypy
except ImportError:  # it is not among what tests need
    mypy = None

RIGHT = """\
from robot.api import Clock, RobotArm, RunTerms, TrackingClient, VisualServoing
from robot.api import find_arm, find_tracker, make_servo, read_arm

description, clock = read_arm(find_arm("planar")), Clock()
arm = RobotArm(description, clock)
client = TrackingClient(*find_tracker(), clock=clock)
servo, stream = make_servo(description, "chain", "look", tolerance=5)
terms = RunTerms({"A": (400, 200)})
verdict = VisualServoing(arm, client, clock, servo, terms, stream).run()
print(verdict.word.upper(), verdict.moves + 1)
"""

WRONG = {
    'RunTerms({"A": 400})': "incompatible type",
    "RunTerms(buget=3)": 'Unexpected keyword argument "buget"',
    'make_servo(description, "chain")': "Missing positional arguments",
    "verdict.word + 1": "Unsupported operand types",
    "client.polls()": 'has no attribute "polls"',
    'Rows("stereo", "2")': "incompatible type",
    "from robot.api import Drover": 'has no attribute "Drover"',
}
"""Lines of a program, and what mypy says of each."""


def names_for_checkers():
    """(module, name) of what api.py imports under MYPY, to hand it on."""
    (block,) = (
        node
        for node in ast.parse((ROBOT / "api.py").read_text(encoding="utf-8")).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "MYPY"
    )
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            assert alias.asname == alias.name  # else mypy does not hand it on
            yield node.module, alias.name


def test_a_type_checker_finds_every_name_where_it_lives():
    lives = {(room, name) for room, names in api.MODULES.items() for name in names}
    declared = list(names_for_checkers())
    assert set(declared) == lives
    assert len(declared) == len(lives)


@pytest.mark.parametrize("name", [name for name in api.__all__ if name != "STOP"])
def test_every_name_and_all_that_it_can_do_is_documented(name):
    value = getattr(api, name)
    assert inspect.getdoc(value)
    if inspect.isclass(value):
        for part, own in vars(value).items():
            if not part.startswith("_") and (callable(own) or isinstance(own, property)):
                assert inspect.getdoc(own), f"{name}.{part}"


@pytest.mark.parametrize("room", ["robot", "shared"])
def test_a_type_checker_believes_what_is_installed(room):
    assert (ROOT / room / "py.typed").read_bytes() == b""


@pytest.mark.long
@pytest.mark.skipif(mypy is None, reason="mypy is not installed; it comes with --group dev")
def test_mypy_finds_wrong_calls_and_no_others(tmp_path):
    lines = [*RIGHT.splitlines(), "from robot.api import Rows", *WRONG]
    (tmp_path / "mine.py").write_text("".join(f"{line}\n" for line in lines))
    argv = ["-m", "mypy", "--no-error-summary", "--hide-error-context", "--follow-imports=silent"]
    done = subprocess.run(
        [sys.executable, *argv, f"--cache-dir={tmp_path / 'cache'}", str(tmp_path / "mine.py")],
        cwd=str(ROOT),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    errors = re.findall(r"mine\.py:(\d+): error: (.*)", done.stdout.decode())
    assert [lines[int(number) - 1] for number, _ in errors] == [*WRONG], errors
    for (_, argv), wanted in zip(errors, WRONG.values()):
        assert wanted in argv
