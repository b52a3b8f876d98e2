"""Who may import whom, and what the checkout may hold.

The rooms and their floors are contracts of import-linter in pyproject.toml.  Here stands which
library each room may use.
"""

import ast
import re
import subprocess
import sys

import grimp
import importlinter.cli
import pytest
from places import ROOT

PACKAGES = ("robot", "shared", "laptop")
TOP_LEVEL = {
    *(*PACKAGES, "tests", ".ci", "README.md", "pyproject.toml", "LICENSE"),
    *("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", ".gitattributes", ".gitignore"),
    ".pre-commit-config.yaml",
}

# The libraries that a module may import; the longest matching name decides, and covers all below.
PICTURES = {"numpy", "cv2"}
LIBRARIES = {
    "shared": set(),
    "robot": set(),
    "robot.doctor": {"ev3dev2"},  # it stands for itself, on bricks without the rest
    "robot.ev3": {"ev3dev2"},
    "laptop": set(),
    "laptop.system": set(),
    "laptop.brick": {"asyncssh"},
    "laptop.brick.finding": {"asyncssh", "ifaddr", "zeroconf"},
    "laptop.record.figures.drawing_film": {"numpy", "matplotlib", "PIL"},
    "laptop.record": {*PICTURES, "matplotlib", "jinja2", "markupsafe", "msgspec"},
    "laptop.drawing": PICTURES,
    "laptop.drawing.areas": {"numpy", "shapely"},
    "laptop.drawing.glyphs": {"HersheyFonts", "numpy"},
    "laptop.drawing.line_drawings": {*PICTURES, "skimage"},
    "laptop.drawing.preview_plot": {*PICTURES, "matplotlib"},
    "laptop.drawing.svg": {"numpy", "shapely"},
    "laptop.drawing.svg_clips": {"numpy", "shapely"},
    "laptop.drawing.svg_css": {"cssselect2", "tinycss2"},
    "laptop.drawing.svg_paint": {"tinycss2"},
    "laptop.drawing.svg_path": {"fontTools", "numpy"},
    "laptop.drawing.svg_place": {"numpy", "shapely"},
    "laptop.drawing.svg_text": {"fontTools", "matplotlib", "numpy", "uharfbuzz"},
    "laptop.drawing.svg_tree": {"numpy", "shapely"},
    "laptop.see": PICTURES,
    "laptop.see.markers.board_sheet": {*PICTURES, "matplotlib"},
    "laptop.see.markers.marker_sheet": {*PICTURES, "matplotlib"},
    "laptop.see.serve": {*PICTURES, "ifaddr", "rich"},
    "laptop.see.table.marker_offset": {"numpy", "scipy"},
    "laptop.see.table.moves_fit": {*PICTURES, "scipy"},
    "laptop.see.table.views_fit": {*PICTURES, "scipy"},
    "laptop.emulator": {"ev3dev2"},  # it is the brick's Python, too
    "laptop.emulator.compiling": {"mypyc", "setuptools"},
    "laptop.emulator.scene": {*PICTURES, "ev3dev2"},
    "laptop.page": {*PICTURES, "matplotlib"},
    "laptop.page.board_mapping": {*PICTURES, "scipy"},
    "laptop.page.browser": {"nicegui"},
    "laptop.page.cards": {"nicegui"},
    "laptop.page.http_limits": {"uvicorn"},
    "laptop.page.http_routes": {"fastapi"},
    "laptop.page.page_clients": {"nicegui", "fastapi"},
    "laptop.page.server": {"nicegui", "fastapi", "uvicorn"},
    "laptop.page.stop_gate": {"uvicorn"},
    "laptop.measure": {*PICTURES, "matplotlib", "rich", "scipy"},
    "laptop.course": {"numpy", "matplotlib", "markupsafe"},
    "laptop.course.call_functions": set(),
    "laptop.course.solutions": {"ev3dev2"},
    "laptop.bench": {*PICTURES, "matplotlib", "rich"},
    "laptop.bench.workers": {"cv2", "distributed"},
    "laptop.docs": {"click", "cogapp", "cv2", "numpy"},
    "laptop.docs.drawings": {"numpy", "matplotlib"},
    "laptop.examples": {"brickservo"},
    "laptop.cli": {"click", "rich"},
}
CLOCK = "robot.clock"
"""The one module of the brick's side that reads the time; to all others it is an argument."""
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@pytest.fixture(scope="module")
def graph():
    """All modules and who imports whom, libraries too."""
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def own(graph):
    """Names of our modules."""
    return sorted(name for name in graph.modules if name.split(".")[0] in PACKAGES)


def test_rooms_import_from_below_only(capsys):
    assert importlinter.cli.lint_imports(str(ROOT / "pyproject.toml"), no_cache=True) == 0, (
        capsys.readouterr().out
    )


def test_each_room_has_its_libraries(graph):
    wrong = {}
    for module in own(graph):
        known = [name for name in LIBRARIES if f"{module}.".startswith(f"{name}.")]
        libraries = graph.find_modules_directly_imported_by(module) - {*own(graph)}
        libraries -= sys.stdlib_module_names | LIBRARIES[max(known, key=len)]
        if libraries:
            wrong[module] = libraries
    assert wrong == {}


def test_the_brick_reads_the_time_in_one_place(graph):
    readers = graph.find_modules_that_directly_import("time")
    assert {name for name in readers if name.startswith("robot.")} == {CLOCK}


def test_the_brick_imports_the_motors_library_only_where_it_turns_one():
    """That costs it a second at the start, and what moves nothing goes without."""
    scripts = "robot.driver, robot.visual_servoing, robot.tracking_client, robot.bench_brick"
    code = f"import sys, {scripts}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert "robot.driver" in done.stdout.split()
    assert "ev3dev2" not in done.stdout.split()


def test_our_environment_variables_are_named_in_one_place():
    found = set()
    for path in SOURCES:
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "BRICKSERVO_" in source else ():
            if isinstance(node, ast.Constant) and re.fullmatch(r"BRICKSERVO_\w+", str(node.value)):
                found.add(path.relative_to(ROOT).as_posix())
    assert found == {"shared/state.py"}


def test_the_checkout_holds_only_the_agreed_entries():
    try:
        listed = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    assert {name.split("/")[0] for name in listed.splitlines()} <= TOP_LEVEL
