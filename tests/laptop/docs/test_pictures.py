"""Each picture of the pages has something that makes it, and comes out the same twice."""

import pytest
from click.testing import CliRunner
from places import ROOT

from laptop.docs import __main__ as docs
from laptop.docs import pictures
from shared.arm_description import ArmError

PAGES = [ROOT / "README.md", *sorted((ROOT / "laptop" / "docs").rglob("*.md"))]
TEXT = "\n".join(page.read_text("utf-8") for page in PAGES)
QUICK = ("guide.svg", "home-spatial.png", "drawings.png", "basins.png")


def test_all_pictures_but_the_pages_own_are_made_by_name():
    there = {file.name for file in pictures.FOLDER.iterdir()}
    assert {name for name in there if not name.startswith("page")} == set(docs.PICTURES)


@pytest.mark.parametrize("name", pictures.COMMANDS)
def test_a_command_that_makes_a_picture_is_shown_in_the_pages(name):
    words, _ = pictures.COMMANDS[name]
    assert words in TEXT


@pytest.mark.parametrize("name", QUICK)
def test_a_picture_comes_out_the_same_twice(tmp_path, monkeypatch, name):
    monkeypatch.setattr(pictures, "FOLDER", tmp_path)
    assert docs.repaint(name) == "new"
    assert docs.repaint(name) == "the same"
    (tmp_path / name).write_bytes(b"")
    assert docs.repaint(name) == "changed"


def test_a_picture_is_what_its_command_leaves(tmp_path, monkeypatch):
    monkeypatch.setitem(pictures.COMMANDS, "owl.svg", ("draw owl --to owl.svg", "owl.svg"))
    pictures.by_command("owl.svg", tmp_path / "it.svg")
    assert (tmp_path / "it.svg").read_text("utf-8").startswith("<?xml")


def test_a_command_that_fails_is_named_with_what_it_said(tmp_path, monkeypatch):
    monkeypatch.setitem(pictures.COMMANDS, "x.svg", ("draw nothing-there --to x.svg", "x.svg"))
    with pytest.raises(ArmError, match="brickservo draw nothing-there --to x.svg: .*nothing-there"):
        pictures.by_command("x.svg", tmp_path / "x.svg")
    assert not (tmp_path / "x.svg").exists()


def test_a_name_that_is_made_by_nothing_is_refused():
    done = CliRunner().invoke(docs.docs, ["house.jpg"])
    assert done.exit_code == 2
    assert "house.gif" in done.output
