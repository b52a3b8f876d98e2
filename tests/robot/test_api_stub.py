"""The stub that editors read says what the code is.

The brick, and so an old Python, reads neither the stub nor these tests.
"""

import ast
import inspect
import subprocess
import sys

import pytest
from places import ROBOT, ROOT

from robot import api
from shared.record import Record

try:
    import mypy
except ImportError:  # it is not among what tests need
    mypy = None

TREE = ast.parse((ROBOT / "api.pyi").read_text(encoding="utf-8"))
ANYTHING = "..."
"""A default that the stub does not say."""


def decorators(node):
    return [ast.unparse(decorator) for decorator in node.decorator_list]


TOLD = {
    node.name: node
    for node in TREE.body
    if isinstance(node, (ast.FunctionDef, ast.ClassDef))
    and "type_check_only" not in decorators(node)
}


def told_parameters(function):
    """Name and default, as text, of each parameter but `self`."""
    names = [argument.arg for argument in function.args.args]
    defaults = [ast.unparse(default) for default in function.args.defaults]
    defaults = [None] * (len(names) - len(defaults)) + defaults
    assert function.args.kwonlyargs == []
    assert function.args.vararg is function.args.kwarg is None
    return [pair for pair in zip(names, defaults) if pair[0] != "self"]


def own_functions(owner):
    """The public functions and properties of a class, and its constructor."""
    for name, value in vars(owner).items():
        if isinstance(value, property):
            yield name, value.fget
        elif inspect.isfunction(value) and (name == "__init__" or not name.startswith("_")):
            yield name, value


def check_docstring(node, value):
    told = ast.get_docstring(node)
    assert told, f"{node.name} has no docstring in the stub"
    true = inspect.getdoc(value).splitlines()[0]
    assert true.startswith(told.rstrip(".")), (node.name, true)


def check_function(node, value):
    true = [p for name, p in inspect.signature(value).parameters.items() if name != "self"]
    told = told_parameters(node)
    assert [name for name, _ in told] == [p.name for p in true], node.name
    for (name, default), parameter in zip(told, true):
        if default is None or parameter.default is parameter.empty:
            assert (default is None) == (parameter.default is parameter.empty), (node.name, name)
        elif default != ANYTHING and not default.startswith("_"):
            assert ast.literal_eval(default) == parameter.default, (node.name, name)
    if node.name != "__init__":
        check_docstring(node, value)


def test_the_stub_has_all_names_and_no_others():
    (told,) = (
        ast.literal_eval(node.value)
        for node in TREE.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    assert told == api.__all__
    assert set(TOLD) | {"STOP"} == set(api.__all__)


@pytest.mark.parametrize("name", [name for name in api.__all__ if name != "STOP"])
def test_a_name_is_as_the_code_has_it(name):
    node, value = TOLD[name], getattr(api, name)
    if isinstance(node, ast.FunctionDef):
        check_function(node, value)
        return
    check_docstring(node, value)
    if issubclass(value, Record):
        assert [part.target.id for part in node.body if isinstance(part, ast.AnnAssign)] == list(
            value._fields
        )
        return
    told = {part.name: part for part in node.body if isinstance(part, ast.FunctionDef)}
    true = dict(own_functions(value))
    assert set(told) == set(true), name
    for part in told:
        check_function(told[part], true[part])


@pytest.mark.long
@pytest.mark.skipif(mypy is None, reason="mypy is not installed; it comes with --group dev")
def test_the_stub_stands_before_a_type_checker(tmp_path):
    """By mypy's own comparison of a stub with what Python has loaded."""
    allowed = tmp_path / "allowed"
    # A record has no `__replace__`, and calls its own class another name.
    allowed.write_text(r"robot\.api\.(Moving|Verdict)\.(__new__|__replace__|_make)" + "\n")
    words = ["-m", "mypy.stubtest", "robot.api", "--allowlist", str(allowed)]
    done = subprocess.run(
        [sys.executable, *words, "--ignore-unused-allowlist"],
        cwd=str(ROOT),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout.decode()
