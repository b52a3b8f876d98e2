"""One connection to a brick by ssh: whom to trust, how to log in, and problems in words.

A host key that is met for the first time is trusted and stored, and another one later is refused
(trust on first use, as OpenSSH's StrictHostKeyChecking=accept-new). A brick has no certificate, and
to compare fingerprints by hand is what nobody does; whoever is between at the first contact only
can be noticed later.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import os
import re
import socket
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from dataclasses import dataclass

import asyncssh

from laptop.brick import COMMAND, BrickProblem
from laptop.brick.answers import NoAnswer
from laptop.brick.known_hosts import DEFAULT_PORT, KnownHosts
from shared.message_fields import printable

USER, PASSWORD = "robot", "maker"
"""Account and password of every card with ev3dev, unless somebody has changed them."""

CONNECT_TIMEOUT = 10.0
"""Longest time until a brick takes a connection, s."""
LOGIN_TIMEOUT = 90.0
"""Longest time from there until the login, s: a brick is slow, and a password is typed."""
KEEPALIVE_PERIOD, KEEPALIVE_COUNT = 5.0, 4
"""Period of requests to a silent brick, s, and number of them without a reply that end it."""

GOODBYE_TIMEOUT = 5.0
"""Longest time of closing a connection in order, s; then it is cut."""

MAX_QUESTIONS = 3
"""Greatest number of questions for the password."""

CUT = (asyncssh.ConnectionLost, BrokenPipeError, ConnectionResetError)
"""Exceptions of a connection that has ended without a word."""


class NobodyReads(Exception):
    """This command's output is closed, and not the connection."""


@contextlib.contextmanager
def shown_here() -> Iterator[None]:
    """Tell closed output from a connection that is cut, for a `with` block that shows something.

    Raises:
        NobodyReads: it is closed.
    """
    try:
        yield
    except BrokenPipeError:
        raise NobodyReads from None


@dataclass(frozen=True)
class BrickAddress:
    """The address of one brick.

    Args:
        host: name or IP address.
        port: TCP port of its ssh.
        user: the account there.
    """

    host: str
    port: int = DEFAULT_PORT
    user: str = USER

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        user = "" if self.user == USER else f"{self.user}@"
        return user + host + ("" if self.port == DEFAULT_PORT else f":{self.port}")


def read_address(text: str) -> BrickAddress:
    """Return the address of `[USER@]HOST[:PORT]`; one of IPv6 with a port stands in brackets.

    Raises:
        BrickProblem: it is something else.
    """
    match = re.fullmatch(
        r"(?:([\w.-]+)@)?(?:\[([\w:.%-]+)\](?::(\d{1,5}))?|([\w:.%-]+?)(?::(\d{1,5}))?)", text
    )
    if match:
        user, bracketed, port, plain, plain_port = match.groups()
        if bracketed or not plain.count(":"):
            host, port = bracketed or plain, port or plain_port or DEFAULT_PORT
        else:  # colons belong to the address
            host, port = text.rpartition("@")[2], DEFAULT_PORT
        if 0 < int(port) < 1 << 16 and (":" not in host or _is_ip(host)) and host[0] != "-":
            return BrickAddress(host, int(port), user or USER)
    raise BrickProblem(
        f"'{text}' is no brick's address; write a name or [USER@]HOST[:PORT], such as "
        "ev3dev.local or 10.42.0.3"
    )


def _is_ip(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class Dialogue:
    """Dialogue with the user who has typed a command.

    Args:
        show: called with a line to print.
        ask_password: called with a question for a password; returns it, or None to stop. None
            where nobody is there to ask.
    """

    show: Callable[[str], None]
    ask_password: Callable[[str], str | None] | None = None

    def report(self, line: str) -> None:
        """Print a line, made printable whatever of it the brick has sent."""
        self.show(printable(line))


@contextlib.asynccontextmanager
async def connected(
    address: BrickAddress, dialogue: Dialogue, known: KnownHosts | None = None
) -> AsyncIterator[asyncssh.SSHClientConnection]:
    """Be connected to a brick, and logged in, for an `async with` block.

    Keys, agent and configuration are those of this user's ssh. A host key that is met for the first
    time is printed and stored, and one that has changed is refused.

    Args:
        address: the brick's.
        dialogue: with who has typed the command.
        known: keys of hosts; those of this user's ssh if None.

    Raises:
        BrickProblem: it is not to be reached, is another one, lets nobody in or goes away, then or
            in the block; or the keys that are known cannot be read.
    """
    known = known or KnownHosts()
    try:
        login = _Login(address, dialogue, known)
    except OSError as error:
        raise BrickProblem(
            f"cannot read {known.file}: {error.strerror}; see whose file it is"
        ) from None
    sock = await _reach(address)
    try:
        connection = await asyncssh.connect(
            address.host,
            address.port,
            sock=sock,
            username=address.user,
            client_factory=lambda: login,
            known_hosts=login.known_keys,
            preferred_auth="publickey,password,keyboard-interactive",
            login_timeout=LOGIN_TIMEOUT,
            keepalive_interval=KEEPALIVE_PERIOD,
            keepalive_count_max=KEEPALIVE_COUNT,
        )
    except (OSError, ValueError, asyncssh.Error) as error:
        sock.close()
        raise login.problem(error) from None
    login.remember()
    try:
        yield connection
    except CUT:
        raise BrickProblem(
            f"the connection to {address} is cut; is the brick on, and the cable in? Then try again"
        ) from None
    except NoAnswer as problem:
        connection.abort()
        raise BrickProblem(f"{address} {problem}") from None
    except asyncssh.Error as error:
        raise BrickProblem(f"{address} ended the connection: {error.reason}; try again") from None
    finally:
        connection.close()
        try:
            await asyncio.wait_for(connection.wait_closed(), GOODBYE_TIMEOUT)
        except asyncio.TimeoutError:
            connection.abort()


async def _reach(address: BrickAddress) -> socket.socket:
    """Return a connected socket.

    Raises:
        BrickProblem: the brick cannot be reached.
    """
    loop = asyncio.get_running_loop()
    try:
        places = await loop.getaddrinfo(address.host, address.port, type=socket.SOCK_STREAM)
    except (socket.gaierror, UnicodeError):
        raise BrickProblem(
            f"nobody here knows {address.host}; is the brick on, and connected? "
            f"{COMMAND} find looks for it, or give the address on its screen: --brick 10.42.0.3"
        ) from None
    problem = ""
    for family, kind, protocol, _, place in places:
        try:
            sock = socket.socket(family, kind, protocol)
        except OSError as error:  # a system without IPv6
            problem = problem or unreached(address, error)
            continue
        sock.setblocking(False)
        try:
            await asyncio.wait_for(loop.sock_connect(sock, place), CONNECT_TIMEOUT)
            return sock
        except (OSError, asyncio.TimeoutError) as error:
            sock.close()
            problem = problem or unreached(address, error)
        except BaseException:
            sock.close()
            raise
    raise BrickProblem(problem)


def unreached(address: BrickAddress, error: Exception) -> str:
    """Return why a connection is refused, for people."""
    if isinstance(error, ConnectionRefusedError):
        return (
            f"{address} is there, but takes no ssh at port {address.port}; if it has just been "
            "switched on, wait two minutes, else it is no brick: give another --brick"
        )
    if isinstance(error, (TimeoutError, asyncio.TimeoutError)):
        return (
            f"{address} does not answer within {CONNECT_TIMEOUT:g} s; is the brick on, and that "
            "its address? It stands on its screen"
        )
    # (Of asyncio's own text the number alone says why.)
    why = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
    return (
        f"there is no way to {address}: {why}; "
        "is the cable in, or this computer in the brick's network?"
    )


class _Login(asyncssh.SSHClient):
    """The dialogue by which a connection comes about."""

    def __init__(self, address: BrickAddress, dialogue: Dialogue, known: KnownHosts) -> None:
        self._address, self._dialogue, self._known = address, dialogue, known
        self._before = known.keys_of(address.host, address.port)
        self._new: asyncssh.SSHKey | None = None
        self._asked = 0
        self._tried_usual = self._given_up = self._takes_passwords = False

    def known_keys(
        self, host: str, addr: str, port: int | None
    ) -> tuple[Sequence[asyncssh.SSHKey], list[asyncssh.SSHKey], list[asyncssh.SSHKey]]:
        """Return the keys that are trusted, as asyncssh takes them."""
        return self._before, [], []

    def validate_host_public_key(
        self, host: str, addr: str, port: int, key: asyncssh.SSHKey
    ) -> bool:
        """Accept a key that is not known, if none is known of this host."""
        self._new = key
        if not self._before:
            self._dialogue.report(
                f"first contact with {self._address}: its key is {fingerprint(key)}"
            )
        return not self._before

    def remember(self) -> None:
        """Store the key that was met for the first time."""
        if self._new is None or self._before:
            return
        try:
            self._known.add(self._address.host, self._address.port, self._new)
            self._dialogue.report(f"it is remembered in {self._known.file}")
        except OSError as error:
            self._dialogue.report(f"it cannot be remembered: {error.strerror}: {self._known.file}")
        self._new = None

    def password_auth_requested(self) -> str | None:
        """Return the next password to try: ev3dev's own, then what is typed; None ends it."""
        self._takes_passwords = True
        if self._address.user == USER and not self._tried_usual:
            self._tried_usual = True
            self._dialogue.report("no ssh key lets in: trying ev3dev's usual password")
            return PASSWORD
        if self._dialogue.ask_password is None or self._given_up or self._asked == MAX_QUESTIONS:
            return None
        if self._asked:
            self._dialogue.report("that was a wrong password")
        self._asked += 1
        password = self._dialogue.ask_password(f"Password of {self._address.user} on the brick")
        self._given_up = password is None
        return password

    def problem(self, error: Exception) -> BrickProblem:
        """Return why no connection has come about, as a BrickProblem."""
        if self._new is not None and self._before:
            return BrickProblem(self._changed(f"this one has {fingerprint(self._new)}"))
        if isinstance(error, asyncssh.KeyExchangeFailed) and self._before:
            return BrickProblem(self._changed("this one has a key of another kind"))
        if isinstance(error, asyncssh.PermissionDenied):
            self.remember()  # it has proved to have that key
            return BrickProblem(self._refused(), 130 if self._given_up else 1)
        if isinstance(error, CUT):
            return BrickProblem(
                f"{self._address} took the connection and ended it before anybody was logged in; "
                "if it has just been switched on, wait two minutes, else look at its cable, and "
                "whether it is a brick at all"
            )
        if isinstance(error, ValueError):
            return BrickProblem(f"~/.ssh/config: {error}; correct the file")
        reason = getattr(error, "reason", "") or str(error) or type(error).__name__
        return BrickProblem(
            f"{self._address} speaks no ssh that is understood here: {reason}; is it the brick?"
        )

    def _changed(self, now: str) -> str:
        return another_brick(self._address, " or ".join(map(fingerprint, self._before)), now)

    def _refused(self) -> str:
        if self._given_up:
            return "no password was given: stopped"
        user = self._address.user
        if self._asked:
            return (
                f"wrong password for {user} on {self._address}: {self._asked} times; on a new card "
                f"it is {PASSWORD}"
            )
        if self._tried_usual:
            refused = f"lets {user} in neither by your ssh keys nor by ev3dev's usual password"
        else:
            refused = f"does not let {user} in by your ssh keys"
        refused = f"{self._address} {refused}"
        if not self._takes_passwords:
            return f"{refused}, and takes no passwords; is {user} the right user?"
        return (
            f"{refused}; nobody can be asked for the password here, so type once in a terminal: "
            f"{COMMAND} key --brick {self._address}"
        )


def another_brick(address: BrickAddress, before: str, now: str) -> str:
    """Return, for people, that a brick has another key than `before`; `now` says which."""
    return (
        f"{address} is not the brick of that name that was met before: its key was {before}, "
        f"{now}. If you know why (another brick, or a new card), type {COMMAND} forget --brick "
        f"{address}"
    )


def fingerprint(key: asyncssh.SSHKey) -> str:
    """Return the fingerprint of a key, which people compare."""
    return str(key.get_fingerprint())
