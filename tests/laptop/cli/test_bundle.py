"""`bundle`: what it asks of uv, what it leaves, and what it refuses.

What is in the folder is installed, without a network, by .ci/run.
"""

import json
import sys

import pytest
from click.testing import CliRunner

from laptop.cli import bundle
from laptop.cli.main import laptop

FAKE_UV = """\
#!{python}
import json, pathlib, sys
words = sys.argv[1:]
with open({log!r}, "a") as log:
    log.write(json.dumps(words) + "\\n")
folder = next((words[k + 1] for k, w in enumerate(words) if w in ("--out-dir", "-w", "--dest")), "")
if "compile" in words:
    print("numpy==2.2.0\\npython-ev3dev2==2.1.0")
    if "windows" in words:
        print("colorama==0.4.6")
elif "wheel" in words or "build" in words:
    name = "brickservo" if "build" in words else "python_ev3dev2"
    pathlib.Path(folder, name + ".whl").write_bytes(b"1" * 1000)
elif {fails}:
    sys.exit("ERROR: no network")
else:
    for word in words:
        if "==" in word or word == "uv":
            pathlib.Path(folder, word + ".whl").write_bytes(b"1" * 1000)
"""


@pytest.fixture
def uv(tmp_path, monkeypatch):
    """A program that does what uv would; gives the words with which it was run."""

    def make(fails=False):
        file, log = tmp_path / "uv", tmp_path / "log"
        text = FAKE_UV.format(python=sys.executable, log=str(log), fails=fails)
        file.write_text(text)
        file.chmod(0o755)
        monkeypatch.setenv("UV", str(file))
        return lambda: [json.loads(line) for line in log.read_text().splitlines()]

    return make


def reported(*args):
    result = CliRunner().invoke(laptop, ["bundle", *map(str, args)])
    return result.exit_code, result.output


def test_all_that_a_class_installs_is_put_into_the_folder(uv, tmp_path):
    asked = uv()
    status, output = reported(tmp_path / "class", "linux-3.11", "windows-3.12")
    assert status == 0, output
    names = {file.name for file in (tmp_path / "class").iterdir()}
    assert names == {
        *("brickservo.whl", "python_ev3dev2.whl", "numpy==2.2.0.whl", "python-ev3dev2==2.1.0.whl"),
        *("colorama==0.4.6.whl", "uv.whl", "constraints.txt", "INSTALL.txt"),
    }
    how = (tmp_path / "class" / "INSTALL.txt").read_text()
    assert "needs Python (3.11, 3.12)" in how
    assert "uv tool install --no-index --find-links . --constraints constraints.txt" in how
    assert "6 wheels, 0 MB" in output
    downloads = [args for args in asked() if "download" in args]
    assert [args[args.index("--python-version") + 1] for args in downloads] == ["3.11", "3.12"]
    assert "manylinux_2_28_x86_64" in downloads[0]
    assert "colorama==0.4.6" not in downloads[0]
    assert "win_amd64" in downloads[1]
    assert "colorama==0.4.6" in downloads[1]


def test_what_cannot_be_had_is_named_and_nothing_is_written(uv, tmp_path):
    uv(fails=True)
    status, output = reported(tmp_path / "class", "linux-3.11")
    assert status == 1
    assert "2 libraries for linux-3.11: ERROR: no network; nothing is written" in output
    assert not (tmp_path / "class").exists()
    assert {file.name for file in tmp_path.iterdir()} == {"uv", "log"}


@pytest.mark.parametrize(
    ("args", "problem"),
    [
        (["class", "beos-3.12"], "'beos-3.12' is no system with a Python; write it as windows-3"),
        (["class", "windows"], "'windows' is no system with a Python"),
        (["full"], "full is not empty; give a folder that is new"),
    ],
)
def test_what_cannot_be_bundled_is_refused(uv, tmp_path, monkeypatch, args, problem):
    uv()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    status, output = reported(*args)
    assert status == 2
    assert problem in output
    assert not (tmp_path / "class").exists()


def test_without_uv_or_a_checkout_it_says_where_to_go(uv, tmp_path, monkeypatch):
    monkeypatch.setattr(bundle, "REPO_ROOT", tmp_path)
    uv()
    status, output = reported(tmp_path / "class")
    assert status == 1
    assert "a bundle is made in a checkout, and this brickservo is an installed one" in output
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("UV")
    status, output = reported(tmp_path / "class")
    assert status == 1
    assert "there is no uv here; the README's first command brings it" in output
