"""Points touched with the brick's arm by hand guiding, received one by one."""

from __future__ import annotations

import asyncio
import shlex
import signal
from collections.abc import Callable
from typing import Any

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import MAX_SILENCE, lines, within
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.install import update
from laptop.brick.running import watched
from laptop.brick.terminal import CTRL_C, END_OF_INPUT, on_signal, reading
from laptop.system import platforms
from shared.message_fields import printable

DRIVER, PROBLEM = "robot/driver.py", "driver.py: "
"""The program there, and the beginning of its line about a problem."""
TAKE, END = b"\n", b"q\n"
"""Lines that the program there reads: a point is to be taken, or that was the last one."""
STOPPED = 130
"""Exit status of a command that was stopped by Ctrl-C."""


async def touch(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    args: tuple[str, ...],
    on_point: Callable[[str], bool],
    on_skip: Callable[[], bool],
) -> None:
    """Let a user touch points with the arm; Enter takes a point, too, s skips, q ends.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who sits here.
        args: further options of `driver.py touch --json`.
        on_point: called in a thread of its own with the line of JSON of each point; returns whether
            that was the last.
        on_skip: called where somebody wants no point of this place; returns whether that was the
            last.

    Raises:
        BrickProblem: it cannot be done, was stopped, or the connection is lost.
        Exception: that of `on_point`, once the arm is held again.
    """
    await update(brick, address, dialogue)
    command = " ".join([DRIVER, "touch", "--json", *map(shlex.quote, args)])
    touching = _Touching(dialogue, on_point, on_skip)
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
    """The program on the brick that takes points, with a user at this computer.

    Args:
        dialogue, on_point, on_skip: see `touch`.

    Attributes:
        failed: exception of `on_point`; None: there was none.
        problem: problem that the program has printed; None: it has printed none.
        is_stopped: whether the user has given up.
    """

    def __init__(
        self, dialogue: Dialogue, on_point: Callable[[str], bool], on_skip: Callable[[], bool]
    ) -> None:
        self._dialogue, self._on_point, self._on_skip = dialogue, on_point, on_skip
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
            await self._handle_points(process.stdout, write)
            await within(MAX_SILENCE, process.wait_closed())
        await within(MAX_SILENCE, listening)
        return process.returncode if process.returncode is not None else 1

    def _type(self, letter: bytes, write: Callable[[bytes], None]) -> None:
        """Handle a key."""
        if letter in b"\r\n ":
            write(TAKE)
        elif letter == b"s":
            if self._on_skip():
                write(END)
        elif letter in (b"q", CTRL_C):
            self.is_stopped = self.is_stopped or letter == CTRL_C
            write(END)

    async def _handle_points(self, stream: Any, write: Callable[[bytes], None]) -> None:
        """Call `on_point` with each point that the program prints, until one fails."""
        async for line in lines(stream, None, None):
            if self.failed or not line.startswith("{"):
                continue
            try:
                if await asyncio.to_thread(self._on_point, line):
                    write(END)
            except Exception as problem:
                self.failed = problem
                write(END)

    async def _listen(self, stream: Any) -> None:
        """Pass on what the program prints for people."""
        async for raw in lines(stream, None, None):
            line = printable(raw.rstrip())
            if line.startswith(PROBLEM):
                self.problem = line.removeprefix(PROBLEM)
            elif line and not line.startswith("point "):  # printed here with the camera's part
                self._dialogue.report(line)
