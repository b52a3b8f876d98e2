"""Programs on the brick, on a terminal there: what they write comes here, what is typed goes there.

A program of ours stops the arm when it is asked to end, and then ends in order: by Ctrl-C, which
the terminal there makes a SIGINT of, or by SIGHUP. That comes when the connection ends, and also
when it falls silent: a watch beside the program hears the laptop every few seconds, or asks it to
end.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import shlex
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath

import asyncssh

from laptop import system
from laptop.brick import BrickProblem
from laptop.brick.connection import CUT, BrickAddress, Dialogue, ask, shown_here
from laptop.brick.install import update
from laptop.brick.program_files import EXECUTABLE, program_files
from laptop.brick.remote_files import put

BEAT_PERIOD, SILENCE_TIMEOUT = 3.0, 15.0
"""Period of the laptop's beats to the watch, and how long it waits for one, s: radio stalls."""

CTRL_C, END_OF_INPUT = b"\x03", b"\x04"
LEAVES = 3
"""The Ctrl-C by which the program is left to itself."""

OWN_SCRIPTS, LOGS = ".brickservo/scripts", ".brickservo/logs"
"""Folders on the brick for scripts that are not ours, and for logs."""
SERVO, KEPT_LOGS = "robot/visual_servoing.py", 10
"""The script that keeps a log, and how many of them stay."""

PROGRAM = "exec env BRICK_RUN={token}.$$ {command}"
"""Starts a program that can be found again: by its number in its own environment."""

WATCH = """exec bash -c '
while read -r -t {timeout:g} word; do [ "$word" != end ] || exit 0; done
for found in $(grep -lzx "BRICK_RUN={token}[.][0-9]*" /proc/[0-9]*/environ 2>/dev/null); do
    number=${{found//[!0-9]/}}  # but what it has started has its number, too
    ! grep -qzx "BRICK_RUN={token}[.]$number" "$found" || kill -HUP "$number"
done'"""
"""Asks it to end once the laptop has been silent for too long, or gone without a word."""


async def run(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    script: str,
    words: tuple[str, ...],
) -> int:
    """Run a script of the program, or a file from here, on the brick; return its exit status.

    Raises:
        BrickProblem: there is no such script, the program cannot be installed, or the connection is
            lost.
    """
    ours = _ours(script)
    own = Path() if ours else _own(script)
    await update(brick, address, dialogue)
    if ours == SERVO and not any(word.startswith("--log") for word in words):
        words = (*words, "--log", await _new_log(brick))
    if not ours:
        await put(brick, f"{OWN_SCRIPTS}/{own.name}", own.read_bytes().replace(b"\r\n", b"\n"))
    start = ours or f'PYTHONPATH="$HOME" python3 {shlex.quote(f"{OWN_SCRIPTS}/{own.name}")}'
    return await _watched(brick, address, dialogue, " ".join([start, *map(shlex.quote, words)]))


async def shell(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> int:
    """Let somebody type commands there; return the exit status of the last one."""
    return await on_terminal(brick, dialogue, None)


def _scripts() -> dict[str, str]:
    """Return the program's scripts: file name -> path on the brick."""
    return {
        PurePosixPath(path).name: path
        for path, file in program_files().items()
        if path.startswith("robot/") and file.mode == EXECUTABLE
    }


def _ours(script: str) -> str | None:
    """Return the path of a script of the program, by its path, name or name without .py."""
    scripts = _scripts()
    return script if script in scripts.values() else scripts.get(f"{script.removesuffix('.py')}.py")


def _own(script: str) -> Path:
    """Return a file of somebody's own.

    Raises:
        BrickProblem: there is none.
    """
    path = Path(script)
    if path.is_file():
        return path
    raise BrickProblem(
        f"there is no script {script}; give a file, or one of {', '.join(_scripts())}"
    )


async def _new_log(brick: asyncssh.SSHClientConnection) -> str:
    """Return the name of a new log there, and remove all but the last ones."""
    keep = f"ls -1 [0-9]*-servo.jsonl 2>/dev/null | head -n -{KEPT_LOGS - 1} | xargs -r rm -f"
    await ask(brick, f"mkdir -p {LOGS} && cd {LOGS} && {keep}")
    # By this computer's clock: a brick's may start anew with each day.
    return f"{LOGS}/{time.strftime('%Y-%m-%d-%H%M%S')}-servo.jsonl"


async def _watched(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue, command: str
) -> int:
    """Run a command that is asked to end when the laptop falls silent; return its exit status."""
    token = secrets.token_hex(8)
    program = PROGRAM.format(token=token, command=command)
    try:
        watch = await brick.create_process(
            WATCH.format(timeout=SILENCE_TIMEOUT, token=token), encoding="utf-8"
        )
        beating = asyncio.ensure_future(_beat(watch, dialogue))
        try:
            status = await on_terminal(brick, dialogue, program)
        finally:
            beating.cancel()
        if not watch.stdin.is_closing():
            watch.stdin.write("end\n")
        await watch.wait()
        return status
    except CUT:
        raise BrickProblem(
            f"the connection to {address} is lost; the program there is asked to stop the arm "
            f"within {SILENCE_TIMEOUT:g} s. See that it does, and look at the cable"
        ) from None


async def _beat(watch: asyncssh.SSHClientProcess, dialogue: Dialogue) -> None:
    while not watch.stdin.is_closing():
        watch.stdin.write("beat\n")
        await asyncio.sleep(BEAT_PERIOD)
    dialogue.say(
        "the watch on the brick has ended, after a long silence or for want of memory; if this "
        "computer falls silent now, nothing there stops the arm: press Ctrl-C, and start again"
    )


async def on_terminal(
    brick: asyncssh.SSHClientConnection, dialogue: Dialogue, command: str | None
) -> int:
    """Run a command, or a shell, on a terminal there as if it were here; return its exit status.

    Raises:
        asyncssh.ConnectionLost: it has not come to its end.
        NobodyReads: its output is read no more; the terminal there is hung up.
    """
    typed = sys.stdin is not None and sys.stdin.isatty()
    modes = {} if typed else {asyncssh.PTY_ECHO: 0}
    if not sys.stdout.isatty():
        modes[asyncssh.PTY_ONLCR] = 0
    process = await brick.create_process(
        command,
        term_type=os.environ.get("TERM") or "vt100",
        term_size=shutil.get_terminal_size(),
        term_modes=modes,
        encoding=None,
    )
    asked = 0

    def send(data: bytes) -> None:
        nonlocal asked
        asked += data.count(CTRL_C)
        if asked >= LEAVES and command is not None:
            dialogue.say("left to itself: the program is asked once more to stop the arm")
            brick.abort()
        elif not process.stdin.is_closing():
            process.stdin.write(data)

    with system.keys_one_by_one(), _reading(send), _ctrl_c(lambda: send(CTRL_C)):
        while data := await process.stdout.read(1 << 16):
            with shown_here():
                sys.stdout.buffer.write(data)
                sys.stdout.buffer.flush()
        await process.wait_closed()
    if process.returncode is None:
        raise asyncssh.ConnectionLost("no exit status")
    return process.returncode if process.returncode >= 0 else 128 - process.returncode


@contextlib.contextmanager
def _reading(send: Callable[[bytes], None]) -> Iterator[None]:
    """Hand over what comes on standard input, for a `with` block; then its end, if it has one."""
    loop, going_on = asyncio.get_running_loop(), True

    def hand_over(data: bytes) -> None:
        if going_on:
            send(data or END_OF_INPUT)

    def read() -> None:
        with contextlib.suppress(OSError, RuntimeError):  # there is no input, or no loop any more
            while data := system.read_typed():
                loop.call_soon_threadsafe(hand_over, data)
            loop.call_soon_threadsafe(hand_over, b"")

    threading.Thread(target=read, daemon=True).start()
    try:
        yield
    finally:
        going_on = False


@contextlib.contextmanager
def _ctrl_c(interrupt: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C call this, for a `with` block, where the terminal makes a signal of it."""
    loop = asyncio.get_running_loop()
    before = signal.signal(
        signal.SIGINT, lambda number, frame: loop.call_soon_threadsafe(interrupt)
    )
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
