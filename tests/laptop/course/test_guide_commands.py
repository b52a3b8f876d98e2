"""What guide and handouts tell to type is there: commands, options, files, keys of an arm."""

import html
import re
import shutil

import click
import pytest
from commands import SCRIPTS, parse_all, parse_script
from places import ROOT

from laptop.brick.connection import PASSWORD, USER
from laptop.brick.install import LINKS
from laptop.course import basins, drawing
from laptop.course.build import render_guide
from laptop.course.handouts import HANDOUTS
from robot import api
from shared import arm_description
from shared.arm_description import find_arm, read_arm
from shared.state import PROGRAM

NAMES = ("planar", "geared", "spatial", "anna.ini", *(handout.name for handout in HANDOUTS))
KEYS = [keys for name, keys in vars(arm_description).items() if name.endswith("_KEYS")]
OTHER_PROGRAMS = {
    "rm": "of the brick's Linux",
    "uv": "it has installed brickservo; .ci/run removes it so",
    "passwd": "of the brick's Linux",
    "sudo": "ev3dev-config comes with ev3dev",
}
OTHER_WORDS = {
    *("check", "ev3dev", "TODO", "picture.png", "markers.pdf", "~/.brickservo"),
    *("load=0.05", "tilt=40,azimuth=70", "robot.api"),
    *("both", "lower", "upper", "none", "touch in1"),  # what find_home and stops may be
    "brick doctor",
    *(USER, PASSWORD),
}
"""What is neither a command nor an option, key or file."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """All pages by name; one is the guide of an arm of somebody's own."""
    folder = tmp_path_factory.mktemp("pages")
    shutil.copy(find_arm("geared"), folder / "anna.ini")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(PROGRAM, "brickservo")
        patch.setattr(basins, "draw_basins", lambda arm, goal: b"")
        for draw in ("draw_links", "draw_plan", "draw_side", "draw_camera"):
            patch.setattr(drawing, draw, lambda arm: drawing.Drawing("", 1.0, 1))
        found = {name: render_guide(read_arm(find_arm(name)), name) for name in NAMES[:3]}
        found["anna.ini"] = render_guide(read_arm(folder / "anna.ini"), "anna.ini")
        return {**found, **{handout.name: handout.page() for handout in HANDOUTS}}


def marked(page, mark):
    """The texts that bear a mark, such as `kbd`."""
    found = re.findall(rf"<{mark}>(.*?)</{mark}>", page, re.DOTALL)
    return [html.unescape(re.sub(r"<[^>]+>", "", text)) for text in found]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder that holds what a reader has by then."""
    monkeypatch.chdir(tmp_path)
    for name in ("my.ini", "anna.ini"):
        shutil.copy(find_arm("geared"), tmp_path / name)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    for handout in HANDOUTS:
        (tmp_path / handout.script).write_text(handout.skeleton, "utf-8")
    (tmp_path / "arms").mkdir()
    shutil.copy(find_arm("geared"), tmp_path / "arms" / "anna.ini")


@pytest.mark.short(every=4)
@pytest.mark.parametrize("name", NAMES)
def test_each_command_would_be_taken(name, pages, folder):
    commands = marked(pages[name], "kbd")
    assert len(commands) >= 2
    for command in commands:
        first, *words = command.split()
        if first != "brickservo":
            assert first in OTHER_PROGRAMS, command
            continue
        script = parse_all(words)
        assert script is None or script in SCRIPTS or script == f"{name}.py", command


@pytest.mark.parametrize("name", NAMES)
def test_each_other_word_in_the_font_of_programs_is_known(name, pages, folder):
    keys = {key for group in KEYS for key, _ in group}
    for text in marked(pages[name], "code"):
        key, _, value = text.partition(" = ")
        words = text.split()
        if words[0].startswith("--"):
            assert is_option(words), text
        elif key in keys:
            assert not value or re.fullmatch(r"here|\d", value), text
        elif text.endswith(".py"):
            assert text in SCRIPTS or text == f"{name}.py", text
        elif text.endswith(".ini"):
            assert (ROOT / text).is_file() or find_arm(text)
        elif words[0] not in OTHER_PROGRAMS:
            assert text in {*OTHER_WORDS, *dir(api), *NAMES}, text


def is_option(words):
    """Whether some command knows an option, with what is behind it; `...` stands for anything."""
    values = [] if words[1:] == ["..."] else words[1:]
    tries = (
        lambda: parse_script("driver.py", [*words, "where"]),
        lambda: parse_all(["brick", "doctor", *words]),
        lambda: parse_all(["simulate", words[0], *(values or ["load=0"]), "driver.py"]),
    )
    for attempt in tries:
        try:
            attempt()
        except (click.UsageError, SystemExit):
            continue
        return True
    return False


def test_an_unknown_option_is_seen(folder):
    assert not is_option(["--no-such-option"])
    with pytest.raises(click.UsageError):
        parse_all(["brick", "doctor", "--no-such-option"])
    with pytest.raises(SystemExit):
        parse_all(["brick", "run", "driver.py", "--no-such-option", "line", "1,2", "3,4"])


def test_the_guide_removes_all_that_was_put_on_the_brick(pages):
    (command,) = (text for text in marked(pages["planar"], "kbd") if text.startswith("rm "))
    assert command.split()[2:] == [*LINKS, ".brickservo"]


def test_the_file_of_the_arm_comes_with_its_guide(pages, tmp_path):
    import base64

    for name in ("planar", "spatial"):
        found = re.search(r'href="data:text/plain;base64,(.*?)" download="my.ini"', pages[name])
        file = tmp_path / "my.ini"
        file.write_bytes(base64.b64decode(found[1]))
        assert read_arm(file)._replace(file="", name="") == read_arm(find_arm(name))._replace(
            file="", name=""
        )
    assert "brick arm anna.ini" in " ".join(marked(pages["anna.ini"], "kbd"))
