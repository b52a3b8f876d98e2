"""A run in virtual time hangs on what was typed, and on nothing else of the computer it is on."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from places import ROOT

from laptop.cli.main import laptop

SCRIPT = """
import glob, os, platform, random, shutil, socket, sys, threading, time
WORDS = {"up", "down", "left", "right", "enter"}
for word in WORDS:
    time.sleep(len(word) / 100.0)
    print(word, time.monotonic())
print(hash("brick"), os.getpid(), threading.get_ident(), threading.get_native_id(), os.getlogin())
print(os.environ.get("USER"), os.path.expanduser("~"), sorted(os.environ), platform.node())
print(socket.gethostname(), os.cpu_count(), shutil.get_terminal_size(), shutil.disk_usage("."))
print(time.strftime("%c %Z"), time.time(), os.getuid(), os.listdir("/proc"), sys.executable)
print([os.path.basename(path) for path in glob.glob("/home/robot/.brickservo/*")])
random.seed()
print(random.random(), random.SystemRandom().random(), "{:n}".format(1234567.5))
try:
    open("/home/robot/.brickservo/none")
except OSError as error:
    print(error)

def count(name):
    for word in WORDS | {name}:
        time.sleep(0.01 + 0.001 * len(word))
        print(name, word, threading.get_ident(), time.monotonic())

threads = {name: threading.Thread(target=count, args=(name,)) for name in WORDS}
for name in set(threads):
    threads[name].start()
for thread in threads.values():
    thread.join()
"""
"""Somebody's: sets, threads, and all that there is to ask."""

SIMULATE = ("simulate", "--no-picture", "--out", "{out}")
QUICK = {
    "doctor": (*SIMULATE, "doctor.py"),
    "job": (*SIMULATE, "driver.py", "job", "drawing.job"),
    "line": (*SIMULATE, "driver.py", "line", "10,0", "9,3"),
    "script": (*SIMULATE, "sets.py"),
    "steps": (*SIMULATE, "driver.py", "--method", "steps", "line", "10,0", "9,3"),
}
SEEING = {
    "servo": (*SIMULATE, "--scene", "", "visual_servoing.py", "--goal", "400,200"),
    "sight": ("draw", "--line", "10,0 9,3", "--trials", "1", "--simulate", "--out", "{out}"),
}
COMMANDS = {**QUICK, **SEEING}
"""Commands by name; a `{out}` in them is a folder."""

COMPARED = ("said", "trace.csv", "run.json")

LIKE_THIS = {"folder": "a", "environment": {}}
COMPUTERS = {
    "process": {"getpid": 7, "getppid": 3},
    "folder": {"folder": "an ordinary folder/of a student/whose name is long"},
    "owner": {"user": "somebody-else", "host": "a-laptop-with-a-long-name.school.example",
              "environment": {"USER": "somebody-else", "LOGNAME": "somebody-else",
                              "HOME": "/home/somebody-else"}},
    "environment": {"environment": {
        "COLUMNS": "40", "LINES": "5", "EDITOR": "vi", "SSH_CLIENT": "192.0.2.1 1 22",
        "PYTHONUNBUFFERED": "1", "FORCE_COLOR": "1", "TERM": "xterm"}},
    "place": {"environment": {"TZ": "Asia/Kathmandu", "LC_ALL": "C", "LANG": "C"}},
    "hash seed": {"environment": {"PYTHONHASHSEED": "4242"}},
    "past": {"before": [QUICK["steps"], QUICK["script"], QUICK["line"]]},
    "order": {"backwards": True},
    "day": {"later": 1e7},
    "load": {"cpu_count": 64, "cores": 1, "others": 3},
}  # fmt: skip
"""What is otherwise on another computer, see helpers/typed_words.py."""


def everything():
    """All of that at once."""
    out = {"environment": {}}
    for computer in COMPUTERS.values():
        out["environment"].update(computer.get("environment", {}))
        out.update({key: value for key, value in computer.items() if key != "environment"})
    return out


def left_by(place, computer, commands):
    """What commands leave on a computer: (name, file) -> bytes."""
    computer = dict(LIKE_THIS, **computer)
    folder = Path(place, computer["folder"])
    folder.mkdir(parents=True)
    (folder / "sets.py").write_text(SCRIPT)
    args = ("draw", "--line", "10,0 9,3", "--to", str(folder / "drawing.job"))
    assert CliRunner().invoke(laptop, args).exit_code == 0
    environment = {key: os.environ[key] for key in ("PATH", "TMPDIR") if key in os.environ}
    environment.update(
        computer["environment"],
        BRICKSERVO_STATE=str(folder / "state"),
        PYTHONPATH=os.pathsep.join([str(ROOT), *sys.path]),
    )
    others = [
        subprocess.Popen(
            [sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE
        )
        for _ in range(computer.get("others", 0))
    ]
    try:
        subprocess.run(
            [sys.executable, ROOT / "tests" / "helpers" / "typed_words.py", json.dumps(computer),
             json.dumps(commands)],
            cwd=folder, env=environment, check=True,
        )  # fmt: skip
    finally:
        for other in others:
            other.communicate()
    return {
        (name, file): (folder / name / file).read_bytes() for name in commands for file in COMPARED
    }


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """What the commands leave here."""
    return left_by(str(tmp_path_factory.mktemp("computer")), {}, COMMANDS)


@pytest.mark.claims  # which of them it is, where the next test has failed
@pytest.mark.parametrize("other", list(COMPUTERS))
def test_the_same_words_leave_the_same_bytes_on_a_computer_with_another(
    usual, tmp_path_factory, other
):
    place = str(tmp_path_factory.mktemp("computer"))
    there = left_by(place, COMPUTERS[other], QUICK)
    assert {key for key in there if usual[key] != there[key]} == set()


@pytest.mark.long
def test_the_same_words_leave_the_same_bytes_where_all_is_otherwise(usual, tmp_path_factory):
    place = str(tmp_path_factory.mktemp("computer"))
    there = left_by(place, everything(), COMMANDS)
    assert {key for key in usual if usual[key] != there[key]} == set()


@pytest.mark.long
def test_the_commands_do_what_they_are_for(usual):
    """Else all would be alike of what was refused."""
    for name in COMMANDS:
        assert usual[name, "said"].endswith(b"status 0\n"), usual[name, "said"].decode()
