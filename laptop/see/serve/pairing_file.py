"""The file that holds this laptop's pairing code and its salt, one line each."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from laptop.system.files import write_whole
from shared import message_fields, pairing
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_text
from shared.state import PAIRING_FILE, state_folder


class BadPairing(ArmError, OSError):
    """The file with the pairing code cannot be read, written or understood."""


class Pairing(NamedTuple):
    """Code and salt that bricks pair with.

    Attributes:
        code: as shared.pairing.read_code returns it.
        salt: 32 hex digits, made with the code.
    """

    code: str
    salt: str


def known_code() -> str | None:
    """Return this laptop's pairing code, as people write it; None where there is none to be read.

    Brick programs that this laptop starts are given it: nobody has to type it.
    """
    try:
        code, _, _ = read_text(Path(state_folder()) / PAIRING_FILE).partition("\n")
        return pairing.show_code(pairing.read_code(code))
    except (OSError, InvalidFile, pairing.BadCode):
        return None


def read_pairing(
    folder: Path | None = None, report: Callable[[str], None] = lambda line: None
) -> Pairing:
    """Read this laptop's pairing code and salt; make them when they are first asked for.

    A code of an earlier version is replaced.

    Args:
        folder: None takes $BRICKSERVO_STATE, or ~/.brickservo.
        report: called with a line if a code was replaced.

    Raises:
        BadPairing: naming the file and what to do.
    """
    file = (folder or Path(state_folder())) / PAIRING_FILE
    try:
        with contextlib.suppress(FileNotFoundError):
            code, _, salt = read_text(file).partition("\n")
            try:
                found = Pairing(pairing.read_code(code), message_fields.NONCE(salt.strip()))
                if file.stat().st_mode & 0o077:
                    file.chmod(0o600)
                return found
            except pairing.OldCode:
                report(
                    "the pairing code was one of an earlier version, too short, and is replaced; "
                    "type the command with the new one on the brick, once"
                )
        made = Pairing(pairing.new_code(), pairing.new_nonce())
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        text = f"{pairing.show_code(made.code)}\n{made.salt}\n"
        write_whole(file, text.encode("ascii"), mode=0o600)  # for this user's eyes only
    except (pairing.BadCode, message_fields.WrongValue):
        raise BadPairing(f"{file} holds no pairing code; remove it for a new one") from None
    except InvalidFile as error:
        raise BadPairing(
            f"{file} holds no pairing code ({error}); remove it for a new one"
        ) from None
    except OSError as error:
        raise BadPairing(
            f"cannot use {file}: {error.strerror}; "
            "set BRICKSERVO_STATE to a folder that can be written"
        ) from None
    return made
