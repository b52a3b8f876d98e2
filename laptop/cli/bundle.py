"""`bundle`: all that a class installs, in one folder, for computers without a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click

from laptop.cli.options import examples, in_one_line
from shared.arm_description import ArmError
from shared.state import laptop_program

REPO_ROOT = Path(__file__).parents[2]
CONSTRAINTS = REPO_ROOT / "laptop" / "constraints.txt"
SYSTEMS = {
    "linux": ("linux", ["manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"]),
    "macos": ("macos", ["macosx_14_0_arm64"]),
    "windows": ("windows", ["win_amd64"]),
}
"""Names of the systems for uv and pip."""
SOURCE_ONLY = ("python-ev3dev2",)
"""Libraries of which there are no wheels: they are made here."""
TARGET = re.compile(rf"({'|'.join(SYSTEMS)})-(3\.[0-9]+)")
HOW = """BrickServo without a network

Each computer needs Python ({pythons}) with pip, and this folder. There, type:

    python3 -m pip install --no-index --find-links . --target .uv uv
    .uv/bin/uv tool install --no-index --find-links . --constraints constraints.txt brickservo

In Windows' PowerShell:

    py -m pip install --no-index --find-links . uv
    py -m uv tool install --no-index --find-links . --constraints constraints.txt brickservo

The same line with --reinstall behind `install` brings another version. To see what is there:

    brickservo doctor

Is brickservo not found? Type this, and open a new window (in PowerShell: py -m uv tool ...):

    .uv/bin/uv tool update-shell
"""


class CannotBundle(ArmError):
    """Error: a part of the bundle is not available."""


@click.command(
    short_help="Put all that is installed into a folder, for want of a network.",
    epilog=examples("bundle class", "bundle class windows-3.12 windows-3.13 linux-3.11"),
)
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@click.argument("systems", metavar="[SYSTEM-PYTHON]...", nargs=-1)
def bundle(folder: Path, systems: tuple[str, ...]) -> None:
    """Put all that a class installs into FOLDER, for computers without a network.

    That is this program, the libraries with the versions that its tests passed with, and uv, for
    SYSTEM-PYTHON: linux (x86-64), macos (Apple silicon) or windows, and a version, as windows-3.12;
    this computer's if none is said. INSTALL.txt says what to type there. Each takes
    160 to 210 MB.
    """
    with in_one_line():
        targets = [_target(text) for text in systems or [_here()]]
        if folder.exists() and any(folder.iterdir()):
            raise click.UsageError(f"{folder} is not empty; give a folder that is new.")
        uv = _uv()
        with tempfile.TemporaryDirectory(dir=_parent(folder)) as draft:
            _fill(Path(draft), uv, targets)
            folder.mkdir(exist_ok=True)
            for file in Path(draft).iterdir():
                shutil.move(file, folder)
    size = sum(file.stat().st_size for file in folder.iterdir()) / 1e6
    click.echo(f"{folder}: {len([*folder.glob('*.whl')])} wheels, {size:.0f} MB")
    click.echo(f"copy it to each computer; {folder / 'INSTALL.txt'} says what to type there")


def _parent(folder: Path) -> Path:
    folder.parent.mkdir(parents=True, exist_ok=True)
    return folder.parent


def _here() -> str:
    """Return the system and the Python of this computer."""
    names = {"linux": "linux", "darwin": "macos", "win32": "windows"}
    return f"{names.get(sys.platform, sys.platform)}-3.{sys.version_info[1]}"


def _target(text: str) -> tuple[str, str]:
    """Return the system and the Python that are named."""
    found = TARGET.fullmatch(text)
    if not found:
        raise click.UsageError(f"'{text}' is no system with a Python; write it as windows-3.12.")
    return found[1], found[2]


def _uv() -> str:
    """Return the program uv."""
    folders = [str(REPO_ROOT / ".uv" / "bin"), *os.environ.get("PATH", "").split(os.pathsep)]
    uv = os.environ.get("UV") or shutil.which("uv", path=os.pathsep.join(filter(None, folders)))
    if uv is None:
        raise CannotBundle("there is no uv here; the README's first command brings it")
    if not (REPO_ROOT / "pyproject.toml").is_file():
        raise CannotBundle(
            "a bundle is made in a checkout, and this brickservo is an installed one; "
            f"go to the checkout and type {laptop_program()} bundle there"
        )
    return uv


def _fill(folder: Path, uv: str, targets: Sequence[tuple[str, str]]) -> None:
    """Fill the folder with all parts of the bundle."""
    _run(
        "this program",
        [uv, "build", "--quiet", "--wheel", "--out-dir", str(folder), str(REPO_ROOT)],
    )
    (folder / ".gitignore").unlink(missing_ok=True)  # of uv's
    pip = [uv, "tool", "run", "--quiet", "pip"]
    for system, python in targets:
        name, platforms = SYSTEMS[system]
        wanted = _run(
            f"the versions for {system}-{python}",
            [
                *(uv, "pip", "compile", "--quiet", "--no-header", "--no-annotate"),
                *("--python-platform", name, "--python-version", python),
                *("--constraints", str(CONSTRAINTS), str(REPO_ROOT / "pyproject.toml")),
            ],
        ).split()
        made = [line for line in wanted if line.partition("==")[0] in SOURCE_ONLY]
        _run(", ".join(made), [*pip, "wheel", "--quiet", "--no-deps", "-w", str(folder), *made])
        _run(
            f"{len(wanted)} libraries for {system}-{python}",
            [
                *(*pip, "download", "--quiet", "--no-deps", "--only-binary=:all:"),
                *("--python-version", python, "--dest", str(folder), "--find-links", str(folder)),
                *(word for platform in platforms for word in ("--platform", platform)),
                *(*wanted, "uv"),
            ],
        )
    shutil.copy(CONSTRAINTS, folder / "constraints.txt")
    pythons = sorted({python for _, python in targets})
    (folder / "INSTALL.txt").write_text(HOW.format(pythons=", ".join(pythons)), encoding="utf-8")


def _run(what: str, args: Sequence[str]) -> str:
    """Run a program, and return what it prints; `what` is for people."""
    click.echo(f"{what} ...", err=True)
    done = subprocess.run(args, capture_output=True, text=True)
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        why = next((line for line in lines if "error" in line.lower()), (lines or ["?"])[-1])
        raise CannotBundle(f"{what}: {why.strip()}; nothing is written")
    return done.stdout
