"""What the pages hold of the programs' own words is what the programs say today."""

import re
import subprocess
import sys

import pytest
from places import ROOT

from laptop.docs import tables
from laptop.emulator.constants import Constant

PAGES = sorted((ROOT / "laptop" / "docs").rglob("*.md"))
MADE = re.compile(
    r"<!-- \[\[\[cog\s+(.+?)\s*\]\]\] -->\n(.*?)<!-- \[\[\[end\]\]\] -->\n", re.DOTALL
)
"""A part of a page: the Python that prints it, of one line or more, and what it has printed."""
PARTS = [
    pytest.param(*part, id=part[0])
    for page in PAGES
    for part in MADE.findall(page.read_text("utf-8"))
]


def printed(capsys, made):
    made()
    return capsys.readouterr().out


@pytest.mark.parametrize(("call", "shown"), PARTS)
def test_a_made_part_is_up_to_date(call, shown):
    """If not: python -m laptop.docs.

    Asked in a process of its own: click keeps a command's --help as another test asked for it.
    """
    code = f"from laptop.docs.tables import *\n{call}"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, check=True
    )
    assert done.stdout.decode().strip() == shown.strip()


def test_every_function_is_called_by_some_page():
    public = {
        name
        for name, value in vars(tables).items()
        if getattr(value, "__module__", "") == tables.__name__ and not name.startswith("_")
    }
    assert {name for part in PARTS for name in re.findall(r"\w+(?=\()", part.id)} == public


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
