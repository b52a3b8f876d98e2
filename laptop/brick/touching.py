"""Points touched with the arm on the brick: each comes here as it is taken."""

from __future__ import annotations

import asyncio
import shlex
import signal
from collections.abc import Callable

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import SILENCE, lines, within
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.install import update
from laptop.brick.running import watched
from laptop.brick.terminal import CTRL_C, END_OF_INPUT, on_signal, reading
from laptop.system import platforms
from shared.message_fields import printable

DRIVER, PROBLEM = "robot/driver.py", "driver.py: "
"""The program there, and how it begins to tell what is wrong."""
TAKE, END = b"\n", b"q\n"
"""What the program there reads: a point is to be taken, or that was the last one."""
STOPPED = 130


async def touch(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    words: tuple[str, ...],
    take: Callable[[str], bool],
    skip: Callable[[], bool],
) -> None:
    """Let somebody touch points with the arm; Enter here takes one, too, s skips, q ends.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who sits here.
        words: further options of `driver.py touch --json`.
        take: called in a thread of its own with the line of each point; whether that was the last.
        skip: called where somebody wants no point of this place; whether that was the last.

    Raises:
        BrickProblem: it cannot be done, was stopped, or the connection is lost.
        Exception: what `take` raises, once the arm is held again.
    """
    await update(brick, address, dialogue)
    command = " ".join([DRIVER, "touch", "--json", *map(shlex.quote, words)])
    failed: list[BaseException] = []
    said: list[str] = []
    stopped = False

    async def follow(program: str) -> int:
        nonlocal stopped
        process = await brick.create_process(program, encoding=None)

        def write(data: bytes) -> None:
            if not process.stdin.is_closing():
                process.stdin.write(data)

        def typed(data: bytes) -> None:
            nonlocal stopped
            for key in data if data != END_OF_INPUT else b"":
                letter = bytes((key,)).lower()
                if letter in b"\r\n ":
                    write(TAKE)
                elif letter == b"s":
                    if skip():
                        write(END)
                elif letter in (b"q", CTRL_C):
                    stopped = stopped or letter == CTRL_C
                    write(END)

        async def listen() -> None:
            async for raw in lines(process.stderr, None, None):
                line = printable(raw.rstrip())
                if line.startswith(PROBLEM):
                    said[:] = [line.removeprefix(PROBLEM)]
                elif line and not line.startswith("point "):  # told here with the camera's part
                    dialogue.say(line)

        listening = asyncio.ensure_future(listen())
        with (
            platforms.keys_one_by_one(),
            reading(typed),
            on_signal(signal.SIGINT, lambda: typed(CTRL_C)),
        ):
            async for line in lines(process.stdout, None, None):
                if failed or not line.startswith("{"):
                    continue
                try:
                    if await asyncio.to_thread(take, line):
                        write(END)
                except Exception as problem:
                    failed.append(problem)
                    write(END)
            await within(SILENCE, process.wait_closed())
        await within(SILENCE, listening)
        return process.returncode if process.returncode is not None else 1

    status = await watched(brick, address, dialogue, command, follow)
    if failed:
        raise failed[0]
    if stopped:
        raise BrickProblem("stopped: nothing is written, and the arm is held", STOPPED)
    if status:
        why = said[-1] if said else "it was killed, or there was no memory"
        raise BrickProblem(f"{address}: touch has ended: {why}")
