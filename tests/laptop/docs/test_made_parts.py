"""What the pages hold of the programs' own words is what the programs say today."""

import re
import subprocess
import sys

from places import ROOT

from laptop.docs import tables
from laptop.emulator.constants import Constant

CALLS = [
    call
    for page in [ROOT / "README.md", *sorted((ROOT / "laptop" / "docs").rglob("*.md"))]
    for call in re.findall(r"<!-- \[\[\[cog\s+(.+?)\]\]\] -->", page.read_text("utf-8"), re.DOTALL)
]
"""Python that prints a part of a page."""


def printed(capsys, made):
    made()
    return capsys.readouterr().out


def test_the_made_parts_are_up_to_date():
    """If not: python -m laptop.docs."""
    done = subprocess.run(
        [sys.executable, "-m", "laptop.docs", "--check"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == 0, done.stdout


def test_every_function_is_called_by_some_page():
    public = {
        name
        for name, value in vars(tables).items()
        if getattr(value, "__module__", "") == tables.__name__ and not name.startswith("_")
    }
    assert {name for call in CALLS for name in re.findall(r"\w+(?=\()", call)} == public


def test_a_table_tells_default_limits_and_words(capsys, monkeypatch):
    known = {
        "tilt": Constant(None, (0.0, 90.0), "deg", "0 looks down"),
        "kind": Constant("disc", ("disc", "ball"), "", "of a | b", str),
    }
    monkeypatch.setattr(tables.plant, "CONSTANTS", known)
    lines = printed(capsys, tables.plant_constants).strip().splitlines()
    assert lines[2:] == [
        "| `tilt` | - | 0 to 90 | 0 looks down |",
        "| `kind` | disc | disc, ball | of a \\| b |",
    ]
