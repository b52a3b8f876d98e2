"""Texts without the folders of this computer."""

from pathlib import Path

import pytest

from laptop.reporting.private_paths import without_folders


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
    ],
)
def test_what_is_no_such_path_stays(text):
    assert without_folders(text) == text
