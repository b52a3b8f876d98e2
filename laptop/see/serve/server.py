"""The laptop's end of the link: listens, authenticates one brick, and serves it.

Only the sockets run in a thread of their own; `publish` sends at once from the thread that calls
it, so that an observation waits for nobody.
"""

from __future__ import annotations

import contextlib
import errno
import math
import selectors
import socket
import threading
import time
from collections.abc import Callable

from laptop.see.serve.guess_limiter import GuessLimiter, sender_of
from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.listening import listen, own_addresses
from laptop.see.serve.server_state import ServerState
from shared import pairing
from shared.job_messages import Draw, JobLog, JobStatus, Order, Want
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
from shared.state import laptop_program

SERVICE_PERIOD = 0.1
"""Longest time between two services of a connection, s."""

MAX_CALLERS = 16
"""Greatest number of connections without a proven code; one more, and the oldest is closed."""

SEND_BUFFER = 16384
"""Number of bytes that the system may hold back from a busy brick: the fewer, the fresher."""

ACCEPT_PAUSE = 1.0
"""Time until the next try when the system has no room for one more connection, s."""


class _Caller:
    """A connection, and how far its handshake is."""

    def __init__(self, sock: socket.socket, address: str, now: Callable[[], float]) -> None:
        self.sock = sock
        self.link = Link(sock, now)
        self.address = address
        self.sender = sender_of(address)
        self.since = now()
        self.brick_nonce: str | None = None
        self.laptop_nonce = pairing.new_nonce()
        self.events = selectors.EVENT_READ


class TrackingServer:
    """Serves one brick that knows the code; everybody else gets the reason.

    Args:
        host: address or name of this machine at which to listen; "" for all.
        port: 0 takes any free one.
        code: as shared.pairing.read_code returns it.
        now: the clock of the observations, s.
        threaded: True lets the sockets run in a thread of their own; else they run only in
            `serve_once`, to be called every SERVICE_PERIOD s or sooner, and whenever it `has_work`.
        salt: of the code, 32 hex digits; None makes one up, so that bricks have to pair anew.

    Attributes:
        host, port: where it listens; host "" is everywhere.
        code: the pairing code.

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
        salt: str | None = None,
    ) -> None:
        host = "" if host in ("0.0.0.0", "::") else host  # no address to type on the brick
        self._listener = listen(host, port)
        self.host = host
        self.port: int = self._listener.getsockname()[1]
        self.code = code
        self._salt = pairing.new_nonce() if salt is None else salt
        self._key = pairing.key_of(code, self._salt)
        self._now = now
        # Guards what follows; never held while waiting.
        self._lock = threading.Lock()
        self._callers: list[_Caller] = []
        self._served: _Caller | None = None
        self._guesses = GuessLimiter()
        self._status: tuple[Status, float, float] | None = None  # with when and how late it came
        self._progress: tuple[JobStatus, float] | None = None  # with when it was sent, s
        self._offer: JobOffer | None = None
        self._refusal = self._lost = ""
        self._ending = False
        self._accept_again: float | None = None

        self._wake_receiver, self._wake_sender = socket.socketpair()
        self._wake_receiver.setblocking(False)
        self._wake_sender.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_receiver, selectors.EVENT_READ)
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._thread: threading.Thread | None = None
        if threaded:
            self._thread = threading.Thread(target=self._serve, name="tracking server", daemon=True)
            self._thread.start()

    def __enter__(self) -> TrackingServer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def place(self) -> str:
        """HOST:PORT at which programs on this machine reach it."""
        return _place(self.host or "127.0.0.1", self.port)

    def addresses(self) -> list[str]:
        """Return HOST:PORT at which bricks may reach it, one for each address of this machine."""
        return [_place(host, self.port) for host in self._hosts()]

    def commands(self) -> list[str]:
        """Return the commands for a run of the brick: one to type here, then some for the brick.

        None has the code: everybody on a computer can read its command lines.
        """
        usual = self.port == PORT
        # Who comes by ssh is served where that comes from.
        here = [] if usual else [f":{self.port}"]
        return [
            " ".join([f"{laptop_program()} brick run visual_servoing.py", *here]),
            *(
                f"robot/visual_servoing.py {host if usual else _place(host, self.port)}"
                for host in self._hosts()
            ),
        ]

    def _hosts(self) -> list[str]:
        return [self.host] if self.host else own_addresses()

    def publish(self, observation: Observation) -> None:
        """Send an observation to the brick, if there is one; never waits for it.

        Raises:
            shared.messages.BadMessage: it has a value that the brick would not accept.
        """
        self.send(observation)

    def offer(self, offer: JobOffer) -> bool:
        """Offer a job to the brick, in the place of any earlier one; return True if there is one.

        Its parts go out as the brick asks for them, on later links, too.
        """
        self._offer = offer
        return self.send(offer.draw)

    def send(self, message: Observation | Start | Stop | Draw | Order) -> bool:
        """Send a message to the brick; return True if there is one."""
        with self._lock:
            if self._served is None:
                return False
            link = self._served.link
            link.send(message)
            if link.blocked or link.closed:
                self._wake_thread()  # to wait until it can go out, or to clear up
            return not link.closed

    def state(self) -> ServerState:
        """Return the state of the link."""
        with self._lock:
            if self._served is None:
                return ServerState(refusal=self._refusal, lost=self._lost)
            link = self._served.link
            return ServerState(
                client=self._served.address,
                since=self._served.since,
                status=self._status and self._status[0],
                status_age=self._status and self._now() - self._status[1],
                round_trip=link.clock.round_trip,
                refusal=self._refusal,
                lost=self._lost,
                counters=dict(link.counters),
                progress=self._progress and self._progress[0],
                progress_age=self._progress and self._now() - self._progress[1],
                status_lag=self._status[2] if self._status else 0.0,
            )

    def close(self, reason: str = "the tracker has ended") -> None:
        """Say bye and stop listening."""
        with self._lock:
            if self._ending:
                return
            self._ending = True
            self._wake_thread()
        if self._thread is not None:
            self._thread.join()
        for caller in self._connections():
            caller.link.close(reason)
        self._callers, self._served = [], None
        self._selector.close()
        for sock in (self._listener, self._wake_receiver, self._wake_sender):
            sock.close()

    # The sockets

    def has_work(self, timeout: float | None = 0.0) -> bool:
        """Return True if `serve_once` has something to do; wait for it, at most `timeout` s."""
        return bool(self._selector.select(timeout))

    def serve_once(self) -> None:
        """Do what is due once: accept, read, answer, ping, send; never waits."""
        with self._lock:
            with contextlib.suppress(BlockingIOError):
                self._wake_receiver.recv(4096)
            if not self._ending:
                self._accept()
                for caller in self._connections():
                    self._service(caller)

    def _serve(self) -> None:
        while not self._ending:
            self.has_work(SERVICE_PERIOD if self._connections() or self._accept_again else None)
            self.serve_once()

    def _wake_thread(self) -> None:
        with contextlib.suppress(BlockingIOError):  # then it wakes up already
            self._wake_sender.send(b"!")

    def _connections(self) -> list[_Caller]:
        return [*self._callers, *([self._served] if self._served else [])]

    def _accept(self) -> None:
        if self._accept_again is not None:
            if self._now() < self._accept_again:
                return
            self._accept_again = None
            self._selector.register(self._listener, selectors.EVENT_READ)
        for _ in range(MAX_CALLERS):
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
            if len(self._callers) >= MAX_CALLERS:
                self._make_room()
            self._callers.append(caller)
            self._selector.register(sock, caller.events)

    def _make_room(self) -> None:
        """Send away the oldest caller of the sender that has the most."""
        senders = [caller.sender for caller in self._callers]
        self._dismiss(self._callers[senders.index(max(senders, key=senders.count))])

    def _service(self, caller: _Caller) -> None:
        if caller not in self._connections():
            return  # sent away meanwhile
        caller.link.poll()
        message = caller.link.receive()
        while message is not None:
            if caller is not self._served:
                self._shake_hands(caller, message)
            else:
                self._handle(caller.link, message)
            message = caller.link.receive()
        if caller.link.closed:
            self._dismiss(caller)
        else:
            events = selectors.EVENT_READ | (caller.link.blocked and selectors.EVENT_WRITE)
            if events != caller.events:
                caller.events = events
                self._selector.modify(caller.sock, events)

    def _handle(self, link: Link, message: object) -> None:
        """Handle a message of the connected brick."""
        now = self._now()
        if isinstance(message, Status):
            self._status = message, now, _lag(link, message.t, now)
        elif isinstance(message, JobStatus):
            self._progress = message, now - _lag(link, message.t, now)
        elif isinstance(message, JobLog) and self._offer and link.clock.is_known:
            self._offer.add_log(message, link.clock.offset)
        elif isinstance(message, Want) and self._offer and (part := self._offer.part(message)):
            link.send(part)

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
                caller.link.send(Challenge(caller.laptop_nonce, self._salt))
        elif isinstance(message, Proof) and caller.brick_nonce is not None:
            self._check_proof(caller, message, caller.brick_nonce)
        elif not isinstance(message, Bye):
            caller.link.close()

    def _check_proof(self, caller: _Caller, message: Proof, brick_nonce: str) -> None:
        now = self._now()
        nonces = brick_nonce, caller.laptop_nonce
        is_right = pairing.is_proof(message.proof, self._key, BRICK, *nonces)
        wait = self._guesses.wait(caller.sender, now)
        # Who knows the code need not wait: another program at its address may go on guessing for
        # ever. Of codes of 59 bits ten thousand guesses a second find one in a million years.
        if not is_right and wait:
            reason = f"a wrong code came from this address; wait {math.ceil(wait)} s"
            self._refuse(caller, "wait", reason, wait)
        elif not is_right:
            wait = self._guesses.add(caller.sender, now)
            reason = (
                "this is not the pairing code; type the command that the tracker prints "
                f"(not before {wait:.0f} s have passed)"
            )
            self._refuse(caller, "code", reason, wait)
        else:
            self._guesses.forgive(caller.sender)
            if self._served is not None and self._served.link.closed:
                self._dismiss(self._served)
            if self._served is not None:
                reason = (
                    f"another program is connected, from {self._served.address}; end that one first"
                )
                self._refuse(caller, "busy", reason)
                return
            caller.link.send(Welcome(pairing.proof(self._key, LAPTOP, *nonces)))
            brick_key, laptop_key = pairing.session_keys(self._key, *nonces)
            caller.link.activate(laptop_key, brick_key)
            self._callers.remove(caller)
            self._served = caller
            self._status = self._progress = None
            self._refusal = ""
            caller.since = now

    def _refuse(self, caller: _Caller, cause: str, reason: str, wait: float = 0.0) -> None:
        self._refusal = f"{caller.address}: {reason}"
        caller.link.send(Refused(cause, reason, wait))
        caller.link.close()


def _lag(link: Link, t: float, now: float) -> float:
    """Return the age, s, of a message that bears the other side's time t; 0: unknown."""
    return max(0.0, now - (t - link.clock.offset)) if link.clock.is_known else 0.0


def _version_advice(version: int) -> str:
    both = f"the brick's program speaks version {version}, the laptop's {VERSION}; "
    if version < VERSION:
        return both + "copy robot/ and shared/ to the brick again"
    return both + "bring the laptop's checkout up to date"


def _place(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
