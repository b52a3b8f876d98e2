"""Who may import whom, and what the checkout may hold.

laptop.cli -> laptop.bench -> laptop.measure.demo -> laptop.emulator -> laptop.see.serve -> laptop.see.markers
laptop.cli -> laptop.page -> laptop.see.serve; whoever tells of a run -> laptop.record.figures
laptop.cli -> laptop.brick -> shared
laptop.cli, laptop.bench -> laptop.see.table -> laptop.see.serve, robot.motion.kinematics
laptop.cli, laptop.bench -> laptop.measure -> laptop.see.serve, laptop.emulator
laptop.cli, laptop.bench -> laptop.measure.accuracy -> laptop.measure, laptop.see.table
laptop.cli, laptop.bench -> laptop.measure.ilc -> laptop.measure, laptop.drawing
laptop.cli -> laptop.course -> laptop.emulator, laptop.brick
laptop.cli -> laptop.record.report -> what laptop.measure.demo has found
laptop.cli -> laptop.drawing -> what is pure of robot.motion
laptop.bench, laptop.measure.demo, laptop.course, laptop.emulator -> robot; all of them -> shared
"""

import ast
import importlib.util
import re
import subprocess
import sys

import pytest
from places import ROOT

PACKAGES = ("robot", "shared", "laptop")
TOP_LEVEL = {
    *(*PACKAGES, "tests", ".ci", "README.md", "pyproject.toml", "LICENSE"),
    *(".gitattributes", ".gitignore"),
}

# What a module may import besides the standard library; the longest matching name decides. A name
# covers everything below it.
LIBRARIES = ("numpy", "cv2", "matplotlib", "rich")
BELOW_EMULATOR = (
    "laptop.system.platforms",
    "laptop.see.serve",
    "laptop.see.markers",
    "laptop.record.figures",
)
PURE = tuple(f"robot.motion.{name}" for name in ("chains", "kinematics", "paths", "trajectory"))
SIGHT_PURE = ("backlash", "gravity", "kinematics", "trajectory")
FOR_THE_CARDS = "laptop.drawing.durations", "laptop.drawing.pictures"
RULES = {
    "shared": ("shared",),
    "robot": ("robot", "shared", "ev3dev2.motor"),
    "laptop.see.markers": (
        *("laptop.see.markers", "laptop.system.files", "laptop.system.picture_heads", "shared"),
        *("numpy", "cv2", "matplotlib"),
    ),
    "laptop.see.serve": (
        *(
            "laptop.system.files",
            "laptop.system.platforms",
            "laptop.see.serve",
            "laptop.see.markers",
            "shared",
        ),
        *("numpy", "cv2", "ifaddr", "rich"),
    ),
    "laptop.see.serve.joint_track": ("robot.motion.kinematics", "shared"),
    "laptop.see.table": (
        *("laptop.see.table", "laptop.see.markers", "laptop.see.serve", "shared", "numpy", "cv2"),
        *("laptop.system.files", "robot.motion.kinematics"),
    ),
    "laptop.measure": (
        *("laptop.measure", "laptop.see.serve", "laptop.emulator", "laptop.system.platforms"),
        *("laptop.see.markers", "shared", "numpy"),
    ),
    "laptop.measure.arm": (
        *("laptop.measure.arm", "laptop.see.table", "laptop.measure", "laptop.see.markers"),
        "laptop.emulator.scene",
        *("robot.motion.gravity", "robot.motion.kinematics", "shared", "numpy", "scipy", "cv2"),
    ),
    "laptop.measure.accuracy": (
        *("laptop.measure.accuracy", "laptop.measure", "laptop.see.table"),
        *("laptop.drawing.reach", "laptop.see.serve.joint_track", *PURE, "shared", "numpy"),
    ),
    "laptop.measure.accuracy.plots": (
        "laptop.measure.accuracy",
        "laptop.record.figures",
        "numpy",
        "matplotlib",
    ),
    "laptop.measure.ilc": (
        *(
            "laptop.measure.ilc",
            "laptop.measure.measured_run",
            "laptop.drawing",
            "laptop.system.files",
        ),
        *("shared", "numpy"),
        *("robot.jobs.learned", *(f"robot.motion.{name}" for name in SIGHT_PURE)),
    ),
    "laptop.measure.ilc.still_table": (
        *("laptop.measure.measured_run", "laptop.see.table.camera_fit", "numpy"),
        *("laptop.see.table.camera_report", "laptop.see.markers.finders.board"),
    ),
    "laptop.measure.ilc.emulated_view": (
        *("laptop.measure.ilc.view", "laptop.see.table.camera_model", "shared", "numpy", "cv2"),
        "laptop.emulator.scene.scene",
    ),
    "laptop.record.figures": (
        "laptop.record.figures",
        "shared",
        "jinja2",
        "markupsafe",
        *LIBRARIES,
    ),
    "laptop.page": (
        *(
            "laptop.page",
            "laptop.drawing",
            "laptop.system.picture_heads",
            *BELOW_EMULATOR,
            "shared",
        ),
        *("robot.motion.kinematics", "robot.motion.paths", "robot.motion.trajectory"),
        *("numpy", "cv2", "matplotlib"),
    ),
    **{  # only these import what the page is made with, and only the server what serves it
        f"laptop.page.{name}": ("laptop.page", "laptop.see.serve.pipeline", "shared", *libraries)
        for name, libraries in (
            ("browser", ("nicegui",)),
            ("cards", ("nicegui", "laptop.record.figures.document", *FOR_THE_CARDS)),
            ("server", ("nicegui", "fastapi", "uvicorn")),
            ("http_limits", ("uvicorn",)),
            ("stop_gate", ("uvicorn",)),
        )
    },
    "laptop.drawing": (
        *("laptop.drawing", "laptop.system.files", "laptop.system.picture_heads", *PURE, "shared"),
        *("numpy", "cv2"),
    ),
    "laptop.drawing.glyphs": ("laptop.drawing.accents", "HersheyFonts", "numpy"),
    "laptop.drawing.line_drawings": ("laptop.drawing.pixel_walks", "numpy", "cv2", "skimage"),
    "laptop.drawing.areas": ("laptop.drawing", "numpy", "shapely"),
    **{
        f"laptop.drawing.{name}": ("laptop.drawing", "numpy", *libraries)
        for name, libraries in (
            ("svg", ("shapely",)),
            ("svg_clips", ("shapely",)),
            ("svg_css", ("cssselect2", "tinycss2")),
            ("svg_paint", ("tinycss2",)),
            ("svg_path", ("fontTools",)),
            ("svg_text", ("fontTools", "matplotlib", "uharfbuzz")),
            ("svg_tree", ("shapely",)),
        )
    },
    "laptop.drawing.picture_files": (
        *(
            "laptop.drawing",
            "laptop.system.picture_heads",
            "laptop.see.camera.frames",
            "numpy",
            "cv2",
        ),
    ),
    "laptop.drawing.timing": (
        *("laptop.drawing", *PURE, "shared", "numpy"),
        *(f"robot.motion.{name}" for name in ("backlash", "gravity", "motor_model", "parking")),
    ),
    **{
        f"laptop.drawing.{name}": (
            *("laptop.drawing", "laptop.record.figures", "shared", "numpy", "cv2", "matplotlib"),
        )
        for name in ("preview_png",)
    },
    "laptop.system.files": ("shared",),
    "laptop.system.picture_heads": ("shared",),
    "laptop.brick": (
        "laptop.brick",
        "laptop.system.files",
        "laptop.system.platforms",
        "shared",
        "asyncssh",
    ),
    "laptop.brick.finding": ("laptop.brick", "asyncssh", "ifaddr", "zeroconf"),
    "laptop.emulator": ("laptop.emulator", "laptop.system.platforms", "robot", "shared", "ev3dev2"),
    "laptop.emulator.scene": (
        *(
            "laptop.emulator",
            "laptop.see.camera.frames",
            "laptop.see.table.board",
            "robot",
            "shared",
        ),
        *("numpy", "cv2"),
    ),
    "laptop.emulator.virtual_tracker": (
        *("laptop.emulator", "laptop.see.serve.server", "robot", "shared"),
    ),
    "laptop.emulator.scene.rendered_tracker": (
        *("laptop.emulator", "laptop.see.markers.markers", "laptop.see.markers.tracker"),
    ),
    "laptop.measure.demo": (
        "laptop.measure.demo",
        "laptop.emulator",
        *BELOW_EMULATOR,
        "shared",
        *LIBRARIES,
    ),
    "laptop.course": (
        *(
            "laptop.course",
            "laptop.brick",
            "laptop.system.files",
            "laptop.emulator",
            "laptop.record.figures",
        ),
        *("robot", "shared"),
        *("numpy", "matplotlib", "jinja2", "markupsafe"),
    ),
    "laptop.course.examiner": (),
    "laptop.record.report": (
        *(
            "laptop.system.files",
            "laptop.record.report",
            "laptop.record.servo.demo_report",
            "laptop.record.servo.results",
        ),
        *("laptop.record.figures", "shared", "numpy", "cv2", "matplotlib", "markupsafe"),
    ),
    "laptop.record.report.print_pdf": ("laptop.system.platforms", "shared"),
    # What students write imports what they may import.
    **{f"laptop.course.{room}": ("robot.api", "ev3dev2.motor") for room in ("tasks", "solutions")},
    "laptop.bench": (
        *("laptop.bench", "laptop.measure.demo", "laptop.emulator", "laptop.see.table"),
        *(*BELOW_EMULATOR, "robot", "shared", *LIBRARIES),
    ),
    "laptop.bench.workers": ("laptop.bench", "shared", "cv2", "distributed"),
    **{
        f"laptop.bench.{name}": (
            *("laptop.bench", "laptop.drawing", "laptop.record.figures", "laptop.emulator"),
            *("robot", "shared", "numpy"),
        )
        for name in ("plot", "plot_speed", "interruptions")
    },
    "laptop.bench.calibrate": (
        *("laptop.bench", "laptop.measure.arm", "laptop.measure", "laptop.record.figures"),
        *("laptop.emulator", "robot", "shared", "numpy"),
    ),
    "laptop.bench.accuracy": (
        *("laptop.bench", "laptop.measure.accuracy", "laptop.see.table", "laptop.measure"),
        *("laptop.see.markers.finders.board", "robot.motion.kinematics", "shared", "numpy"),
    ),
    "laptop.bench.sight": (
        *("laptop.bench", "laptop.drawing", "laptop.measure", "laptop.record.figures"),
        *("laptop.measure.ilc", "laptop.emulator", "shared", "numpy"),
    ),
    "laptop.bench.plot_drawings": ("laptop.drawing.artwork", "numpy"),
    "laptop.bench.page": (
        *("laptop.bench", "laptop.measure.demo", "laptop.emulator", *BELOW_EMULATOR),
        *("robot", "shared", *LIBRARIES, "playwright"),
    ),
    "laptop.cli": ("laptop", "shared", "click", "rich"),
    "laptop.__main__": ("laptop.cli", "shared.state"),
    "laptop": (),
}
# The brick imports these only where they are used: each costs it a second at the start.
LAZY = {"robot": ("ev3dev2.power", "ev3dev2.button", "ev3dev2.sensor.lego")}
# Time is an argument: only here is it read.
CLOCK = "robot.clock"


def is_below(module, packages):
    """Return True if `module` is one of `packages` or inside one."""
    return any(module == package or module.startswith(package + ".") for package in packages)


def is_module(name):
    """Return True if a dotted name is a module here (and not a function or class in one)."""
    if name.split(".")[0] in PACKAGES:
        path = ROOT.joinpath(*name.split("."))
        return path.is_dir() or path.with_suffix(".py").is_file()
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def imports(module, source):
    """Each import as (line, dotted module name, whether it is inside a function).

    `from package import name` gives package.name where that is a module.
    """

    def walk(node, lazy):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                for alias in child.names:
                    yield child.lineno, alias.name, lazy
            elif isinstance(child, ast.ImportFrom):
                base = child.module or ""
                if child.level:  # relative to the package that holds `module`
                    parent = module.split(".")[: -child.level]
                    base = ".".join([*parent, *filter(None, [base])])
                for alias in child.names:
                    inner = base + "." + alias.name
                    yield child.lineno, inner if is_module(inner) else base, lazy
            else:
                function = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
                yield from walk(child, lazy or function)

    return walk(ast.parse(source), False)


def violations(module, source):
    """The imports of `module` (its dotted name) that break a rule, one line of text each."""
    allowed = RULES[max((name for name in RULES if is_below(module, [name])), key=len)]
    lazily = LAZY.get(module.split(".")[0], ())
    found = []
    for line, name, lazy in imports(module, source):
        standard = name.split(".")[0] in sys.stdlib_module_names
        if name == "time" and is_below(module, ["robot"]) and module != CLOCK:
            found.append(f"{module}:{line} imports time; take the clock as an argument")
        elif is_below(name, lazily):
            if not lazy:
                found.append(f"{module}:{line} imports {name} at the top, not where it is used")
        elif not (standard or is_below(name, allowed)):
            found.append(f"{module}:{line} imports {name}; allowed: {', '.join(allowed)}")
    return found


def dotted(path):
    """The module's name: robot/motion/arm.py -> robot.motion.arm, robot/__init__.py -> robot."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def test_imports_follow_the_direction():
    found = {}
    for path in SOURCES:
        # A package's name is its __init__'s too: relative imports start one level deeper.
        module = dotted(path) + (".__init__" if path.name == "__init__.py" else "")
        found[module] = violations(module, path.read_text(encoding="utf-8"))
    assert {module: wrong for module, wrong in found.items() if wrong} == {}


@pytest.mark.parametrize(
    ("module", "source", "name"),
    [
        ("shared.link", "import robot", "robot"),
        ("shared.link", "import ev3dev2.motor", "ev3dev2.motor"),
        (
            "robot.motion.arm",
            "from laptop.emulator.host import world",
            "laptop.emulator.host.world",
        ),
        ("robot.motion.arm", "import numpy", "numpy"),
        ("robot.motion.arm", "def f():\n    import numpy as np", "numpy"),
        ("robot.motion.arm", "import time", "time"),
        ("robot.motion.arm", "def f():\n    from time import sleep", "time"),
        ("robot.motion.arm", "import ev3dev2.power", "ev3dev2.power"),
        ("robot.motion.arm", "from ev3dev2 import button", "ev3dev2.button"),
        ("robot.motion.arm", "from ev3dev2 import sound", "ev3dev2.sound"),
        ("robot.motion.arm", "if 1:\n    from ev3dev2.button import Button", "ev3dev2.button"),
        ("laptop.see.markers.tracker", "import robot.motion.kinematics", "robot.motion.kinematics"),
        ("laptop.see.markers.tracker", "from .. import emulator", "laptop.emulator"),
        (
            "laptop.see.markers.tracker",
            "from ..emulator.host.world import World",
            "laptop.emulator.host.world",
        ),
        ("laptop.see.markers.tracker", "from laptop import bench", "laptop.bench"),
        ("laptop.see.markers.tracker", "import requests", "requests"),
        ("laptop.see.markers.tracker", "import click", "click"),
        ("laptop.see.serve.track", "from laptop.page import process", "laptop.page.process"),
        ("laptop.see.serve.setup", "from ..emulator import live", "laptop.emulator.live"),
        ("laptop.see.serve.server", "import robot.clock", "robot.clock"),
        (
            "laptop.see.markers.tracker",
            "from laptop.see.serve import server",
            "laptop.see.serve.server",
        ),
        ("laptop.page.controller", "from laptop.emulator import live", "laptop.emulator.live"),
        ("laptop.brick.choosing", "from laptop.see.serve import server", "laptop.see.serve.server"),
        ("laptop.see.table.camera_fit", "from laptop.cli import main", "laptop.cli.main"),
        ("laptop.see.markers.tracker", "from laptop import calibration", "laptop.see.table"),
        ("laptop.see.serve.track", "from laptop.brick import choosing", "laptop.brick.choosing"),
        ("laptop.drawing.svg", "from laptop.see.markers import frames", "laptop.see.camera.frames"),
        ("laptop.drawing.cards", "from robot.motion import arm", "robot.motion.arm"),
        ("laptop.drawing.sources", "import click", "click"),
        ("laptop.drawing.preview", "import matplotlib", "matplotlib"),
        ("laptop.drawing.planning", "from robot.motion import backlash", "robot.motion.backlash"),
        ("laptop.cli.brick", "import asyncssh", "asyncssh"),
        (
            "laptop.page.controller",
            "from laptop.measure.demo import results",
            "laptop.record.servo.results",
        ),
        (
            "laptop.record.figures.charts",
            "import laptop.see.markers.view",
            "laptop.see.markers.view",
        ),
        ("laptop.measure.demo", "from laptop.page import process", "laptop.page.process"),
        ("laptop.page.rpc", "from nicegui import ui", "nicegui.ui"),
        ("laptop.page.cards.drive", "import fastapi", "fastapi"),
        ("laptop.measure.demo", "from laptop.cli import main", "laptop.cli.main"),
        ("laptop.bench.draw", "from laptop.cli import main", "laptop.cli.main"),
        ("laptop.cli.simulate", "from robot.driver import Driver", "robot.driver"),
        ("laptop.cli.simulate", "import numpy", "numpy"),
        ("laptop.__main__", "from laptop import demo", "laptop.measure.demo"),
        ("laptop.measure.demo", "import laptop.bench.draw", "laptop.bench.draw"),
        ("laptop.emulator.session", "import laptop.course.lego", "laptop.course.lego"),
        ("laptop.course.solutions.line", "import robot.motion.arm", "robot.motion.arm"),
        (
            "laptop.emulator.host.world",
            "from laptop.see.markers.tracker import find",
            "laptop.see.markers.tracker",
        ),
        ("laptop.emulator.host.world", "from ... import bench", "laptop.bench"),
        (
            "laptop.emulator.host.world",
            "import laptop.see.serve.server",
            "laptop.see.serve.server",
        ),
        (
            "laptop.emulator.virtual_tracker",
            "from laptop.see.serve import track",
            "laptop.see.serve.track",
        ),
        ("laptop.emulator.host.world", "import cv2", "cv2"),
        ("laptop.emulator.__init__", "from ..bench import NAMES", "laptop.bench"),
    ],
)
def test_a_forbidden_import_is_caught(module, source, name):
    (found,) = violations(module, source)
    assert f" imports {name}" in found


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("shared.link", "import socket"),
        ("robot.motion.motors", "from ev3dev2.motor import LargeMotor"),
        ("robot.driver", "def f():\n    from ev3dev2.button import Button"),
        ("robot.clock", "import time"),
        ("laptop.see.markers.tracker", "import cv2, numpy\nfrom shared import messages"),
        ("laptop.measure.demo", "from laptop.emulator.host.world import World"),
        ("laptop.drawing.cards", "import cv2\nfrom robot.motion.kinematics import forward"),
        ("laptop.cli.bench", "import click\nfrom laptop import bench, emulator"),
        ("laptop.emulator.__init__", "from .host.world import World"),
        (
            "laptop.emulator.virtual_tracker",
            "from laptop.see.serve.server import TrackingServer",
        ),
        ("laptop.emulator.host.runner", "import ev3dev2.sound, robot.motion.arm, time"),
        ("laptop.bench.draw", "import numpy\nfrom robot import arm\nfrom laptop import emulator"),
    ],
)
def test_an_allowed_import_passes(module, source):
    assert violations(module, source) == []


def test_our_environment_variables_are_named_in_one_place():
    found = set()
    for path in SOURCES:
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "BRICKSERVO_" in source else ():
            if isinstance(node, ast.Constant) and re.fullmatch(r"BRICKSERVO_\w+", str(node.value)):
                found.add(dotted(path))
    assert found == {"shared.state"}


def test_the_checkout_holds_only_the_agreed_entries():
    try:
        listed = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    assert {name.split("/")[0] for name in listed.splitlines()} <= TOP_LEVEL
