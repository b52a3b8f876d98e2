"""Answers of a brick to commands, in bounded time and size, whatever is there instead of a brick.

Three bounds hold, each against another fault. The silence is bounded, against a program that hangs;
the total time, against one that sends a byte now and then; the size, against one that sends without
end. What the brick takes counts as a sign of life, too: a slow card is busy with it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable
from dataclasses import dataclass
from typing import Any, TypeVar

import asyncssh

T = TypeVar("T")

MAX_SILENCE = 30.0
"""Longest time in which a brick neither sends nor takes anything where an answer is due, s."""
MAX_ANSWER_TIME = 600.0
"""Longest time of an answer, s: files go both ways in it."""
MAX_ANSWER, MAX_ERRORS = 1 << 20, 1 << 16
"""Greatest size of an answer, and of what is stored of its errors, bytes."""
MAX_LINE = 1 << 16
"""Greatest size of a line, bytes."""
CHUNK_SIZE = 1 << 15
"""Size of what is read or written at once, bytes."""


class NoAnswer(Exception):
    """A brick's answer does not come to its end; the text follows the brick's name."""


@dataclass(frozen=True)
class Answer:
    """The end of a command on the brick.

    Args:
        status: exit status.
        data: standard output.
        errors: standard error, as far as it is stored.
    """

    status: int
    data: bytes
    errors: str

    @property
    def out(self) -> str:
        """Standard output as text."""
        return self.data.decode(errors="replace")


async def within(seconds: float | None, coming: Awaitable[T]) -> T:
    """Return the result of an awaitable.

    Args:
        seconds: timeout, s; None: without.
        coming: the awaitable.

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
    most: int = MAX_ANSWER,
    silence: float = MAX_SILENCE,
) -> Answer:
    """Run a command and return its Answer.

    Args:
        brick: the connection.
        command: for the brick's shell, in its home.
        given: bytes for its standard input.
        most: greatest size of its output, bytes.
        silence: longest time in which it neither takes nor sends anything, s.

    Raises:
        asyncssh.ConnectionLost: it has not come to its end.
        NoAnswer: it is silent for too long, takes too long, or sends too much.
    """
    return await _RemoteCommand(brick, command, given, most, silence).answer()


class _RemoteCommand:
    """A command on the brick that is being answered; see `ask` for its arguments."""

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
        self._began = self._active_at = self._now()

    async def answer(self) -> Answer:
        """Return its answer, or raise where it takes too long, see `ask`."""
        now = self._now
        coming = asyncio.ensure_future(self._run())
        try:
            while not coming.done():
                left = min(self._active_at + self._silence, self._began + MAX_ANSWER_TIME) - now()
                if left <= 0:
                    is_silent = now() - self._active_at >= self._silence
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
                self._receive(process.stdout, self._most, self._most),
                self._receive(process.stderr, self._most, MAX_ERRORS),
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
            for k in range(0, len(self._given), CHUNK_SIZE):
                process.stdin.write(self._given[k : k + CHUNK_SIZE])
                await process.stdin.drain()
                self._active_at = self._now()
            process.stdin.write_eof()
        except (BrokenPipeError, ConnectionResetError):
            pass  # it has ended without reading all of it: its status says why
        return b""

    async def _receive(self, stream: Any, most: int, stored: int) -> bytes:
        """Return the first `stored` bytes of a stream that may have `most`."""
        data, total = bytearray(), 0
        while more := await stream.read(CHUNK_SIZE):
            self._active_at = self._now()
            total += len(more)
            if total > most:
                raise _endless(most)
            data += more[: stored - len(data)]
        return bytes(data)


async def lines(
    stream: Any, most: int | None = MAX_ANSWER, silence: float | None = MAX_SILENCE
) -> AsyncIterator[str]:
    """Yield the lines that come, without their ends.

    Args:
        stream: of bytes, such as the standard output of a process there.
        most: greatest size of all lines, bytes; None: unbounded.
        silence: longest time in which nothing comes, s; None: unbounded.

    Raises:
        NoAnswer: a line, or all of them, are too long, or nothing comes.
    """
    rest, total = b"", 0
    while data := await within(silence, stream.read(CHUNK_SIZE)):
        total += len(data)
        *complete, rest = (rest + data).split(b"\n")
        if len(rest) > MAX_LINE:
            raise _endless(MAX_LINE)
        if most is not None and total > most:
            raise _endless(most)
        for line in complete:
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
        f"has taken {MAX_ANSWER_TIME / 60:g} minutes for one answer, and has not come to its end; "
        "is the network so slow? Come nearer, or take a cable"
    )
