"""Small files there and back: arms of one's own, logs, the figures of a bench."""

from __future__ import annotations

import os
import posixpath
import re
import shlex
from pathlib import Path

import asyncssh

from laptop.brick import COMMAND, BrickProblem
from laptop.brick.answers import ask
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.remote_files import put, read
from laptop.brick.run_log import is_of, stored_runs
from laptop.brick.running import LOGS, run
from laptop.system.files import check_new, write_whole
from shared.arm_description import read_arm
from shared.config_files import MAX_SIZE

ARMS = ".brickservo/arms"
"""Folder of arm files in the brick's home."""
MENU_LOGS = "brickservo-*.err.log"
"""Files in the brick's home that hold the errors of what its menu has started."""
MAX_LOGS, MAX_LOG_SIZE = 40, 1 << 25
"""Greatest number of logs that are fetched, the last by name, and greatest size of one, bytes."""
DEVICES = {
    "CON",
    "PRN",
    "AUX",
    "NUL",
    *(f"{port}{k}" for port in ("COM", "LPT") for k in range(10)),
}
"""Names that stand for something else on Windows, with whatever ending."""
FIGURES = ".brickservo/brick.json"
"""File on the brick for what its bench measures."""


async def put_arm(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    path: Path,
    replace: bool,
) -> None:
    """Put an arm file on the brick.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has typed it.
        path: the file here.
        replace: whether another one of that name there is replaced.

    Raises:
        BrickProblem: there is another one, or it cannot be put there.
        shared.arm_description.ArmError: it describes no arm.
    """
    read_arm(path)
    data = path.read_bytes().replace(b"\r\n", b"\n")
    name = path.name if path.suffix == ".ini" else f"{path.name}.ini"
    existing = await read(brick, f"{ARMS}/{name}")
    if existing not in (None, data) and not replace:
        raise BrickProblem(
            f"another {name} is on {address}, which may hold what was found out there: fetch it by "
            f"{COMMAND} arm --fetch {name[:-4]}, or put yours in its place with --replace"
        )
    if existing != data:
        await put(brick, f"{ARMS}/{name}", data)
    dialogue.report(f"{address}: programs there take it by --arm {shlex.quote(name[:-4])}")


async def fetch_arm(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    name: str,
    replace: bool,
) -> None:
    """Fetch an arm file of the brick's into this folder.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has typed it.
        name: name of the arm, with or without .ini.
        replace: whether another file of that name here is replaced.

    Raises:
        BrickProblem: there is none, or another one here.
    """
    file = f"{posixpath.basename(name).removesuffix('.ini')}.ini"
    data = await read(brick, f"{ARMS}/{file}")
    if data is None:
        raise BrickProblem(
            f"no {file} of its own is on {address}; there are: {await _arms(brick) or 'none'}"
        )
    here = Path(file)
    if not here.is_file() or here.read_bytes() != data:
        check_new(here, (".ini",), replace)
        write_whole(here, data)
    dialogue.report(f"{file} is here as it is on {address}")


async def list_arms(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> None:
    """Report the arm files of a brick."""
    dialogue.report(f"{address} has arms of its own: {await _arms(brick) or 'none'}")


async def _arms(brick: asyncssh.SSHClientConnection) -> str:
    found = await ask(brick, f"cd {ARMS} 2>/dev/null && ls -1")
    return ", ".join(one[:-4] for one in found.out.splitlines() if one.endswith(".ini"))


async def fetch_logs(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue, folder: Path
) -> None:
    """Fetch the logs of the last runs into a folder: the brick's, and those stored here.

    One that is there already as it is stays, and so does another one of that name.

    Raises:
        BrickProblem: there are none, or they cannot be fetched.
        OSError: they cannot be written.
    """
    # (What does not match stays a pattern, which names no file. A link is no log.)
    listed = await ask(
        brick,
        f"for one in {LOGS}/* {MENU_LOGS}; do "
        '[ ! -f "$one" ] || [ -L "$one" ] || echo "$one"; done',
    )
    if listed.status:
        raise BrickProblem(f"{address} cannot send its logs: {listed.errors.strip()}")
    places = listed.out.splitlines()
    logs = {posixpath.basename(one): one for one in places if is_log(one)}
    ours = [file for file in stored_runs() if is_of(file, address)]
    if not logs and not ours:
        raise BrickProblem(
            f"{address} has no logs; each {COMMAND} run leaves one, and so does what its menu "
            "starts where it fails"
        )
    folder.mkdir(parents=True, exist_ok=True)
    written = [_write_log(folder / file.name, file.read_bytes()) for file in ours]
    for name, place in sorted(logs.items())[-MAX_LOGS:]:
        try:
            data = await read(brick, place, most=MAX_LOG_SIZE)
        except BrickProblem as problem:
            dialogue.report(f"left out: {problem}")
            continue
        if data is not None:
            written.append(_write_log(folder / name, data))
    dialogue.report(f"in {folder}: {', '.join(sorted(written))}")
    if strange := len(places) - len(logs):
        dialogue.report(f"{strange} names there are none of logs, and are left out")


def is_log(place: str) -> bool:
    """Return True if a path on the brick is that of a log, by its name alone."""
    folder, name = posixpath.split(place)
    return (
        folder in (LOGS, "")
        and re.fullmatch(r"[\w-][\w.-]{0,99}[.](log|jsonl|txt)", name, re.ASCII) is not None
        and name.partition(".")[0].upper() not in DEVICES
    )


def _write_log(path: Path, data: bytes) -> str:
    """Write a log unless it is there; return its name, another one if that was taken."""
    k, free = 1, path
    while os.path.lexists(free):
        if free.is_file() and free.read_bytes() == data:
            return free.name
        k += 1
        free = path.with_name(f"{path.stem}-{k}{path.suffix}")
    write_whole(free, data)
    return free.name


async def bench(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    args: tuple[str, ...],
    file: Path,
) -> int:
    """Run bench_brick.py there, and fetch what it has measured; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has typed it.
        args: arguments of the script.
        file: file to write here.

    Raises:
        BrickProblem: it cannot be run.
        OSError: what it has measured cannot be written here.
    """
    await ask(brick, f"rm -f {FIGURES}")
    status = await run(brick, address, dialogue, "bench_brick.py", (*args, "--json", FIGURES))
    data = await read(brick, FIGURES, most=16 * MAX_SIZE)
    if data is not None:
        write_whole(file, data)
        dialogue.report(
            f"{file}: what was measured; simulate --constants {file} emulates this brick"
        )
    return status
