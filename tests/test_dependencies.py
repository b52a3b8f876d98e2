"""What is installed here is what pyproject.toml says, to the version, so that all have the same."""

import re
import runpy
from importlib.metadata import distributions

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from places import ROOT

try:
    import tomllib
except ImportError:  # Python 3.10, where pytest brings it
    import tomli as tomllib

TEXT = (ROOT / "pyproject.toml").read_text("utf-8")
PROJECT = tomllib.loads(TEXT)
CONSTRAINTS = [Requirement(text) for text in PROJECT["tool"]["uv"]["constraint-dependencies"]]
GROUPS = PROJECT["dependency-groups"]


def test_every_constraint_is_a_version_and_no_address():
    for constraint in CONSTRAINTS:
        assert re.fullmatch(r"==[^*,]+", str(constraint.specifier)), constraint
        assert constraint.url is None


def test_an_installed_tool_is_held_to_the_same():
    told = (ROOT / "laptop" / "constraints.txt").read_text("utf-8")
    assert told.splitlines() == PROJECT["tool"]["uv"]["constraint-dependencies"]


def test_the_command_that_writes_them_replaces_these_alone():
    command = runpy.run_path(str(ROOT / ".ci" / "constrain.py"))
    versions = PROJECT["tool"]["uv"]["constraint-dependencies"]
    bare = command["constrained"](TEXT, [])
    assert tomllib.loads(bare)["tool"]["uv"]["constraint-dependencies"] == []
    assert command["constrained"](bare, versions) == TEXT
    assert all(command["EXACT"].fullmatch(version) for version in versions)
    for other in ("numpy", "numpy>=2", "numpy @ file:///tmp/numpy", "--index-url https://x.y"):
        assert not command["EXACT"].fullmatch(other)


@pytest.mark.parametrize("room", ["programs", *GROUPS])
def test_every_range_admits_the_version_that_it_is_held_to(room):
    ranges = PROJECT["project"]["dependencies"] if room == "programs" else GROUPS[room]
    for asked in (Requirement(text) for text in ranges if isinstance(text, str)):
        held = [one for one in CONSTRAINTS if one.name == canonicalize_name(asked.name)]
        assert held, f"{asked} is not held; run .ci/constrain.py"
        for one in held:
            (exactly,) = one.specifier
            assert exactly.version in asked.specifier


def test_what_is_installed_here_is_what_it_is_held_to():
    here = {canonicalize_name(one.name): one.version for one in distributions()}
    for constraint in CONSTRAINTS:
        if constraint.name in here and (constraint.marker is None or constraint.marker.evaluate()):
            assert here[constraint.name] in constraint.specifier, constraint


def test_the_version_is_the_one_that_the_programs_tell():
    told = runpy.run_path(str(ROOT / "shared" / "version.py"))["VERSION"]
    assert PROJECT["project"]["version"] == told


def test_the_first_command_installs_no_developers_tool():
    """Nor does anything come unasked that only tests need."""
    assert PROJECT["tool"]["uv"]["default-groups"] == []
    programs = {Requirement(text).name for text in PROJECT["project"]["dependencies"]}
    tools = {
        Requirement(text).name for texts in GROUPS.values() for text in texts if type(text) is str
    }
    assert not programs & tools
