"""What a brick answers to a command: in bounded time and size, whatever is there instead of one."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable
from dataclasses import dataclass
from typing import Any, TypeVar

import asyncssh

T = TypeVar("T")

SILENCE = 30.0
"""For so long a brick may say no word, and take none, where an answer is due, s."""
LONGEST = 600.0
"""For so long an answer may come, s: files go both ways in it."""
MOST_ANSWER, KEPT_ERRORS = 1 << 20, 1 << 16
"""Bytes of an answer, and of its errors those that are kept."""
MOST_LINE = 1 << 16
"""Bytes of a line."""
CHUNK = 1 << 15


class NoAnswer(Exception):
    """What a brick answers has no end; begins with what is to follow its name."""


@dataclass(frozen=True)
class Answer:
    """The end of a command on the brick: exit status, output and errors."""

    status: int
    data: bytes
    errors: str

    @property
    def out(self) -> str:
        """The output as text."""
        return self.data.decode(errors="replace")


async def within(seconds: float | None, coming: Awaitable[T]) -> T:
    """Return what comes.

    Args:
        seconds: in which it has to; None: whenever it will.
        coming: what is waited for.

    Raises:
        NoAnswer: it has not come by then.
    """
    try:
        return await asyncio.wait_for(coming, seconds)
    except asyncio.TimeoutError:
        raise _silent(seconds or 0.0) from None


async def ask(
    brick: asyncssh.SSHClientConnection,
    command: str,
    given: bytes = b"",
    most: int = MOST_ANSWER,
    silence: float = SILENCE,
) -> Answer:
    """Run a command and return its Answer.

    Args:
        brick: the connection.
        command: for the brick's shell, in its home.
        given: bytes for its standard input.
        most: bytes of its output.
        silence: for which it may neither take nor say anything, s.

    Raises:
        asyncssh.ConnectionLost: it has not come to its end.
        NoAnswer: it goes on without a word, or for ever.
    """
    return await _Asked(brick, command, given, most, silence).answer()


class _Asked:
    """A command on the brick that is being answered; it knows when anything was heard last."""

    def __init__(
        self,
        brick: asyncssh.SSHClientConnection,
        command: str,
        given: bytes,
        most: int,
        silence: float,
    ) -> None:
        self._brick, self._command = brick, command
        self._given, self._most, self._silence = given, most, silence
        self._now = asyncio.get_running_loop().time
        self._began = self._heard = self._now()

    async def answer(self) -> Answer:
        """Return its answer, or raise where it takes too long, see `ask`."""
        now = self._now
        coming = asyncio.ensure_future(self._run())
        try:
            while not coming.done():
                left = min(self._heard + self._silence, self._began + LONGEST) - now()
                if left <= 0:
                    is_silent = now() - self._heard >= self._silence
                    raise _silent(self._silence) if is_silent else _slow()
                await asyncio.wait({coming}, timeout=left)
            return coming.result()
        finally:
            coming.cancel()
            await asyncio.wait({coming})

    async def _run(self) -> Answer:
        process = await self._brick.create_process(self._command, encoding=None)
        parts = [
            asyncio.ensure_future(part)
            for part in (
                self._hear(process.stdout, self._most, self._most),
                self._hear(process.stderr, self._most, KEPT_ERRORS),
                self._send(process),
            )
        ]
        try:
            out, errors, _ = await asyncio.gather(*parts)
            await process.wait_closed()
        finally:
            for part in parts:
                part.cancel()
            process.close()
        if process.exit_status is None:
            raise asyncssh.ConnectionLost("no exit status")
        return Answer(process.returncode or 0, out, errors.decode(errors="replace"))

    async def _send(self, process: asyncssh.SSHClientProcess[bytes]) -> bytes:
        try:
            for k in range(0, len(self._given), CHUNK):
                process.stdin.write(self._given[k : k + CHUNK])
                await process.stdin.drain()
                self._heard = self._now()
            process.stdin.write_eof()
        except (BrokenPipeError, ConnectionResetError):
            pass  # it has ended without hearing all of it: its status says why
        return b""

    async def _hear(self, stream: Any, most: int, kept: int) -> bytes:
        data, total = bytearray(), 0
        while more := await stream.read(CHUNK):
            self._heard = self._now()
            total += len(more)
            if total > most:
                raise _endless(most)
            data += more[: kept - len(data)]
        return bytes(data)


async def lines(
    stream: Any, most: int | None = MOST_ANSWER, silence: float | None = SILENCE
) -> AsyncIterator[str]:
    """Yield the lines that come, without their ends.

    Args:
        stream: of bytes, such as the standard output of a process there.
        most: bytes of them all; None: as many as will come.
        silence: for which nothing may come, s; None: as long as it likes.

    Raises:
        NoAnswer: one, or all of them, are longer than that, or nothing comes.
    """
    rest, total = b"", 0
    while data := await within(silence, stream.read(CHUNK)):
        total += len(data)
        *whole, rest = (rest + data).split(b"\n")
        if len(rest) > MOST_LINE:
            raise _endless(MOST_LINE)
        if most is not None and total > most:
            raise _endless(most)
        for line in whole:
            yield line.decode(errors="replace")
    if rest:
        yield rest.decode(errors="replace")


def _silent(seconds: float) -> NoAnswer:
    return NoAnswer(
        f"has not said a word for {seconds:g} s; is it busy with something else? Wait a minute, or "
        "switch it off and on, and try again"
    )


def _endless(most: int) -> NoAnswer:
    return NoAnswer(
        f"says more than {most / 1000:.0f} kB where much less is due; is it a brick of yours? "
        "Nothing of it is taken"
    )


def _slow() -> NoAnswer:
    return NoAnswer(
        f"has taken {LONGEST / 60:g} minutes for one answer, and has not come to its end; is the "
        "network so slow? Come nearer, or take a cable"
    )
