"""The brick's end of the link to the tracker: markers as cameras see them, newest only."""

import math
import select
import socket

from robot.tracker_address import (
    Memory,
    SaltedKey,
    ServerAddress,
    addresses_of,
    remembered,
    why_unreachable,
)
from shared import pairing
from shared.job_messages import Draw, JobPart, Order
from shared.link import FOREIGN, MAX_AGE, Link
from shared.message_fields import one_line
from shared.messages import (
    BRICK,
    LAPTOP,
    STATUS_PERIOD,
    VERSION,
    BadMessage,
    Challenge,
    Hello,
    Proof,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
)

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from shared.job_messages import JobStatus, Want  # noqa: F401
    from shared.messages import Observation  # noqa: F401

    Command = Union[Start, Stop, Draw]
    OfJob = Union[JobPart, Order]
    Select = Callable[..., Tuple[Sequence[object], Sequence[object], Sequence[object]]]
    _Say = Callable[[str], object]
    _Volts = Callable[[], Optional[float]]  # of the battery, V
    _Errors = Optional[Mapping[str, float]]  # by row, px
    _OrNone = Optional[float]

CONNECT_TIMEOUT = 3.0
"""Longest wait for TCP to connect, s; after that it is the link that notices silence."""

MIN_PAUSE = 0.25
MAX_PAUSE = 2.0
"""Least and greatest pause between two tries to connect, s; it doubles after each."""

PING_TIMEOUT = 0.005
"""Wait for the answer to a ping, s: it bounds how well the clock offset can be known."""

MAX_COMMANDS = 16
"""Greatest number of commands that wait, and of messages of a job; older ones are dropped."""

RECEIVE_BUFFER = 16384
"""Size of the system's receive buffer, bytes: a second or two of observations."""


class TrackingClient(object):
    """A link to the tracker that comes back by itself. Call `poll` often; nothing runs beside it.

    Host and code are stored once the tracker has proven that it knows the code. A name is looked up
    here, at once; later nothing waits for longer than its timeout, but for the answer to a ping now
    and then (PING_TIMEOUT; ten times that while nothing can be dated anyway).

    Args:
        host, port: of the tracker.
        code: as pairing.read_code returns it.
        clock: robot.clock.Clock.
        memory: Memory() if None.
        say: called with a line whenever the link comes, goes, or fails for another reason; who
            sees `refused` reports `why` in its own way.
        select: waits for sockets, as select.select does.
        battery: called for its voltage, V or None, before each report.

    Attributes:
        linked: whether observations can come in.
        why: why not; "" while linked.
        refused: whether it has given up: another code or another version is needed.
        lost_since: time since when it is not linked, s on our clock; None while linked.

    Raises:
        NotPaired: nothing is known of a host of that name.
    """

    def __init__(
        self, host, port, code, clock, memory=None, say=print, select=select.select,
        battery=lambda: None
    ):  # fmt: skip
        # type: (str, int, str, Clock, Optional[Memory], _Say, Select, _Volts) -> None
        self.linked = False
        self.why = "not connected yet"
        self.refused = False
        self.lost_since = clock.now()  # type: Optional[float]
        self._tracker = ServerAddress(host, port, code)
        self._place = ("[{}]:{}" if ":" in host else "{}:{}").format(host, port)
        self._addresses = addresses_of(host, port)
        self._clock = clock
        self._memory = memory or Memory()
        self._key = self._memory.load_key(code)  # a SaltedKey
        self._is_key_checked = False  # against the salt that the tracker has today
        self._say = say
        self._announced = None  # type: Optional[str]
        self._select = select
        self._battery = battery

        self._connecting = None  # type: Optional[socket.socket]  # a socket that connects
        self._link = None  # type: Optional[Link]
        self._nonces = "", ""  # ours, theirs; "" before they are known
        self._limit = 0.0  # time until which connecting may take, s
        self._tries = 0
        self._pause = MIN_PAUSE
        self._next_try = clock.now()
        # Capture time of the newest observation handed over, s, by camera.
        self._seen = {}  # type: Dict[str, float]
        self._commands, self._of_job = [], []  # type: List[Command], List[OfJob]
        # Time of the last report on this link, s, and its run and verdict.
        self._reported_at, self._reported = -math.inf, (0, "")

    def poll(self, timeout=0.0):
        # type: (float) -> Dict[str, Observation]
        """Do what is due, and return what is new; better wait here than sleep elsewhere.

        Args:
            timeout: longest wait until something comes in, s.

        Returns:
            {camera: Observation}, each newer than the last one; their t is on our clock.
        """
        if self._link is None and self._connecting is None:
            now = self._clock.now()
            if self.refused or now < self._next_try:
                left = timeout if self.refused else min(timeout, self._next_try - now)
                self._clock.sleep(left)
                return {}
            self._connect()
        if self._connecting is not None:
            self._finish_connecting(self._connecting, timeout)
            timeout = 0.0
        if self._link is None:
            return {}
        self._link.poll(timeout)
        self._listen(self._link)
        if not self.linked:
            return {}
        new = {}
        for camera, seen in self._link.newest().items():
            # Where the clock offset was corrected a later picture can seem the older one; one that
            # is much older shows that our own clock has jumped back.
            if not 0 <= self._seen.get(camera, -float("inf")) - seen.t < MAX_AGE:
                self._seen[camera] = seen.t
                new[camera] = seen
        return new

    def age(self, camera):
        # type: (str) -> float
        """Return the age of a camera's newest observation, s; inf if there was none."""
        return self._clock.now() - self._seen.get(camera, -float("inf"))

    def commands(self):
        # type: () -> List[Command]
        """Return the Start, Stop and Draw messages since the last call; a lost link drops them."""
        commands, self._commands = self._commands, []
        return commands

    def of_job(self):
        # type: () -> List[OfJob]
        """Return the JobParts and Orders since the last call; a lost link drops them."""
        of_job, self._of_job = self._of_job, []
        return of_job

    def send(self, message):
        # type: (Union[Want, JobStatus]) -> bool
        """Send a Want or JobStatus; return whether there is a link."""
        if self._link is not None and self.linked:
            self._link.send(message)
        return self.linked

    def report(self, q, error, verdict="", reason="", e=None, condition=None, moves=0, run=1):
        # type: (Sequence[float], _OrNone, str, str, _Errors, _OrNone, int, int) -> None
        """Report progress to the laptop; more often than every STATUS_PERIOD, only new verdicts.

        What is not finite, or too large for a message, is sent as not known: no angles, no error.
        `q` are joint angles, rad; `error` is px or None; `verdict` is "" while the run goes on;
        `reason` is cut to one line; `e`, `condition`, `moves` and `run` are as in Status.
        """
        now = self._clock.now()
        link, due = self._link, now - self._reported_at >= STATUS_PERIOD
        if link is not None and self.linked and (due or (run, verdict) != self._reported):
            self._reported_at, self._reported = now, (run, verdict)
            reason, q = one_line(reason), tuple(q)
            status = Status(
                now, q, error, verdict, reason, e or {}, condition, moves, run, self._battery()
            )  # fmt: skip
            try:
                link.send(status)
            except BadMessage:
                link.send(status._replace(q=(), error=None, e={}, condition=None, battery=None))

    @property
    def late(self):
        # type: () -> Dict[str, float]
        """{camera: age, s} of the cameras whose last observation came too late to be used."""
        return self._link.late if self._link is not None and self.linked else {}

    @property
    def round_trip(self):
        # type: () -> Optional[float]
        """Round trip of the ping that the clock offset rests on, s; None while there is none."""
        return self._link.clock.round_trip if self._link is not None and self.linked else None

    @property
    def counters(self):
        # type: () -> Dict[str, int]
        """Counters of the present link (see Link); {} without one."""
        return dict(self._link.counters) if self._link else {}

    def close(self, reason=""):
        # type: (str) -> None
        """Say bye and end; `poll` would connect again."""
        if self._connecting is not None:
            self._connecting.close()
            self._connecting = None
        if self._link is not None:
            self._link.close(reason)
            self._link = None
        self._lose("closed", self._clock.now(), quietly=True)

    # Connecting

    def _connect(self):
        # type: () -> None
        family, address = self._addresses[self._tries % len(self._addresses)]
        self._tries += 1
        self._limit = self._clock.now() + CONNECT_TIMEOUT
        try:
            self._connecting = socket.socket(family, socket.SOCK_STREAM)
            self._connecting.setblocking(False)
            self._connecting.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            self._connecting.connect(address)
        except BlockingIOError:
            pass  # it goes on connecting
        except OSError as error:
            self._not_connected(error.errno)

    def _finish_connecting(self, sock, timeout):
        # type: (socket.socket, float) -> None
        if self._select([], [sock], [], timeout)[1]:
            number = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if number:
                self._not_connected(number)
                return
            self._connecting = None
            self._link = Link(sock, self._clock.now, patience=PING_TIMEOUT, select=self._select)
            self._nonces = pairing.new_nonce(), ""
            self._link.send(Hello(VERSION, BRICK, self._nonces[0]))
        elif self._clock.now() > self._limit:
            self._not_connected(None)

    def _not_connected(self, number):
        # type: (Optional[int]) -> None
        if self._connecting is not None:  # the system has perhaps no socket of this kind
            self._connecting.close()
            self._connecting = None
        why = why_unreachable(self._place, self._tracker.port, number, CONNECT_TIMEOUT)
        self._lose(why, self._clock.now())

    # The handshake, and messages after it

    def _listen(self, link):
        # type: (Link) -> None
        message = link.receive()
        while message is not None:
            if self.linked:
                if isinstance(message, (Start, Stop, Draw)):
                    self._commands.append(message)
                    del self._commands[:-MAX_COMMANDS]
                elif isinstance(message, (JobPart, Order)):
                    self._of_job.append(message)
                    del self._of_job[:-MAX_COMMANDS]
            else:
                self._shake_hands(link, message)
            message = self._link.receive() if self._link else None
        if self._link is None:
            return
        now = self._clock.now()
        if self._link.closed:
            why = "{}: {}".format(self._place, self._link.reason)
            if self._link.reason == FOREIGN:
                why = (
                    "{}: something else than the tracker answers there; "
                    "check address and port".format(self._place)
                )
            self._lose(why, now)

    def _shake_hands(self, link, message):
        # type: (Link, object) -> None
        ours, theirs = self._nonces
        if isinstance(message, Challenge) and not theirs:
            key = self._key_for(message.salt)
            if key is not None:
                self._nonces = ours, message.nonce
                link.send(Proof(pairing.proof(key.key, BRICK, ours, message.nonce)))
        elif isinstance(message, Welcome) and theirs and self._key is not None:
            if pairing.is_proof(message.proof, self._key.key, LAPTOP, ours, theirs):
                self._welcome(link, self._key)
            else:
                self._give_up(
                    "{} does not know the pairing code, so it is not your tracker; "
                    "check the address".format(self._place)
                )
        elif isinstance(message, Refused):
            now = self._clock.now()
            if message.cause in ("code", "version"):
                self._give_up("{}: {}".format(self._place, message.reason))
            else:
                self._lose("{}: {}".format(self._place, message.reason), now)
                self._next_try = max(self._next_try, now + message.wait)
        else:
            self._lose("{} does not keep to the handshake".format(self._place), self._clock.now())

    def _key_for(self, salt):
        # type: (str) -> Optional[SaltedKey]
        """Return the SaltedKey if it is at hand; else compute it now, and end the connection.

        That happens once per program at most: an arm that moves is never kept waiting by it.
        """
        if self._key is not None and self._key.salt == salt:
            self._is_key_checked = True
            return self._key
        if self._is_key_checked:
            self._give_up(
                "the tracker at {} has another pairing code now; "
                "type the command that it prints".format(self._place)
            )
        else:
            self._is_key_checked = True
            self._lose("pairing", self._clock.now(), quietly=True)  # it is not kept waiting
            self._announce("pairing with {}: a moment, this once".format(self._place))
            self._key = SaltedKey(salt, pairing.key_of(self._tracker.code, salt))
            self._next_try = self._clock.now()
        return None

    def _welcome(self, link, key):
        # type: (Link, SaltedKey) -> None
        link.activate(*pairing.session_keys(key.key, *self._nonces))
        self.linked = True
        self.why = ""
        self.lost_since = None
        self._pause = MIN_PAUSE
        self._announce("linked to {}".format(self._place))
        known = remembered(self._memory), self._memory.load_key(self._tracker.code)
        if known != (self._tracker, key):
            try:
                self._memory.save(self._tracker, key)
            except OSError as error:
                self._announce(
                    "{} cannot be written ({}), so host and code must be told again".format(
                        self._memory.file, error.strerror
                    )
                )
        link.poll()  # the first ping

    def _give_up(self, why):
        # type: (str) -> None
        self.refused = True
        self._lose(why, self._clock.now())

    def _lose(self, why, now, quietly=False):
        # type: (str, float, bool) -> None
        if self._link is not None:
            self._link.close()
            self._link = None
        if self.lost_since is None:
            self.lost_since = now
        self.linked = False
        self.why = why
        self._commands, self._of_job = [], []
        self._reported_at = -math.inf
        self._next_try = now + self._pause
        self._pause = min(2 * self._pause, MAX_PAUSE)
        if not quietly and not self.refused:
            self._announce("not linked: {}".format(why))

    def _announce(self, line):
        # type: (str) -> None
        if line != self._announced:
            self._announced = line
            self._say(line)
