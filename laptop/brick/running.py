"""Programs on a terminal of the brick: their output comes here, typed input goes there.

A program of ours stops the arm when it is asked to end, and then ends in order: by Ctrl-C, which
the terminal there makes a SIGINT of, or by SIGHUP. That comes when the connection ends. But TCP
does not notice a laptop that sleeps, or a pulled cable, for minutes. So a watchdog runs beside the
program there: it gets a beat from the laptop every BEAT_PERIOD, and after SILENCE_TIMEOUT without
one it sends SIGHUP itself. It finds the program by a random token in its environment, for the
program's number is not known to it, and could be another's by then.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import shlex
import signal
import sys
import time
from collections.abc import Awaitable, Callable
from itertools import pairwise
from pathlib import Path, PurePosixPath

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import MAX_SILENCE, NoAnswer, ask, lines, within
from laptop.brick.connection import CUT, BrickAddress, Dialogue, shown_here
from laptop.brick.install import update
from laptop.brick.program_files import EXECUTABLE, HOLD, THIS_VERSION, program_files
from laptop.brick.remote_files import put
from laptop.brick.run_log import BrickRunLog
from laptop.brick.terminal import CTRL_C, on_signal, reading, window_size
from laptop.system import platforms
from shared.state import CODE

BEAT_PERIOD, SILENCE_TIMEOUT = 3.0, 15.0
"""Period of the laptop's beats to the watchdog, and its longest wait for one, s: radio stalls."""

LEAVING_PRESSES = 3
"""Number of the Ctrl-C by which the program is left to itself."""

OWN_SCRIPTS, LOGS = ".brickservo/scripts", ".brickservo/logs"
"""Folders on the brick for users' scripts, and for logs."""
SERVO, MAX_LOGS = "robot/visual_servoing.py", 10
"""The script that writes a log, and greatest number of logs that are stored there."""

PAIRS = ("robot/visual_servoing.py",), ("robot/tracking_client.py",), ("robot/driver.py", "check")
"""Scripts, and their first arguments, that may pair with a tracker: at the next one, if at any."""
OPTIONS = ("--code", "--cod", "--co")
"""Spellings of the option for the code."""
FLAGS = ("--wait", "--follow", "--low", "--take", "--camera")
"""Options of these scripts that take no value."""
CODE_FILE = ".brickservo/code-{token}"
TAKE_CODE = f"read -r {CODE} <{{file}}; rm -f {{file}}; export {CODE}; "
"""Shell commands that read a pairing code from a file: it stands in no command line."""
SWEEP_CODES = "find .brickservo -name 'code-*' -mmin +2 -exec rm -f {} +"
"""Command that removes such files that nobody read, as where the connection was cut."""

PROGRAM = HOLD + "; {before}exec env BRICK_RUN={token}.$$ {command}"
"""Command that starts a program with the token and its own number in its environment."""

ASKED_STATUS = 3
"""Exit status of WATCH where it has asked the program to end."""
WATCH = """exec bash -c '
while read -r -t {timeout:g} word; do [ "$word" != end ] || exit 0; done
status=0
for found in $(grep -lzx "BRICK_RUN={token}[.][0-9]*" /proc/[0-9]*/environ 2>/dev/null); do
    number=${{found//[!0-9]/}}  # but what it has started has its number, too
    if grep -qzx "BRICK_RUN={token}[.]$number" "$found"; then
        kill -HUP "$number" && status={asked}
    fi
done
exit $status'"""
"""The watchdog: asks a program to end once the laptop has been silent for too long, or is gone."""


async def run(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    script: str,
    args: tuple[str, ...],
    own_code: str | None = None,
) -> int:
    """Run a script of the program, or a file from here, on the brick; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has typed it.
        script: see `find_script`.
        args: its arguments.
        own_code: pairing code of this computer's own tracker, if it has one.

    Raises:
        BrickProblem: there is no such script, the program cannot be installed, or the connection is
            lost.
    """
    ours = find_script(script)
    await update(brick, address, dialogue)
    code, args = code_for(ours, args, own_code)
    if ours == SERVO and not any(arg.startswith("--log") for arg in args):
        args = (*args, "--log", await _new_log(brick))
    start = ours
    if not ours:
        own = f"{OWN_SCRIPTS}/{Path(script).name}"
        await put(brick, own, Path(script).read_bytes().replace(b"\r\n", b"\n"))
        start = f"PYTHONPATH={THIS_VERSION} python3 {shlex.quote(own)}"
    before = ""
    if code is not None:
        await ask(brick, SWEEP_CODES)
        file = CODE_FILE.format(token=secrets.token_hex(4))
        await put(brick, file, f"{code}\n".encode(), private=True)
        before = TAKE_CODE.format(file=file)
    with BrickRunLog(address, (script, *args), dialogue.report) as log:
        command = " ".join([start, *map(shlex.quote, args)])
        log.status = await watched(
            brick,
            address,
            dialogue,
            command,
            lambda program: on_terminal(brick, program, log.add),
            before,
        )
        return log.status


def code_for(
    ours: str, args: tuple[str, ...], own_code: str | None
) -> tuple[str | None, tuple[str, ...]]:
    """Return the pairing code that a script may need, and its arguments without it.

    It is the one that was typed or is in the environment, else that of this computer's own tracker,
    unless another host is named.

    Args:
        ours: path of a script of the program; "" for another one, which needs none.
        args: as typed.
        own_code: see `run`.
    """
    pair = next((start for start in PAIRS if (ours, *args)[: len(start)] == start), None)
    if pair is None:
        return None, args
    others: list[str] = []
    typed = None
    rest = list(args)
    while rest:
        arg = rest.pop(0)
        name, equals, value = arg.partition("=")
        if name not in OPTIONS or not (equals or rest):
            others.append(arg)
        else:
            typed = value if equals else rest.pop(0)
    code = typed if typed is not None else os.environ.get(CODE) or None
    place = next(
        (
            arg
            for before, arg in pairwise(["", *others[len(pair) - 1 :]])
            if arg[:1] != "-" and (before[:1] != "-" or before in FLAGS)
        ),
        "",
    )
    if code is None and (not place or place[0] == ":"):
        code = own_code
    return code, tuple(others)


async def shell(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> int:
    """Open a shell on the brick; return the exit status of its last command."""
    return await on_terminal(brick, None)


def _scripts() -> dict[str, str]:
    """Return the program's scripts: file name -> path on the brick."""
    return {
        PurePosixPath(path).name: path
        for path, file in program_files().items()
        if path.startswith("robot/") and file.mode == EXECUTABLE
    }


def find_script(script: str) -> str:
    """Return the path on the brick of a bundled script; "" for a user's own file.

    Args:
        script: its path, its name, its name without .py, or a file here.

    Raises:
        BrickProblem: there is none.
    """
    scripts = _scripts()
    if script in scripts.values():
        return script
    ours = scripts.get(f"{script.removesuffix('.py')}.py", "")
    if not ours and not Path(script).is_file():
        raise BrickProblem(
            f"there is no script {script} here; give a file, or one of {', '.join(scripts)}"
        )
    return ours


async def _new_log(brick: asyncssh.SSHClientConnection) -> str:
    """Return the name of a new log there, and remove all but the last ones."""
    command = f"ls -1 [0-9]*-servo.jsonl 2>/dev/null | head -n -{MAX_LOGS - 1} | xargs -r rm -f"
    await ask(brick, f"mkdir -p {LOGS} && cd {LOGS} && {command}")
    # By this computer's clock: a brick's may start anew with each day.
    return f"{LOGS}/{time.strftime('%Y-%m-%d-%H%M%S')}-servo.jsonl"


async def watched(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    command: str,
    follow: Callable[[str], Awaitable[int]],
    before: str = "",
) -> int:
    """Run a command that is asked to end when the laptop falls silent; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has started it.
        command: for the brick's shell.
        follow: called with a command to start; follows it to its end, and returns its exit status.
        before: shell commands that come first.

    Raises:
        BrickProblem: the connection is lost.
    """
    token = secrets.token_hex(8)
    program = PROGRAM.format(token=token, before=before, command=command)
    try:
        watch = await brick.create_process(
            WATCH.format(timeout=SILENCE_TIMEOUT, token=token, asked=ASKED_STATUS),
            encoding=None,
            stderr=asyncssh.STDOUT,
        )
        beating = asyncio.ensure_future(_beat(watch, dialogue))
        try:
            status = await follow(program)
        finally:
            beating.cancel()
        with contextlib.suppress(BrokenPipeError):  # it has ended: it has asked the program to
            watch.stdin.write(b"end\n")
        with contextlib.suppress(NoAnswer):  # the program has ended, and that counts
            async for _ in lines(watch.stdout):
                pass  # the shell there may complain
            await within(MAX_SILENCE, watch.wait_closed())
        if watch.exit_status == ASKED_STATUS:
            dialogue.report(
                f"{address} heard nothing of this computer for {SILENCE_TIMEOUT:g} s, as where it "
                "sleeps or radio stalls, and has asked the program to stop the arm"
            )
        return status
    except CUT:
        raise BrickProblem(
            f"the connection to {address} is lost; the program there is asked to stop the arm "
            f"within {SILENCE_TIMEOUT:g} s. See that it does, and look at the cable"
        ) from None


async def _beat(watch: asyncssh.SSHClientProcess[bytes], dialogue: Dialogue) -> None:
    while not watch.stdin.is_closing():
        watch.stdin.write(b"beat\n")
        await asyncio.sleep(BEAT_PERIOD)
    await watch.wait_closed()
    if watch.exit_status != ASKED_STATUS:
        dialogue.report(
            "the watch on the brick has ended, as for want of memory; if this computer falls "
            "silent now, nothing there stops the arm: press Ctrl-C, and start again"
        )


async def on_terminal(
    brick: asyncssh.SSHClientConnection,
    command: str | None,
    on_output: Callable[[bytes], None] = lambda data: None,
) -> int:
    """Run a command, or a shell, on a terminal there as if it were here; return its exit status.

    Args:
        brick: the connection.
        command: for the brick's shell; None for that shell itself.
        on_output: called with all that is written there.

    Raises:
        asyncssh.ConnectionLost: it has not come to its end.
        BrickProblem: somebody has left it to itself.
        NobodyReads: its output is read no more; the terminal there is hung up.
    """
    process = await _start_on_terminal(brick, command)
    asked = 0

    def is_left() -> bool:
        return asked >= LEAVING_PRESSES and command is not None

    def send(data: bytes) -> None:
        nonlocal asked
        asked += data.count(CTRL_C)
        if is_left():
            brick.abort()
        elif not process.stdin.is_closing():
            process.stdin.write(data)

    def resize() -> None:
        if not process.stdin.is_closing():
            process.change_terminal_size(*window_size())

    with (
        platforms.keys_one_by_one(),
        reading(send),
        on_signal(signal.SIGINT, lambda: send(CTRL_C)),
        on_signal(platforms.TERMINAL_CHANGES, resize),
    ):
        try:
            await _show(process, on_output)
        except CUT:
            if not is_left():
                raise
    if is_left() and process.returncode is None:
        raise BrickProblem(
            "left to itself at the third Ctrl-C: the program is asked once more to stop the arm, "
            f"within {SILENCE_TIMEOUT:g} s. See that it does",
            130,
        )
    if process.returncode is None:
        raise asyncssh.ConnectionLost("no exit status")
    return process.returncode if process.returncode >= 0 else 128 - process.returncode


async def _start_on_terminal(
    brick: asyncssh.SSHClientConnection, command: str | None
) -> asyncssh.SSHClientProcess[bytes]:
    """Start a command, or a shell, on a terminal there that is like the one here."""
    typed = sys.stdin is not None and sys.stdin.isatty()
    modes = {} if typed else {asyncssh.PTY_ECHO: 0}
    if not sys.stdout.isatty():
        modes[asyncssh.PTY_ONLCR] = 0
    return await brick.create_process(
        command,
        term_type=os.environ.get("TERM") or "vt100",
        term_size=window_size(),
        term_modes=modes,
        encoding=None,
        stderr=asyncssh.STDOUT,
    )


async def _show(
    process: asyncssh.SSHClientProcess[bytes], on_output: Callable[[bytes], None]
) -> None:
    """Write here what is written there, to its end; `on_output` is called with it."""
    while data := await process.stdout.read(1 << 16):
        on_output(data)
        with shown_here():
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()
    await within(MAX_SILENCE, process.wait_closed())
