"""The ssh key by which this computer logs in to a brick without a password."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import ask
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.known_hosts import ssh_folder

NAMES = "id_ed25519", "id_ecdsa", "id_rsa"
"""Files in ~/.ssh that every ssh takes; the first is the one that is made."""

TRUST = """
set -e
umask 077
mkdir -p .ssh
[ -z "$(tail -c 1 .ssh/authorized_keys 2>/dev/null)" ] || echo >>.ssh/authorized_keys
grep -qsxF {key} .ssh/authorized_keys || echo {key} >>.ssh/authorized_keys
"""
"""Script that lets a key in, once; what stands there already stays."""


async def trust(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> None:
    """Authorize this computer's key on a brick; a key is made where there is none.

    Raises:
        BrickProblem: this computer has no key that can be used, or the brick does not take it.
    """
    file, key = _own_key(dialogue)
    line = key.export_public_key("openssh").decode().strip()
    done = await ask(brick, TRUST.format(key=shlex.quote(line)))
    if done.status:
        raise BrickProblem(f"{address} does not take the key: {done.errors.strip() or done.status}")
    dialogue.report(f"{address} lets this computer in by {file} from now on, without a password")


def _own_key(dialogue: Dialogue) -> tuple[Path, asyncssh.SSHKey]:
    """Return the key of this user's ssh, and where it is.

    Raises:
        BrickProblem: it cannot be read or made.
    """
    folder = ssh_folder()
    file = next((folder / name for name in NAMES if (folder / name).exists()), folder / NAMES[0])
    try:
        if not file.exists():
            key = asyncssh.generate_private_key("ssh-ed25519")
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with open(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as made:
                made.write(key.export_private_key("openssh"))
            file.with_name(file.name + ".pub").write_bytes(key.export_public_key("openssh"))
            dialogue.report(f"a key is made for this computer: {file}")
        return file, asyncssh.read_private_key(str(file))
    except ValueError as error:  # it is encrypted, or no key
        raise BrickProblem(
            f"{file}: {error}; a key with a passphrase is for your ssh: ssh-copy-id puts it there"
        ) from None
    except OSError as error:
        raise BrickProblem(f"cannot make or read a key: {error.strerror}: {file}") from None
