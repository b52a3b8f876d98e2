"""On an old Python only the brick-side tests are collected: those of what runs on the brick.

They are found by what they import: `robot`, `shared` or `laptop.simulator`, and nothing else of
the laptop's. Read line by line, because an old Python cannot parse the others.
"""

import atexit
import gc
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

IMPORT = re.compile(r"^\s*(?:from|import)\s+([\w.]+)(?:\s+import\s+\(?(\w+))?", re.MULTILINE)
BRICK_SIDE = ("robot", "shared", "laptop.simulator")
LAPTOP_ONLY = tuple(
    "laptop.simulator." + name
    for name in ("optics", "scene", "sight", "synthetic_camera", "virtual_tracker")
) + ("servo_rig",)
LAPTOP_ONLY_FIXTURE = re.compile(r"^def test_\w+\([^)]*\bwatched\b", re.MULTILINE)
LAPTOP_SIDE = (
    "laptop",
    "click",
    "cv2",
    "hypothesis",
    "matplotlib",
    "numpy",
    "parso",
    "rich",
    "vermin",
)

# So that tests can share `rig`: pytest for an old Python knows no `tests.rig`.
sys.path.insert(0, str(Path(__file__).parent))


if sys.version_info >= (3, 8) and os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
    # Python is started a few hundred times: all would be compiled each time.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = tempfile.mkdtemp(prefix="brickservo-bytecode-")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    atexit.register(shutil.rmtree, sys.pycache_prefix, ignore_errors=True)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One more than there are cores: tests in real time, of the page above all, mostly wait."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_finish(session):
    """What is there now stays: it is not to be looked through for garbage again and again."""
    gc.collect()
    getattr(gc, "freeze", lambda: None)()  # Python 3.7
    gc.set_threshold(20000, 20, 20)


def is_brick_side(source):
    """Whether the text of a test module imports the brick's side and nothing of the laptop's."""

    def is_below(module, packages):
        return (module + ".").startswith(tuple(package + "." for package in packages))

    modules = [".".join(filter(None, names)) for names in IMPORT.findall(source)]
    brick_side = [module for module in modules if is_below(module, BRICK_SIDE)]
    laptop_side = [module for module in modules if is_below(module, LAPTOP_SIDE)]
    if any(is_below(module, LAPTOP_ONLY) for module in modules):
        return False
    if LAPTOP_ONLY_FIXTURE.search(source):
        return False
    return bool(brick_side) and set(laptop_side) <= set(brick_side)


collect_ignore = []
if sys.version_info < (3, 10):
    for path in sorted(Path(__file__).parent.glob("test_*.py")):
        if not is_brick_side(path.read_text(encoding="utf-8")):
            collect_ignore.append(path.name)


def pytest_report_header():
    """What was left out, so that a short run is not taken for the whole."""
    return "without the laptop's " + ", ".join(collect_ignore) if collect_ignore else None


@pytest.fixture
def watched(tmp_path, monkeypatch, capsys):
    """Makes arms that the real tracking server watches, see servo_rig.Watched; ends them."""
    from servo_rig import Watched  # not on an old Python: who asks for it is left out there

    made = []

    def build(**options):
        made.append(Watched(tmp_path, monkeypatch, capsys, **options))
        return made[-1]

    yield build
    for one in made:
        one.tracker.close()
