"""The gate before the brick: what it runs must be Python 3.5, in syntax and in library.

parso's grammar of 3.5 knows the syntax (also the comma after `*args`, which no other tool minds);
vermin knows which names of the standard library came later.
"""

import ast
import subprocess
import sys

import parso
import pytest
from places import ROOT

BRICK_SIDE = [ROOT / "laptop" / "__init__.py"]  # the emulator's package
for folder in ("robot", "shared", "laptop/emulator"):
    BRICK_SIDE += sorted((ROOT / folder).rglob("*.py"))
# What students write, and what asks them, runs on the brick.
BRICK_SIDE.append(ROOT / "laptop" / "course" / "call_functions.py")
BRICK_SIDE += sorted((ROOT / "laptop" / "course" / "solutions").glob("*.py"))
BRICK_SIDE += [
    path
    for path in sorted((ROOT / "laptop" / "examples").glob("*.py"))
    if "import brickservo" not in path.read_text("utf-8")
]
# These need OpenCV, or the laptop's side of the link, and so never see an old Python.
LAPTOP_SIDE = tuple(
    "laptop/emulator/" + name
    for name in (
        "scene/",
        "virtual_tracker.py",
        "rendered_tracker.py",
        "watching.py",
        "loopback.py",
    )
)
BRICK_SIDE = [
    path for path in BRICK_SIDE if not path.relative_to(ROOT).as_posix().startswith(LAPTOP_SIDE)
]

GRAMMAR = parso.load_grammar(version="3.5")


def syntax_errors(source):
    """What Python 3.5 would refuse to parse, one line of text each."""
    errors = GRAMMAR.iter_errors(GRAMMAR.parse(source))
    return [f"line {error.start_pos[0]}: {error.message}" for error in errors]


def as_run(source):
    """The source without what stands under `if MYPY:`, which type checkers alone read."""
    lines = source.splitlines(keepends=True)
    for node in reversed(ast.parse(source).body):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "MYPY":
            first, last = node.body[0].lineno, node.body[-1].end_lineno
            lines[first - 1 : last] = ["    pass\n"]
    return "".join(lines)


def later_features(paths, folder):
    """vermin's report of what came after 3.5, empty if nothing did; comments cannot silence it."""
    copies = []
    for path in paths:
        copies.append(folder / "as_run" / path.relative_to(path.anchor))
        copies[-1].parent.mkdir(parents=True, exist_ok=True)
        copies[-1].write_text(as_run(path.read_text(encoding="utf-8")), encoding="utf-8")
    options = ["-t=3.5-", "--violations", "--quiet", "--eval-annotations", "--pessimistic"]
    options += ["--no-config-file", "--no-parse-comments"]
    program = [sys.executable, "-c", "import vermin; vermin.main()"]
    run = subprocess.run([*program, *options, *map(str, copies)], capture_output=True, text=True)
    assert run.stderr == ""
    assert (run.returncode != 0) == bool(run.stdout.strip())
    return run.stdout.strip()


def is_of_the_emulator(path):
    """Whether a file never comes onto a brick: an old Python runs it in tests alone."""
    return path.relative_to(ROOT).parts[:2] == ("laptop", "emulator")


EACH_SIDE = pytest.mark.parametrize(
    "paths",
    [
        pytest.param([path for path in BRICK_SIDE if not is_of_the_emulator(path)], id="brick"),
        pytest.param(
            list(filter(is_of_the_emulator, BRICK_SIDE)), id="emulator", marks=pytest.mark.long
        ),
    ],
)


@EACH_SIDE
def test_brick_code_parses_under_the_grammar_of_3_5(paths):
    assert len(paths) > 50
    found = {path: syntax_errors(path.read_text(encoding="utf-8")) for path in paths}
    assert {str(path): errors for path, errors in found.items() if errors} == {}


@EACH_SIDE
def test_brick_code_uses_nothing_newer_than_3_5(paths, tmp_path):
    assert later_features(paths, tmp_path) == ""


@pytest.mark.parametrize(
    "source",
    [
        'f"{1}"\n',
        "million = 1_000_000\n",
        "x: int = 3\n",
        "def f(a, *args,):\n    pass\n",
        "def f(a, *, b,):\n    pass\n",
        "def f(a, **options,):\n    pass\n",
        "async def f():\n    yield 1\n",
        "async def f():\n    return [x async for x in y]\n",
        "if (n := 10) > 5:\n    pass\n",
        "def f(a, /):\n    pass\n",
        "with (open(a) as b, open(c) as d):\n    pass\n",
    ],
)
def test_newer_syntax_is_caught(source):
    assert syntax_errors(source)


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "source",
    [
        'f"{1}"\n',
        "from dataclasses import dataclass\n",
        "import time\ntime.monotonic_ns()\n",
        "import math\nmath.dist(p, q)\n",
        "import subprocess\nsubprocess.run([], capture_output=True)\n",
        "import secrets  # novermin\n",
        "def f(x: 'int | None', y: list[int]):\n    pass\n",
    ],
)
def test_newer_library_is_caught(source, tmp_path):
    path = tmp_path / "planted.py"
    path.write_text(source)
    assert later_features([path], tmp_path)


def test_what_type_checkers_alone_read_may_be_newer(tmp_path):
    types = "from typing import Protocol\n"
    path = tmp_path / "planted.py"
    path.write_text("MYPY = False\nif MYPY:\n    " + types)
    assert later_features([path], tmp_path) == ""
    path.write_text("MYPY = False\nif MYPY:\n    pass\nelse:\n    " + types)
    assert later_features([path], tmp_path)


def test_plain_3_5_passes(tmp_path):
    source = 'def f(a, *args):\n    return "{:.2f}".format(a, *args)\n'
    path = tmp_path / "plain.py"
    path.write_text(source)
    assert syntax_errors(source) == []
    assert later_features([path], tmp_path) == ""
