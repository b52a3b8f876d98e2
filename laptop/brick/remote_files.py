"""Single files of a brick: read and written."""

from __future__ import annotations

import posixpath
import shlex

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import CHUNK_SIZE, ask
from shared.config_files import MAX_SIZE


async def put(
    brick: asyncssh.SSHClientConnection, target: str, data: bytes, private: bool = False
) -> None:
    """Write a file there, all of it or nothing.

    Args:
        brick: the connection.
        target: path of the file there.
        data: contents of the file.
        private: whether nobody else there may read it.

    Raises:
        BrickProblem: it cannot be written.
    """
    folder, path = shlex.quote(posixpath.dirname(target)), shlex.quote(target)
    new = f"{path}.new"
    # A connection that is cut ends the input there as if that were all of it.
    is_complete = f'[ "$(wc -c <{new})" -eq {len(data)} ]'
    write = f"mkdir -p {folder} && cat >{new} && {is_complete} && mv {new} {path}"
    write = f"umask 077; {write}" if private else write
    done = await ask(brick, write, data)
    if done.status:
        raise BrickProblem(f"the brick cannot take {target}: {done.errors.strip() or done.status}")


async def read(
    brick: asyncssh.SSHClientConnection, path: str, most: int = MAX_SIZE
) -> bytes | None:
    """Return the contents of a file on the brick, None if there is none.

    Args:
        brick: the connection.
        path: path of the file there.
        most: greatest size of the file, bytes.

    Raises:
        BrickProblem: it is too large to be one of ours.
    """
    quoted = shlex.quote(path)
    done = await ask(
        brick, f"[ -f {quoted} ] && head -c {most + 1} {quoted}", most=most + CHUNK_SIZE
    )
    if len(done.data) > most:
        raise BrickProblem(f"{path} on the brick has more than {most} bytes; it is none of ours")
    return None if done.status else done.data
