"""What a program computes is counted in it: the same on every Python, and nothing else changes."""

import glob
import sys

import pytest
from places import ROOT

from laptop.emulator.host import counting
from laptop.emulator.host.instruction_costs import CALLS, COSTS, imports

P = COSTS


def counted(source, monkeypatch, names=()):
    """The namespace of a counted module after its run, and what it asked for."""
    import builtins

    reported = []

    def enrol(space, length, asked):
        space["_count_"] = 0
        space["_spend_"] = lambda price: space.__setitem__("_count_", space["_count_"] + price)
        space["_load_"] = lambda asked: reported.append((0, asked))
        reported.append((length, asked))

    monkeypatch.setattr(builtins, counting.ENROL, enrol, raising=False)
    space = {"__name__": "script", **dict(names)}
    exec(counting.compiled(source.encode(), "script.py"), space)
    return space, reported


BEHAVIOURS = """
import math
from collections import namedtuple
"docstring" "is none"
Point = namedtuple("Point", "x y")
class Base(object):
    "A docstring."
    table = [k * k for k in range(3)]
    pairs = {k: v for k, v in zip("ab", (1, 2))}
    def __init__(self, x=1, *rest, **more):
        self.x, self.rest, self.more = x, rest, more
    @property
    def double(self):
        "Another."
        return 2 * self.x
    @staticmethod
    def twice(f, *a):
        return f(*a), f(*a)
def gen(n):
    for k in range(n):
        got = yield k
        if got:
            return
def closure():
    total = 0
    def add(k):
        nonlocal total
        total += k
        return total
    return [add(k) for k in range(4)], total
def leaves(x):
    for k in range(5):
        if k == x:
            break
        elif k > 3:
            continue
        try:
            1 / (x - k - 1)
        except ZeroDivisionError as error:
            return type(error).__name__
        else:
            x += 0
        finally:
            x += 0
    else:
        return "none"
    while x:
        x -= 1
        if x == 2:
            return "two"
    return "end"
def nested(M):
    rows = [list(map(float, row)) for row in M]
    return [[a * b for a, b in zip(r, r)] for r in [list(r) for r in rows] if sum(c for c in r)]
def shadow(_x):
    lam = lambda a, b=3: [a + k for k in range(b) if k] if b else (lambda: a)()
    return lam(1), lam(2, 0), sorted([3, 1, 2], key=lambda v: -v)
def scoped():
    x = [1, 2]
    x[0] += 5
    x, (y, *z) = 3, x
    del x
    with open(__import__("os").devnull) as f:
        w = f.read()
    return y, z, w, {k for k in "aba"}, [i for i in range(3) for _ in range(i)], "%d" % 3
p = Point(1, 2)
def late():
    from os import path
    import math as m
    return path.sep, m.floor(1.5)
RESULT = [
    Base.table, Base.pairs, Base(4, 5, z=6).double, Base.twice(len, "ab"), list(gen(3)), closure(),
    [leaves(k) for k in range(7)], nested([[1, 2], [0, 0], [3, -4]]), shadow(0), scoped(), p,
    p._replace(x=3), late(),
    (1 if p.x else 2) + (p.y and 3), 0 < p.x < 2 <= p.y, math.hypot(3, 4), gen.__doc__,
    Base.__doc__, Base.double.__doc__, __doc__ if "__doc__" in globals() else None,
]
"""


def test_counted_code_does_what_the_plain_does(monkeypatch):
    plain = {"__name__": "script"}
    exec(compile(BEHAVIOURS, "script.py", "exec"), plain)
    assert repr(counted(BEHAVIOURS, monkeypatch)[0]["RESULT"]) == repr(plain["RESULT"])


@pytest.mark.parametrize("folder", ["robot", "shared"])
def test_all_of_the_brick_s_code_can_be_counted(folder):
    files = glob.glob(str(ROOT / folder / "*.py"))
    assert len(files) > 5
    for file in files:
        with open(file, "rb") as source:
            counting.compiled(source.read(), file)


def spent(source, call, monkeypatch):
    """What one call costs."""
    space, _ = counted(source, monkeypatch)
    before = space["_count_"]
    space["f"](*call)
    return space["_count_"] - before


def test_each_turn_of_a_loop_counts(monkeypatch):
    source = "def f(n):\n    for k in range(n):\n        k + 1.0\n"
    turn = P["turn"] + P["store"] + P["local"] + P["constant"] + P["add"] + P["pop"]
    at_once = P["function"] + P["loop"] + P["call"] + P["argument"] + P["local"] + P["builtin"]
    at_once += CALLS["range"]
    assert spent(source, (0,), monkeypatch) == at_once
    assert spent(source, (7,), monkeypatch) == at_once + 7 * turn


@pytest.mark.parametrize(
    "loop",
    [
        "[x * x for x in a if x > y]",
        "list(x * x for x in a if x > y)",
        "{x: x * x for x in a if x > y}",
    ],
)  # fmt: skip
def test_each_element_of_a_comprehension_counts_that_is_not_left_out(loop, monkeypatch):
    source = f"def f(a, y):\n    return {loop}\n"
    cases = ((0, 0), (3, 2), (3, 0), (6, 0))
    costs = [spent(source, ([1.0] * n, y), monkeypatch) for n, y in cases]
    left_out, taken = (costs[1] - costs[0]) / 3, (costs[2] - costs[0]) / 3
    assert 0 < left_out < taken
    assert costs[3] == costs[0] + 6 * taken


def test_a_branch_counts_only_if_it_is_taken(monkeypatch):
    source = "def f(x):\n    if x is None:\n        return x + x\n    y = x * x * x\n    return y\n"
    both = P["function"] + P["local"] + P["constant"] + P["is"] + P["branch"] + P["return"]
    assert spent(source.replace("x + x", "x"), (None,), monkeypatch) == both + P["local"]
    long_way = both + 3 * P["local"] + 2 * P["add"] + P["store"] + P["local"]
    assert spent(source, (1.0,), monkeypatch) == long_way


def test_what_comes_after_an_error_does_not_count(monkeypatch):
    source = "def f(x):\n    try:\n        x.y\n        {}\n"
    source += "    except AttributeError:\n        return 1\n"
    caught = spent(source.format("pass"), (1,), monkeypatch)
    assert caught == sum(
        P[part] for part in ("function", "try", "attribute", "local", "pop", "handler", "global")
    ) - P["global"] + P["builtin"] + P["return"] + P["constant"]  # fmt: skip


def test_a_lambda_counts_where_it_is_called(monkeypatch):
    source = "g = lambda x: x * x\ndef f(n):\n    return [g(1.5) for _ in range(n)]\n"
    costs = [spent(source, (n,), monkeypatch) for n in (0, 1, 2)]
    assert costs[2] - costs[1] == costs[1] - costs[0] > P["function"] + P["add"]


def test_calls_cost_by_their_names_however_they_were_imported(monkeypatch):
    base = "def f():\n    return {}(1.0)\n"
    cosine = {
        spent("import math\n" + base.format("math.cos"), (), monkeypatch) - P["module attribute"],
        spent("import math as m\n" + base.format("m.cos"), (), monkeypatch) - P["module attribute"],
        spent("from math import cos\n" + base.format("cos"), (), monkeypatch),
        spent("from math import cos as c\n" + base.format("c"), (), monkeypatch),
    }
    assert len(cosine) == 1
    plain = spent("def g(x):\n    return x\n" + base.format("g"), (), monkeypatch)
    called = P["function"] + P["return"] + P["local"]
    assert cosine.pop() - CALLS["math.cos"] == plain - called


def test_a_module_tells_what_it_imports_and_how_long_it_is(monkeypatch):
    source = "import json\nfrom os import path\ndef f():\n    import argparse\n"
    source += "import ev3dev2.motor as m\n"
    motor = type(sys)("ev3dev2.motor")
    package = type(sys)("ev3dev2")
    package.motor = motor
    monkeypatch.setitem(sys.modules, "ev3dev2", package)
    monkeypatch.setitem(sys.modules, "ev3dev2.motor", motor)
    assert counted(source, monkeypatch)[1] == [(len(source), ["ev3dev2", "json"])]


def test_what_type_checkers_alone_read_is_loaded_and_not_run(monkeypatch):
    plain = "import json\n\nMYPY = False\nif MYPY:\n    pass\n\n\n"
    plain += "def f(a):\n    return a\n\n\nB = f(1)\n"
    typed = plain.replace(
        "    pass\n", "    import argparse\n\n    from typing import List\n\n    Bs = List[int]\n"
    ).replace("f(a):\n", "f(a):\n    # type: (Bs) -> Bs\n")
    typed = typed.replace("B = f(1)", "B = f(1)  # type: Bs")
    counts = []
    for source in (plain, typed):
        space, reported = counted(source, monkeypatch)
        counts.append((space["_count_"], reported))
    (plain_count, [(plain_length, asked)]), (typed_count, [(typed_length, also)]) = counts
    assert plain_count == typed_count
    assert asked == also == ["json"]
    names = "import argparse\n\nfrom typing import List\n\nBs = List[int]\n"
    assert typed_length - plain_length == len(names) - len("pass\n")


def test_imports_are_known_with_all_that_they_bring():
    table = imports()
    for name, (price, others) in table.items():
        assert price > 0
        assert set(others) <= set(table), name


def test_what_is_of_the_future_stays_first(monkeypatch):
    source = '"A docstring."\nfrom __future__ import division\nHALF = 1 / 2\n'
    space, _ = counted(source, monkeypatch)
    assert (space["__doc__"], space["HALF"]) == ("A docstring.", 0.5)
