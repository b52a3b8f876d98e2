"""Names tell files apart: no class stands twice, and no file is too long to be read at once."""

import ast
from collections import Counter

from places import ROOT

SOURCES = [path for room in ("robot", "shared", "laptop") for path in (ROOT / room).rglob("*.py")]
ON_THE_WAY = ("robot/motion", "robot/servoing", "robot/tracking", "shared/")
"""Where the data pass from the image to the motors, and the laptop's rooms on that way."""
LAPTOP_ON_THE_WAY = ("laptop/see/markers/tracker", "laptop/see/markers/finders", "laptop/see/serve")


def classes(source):
    """Names of the classes of a text, those that `record` makes too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            made_by = getattr(node.value.func, "id", "")
            yield from [node.targets[0].id] if made_by in ("record", "namedtuple") else []


def test_no_class_name_stands_in_two_files():
    found = Counter(
        name for path in SOURCES for name in set(classes(path.read_text(encoding="utf-8")))
    )
    assert [name for name, times in found.items() if times > 1] == []


def test_no_file_is_too_long():
    for path in SOURCES:
        place = path.relative_to(ROOT).as_posix()
        limit = 400 if place.startswith(ON_THE_WAY + LAPTOP_ON_THE_WAY) else 500
        lines = len(path.read_text(encoding="utf-8").splitlines())
        assert lines <= limit, f"{place} has {lines} lines; split it by trade"
