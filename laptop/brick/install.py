"""Installation of the program on a brick: what changed, and all of it or nothing.

In `~/.brickservo` there, `versions/` holds folders with a complete program each, and the link
`program` points to the one that counts. A new one is made beside it, of hard links to what has not
changed, checked and compiled; then the link is replaced in one step (rename(2), which is atomic).
So whatever is cut, and whenever, a complete program counts. The one before stays until the next,
and as long as something runs of it: Python loads some modules late.
"""

from __future__ import annotations

import posixpath
import re
import secrets
import shlex
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import ask
from laptop.brick.connection import CUT, BrickAddress, Dialogue
from laptop.brick.program_files import (
    ProgramFile,
    archive,
    manifest,
    program_files,
    version_of,
)

LINKS = {
    "robot": ".brickservo/program/robot",
    "shared": ".brickservo/program/shared",
    "brickservo-draw": ".brickservo/program/menu/draw",
    "brickservo-servo": ".brickservo/program/menu/servo",
}
"""Targets of links by their names in the brick's home, the last two for its menu."""

MANIFEST = ".files"
"""Name of the list of files in a version's folder."""

ASK = f"""
for name in {" ".join(LINKS)}; do
    [ ! -L $name ] || echo "link $name $(readlink $name)"
done
cd .brickservo 2>/dev/null || exit 0
[ -L program ] || exit 0
echo "folder $(readlink program)"
cd program/ 2>/dev/null || exit 0
[ ! -f {MANIFEST} ] || while read -r sum name; do echo "ours $name"; done <{MANIFEST}
find . -type f ! -name '*.pyc' -printf 'mode %m %P\\n'
find . -type f ! -name '*.pyc' -print0 | xargs -0r sha256sum | sed 's/^/sum /'
"""
"""Script that prints what is installed, without Python, which would take seconds to start."""

CARD_SILENCE = 120.0
"""Longest silence of a brick that writes its card, s: it can be slow."""

NO_PYTHON, BUSY = 10, 11
"""Exit statuses of INSTALL."""

INSTALL = r"""
set -eu
umask 022
command -v python3 >/dev/null || exit {no_python}
mkdir -p .brickservo/versions .brickservo/arms .brickservo/logs
cd .brickservo
exec 9>install.lock
flock -n 9 || exit {busy}
old=$(readlink program) || old=
for one in versions/*/; do
    one=${{one%/}}
    [ ! -d "$one" ] || [ "$one" = "$old" ] || flock -n -E 0 "$one" rm -rf "$one"
done
new=versions/{name}
trap 'cd "$HOME/.brickservo"; rm -rf "$new"' EXIT
if [ -n "$old" ] && [ -d "$old" ]; then cp -al "$old" "$new"; else mkdir "$new"; fi
cd "$new"
{remove}
tar -xzf -
find . -depth -mindepth 1 -type d -empty -delete
cat >{manifest} <<'END'
{files}END
sha256sum --quiet -c {manifest}
sed -n 's/^[^ ]*  \(.*[.]py\)$/\1/p' {manifest} | python3 -u -m compileall -i -
sync
cd ../..
ln -sfn "$new" program.new
mv -T program.new program
trap - EXIT
cd ..
lead() {{
    [ "$(readlink "$1")" != "$2" ] || return 0
    if [ -e "$1" ] || [ -L "$1" ]; then
        k=1
        while [ -e "$1.before-$k" ] || [ -L "$1.before-$k" ]; do k=$((k + 1)); done
        mv -T "$1" "$1.before-$k"
        echo "moved $1 $1.before-$k"
    fi
    ln -s "$2" "$1"
}}
{links}
"""
"""Script that makes a version of the old one and an archive on standard input, and links to it."""


@dataclass
class Installed:
    """The program that is installed on a brick.

    Args:
        folder: folder of the version that counts; "" if there is none.
        ours: names of files that this program has put there.
        modes: mode of each file that is there, by name.
        sums: SHA-256 of each file that is there, in hex, by name.
        links: targets of those of LINKS that are there.
    """

    folder: str = ""
    ours: set[str] = field(default_factory=set)
    modes: dict[str, int] = field(default_factory=dict)
    sums: dict[str, str] = field(default_factory=dict)
    links: dict[str, str] = field(default_factory=dict)

    @property
    def version(self) -> str:
        """Version that is installed; "" if there is none."""
        return posixpath.basename(self.folder).partition("-")[0]

    def lacks(self, files: Mapping[str, ProgramFile]) -> list[str]:
        """Return the names of those that are not there as they should be."""
        return [
            name
            for name, file in files.items()
            if self.sums.get(name) != file.digest or self.modes.get(name) != file.mode
        ]

    def leftover(self, files: Mapping[str, ProgramFile]) -> list[str]:
        """Return the names of files that an earlier version has installed and this one lacks."""
        return sorted((self.ours & set(self.sums)) - set(files))


def parse_installed(text: str) -> Installed:
    """Return what ASK has printed; other lines are skipped."""
    found = Installed()
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        first, _, second = rest.partition(" ")
        if kind == "folder":
            found.folder = rest
        elif kind == "ours":
            found.ours.add(rest)
        elif kind == "mode" and re.fullmatch("[0-7]{1,5}", first):
            found.modes[second] = int(first, 8)
        elif kind == "sum":
            found.sums[second.strip().removeprefix("./")] = first
        elif kind == "link":
            found.links[first] = second
    return found


async def install(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> None:
    """Install this program on the brick, and report how long that took.

    Raises:
        BrickProblem: see `update`.
    """
    began = time.monotonic()
    version = await update(brick, address, dialogue)
    if version:
        took = time.monotonic() - began
        dialogue.report(f"{address}: {version} is there and here: nothing to do ({took:.1f} s)")


async def update(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> str:
    """Update the program on the brick; return its version if it is up to date, else "".

    Raises:
        BrickProblem: the brick cannot take it; what was there is as before.
    """
    began = time.monotonic()
    try:
        files = program_files()
    except OSError as error:
        raise BrickProblem(f"cannot read {error.filename}: {error.strerror}") from None
    ours, installed = version_of(files), parse_installed((await ask(brick, ASK)).out)
    lacking, leftover = installed.lacks(files), installed.leftover(files)
    if not lacking and not leftover and installed.links == LINKS and installed.version == ours:
        return ours
    dialogue.report(
        f"{address}: {installed.version or 'no program'} is there, {ours} is here: "
        f"{_summary(installed, lacking, leftover)}"
    )
    script = _script(f"{ours}-{secrets.token_hex(2)}", files, lacking, leftover)
    try:
        done = await ask(brick, script, archive(files, lacking), silence=CARD_SILENCE)
    except CUT:
        raise BrickProblem(
            f"the connection to {address} was cut on the way; the program there is whole: "
            f"{f'as before, {installed.version}' if installed.version else 'none, as before'}, or "
            "the new one. Look at the cable, and try again"
        ) from None
    if done.status:
        why = why_not_taken(done.status, done.errors + done.out)
        raise BrickProblem(
            f"{address} cannot take the program: {why}; "
            + (f"{installed.version} is there, as before" if installed.version else "none is there")
        )
    for name, new in re.findall(r"^moved (\S+) (\S+)$", done.out, re.MULTILINE)[: len(LINKS)]:
        dialogue.report(f"~/{name} there was somebody's own: it is {new} now")
    dialogue.report(
        f"{address}: {ours} is installed ({time.monotonic() - began:.1f} s); in the brick's File "
        "Browser it is brickservo-draw and brickservo-servo"
    )
    return ""


def _script(
    name: str, files: Mapping[str, ProgramFile], lacking: list[str], leftover: list[str]
) -> str:
    """Return INSTALL for a version's folder."""
    # A hard link is not to be written through; nor does a compiled file outlive its source.
    old = [path for one in [*lacking, *leftover] for path in (shlex.quote(one), _compiled(one))]
    return INSTALL.format(
        no_python=NO_PYTHON,
        busy=BUSY,
        name=name,
        remove=f"rm -f {' '.join(old)}" if old else "",
        manifest=MANIFEST,
        files=manifest(files),
        links="\n".join(f"lead {name} {target}" for name, target in LINKS.items()),
    )


def _compiled(name: str) -> str:
    """Return a pattern, for sh, of the compiled files of a module."""
    folder, base = posixpath.split(name)
    stem = posixpath.splitext(base)[0]
    return f"{shlex.quote(posixpath.join(folder, '__pycache__', stem))}.*.pyc"


def _summary(installed: Installed, lacking: list[str], leftover: list[str]) -> str:
    """Return what is about to change, for people."""
    if not installed.version:
        return f"{len(lacking)} files are sent and compiled, which takes a brick a while"
    parts = []
    for names, what in ((lacking, "sent"), (leftover, "removed")):
        if names:
            shown = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
            parts.append(f"{len(names)} {'file is' if len(names) == 1 else 'files are'} {what}")
            parts[-1] += f" ({shown})"
    return " and ".join(parts) or "what leads there from the home folder is put right"


def why_not_taken(status: int, errors: str) -> str:
    """Return why INSTALL has ended with that status and errors, for people."""
    if status == NO_PYTHON:
        return "there is no python3, so its card is not one with ev3dev; write one, see ev3dev.org"
    if status == BUSY:
        return "another computer is just installing there; try again when that is done"
    lines = [line.strip() for line in errors.splitlines() if line.strip()] or ["it does not say"]
    if any("No space left" in line or "Disk quota" in line for line in lines):
        return "its card is full; delete files of yours there (brick shell, then df and rm)"
    if any("Read-only file system" in line for line in lines):
        return "its card cannot be written; switch the brick off and on, else write a new card"
    return f"{lines[0]} (status {status})"
