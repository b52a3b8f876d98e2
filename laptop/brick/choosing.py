"""Choice of the brick that a command is for: the one that is named, or the last one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from laptop.brick import BrickProblem
from laptop.brick.connection import BrickAddress, Dialogue, read_address
from laptop.brick.known_hosts import KnownHosts
from laptop.system.files import write_whole
from shared.config_files import InvalidFile, read_text
from shared.state import LAST_BRICK_FILE, state_folder


def _file() -> Path:
    return Path(state_folder(), LAST_BRICK_FILE)


def last_brick() -> BrickAddress | None:
    """Return the brick of the last command, if one is stored.

    Raises:
        BrickProblem: the file of it cannot be read.
    """
    try:
        return read_address(read_text(str(_file())).strip())
    except FileNotFoundError:
        return None
    except OSError as error:
        raise BrickProblem(
            f"cannot read {_file()}: {error.strerror}; put that right, or say which brick: "
            "--brick NAME"
        ) from None
    except (InvalidFile, BrickProblem) as error:
        raise BrickProblem(
            f"{_file()}: {error}; delete it, and say which brick: --brick NAME"
        ) from None


async def choose(name: str | None, dialogue: Dialogue) -> BrickAddress:
    """Return the address of the brick that is meant.

    A bare name is one that a brick announces; without a name it is the last one, else the only one
    that is there.

    Args:
        name: a bare name, or as connection.read_address reads it; None: none was typed.
        dialogue: with who has typed it.

    Raises:
        BrickProblem: nobody can say which one that is.
    """
    wanted = read_address(name) if name else last_brick()
    if wanted and not _is_bare(wanted.host):
        return wanted
    from laptop.brick import finding  # it takes a while, and is not always needed

    found = await finding.find()
    if wanted is None:
        if not found:
            raise BrickProblem(finding.NO_BRICK)
        if len(found) > 1:
            finding.report(found, None, dialogue.report)
            raise BrickProblem(
                f"{len(found)} bricks are there; say which one: --brick NAME, or its address"
            )
        dialogue.report(f"the brick is {found[0].name or '?'} at {found[0].address}")
        return found[0].address
    same = [one for one in found if one.name == wanted.host]
    if len(same) > 1:
        raise BrickProblem(finding.same_name(wanted.host, found))
    if same:
        return replace(same[0].address, user=wanted.user)
    return named(str(wanted))


def _is_bare(host: str) -> bool:
    return not ("." in host or ":" in host or host == "localhost")


def remember(address: BrickAddress, dialogue: Dialogue) -> None:
    """Store an address as that of the last brick; report where that fails."""
    invalid = None
    try:
        if last_brick() == address:
            return
    except BrickProblem as problem:
        invalid = problem
    file = _file()
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(file, f"{address}\n".encode())
    except OSError as error:
        dialogue.report(f"cannot remember {address}: {error.strerror}: {file}")
        return
    if invalid:
        dialogue.report(f"{invalid}; now it is replaced")


def forget(name: str | None, dialogue: Dialogue, known: KnownHosts | None = None) -> None:
    """Remove the keys of a brick, and that it was the last one.

    Args:
        name: as for `choose`.
        dialogue: with who has typed it.
        known: keys of hosts; those of this user's ssh if None.

    Raises:
        BrickProblem: no brick is named or remembered, or the file of keys cannot be written.
    """
    last = last_brick()
    address = named(name) if name else last
    if address is None:
        raise BrickProblem("no brick is remembered here; say which one: --brick NAME")
    known = known or KnownHosts()
    try:
        keys = known.forget(address.host, address.port)
    except OSError as error:
        raise BrickProblem(
            f"cannot change {known.file}: {error.strerror}; see whose file it is"
        ) from None
    if last == address:
        _file().unlink(missing_ok=True)
    if keys or last == address:
        what = [f"{keys} {'key' if keys == 1 else 'keys'} in {known.file}"] * bool(keys)
        what += ["that it was the last one"] * (last == address)
        dialogue.report(f"forgotten of {address}: {', and '.join(what)}")
    else:
        dialogue.report(f"nothing is remembered of {address}")


def named(name: str) -> BrickAddress:
    """Return the address that a name stands for: a bare one is looked for as NAME.local.

    Raises:
        BrickProblem: it is none.
    """
    address = read_address(name)
    if not _is_bare(address.host):
        return address
    return BrickAddress(f"{address.host}.local", address.port, address.user)
