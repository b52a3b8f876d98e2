"""The laptop's end of the link: listens, lets one brick in that knows the code, and serves it.

Only the sockets run in a thread of their own; `publish` sends at once from the thread that calls
it, so that an observation waits for nobody.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import math
import os
import selectors
import socket
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from shared import pairing
from shared.arm_description import ArmError
from shared.link import Link
from shared.messages import (
    BRICK,
    LAPTOP,
    PORT,
    VERSION,
    Bye,
    Challenge,
    Hello,
    Observation,
    Proof,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
)
from shared.state import state_folder

TICK = 0.1
"""How often the thread looks at what is due while somebody is connected, s."""

MOST_CALLERS = 16
"""Connections that have not proven themselves yet; one more, and the oldest has to go."""

LONGEST_DELAY = 60.0
"""After wrong codes, s: 1, 2, 4, ... and no more than this."""

FORGIVEN = 600.0
"""After so long without another wrong code it begins at 1 s again, s."""

BACKLOG = 128
"""Connections that the system keeps for the thread, so that a crowd shuts nobody out."""

MOST_OFFENDERS = 256
"""Senders of wrong codes that are remembered."""

SEND_BUFFER = 16384
"""Bytes that the system may hold back when the brick does not take them: the fewer, the fresher."""

ACCEPT_PAUSE = 1.0
"""When the system has no room for one more connection, s."""


class CannotListen(ArmError, OSError):
    """The port or the address is not to be had."""


class BadPairing(ArmError, OSError):
    """The file with the pairing code cannot be read, written or understood."""


def pairing_code(folder: Path | None = None) -> str:
    """This laptop's pairing code, made when it is first asked for.

    Args:
        folder: None takes $BRICKSERVO_STATE, or ~/.brickservo.

    Raises:
        BadPairing: naming the file and what to do.
    """
    file = (folder or Path(state_folder())) / "pairing"
    try:
        with contextlib.suppress(FileNotFoundError):
            code = pairing.read_code(file.read_text(encoding="ascii"))
            if file.stat().st_mode & 0o077:
                file.chmod(0o600)
            return code
        code = pairing.new_code()
        file.parent.mkdir(parents=True, exist_ok=True)
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


def own_addresses() -> list[str]:
    """The addresses at which others may reach this machine, loopback left out."""
    found = []
    if sys.platform == "linux":
        import fcntl

        siocgifaddr = 0x8915  # linux/sockios.h; struct ifreq has the address at byte 20
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            for _, name in socket.if_nameindex():
                with contextlib.suppress(OSError):  # that one has no address
                    request = struct.pack("256s", name.encode()[:15])
                    found.append(socket.inet_ntoa(fcntl.ioctl(sock, siocgifaddr, request)[20:24]))
    else:
        # The address from which a packet would leave; nothing is sent.
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock,
        ):
            sock.connect(("192.0.2.1", 9))
            found.append(sock.getsockname()[0])
    return [address for address in found if not ipaddress.ip_address(address).is_loopback]


@dataclass(frozen=True)
class State:
    """How the link is doing.

    Attributes:
        client: address of the brick that is served, or None.
        since: since when, s on the server's clock.
        status: its last Status, or None.
        status_age: s since that came in.
        round_trip: the least of the last pings, s; until the brick's program looks, it waits too.
        refusal: the last one, with its sender; "" if there was none since a brick was let in.
        lost: why the last brick left; "" if none did.
        counters: of the present link, see shared.link.Link; {} without one.
    """

    client: str | None = None
    since: float | None = None
    status: Status | None = None
    status_age: float | None = None
    round_trip: float | None = None
    refusal: str = ""
    lost: str = ""
    counters: dict[str, int] = field(default_factory=dict)


class _Caller:
    """One connection."""

    def __init__(self, sock: socket.socket, address: str, now: Callable[[], float]) -> None:
        self.sock = sock
        self.link = Link(sock, now, proven=False)
        self.address = address
        self.sender = _sender(address)
        self.since = now()
        self.brick_nonce: str | None = None
        self.laptop_nonce = pairing.new_nonce()
        self.events = selectors.EVENT_READ


def _sender(address: str) -> str:
    """Whom a wrong code is held against: an IPv6 machine has as many addresses as it likes."""
    ip = ipaddress.ip_address(address.partition("%")[0])
    return str(ip if ip.version == 4 else ipaddress.ip_network((ip, 64), strict=False))


class _Offenders:
    """Who gave wrong codes, and how long each has to wait: 1, 2, 4, ... s."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[int, float, float]] = {}  # failures, last one, wait until

    def wait(self, sender: str, now: float) -> float:
        """How long `sender` has to wait still, s."""
        return max(0.0, self._known[sender][2] - now) if sender in self._known else 0.0

    def add(self, sender: str, now: float) -> float:
        """Note a wrong code; how long `sender` has to wait, s."""
        failures, last, _ = self._known.pop(sender, (0, now, now))
        failures = 1 if now - last > FORGIVEN else failures + 1
        if len(self._known) >= MOST_OFFENDERS:
            del self._known[min(self._known, key=lambda known: self._known[known][2])]
        delay = min(LONGEST_DELAY, 2.0 ** min(failures - 1, 10))
        self._known[sender] = failures, now, now + delay
        return delay

    def forgive(self, sender: str) -> None:
        """It knows the code after all."""
        self._known.pop(sender, None)


class TrackingServer:
    """Serves one brick that knows the code; everybody else is told why not.

    Args:
        host: address or name of this machine at which to listen; "" for all.
        port: 0 takes any free one.
        code: as shared.pairing.read_code returns it.
        now: the clock of the observations, s.
        threaded: whether the sockets run in a thread of their own. If not, they run only in `turn`,
            which is to be called at least every TICK s, and whenever somebody is `calling`.

    Attributes:
        host, port: where it listens; host "" is everywhere.

    Raises:
        CannotListen: in one line with the next step.
    """

    def __init__(
        self,
        host: str,
        port: int,
        code: str,
        now: Callable[[], float] = time.monotonic,
        threaded: bool = True,
    ) -> None:
        host = "" if host in ("0.0.0.0", "::") else host  # no address to type on the brick
        self._listener = _listen(host, port)
        self.host = host
        self.port: int = self._listener.getsockname()[1]
        self._code = code
        self._key = pairing.key_of(code)
        self._now = now
        # Guards what follows; never held while waiting.
        self._lock = threading.Lock()
        self._callers: list[_Caller] = []
        self._served: _Caller | None = None
        self._offenders = _Offenders()
        self._status: tuple[Status, float] | None = None
        self._refusal = self._lost = ""
        self._ending = False
        self._accept_again: float | None = None

        self._bell, self._ringer = socket.socketpair()
        self._bell.setblocking(False)
        self._ringer.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._bell, selectors.EVENT_READ)
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._thread: threading.Thread | None = None
        if threaded:
            self._thread = threading.Thread(target=self._serve, name="tracking server", daemon=True)
            self._thread.start()

    def __enter__(self) -> TrackingServer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def commands(self) -> list[str]:
        """What to type on the brick: the first if ssh is used from here, the others always work."""
        code = pairing.show_code(self._code)
        addresses = [self.host] if self.host else own_addresses()
        port = "" if self.port == PORT else f":{self.port}"
        places = [
            (f"[{address}]{port}" if ":" in address and port else f"{address}{port}")
            for address in addresses
        ]
        return [
            f"robot/visual_servoing.py{' ' if place else ''}{place} --code {code}"
            for place in [port, *places]
        ]

    def publish(self, observation: Observation) -> None:
        """Send an observation to the brick, if there is one; never waits for it.

        Raises:
            shared.messages.BadMessage: it has a value that the brick would not accept.
        """
        self.send(observation)

    def send(self, message: Observation | Start | Stop) -> bool:
        """Send a message to the brick; whether there is one."""
        with self._lock:
            if self._served is None:
                return False
            link = self._served.link
            link.send(message)
            if link.blocked or link.closed:
                self._ring()  # to wait until it can go out, or to clear up
            return not link.closed

    def state(self) -> State:
        """How it is doing."""
        with self._lock:
            if self._served is None:
                return State(refusal=self._refusal, lost=self._lost)
            link = self._served.link
            return State(
                client=self._served.address,
                since=self._served.since,
                status=self._status and self._status[0],
                status_age=self._status and self._now() - self._status[1],
                round_trip=link.clock.round_trip,
                refusal=self._refusal,
                lost=self._lost,
                counters=dict(link.counters),
            )

    def close(self, reason: str = "the tracker has ended") -> None:
        """Say bye and stop listening."""
        with self._lock:
            if self._ending:
                return
            self._ending = True
            self._ring()
        if self._thread is not None:
            self._thread.join()
        for caller in self._everybody():
            caller.link.close(reason)
        self._callers, self._served = [], None
        self._selector.close()
        for sock in (self._listener, self._bell, self._ringer):
            sock.close()

    # The sockets

    def calling(self, timeout: float | None = 0.0) -> bool:
        """Whether there is something for `turn` to do; waits for it, at most `timeout` s."""
        return bool(self._selector.select(timeout))

    def turn(self) -> None:
        """Do once what is due: let callers in, read, answer, ping, send; never waits."""
        with self._lock:
            with contextlib.suppress(BlockingIOError):
                self._bell.recv(4096)
            if not self._ending:
                self._accept()
                for caller in self._everybody():
                    self._attend(caller)

    def _serve(self) -> None:
        while not self._ending:
            self.calling(TICK if self._everybody() or self._accept_again else None)
            self.turn()

    def _ring(self) -> None:
        with contextlib.suppress(BlockingIOError):  # then it rings already
            self._ringer.send(b"!")

    def _everybody(self) -> list[_Caller]:
        return [*self._callers, *([self._served] if self._served else [])]

    def _accept(self) -> None:
        if self._accept_again is not None:
            if self._now() < self._accept_again:
                return
            self._accept_again = None
            self._selector.register(self._listener, selectors.EVENT_READ)
        for _ in range(MOST_CALLERS):
            try:
                sock, address = self._listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno not in (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM):
                    continue  # this caller has hung up
                self._selector.unregister(self._listener)
                self._accept_again = self._now() + ACCEPT_PAUSE
                return
            with contextlib.suppress(OSError):  # an older observation or two, then
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            # An IPv4 caller of an IPv6 listener is shown as people know it.
            caller = _Caller(sock, address[0].removeprefix("::ffff:"), self._now)
            if len(self._callers) >= MOST_CALLERS:
                self._make_room()
            self._callers.append(caller)
            self._selector.register(sock, caller.events)

    def _make_room(self) -> None:
        """Send away the oldest caller of the sender that has the most."""
        senders = [caller.sender for caller in self._callers]
        self._dismiss(self._callers[senders.index(max(senders, key=senders.count))])

    def _attend(self, caller: _Caller) -> None:
        if caller not in self._everybody():
            return  # sent away meanwhile
        caller.link.poll()
        message = caller.link.receive()
        while message is not None:
            if caller is not self._served:
                self._shake_hands(caller, message)
            elif isinstance(message, Status):
                self._status = message, self._now()
            message = caller.link.receive()
        if caller.link.closed:
            self._dismiss(caller)
        else:
            events = selectors.EVENT_READ | (caller.link.blocked and selectors.EVENT_WRITE)
            if events != caller.events:
                caller.events = events
                self._selector.modify(caller.sock, events)

    def _dismiss(self, caller: _Caller) -> None:
        if caller is self._served:
            self._lost = f"{caller.address}: {caller.link.reason}"
            self._served = None
        else:
            self._callers.remove(caller)
        self._selector.unregister(caller.sock)
        caller.link.close()

    def _shake_hands(self, caller: _Caller, message: object) -> None:
        if isinstance(message, Hello) and caller.brick_nonce is None:
            if message.version != VERSION:
                self._refuse(caller, "version", _version_advice(message.version))
            elif message.role != BRICK:
                caller.link.close()
            else:
                caller.brick_nonce = message.nonce
                caller.link.send(Challenge(caller.laptop_nonce))
        elif isinstance(message, Proof) and caller.brick_nonce is not None:
            self._judge(caller, message, caller.brick_nonce)
        elif not isinstance(message, Bye):
            caller.link.close()

    def _judge(self, caller: _Caller, message: Proof, brick_nonce: str) -> None:
        now = self._now()
        nonces = brick_nonce, caller.laptop_nonce
        wait = self._offenders.wait(caller.sender, now)
        if wait:  # whatever it says: else ten connections at once would be ten guesses
            reason = f"a wrong code came from this address; wait {math.ceil(wait)} s"
            self._refuse(caller, "wait", reason, wait)
        elif not pairing.is_proof(message.proof, self._key, BRICK, *nonces):
            wait = self._offenders.add(caller.sender, now)
            reason = (
                "this is not the pairing code; type the command that the tracker prints "
                f"(not before {wait:.0f} s have passed)"
            )
            self._refuse(caller, "code", reason, wait)
        else:
            self._offenders.forgive(caller.sender)
            if self._served is not None and self._served.link.closed:
                self._dismiss(self._served)
            if self._served is not None:
                reason = (
                    f"another program is connected, from {self._served.address}; end that one first"
                )
                self._refuse(caller, "busy", reason)
                return
            caller.link.send(Welcome(pairing.proof(self._key, LAPTOP, *nonces)))
            caller.link.trust()
            self._callers.remove(caller)
            self._served = caller
            self._status = None
            self._refusal = ""
            caller.since = now

    def _refuse(self, caller: _Caller, cause: str, reason: str, wait: float = 0.0) -> None:
        self._refusal = f"{caller.address}: {reason}"
        caller.link.send(Refused(cause, reason, wait))
        caller.link.close()


def _version_advice(version: int) -> str:
    both = f"the brick's program speaks version {version}, the laptop's {VERSION}; "
    if version < VERSION:
        return both + "copy robot/ and shared/ to the brick again"
    return both + "bring the laptop's checkout up to date"


def _listen(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise CannotListen(f"{port} is no port; --port takes 1 to 65535")
    try:
        listener = _bind(host, port)
    except (socket.gaierror, UnicodeError):
        raise CannotListen(
            f"there is no host {ascii(host)[:40]}; give --host an address of this machine, "
            f"one of {', '.join(['127.0.0.1', *own_addresses()])}, or leave it out"
        ) from None
    except OSError as error:
        raise CannotListen(_why_not(host, port, error)) from None
    listener.setblocking(False)
    return listener


def _bind(host: str, port: int) -> socket.socket:
    if not host:
        # IPv6 and IPv4 in one, where the system has IPv6 at all.
        with contextlib.suppress(OSError):
            if socket.has_dualstack_ipv6():
                return socket.create_server(
                    ("", port), family=socket.AF_INET6, backlog=BACKLOG, dualstack_ipv6=True
                )
        return socket.create_server(("", port), backlog=BACKLOG)
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    family, _, _, _, address = found[0]
    return socket.create_server(
        (str(address[0]), port), family=socket.AddressFamily(family), backlog=BACKLOG
    )


def _why_not(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} is in use, perhaps by another tracker; "
            f"end that, or take another port: --port {port + 1 if port < 65535 else PORT}"
        )
    if error.errno == errno.EACCES:
        return f"port {port} is not for everybody; take one from 1024 on, like --port {PORT}"
    if error.errno == errno.EADDRNOTAVAIL:
        return (
            f"this machine has not the address {host}; give --host one of "
            f"{', '.join(['127.0.0.1', *own_addresses()])}, or leave it out"
        )
    return f"cannot listen at {host or 'any address'}, port {port}: {error.strerror}"
