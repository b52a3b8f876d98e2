"""On an old Python only the brick-side tests are collected: those of what runs on the brick.

They are found by what they import: `robot`, `shared` or `laptop.emulator`, and nothing else of
the laptop's. Read line by line, because an old Python cannot parse the others.
"""

import collections
import gc
import os
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

import pytest

IMPORT = re.compile(
    r"^[ \t]*(?:from|import)[ \t]+([\w.]+)(?:[ \t]+import[ \t]+\(?(\w+))?", re.MULTILINE
)
BRICK_SIDE = ("robot", "shared", "laptop.emulator")
LAPTOP_ONLY = (
    "laptop.emulator.loopback",
    "laptop.emulator.scene",
    "laptop.emulator.virtual_tracker",
    "laptop.emulator.watching",
    "servo_rig",
    "page_scene",
    "tests.claims",
)
LAPTOP_ONLY_FIXTURE = re.compile(r"^def test_\w+\([^)]*\bwatched\b", re.MULTILINE)
LAPTOP_SIDE = (
    "laptop",
    "click",
    "cv2",
    "hypothesis",
    "matplotlib",
    "mypy",
    "numpy",
    "parso",
    "rich",
    "vermin",
)

SHORT = "not long"
"""Which tests pyproject.toml asks for."""

LONG = "long and not claims"
"""All others but those that measure."""

MEMORY = "/dev/shm"
"""Where Linux has files that are on no disk."""

# So that tests can share what helps them: pytest for an old Python knows no `tests.helpers`.
sys.path.insert(0, str(Path(__file__).parent / "helpers"))

import duck_motors  # noqa: E402  only now it is found
import stacks  # noqa: E402


def pytest_addoption(parser):
    """Offer another kind of motor, and fewer cases."""
    parser.addoption(
        "--motors",
        choices=("own", "duck"),
        default="own",
        help="duck: whatever moves an arm does so by motors of a kind that derives from nothing",
    )
    parser.addoption(
        "--first-cases",
        action="store_true",
        help="of each short test its first case alone, as for another Python",
    )


def is_by_name(config):
    """Whether single tests are asked for."""
    return any("::" in arg for arg in config.args)


def has_room(folder):
    """Whether a folder is there and takes a gigabyte."""
    return os.access(folder, os.W_OK) and shutil.disk_usage(folder).free > 1e9


def bytecode(config):
    """The folder for bytecode in pytest's cache, which lasts from run to run; None without one."""
    return Path(str(config.cache.mkdir("bytecode"))) if hasattr(config, "cache") else None


def pytest_configure(config):
    """Which tests are run, and where temporary files and bytecode are.

    Every run of the emulated brick makes some fifty small files, which on a disk take a fifth of
    its time. And where Python is told to write no bytecode, it is kept with pytest's cache all the
    same: all asserts are rewritten and Python is started a hundred times, and most of the time of a
    run would go into compiling what has not changed.
    """
    if config.option.markexpr == SHORT and is_by_name(config):
        config.option.markexpr = ""  # a test that is asked for by its name is run
    if "TMPDIR" not in os.environ and has_room(MEMORY):
        os.environ["TMPDIR"] = MEMORY
        tempfile.tempdir = None  # what it was before
    # Tests are collected with the arms that come along: whoever has calibrated one has a `planar`.
    os.environ["BRICKSERVO_STATE"] = os.path.join(tempfile.gettempdir(), "brickservo-tests-state")
    os.environ.setdefault(
        "OPENBLAS_NUM_THREADS", "1"
    )  # as the commands do, see laptop/cli/start.py
    stacks.install()
    if config.option.motors == "duck":
        duck_motors.install()
    folder = bytecode(config)
    if folder and sys.version_info >= (3, 8) and os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
        sys.dont_write_bytecode = False
        sys.pycache_prefix = os.environ["PYTHONPYCACHEPREFIX"] = str(folder)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """A worker for each core, and one more: some tests wait for a process, an ssh or a browser."""
    return (os.cpu_count() or 1) + 1


def is_short(item):
    """Whether everybody runs it."""
    return item.get_closest_marker("long") is None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Long: what short leaves out of a test's cases, what needs a browser or sshd, or measures."""
    cases = collections.defaultdict(list)
    for item in items:
        cases[item.nodeid.split("[")[0]].append(item)
        if "browser" in item.fixturenames:
            item.add_marker("browser")
        if {"browser", "ssh_brick"} & set(item.fixturenames):
            item.add_marker("long")
    for test, of_test in cases.items():
        mark = of_test[0].get_closest_marker("short")
        if not mark or is_by_name(config):
            continue
        if mark.args:
            short = {test + "[" + case + "]" for case in mark.args}
        else:
            short = {item.nodeid for item in of_test[:: mark.kwargs["every"]]}
        left_out = [item for item in of_test if item.nodeid not in short]
        if len(of_test) - len(left_out) != len(short):
            of_test[0].runtest = lambda: pytest.fail("`short` names what is no case", False)
            left_out = of_test[1:]
        for item in left_out:
            item.add_marker(mark.kwargs.get("rest", "long"))
    for item in items:
        if item.get_closest_marker("claims"):
            item.add_marker("long")
    if config.option.first_cases:
        firsts = {test: next(filter(is_short, of_test), None) for test, of_test in cases.items()}
        config.hook.pytest_deselected(items=[item for item in items if item not in firsts.values()])
        items[:] = filter(None, firsts.values())


def all_compiled(session):
    """The file that tells that all tests have been compiled once; None if not all are asked for."""
    folder = bytecode(session.config)
    everything = session.config.args == session.config.getini("testpaths")
    return folder / "complete" if folder and everything else None


def pytest_collection(session):
    """In the first run of all one worker compiles, and the others wait for what it has written."""
    done = all_compiled(session)
    deadline = time.monotonic() + 100  # the first may have died
    if done and os.environ.get("PYTEST_XDIST_WORKER", "gw0") != "gw0":
        while not done.exists() and time.monotonic() < deadline:
            time.sleep(0.1)


def pytest_collection_finish(session):
    """What is there now stays: it is not to be looked through for garbage again and again."""
    done = all_compiled(session)
    if done:
        done.touch()
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
    for path in sorted(Path(__file__).parent.rglob("test_*.py")):
        if not is_brick_side(path.read_text(encoding="utf-8")):
            collect_ignore.append(str(path.relative_to(Path(__file__).parent)))


def pytest_report_header():
    """What was left out, so that a short run is not taken for the whole."""
    return "without the laptop's " + ", ".join(collect_ignore) if collect_ignore else None


def pytest_terminal_summary(terminalreporter, config):
    """The same of the long tests, at the end, where one looks."""
    if config.option.markexpr == SHORT:
        terminalreporter.write_line('without the long tests (all: pytest -m "long or not long")')
    elif config.option.markexpr == LONG:
        terminalreporter.write_line("without what measures (that: pytest -m claims)")


@pytest.fixture(scope="session", autouse=True)
def nothing_of_the_user(tmp_path_factory):
    """No test looks at, or writes, what whoever runs it keeps in a home."""
    os.environ["BRICKSERVO_STATE"] = str(tmp_path_factory.mktemp("state"))
    for name in ("BRICKSERVO_ARM", "BRICKSERVO_PLAN", "UV_RUN_RECURSION_DEPTH"):
        os.environ.pop(name, None)


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
