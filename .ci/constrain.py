"""Write the newest versions that the ranges in pyproject.toml admit into it, as uv's constraints.

    .uv/bin/uv run --no-project .ci/constrain.py && .ci/run

Those of all groups, for every Python and system that the project is for. What the checks then
passed with is committed, and everybody gets the same. `uv tool install` reads nothing of it there,
so that it is told the same by laptop/constraints.txt.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROJECT = ROOT / "pyproject.toml"
TOLD = ROOT / "laptop" / "constraints.txt"
CONSTRAINTS = re.compile(r'^constraint-dependencies = \[\n(?: {4}".*",\n)*\]$', re.MULTILINE)
EXACT = re.compile(r'[a-z0-9-]+==[^\s;@/"]+( ; [^"]+)?')
EXPORT = ["export", "--quiet", "--all-groups", "--no-emit-project"]
EXPORT += ["--no-hashes", "--no-header", "--no-annotate", "--format", "requirements.txt"]


def resolved(project: str) -> list[str]:
    """Return what uv takes for the text of a pyproject.toml: `NAME==VERSION ; MARKER` alone.

    Raises:
        SystemExit: uv fails, or takes something that has no version.
    """
    uv = shutil.which("uv", path=os.pathsep.join([str(ROOT / ".uv" / "bin"), os.environ["PATH"]]))
    if uv is None:
        sys.exit("constrain: there is no uv; the README's first command brings it")
    with tempfile.TemporaryDirectory() as folder:  # in which nothing was locked before
        Path(folder, "pyproject.toml").write_text(project, encoding="utf-8")
        words = [uv, *EXPORT, "--directory", folder]
        done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{done.stderr}constrain: uv finds no versions, see above; nothing is changed")
    lines = done.stdout.splitlines()
    for line in lines:
        if not EXACT.fullmatch(line):
            sys.exit(f"constrain: '{line}' is not NAME==VERSION ; MARKER; nothing is changed")
    return lines


def constrained(project: str, versions: list[str]) -> str:
    """Return the text of a pyproject.toml with these constraints for those it has."""
    lines = "".join(f'    "{version}",\n' for version in versions)
    changed, count = CONSTRAINTS.subn(lambda _: f"constraint-dependencies = [\n{lines}]", project)
    if count != 1:
        sys.exit(f"constrain: {PROJECT.name} has no constraint-dependencies = [...] to replace")
    return changed


def main() -> None:
    """Find the newest versions, see that they are found again, and write them."""
    before = PROJECT.read_text(encoding="utf-8")
    versions = resolved(constrained(before, []))
    after = constrained(before, versions)
    if resolved(after) != versions:
        sys.exit("constrain: with these constraints uv takes other versions; nothing is changed")
    told = "".join(f"{version}\n" for version in versions)
    if after == before and TOLD.read_text("utf-8") == told:
        print(f"constrain: {PROJECT.name} has the newest versions already")
        return
    for path, text in ((PROJECT, after), (TOLD, told)):
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
    print(f"constrain: {len(versions)} versions are in {PROJECT.name}; commit it if .ci/run passes")


if __name__ == "__main__":
    main()
