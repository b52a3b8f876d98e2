"""Texts without the folders of this computer."""

from pathlib import Path

import pytest

from laptop.record.figures.private_paths import without_folders


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("/home/anna/lab.py", "lab.py"),
        ("/home/anna maria/lab 1.py", "lab 1.py"),
        ("--log=/home/anna maria/x.jsonl", "--log=x.jsonl"),
        (r"C:\Users\anna\x.svg", "x.svg"),
        (r"\\server\share\x.svg", "x.svg"),
        ("~/lab/x.svg", "x.svg"),
        ("../anna/x.svg", "x.svg"),
        ("file:///home/anna/x.svg", "x.svg"),
        ("/home/anna/", "anna"),
        ("cannot read:/home/anna/x.py", "cannot read:x.py"),
        ("cannot read /home/anna maria/lab/x.py: gone", "cannot read x.py: gone"),
        ("'/tmp/a/b' and (/tmp/c)", "'b' and (c)"),
        (f"in {Path.home()}/a b/x.py", "in x.py"),
        ("a//home/anna/x", "ax"),
        ("see a\\\\server\\anna\\x", "see ax"),
        ("in ///home//anna/x", "in x"),
        ("sqlite:///home/anna/x", "sqlite:x"),
        ("in \x1b[31m/home/anna/x\x1b[0m", "in  x "),
        ("\x1b[1;31m/home/anna/x", " x"),
        ("in \x1b[31/home/anna/x", "in  x"),
        ("in \x1bM/home/anna/x", "in  x"),
        ("in \x1b/home/anna/x", "in  x"),
        ("in \x9b31m/home/anna/x", "in  x"),
        ("in  [31m/home/anna/x", "in   x"),
    ],
)
def test_a_path_of_this_computer_is_but_its_last_name(text, told):
    assert without_folders(text) == told


@pytest.mark.parametrize(
    "text",
    [
        "robot/driver.py",
        "12 cm/s",
        "1/2 and/or 3 / 4",
        "http://a.b/c",
        "-4,8",
        "--goal",
        "",
        "a: b",
        "http://a.b/home/c",
        "a [31m] b",
    ],
)
def test_what_is_no_such_path_stays(text):
    assert without_folders(text) == text


@pytest.mark.parametrize("home", [None, "/", ""])
def test_where_nobody_tells_a_home_folder_none_is_needed(monkeypatch, home):
    def nobody(number):
        raise KeyError(number)

    monkeypatch.setattr("pwd.getpwuid", nobody)
    monkeypatch.delenv("HOME", raising=False)
    if home is not None:
        monkeypatch.setenv("HOME", home)
    assert without_folders("12 cm/s in /home/anna/x.py") == "12 cm/s in x.py"


def test_the_name_of_a_home_folder_may_begin_another_one(monkeypatch):
    monkeypatch.setenv("HOME", "/home/anna")
    assert without_folders("in /home/annabel/x.py") == "in x.py"
    assert without_folders("in /home/anna: x") == "in ~: x"
