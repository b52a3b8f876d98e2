"""The emulator's compiled modules: the same bytes as the sources, and of these sources alone."""

import ast
import importlib.util
import os
import shutil
import subprocess
import sys

import pytest
from places import ROOT, SCRIPTS

from laptop.emulator import compiled, compiling

BUILT = os.path.isdir(compiled.folder())
HINT = "uv run --group compiled python -m laptop.emulator.compiling"
needs_them = pytest.mark.skipif(not BUILT, reason="nothing is compiled here: " + HINT)
needs_mypyc = pytest.mark.skipif(
    importlib.util.find_spec("setuptools") is None
    or importlib.util.find_spec("mypyc") is None
    or shutil.which("cc") is None,
    reason="there is no mypyc or no C compiler here",
)


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """A copy of the sources that the compiled modules depend on."""
    for module in compiled.MODULES + compiled.READ:
        copy = tmp_path / compiled.path_of(module)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / compiled.path_of(module), copy)
    monkeypatch.setattr(compiled, "REPO_ROOT", str(tmp_path))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    monkeypatch.delenv("BRICKSERVO_PURE", raising=False)
    return tmp_path


def is_installed():
    """Whether imports would find compiled modules."""
    return any(isinstance(finder, compiled.CompiledFinder) for finder in sys.meta_path)


# Which are used


def test_without_a_folder_there_is_nothing_to_find(elsewhere):
    before = list(sys.meta_path)
    assert not compiled.install()
    assert sys.meta_path == before


def test_those_of_these_sources_are_found(elsewhere):
    os.makedirs(compiled.folder())
    assert compiled.install()
    spec = sys.meta_path[0].find_spec(compiled.MODULES[0])
    assert spec.origin.startswith(compiled.folder())
    assert spec.origin.endswith(compiled.SUFFIX)
    assert sys.meta_path[0].find_spec("laptop.emulator.device.brick") is None


@pytest.mark.parametrize("module", compiled.MODULES + compiled.READ)
def test_once_a_source_has_changed_they_are_not_found(elsewhere, module):
    os.makedirs(compiled.folder())
    with open(elsewhere / compiled.path_of(module), "a", encoding="utf-8") as file:
        file.write("\n")
    assert not compiled.install()


def test_another_python_or_place_has_its_own(elsewhere, monkeypatch):
    keys = {compiled.key()}
    with monkeypatch.context() as other:
        other.setattr(compiled, "SUFFIX", ".cpython-399-x86_64-linux-gnu.so")
        keys.add(compiled.key())
    shutil.copytree(elsewhere, elsewhere / "moved", ignore=shutil.ignore_patterns("moved"))
    monkeypatch.setattr(compiled, "REPO_ROOT", str(elsewhere / "moved"))
    keys.add(compiled.key())
    assert len(keys) == 3


def test_a_variable_switches_them_off(elsewhere, monkeypatch):
    os.makedirs(compiled.folder())
    monkeypatch.setenv("BRICKSERVO_PURE", "1")
    assert not compiled.install()


def ours(module):
    """The modules of the project that a module imports, for type checkers too."""
    source = (ROOT / compiled.path_of(module)).read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            names = [node.module + "." + alias.name for alias in node.names]
            for name in {node.module, *names}:
                if (ROOT / compiled.path_of(name)).exists():
                    yield name


@pytest.mark.parametrize("module", compiled.MODULES)
def test_all_that_they_import_counts(module):
    assert set(ours(module)) <= {*compiled.MODULES, *compiled.READ, "laptop.emulator"}


# How they are made


def test_without_mypyc_it_says_what_to_type(elsewhere, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mypyc.build", None)
    monkeypatch.setitem(sys.modules, "setuptools", None)
    assert compiling.main() == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("compiling: mypyc is not installed; ")
    assert err.count("\n") == 1
    assert HINT in err
    assert not os.path.isdir(compiled.folder())


def compiling_in(folder, **environment):
    """Run it on a copy of all sources, in a process of its own."""
    for name in ("laptop", "robot", "shared"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return subprocess.run(
        [sys.executable, "-m", "laptop.emulator.compiling"],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


@needs_mypyc
@pytest.mark.long
def test_without_a_c_compiler_it_says_so_and_leaves_nothing(tmp_path):
    done = compiling_in(tmp_path, CC="no-such-compiler", PYTHONPATH="")
    assert done.returncode == 1, done.stdout
    assert done.stderr.splitlines()[-1].startswith("compiling: no C compiler could make them")
    assert os.listdir(tmp_path / compiled.FOLDER) == []


@needs_mypyc
@pytest.mark.long
def test_it_compiles_once(tmp_path):
    done = compiling_in(tmp_path, PYTHONPATH="")
    assert done.returncode == 0, done.stderr
    (made,) = os.listdir(tmp_path / compiled.FOLDER)
    asked = "from laptop.emulator.device import plant; print(plant.__file__)"
    again = "import sys; from laptop.emulator import compiling; sys.exit(compiling.main())"
    for code, told in ((asked, compiled.SUFFIX), (again, "already")):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        assert told in done.stdout
        assert made in done.stdout


# What they compute

WHEELS = "--arm none --wheels left=A,right=D --plug C=medium:-90..40"
LINE = "driver.py line 15,0 0,15"
RUNS = {
    "planar": LINE,
    "geared": "--arm geared --plant seed=7 driver.py line 10,0 5,10",
    "spatial": "--arm spatial driver.py line 12,0,8 6,10,8",
    "lost": "--arm spatial --start lost driver.py home --here",
    "faults": "--fault stall:B@4 --fault unplug:A@7 " + LINE,
    "pushed": "--fault push:C@3 --fault dead-encoder:A@6 " + LINE,
    "led": "--hand 10,5@3_12,0@6 --press touch@4 driver.py touch --points 1",
    "seen": "--scene goal_x=9,goal_y=8 visual_servoing.py",
    "seen in space": "--arm spatial --scene seed=3 visual_servoing.py",
    "wheels": WHEELS + " SCRIPTS/move1_tank.py",
    "loop": "SCRIPTS/lab6_pd_loop.py",
}
"""Words of `simulate`, with _ for a blank within one."""


def left(folder, text, pure):
    """The status of a run, what it prints, and the files that it leaves: name -> bytes."""
    words = [word.replace("_", " ") if "@" in word else word for word in text.split()]
    words = [word.replace("SCRIPTS", str(SCRIPTS)) for word in words]
    words = [sys.executable, "-m", "laptop", "simulate", "--no-picture", "--out", "run", *words]
    own = {"BRICKSERVO_PURE": pure, "BRICKSERVO_STATE": "state", "PYTHONPATH": str(ROOT)}
    folder.mkdir()
    environment = {**os.environ, **own}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True)
    found = {path.name: path.read_bytes() for path in (folder / "run").glob("*")}
    found.update(out=done.stdout, err=done.stderr)
    place = str(folder).encode()
    return done.returncode, {name: data.replace(place, b"") for name, data in found.items()}


@needs_them
@pytest.mark.short("planar")
@pytest.mark.parametrize("name", RUNS)
def test_they_give_the_same_bytes(tmp_path, name):
    pure = left(tmp_path / "a", RUNS[name], "1")
    assert {"trace.csv", "run.json"} <= set(pure[1])
    assert left(tmp_path / "b", RUNS[name], "") == pure


@needs_them
def test_a_run_computes_by_them(tmp_path):
    asked = "from laptop.emulator import rig; from laptop.emulator.device import plant, tacho_motor"
    asked += "; print(plant.__file__, tacho_motor.__file__)"
    for pure, suffix in (("1", ".py"), ("", compiled.SUFFIX)):
        environment = {**os.environ, "BRICKSERVO_PURE": pure, "PYTHONPATH": str(ROOT)}
        told = subprocess.check_output(
            [sys.executable, "-c", asked], cwd=tmp_path, env=environment, universal_newlines=True
        )
        assert [file.endswith(suffix) for file in told.split()] == [True, True]
