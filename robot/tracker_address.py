"""Address of the tracker on the laptop, and the code by which the brick pairs: given or stored.

A code comes from the environment or is typed where it is asked for: everybody on a computer can
read the command lines of its programs.
"""

import binascii
import contextlib
import errno
import json
import os
import re
import sys

from shared import message_fields as fields
from shared import pairing
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, number, read_json, write_whole
from shared.messages import PORT
from shared.record import record
from shared.state import CODE, TRACKER_FILE, laptop_program, state_folder

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Any, Callable, List, Mapping, NamedTuple, Optional, Tuple  # noqa: F401

    _Address = Tuple[Any, ...]  # as the system's family of sockets has it

MAX_TYPED = 80
"""Greatest length of a line that is typed, characters."""


class NotPaired(ArmError):
    """The tracker's address, or its code, is not known."""


class InvalidMemory(NotPaired):
    """The file in which the tracker is stored is there, and of no use."""


class Refusal(ArmError):
    """The tracker will not serve this client however often it tries."""


if MYPY:
    SaltedKey = NamedTuple("SaltedKey", [("salt", str), ("key", bytes)])
else:
    SaltedKey = record("SaltedKey", "salt key")
SaltedKey.__doc__ = """The key of the pairing code, and the laptop's salt that it was made with."""

if MYPY:
    ServerAddress = NamedTuple("ServerAddress", [("host", str), ("port", int), ("code", str)])
else:
    ServerAddress = record("ServerAddress", "host port code")
ServerAddress.__doc__ = (
    """Address of the tracker, and the code that it printed (as pairing.read_code)."""
)


class Memory(object):
    """The tracker on file, so that it is given once; and the key, which takes long to compute.

    Args:
        folder: of the file; None takes $BRICKSERVO_STATE, or ~/.brickservo.

    Attributes:
        file: path of the file.
    """

    def __init__(self, folder=None):
        # type: (Optional[str]) -> None
        self.file = os.path.join(folder or state_folder(), TRACKER_FILE)

    def load(self):
        # type: () -> Optional[ServerAddress]
        """Return the ServerAddress; None if none is stored.

        Raises:
            InvalidMemory: the file is there, and of no use.
        """
        try:
            stored = read_json(self.file)
            host, port, code = (stored[key] for key in ("host", "port", "code"))
            if not isinstance(host, str) or not isinstance(code, str) or number(port) % 1:
                raise InvalidFile("has something of another kind")
            host, port = read_place(host, int(port))
            if not host or port is None:
                raise InvalidFile("names no host")
            return ServerAddress(host, port, pairing.read_code(code))
        except FileNotFoundError:
            return None
        except OSError as error:
            problem = "cannot be read ({})".format(error.strerror)
        except KeyError:
            problem = "lacks something"
        except InvalidFile as error:
            problem = str(error)
        except ArmError as error:
            problem = "cannot be used ({})".format(error)
        raise InvalidMemory(
            "{} {}; remove it, and give the tracker's address, HOST: then the code is asked "
            "for".format(self.file, problem)
        )

    def load_key(self, code):
        # type: (str) -> Optional[SaltedKey]
        """Return the SaltedKey of a code; None if none is stored."""
        try:
            stored = read_json(self.file)
            key = binascii.unhexlify(fields.PROOF(stored["key"]))
            return SaltedKey(fields.NONCE(stored["salt"]), key) if stored["code"] == code else None
        except (InvalidFile, OSError, KeyError, fields.WrongValue):
            return None

    def save(self, tracker, key):
        # type: (ServerAddress, SaltedKey) -> None
        """Store a ServerAddress and the SaltedKey of its code, for this user's eyes only.

        Raises:
            OSError: it cannot be written.
        """
        stored = dict(tracker._asdict())
        stored.update(salt=key.salt, key=binascii.hexlify(key.key).decode("ascii"))
        write_whole(self.file, json.dumps(stored, sort_keys=True) + "\n", 0o600)


def read_place(text, port=None):
    # type: (str, Optional[int]) -> Tuple[Optional[str], Optional[int]]
    """Return host and port of a text; None for a missing one.

    Args:
        text: HOST, HOST:PORT, [IPV6]:PORT or :PORT.
        port: the port if it says none.

    Raises:
        NotPaired: it is none of these.
    """
    host, number = text, ""
    if text.startswith("["):
        host, bracket, rest = text[1:].partition("]")
        if not bracket or not host or rest[:1] not in ("", ":"):
            raise NotPaired("'{}' is no place; write [IPV6]:PORT".format(shortened(text)))
        number = rest[1:]
    elif text.count(":") == 1:
        host, _, number = text.partition(":")
    if number or text.endswith(":"):
        port = int(number) if re.match(r"[0-9]{1,5}\Z", number) else 0
    if port is not None and not 1 <= port <= 65535:
        raise NotPaired("'{}' has no port from 1 to 65535; write HOST:PORT".format(shortened(text)))
    if len(host) > 255 or not host.isprintable() or any(letter.isspace() for letter in host):
        raise NotPaired("'{}' is no host; write HOST or HOST:PORT".format(shortened(text)))
    return host or None, port


def find_tracker(
    place="",  # type: str
    code=None,  # type: Optional[str]
    environ=None,  # type: Optional[Mapping[str, str]]
    memory=None,  # type: Optional[Memory]
    ask=None,  # type: Optional[Callable[[str], str]]
):
    # type: (...) -> ServerAddress
    """Return the ServerAddress of the tracker: as given, else where ssh came from, else as stored.

    Args:
        place: as for read_place; "" where nothing is given.
        code: as typed, or None: that of the environment, else as stored.
        environ: os.environ if None.
        memory: Memory() if None.
        ask: called with a question, and returns the code that somebody types; None where nobody is
            there.

    Raises:
        NotPaired, pairing.BadCode: something is missing or wrong; it says what to type.
    """
    environ = os.environ if environ is None else environ
    host, port = read_place(place)
    known = invalid = None
    try:
        known = (memory or Memory()).load()
    except InvalidMemory as problem:
        invalid = problem  # raised where something of it is needed; else it is written anew
    if code is None and not (known and known.host == host):
        check_is_no_code(place)
    if code is None:
        code = environ.get(CODE) or None
    code = pairing.read_code(code) if code is not None else known and known.code
    if not host:
        ssh = (environ.get("SSH_CLIENT") or environ.get("SSH_CONNECTION") or "").split()
        host = ssh[0] if ssh else known and known.host
    if invalid and not (host and code):
        raise invalid
    if not host:
        raise NotPaired(
            "where is the tracker? give its address, HOST, as the tracker on the laptop prints it"
        )
    if not code and ask is not None:
        code = pairing.read_code(ask("pairing code, as the tracker on the laptop prints it: "))
    if not code:
        raise NotPaired(
            "this brick is not paired yet; type this in a terminal, or by brick run on the "
            "laptop: then the code is asked for, or known"
        )
    if port is None:
        port = known.port if known and known.host == host else PORT
    return ServerAddress(host, port, code)


def addresses_of(host, port):
    # type: (str, int) -> List[Tuple[int, _Address]]
    """Resolve a host's name: a list of (family, address), as sockets take them.

    Raises:
        NotPaired: nothing is known of such a host.
    """
    import socket  # not above: who asks for the pairing code needs none

    try:
        found = socket.getaddrinfo(host, port, 0, socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise NotPaired(
            "there is no host '{}'; give the laptop's address as the tracker prints it: "
            "HOST".format(shortened(host))
        ) from None
    return [(family, address) for family, _, _, _, address in found]


def why_unreachable(place, port, number, waited):
    # type: (str, int, Optional[int], float) -> str
    """Return one line for people: why no connection came about.

    Args:
        place: HOST:PORT.
        port: the same port, for people.
        number: number of the system's error; None: no answer.
        waited: time that it was waited, s.
    """
    if number is None:
        return (
            "no answer from {} within {:g} s; is it on the same network, and does its firewall let "
            "port {} in?".format(place, waited, port)
        )
    why = "cannot reach {}: {}; start the tracker there: {} track".format(
        place, os.strerror(number).lower(), laptop_program()
    )
    return why + ", or check the port that it prints" * (number == errno.ECONNREFUSED)


def at_terminal():
    # type: () -> Optional[Callable[[str], str]]
    """Return a function that asks a question in this terminal; None without one."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stderr and sys.stderr.isatty()):
        return None
    return _typed


def _typed(question):
    # type: (str) -> str
    sys.stderr.write(question)
    sys.stderr.flush()
    return sys.stdin.readline(MAX_TYPED).strip()


def remembered(memory):
    # type: (Memory) -> Optional[ServerAddress]
    """Return the ServerAddress on file; None if there is none, or the file is of no use."""
    with contextlib.suppress(InvalidMemory):
        return memory.load()
    return None


def check_is_no_code(word):
    # type: (str) -> None
    """Raise NotPaired if a word that stands alone reads as a pairing code."""
    with contextlib.suppress(pairing.BadCode):
        pairing.read_code(word)
        raise NotPaired("'{}' reads as a pairing code; leave it out: it is asked for".format(word))


def shortened(text):
    # type: (str) -> str
    """Return a text that may be anything as one short printable line."""
    shown = ascii(text)[1:-1]
    return shown if len(shown) <= 40 else shown[:37] + "..."
