"""The file that holds this laptop's pairing code."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from shared import pairing
from shared.arm_description import ArmError
from shared.state import PAIRING_FILE, state_folder


class BadPairing(ArmError, OSError):
    """The file with the pairing code cannot be read, written or understood."""


def pairing_code(folder: Path | None = None) -> str:
    """Read this laptop's pairing code; make it when it is first asked for.

    Args:
        folder: None takes $BRICKSERVO_STATE, or ~/.brickservo.

    Raises:
        BadPairing: naming the file and what to do.
    """
    file = (folder or Path(state_folder())) / PAIRING_FILE
    try:
        with contextlib.suppress(FileNotFoundError):
            code = pairing.read_code(file.read_text(encoding="ascii"))
            if file.stat().st_mode & 0o077:
                file.chmod(0o600)
            return code
        code = pairing.new_code()
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor, draft = tempfile.mkstemp(dir=file.parent)  # for this user's eyes only
        try:
            with open(descriptor, "w", encoding="ascii") as out:
                out.write(pairing.show_code(code) + "\n")
            os.replace(draft, file)
        except OSError:
            os.unlink(draft)
            raise
    except (pairing.BadCode, UnicodeDecodeError):
        raise BadPairing(f"{file} holds no pairing code; remove it for a new one") from None
    except OSError as error:
        raise BadPairing(
            f"cannot use {file}: {error.strerror}; "
            "set BRICKSERVO_STATE to a folder that can be written"
        ) from None
    return code
