"""Points touched with the arm on the brick: each comes here as it is taken."""

from __future__ import annotations

import asyncio
import shlex
import signal
from collections.abc import Callable
from typing import Any

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
    touching = _Touching(dialogue, take, skip)
    status = await watched(
        *(brick, address, dialogue, command),
        lambda program: touching.follow(brick, program),
    )
    if touching.failed:
        raise touching.failed
    if touching.is_stopped:
        raise BrickProblem("stopped: nothing is written, and the arm is held", STOPPED)
    if status:
        why = touching.problem
        if why is None:
            why = "it was killed, or there was no memory"
        raise BrickProblem(f"{address}: touch has ended: {why}")


class _Touching:
    """The program on the brick that touches, while somebody sits here.

    Args:
        dialogue, take, skip: see `touch`.

    Attributes:
        failed: what `take` has raised; None: nothing.
        problem: what is wrong by that program; None: it has not said.
        is_stopped: somebody has given up.
    """

    def __init__(
        self, dialogue: Dialogue, take: Callable[[str], bool], skip: Callable[[], bool]
    ) -> None:
        self._dialogue, self._take, self._skip = dialogue, take, skip
        self.failed: Exception | None = None
        self.problem: str | None = None
        self.is_stopped = False

    async def follow(self, brick: asyncssh.SSHClientConnection, program: str) -> int:
        """Run it to its end; return its exit status."""
        process = await brick.create_process(program, encoding=None)

        def write(data: bytes) -> None:
            if not process.stdin.is_closing():
                process.stdin.write(data)

        def typed(data: bytes) -> None:
            for key in data if data != END_OF_INPUT else b"":
                self._type(bytes((key,)).lower(), write)

        listening = asyncio.ensure_future(self._listen(process.stderr))
        with (
            platforms.keys_one_by_one(),
            reading(typed),
            on_signal(signal.SIGINT, lambda: typed(CTRL_C)),
        ):
            await self._take_points(process.stdout, write)
            await within(SILENCE, process.wait_closed())
        await within(SILENCE, listening)
        return process.returncode if process.returncode is not None else 1

    def _type(self, letter: bytes, write: Callable[[bytes], None]) -> None:
        """Take in a key."""
        if letter in b"\r\n ":
            write(TAKE)
        elif letter == b"s":
            if self._skip():
                write(END)
        elif letter in (b"q", CTRL_C):
            self.is_stopped = self.is_stopped or letter == CTRL_C
            write(END)

    async def _take_points(self, stream: Any, write: Callable[[bytes], None]) -> None:
        """Hand on each point that the program tells, until one fails."""
        async for line in lines(stream, None, None):
            if self.failed or not line.startswith("{"):
                continue
            try:
                if await asyncio.to_thread(self._take, line):
                    write(END)
            except Exception as problem:
                self.failed = problem
                write(END)

    async def _listen(self, stream: Any) -> None:
        """Take in what the program says to people."""
        async for raw in lines(stream, None, None):
            line = printable(raw.rstrip())
            if line.startswith(PROBLEM):
                self.problem = line.removeprefix(PROBLEM)
            elif line and not line.startswith("point "):  # told here with the camera's part
                self._dialogue.say(line)
