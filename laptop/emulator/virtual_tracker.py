"""A tracker that lives in the emulated world: the real server and the real link, in virtual time.

What the camera would see is asked of a function; everything behind it is real: the messages, the
loopback socket, the pairing, `TrackingServer` without its thread, and the client's own code. All
runs in the thread that lets the world go on, so a run repeats exactly.

    from laptop.emulator.rig import Rig
    from laptop.emulator.virtual_tracker import VirtualTracker

    with Rig("planar") as rig, rig.program() as program:

        def see(camera, index, t):
            x, y = rig.tip  # the true one, cm
            return {"effector": (320 + 12 * x, 400 - 12 * y, 1.0), "goal": (500.0, 300.0, 1.0)}

        with VirtualTracker(rig.world, see) as tracker:
            client = tracker.client()
            zero = program["robot.motion.zero"].Zero(rig.arm, rig.state_folder)
            arm = program["robot.motion.arm"].RobotArm(rig.arm, program.clock, zero)
            arm.load_zero()
            before = client.poll(0.2)["A"]
            arm.go_to([angle + 0.4 for angle in arm.angles()])
            after = client.poll(0.2)["A"]  # as it was at `after.t` on `rig.world`, 60 ms ago
            client.report(arm.angles(), 12.3)

A program that the rig runs finds it at 127.0.0.1:`tracker.port`, with `tracker.code`; there
`select.select` is `tracker.select`.
"""

from __future__ import annotations

import contextlib
import heapq
import math
import random
import select as real_select
import socket
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from laptop.emulator.host.world import World
from laptop.emulator.loopback import Loopback
from laptop.emulator.picture_faults import PictureFaults
from laptop.see.serve.server import TrackingServer
from robot.tracker_address import SaltedKey, ServerAddress
from robot.tracking import TrackingClient
from shared import pairing
from shared.messages import Observation

Markers = Mapping[str, "tuple[float, float, float] | None"]
See = Callable[[str, int, float], "Markers | None"]

HOST = "127.0.0.1"
CODE = "ABCDEFGHJKMN"
SALT = "5a" * 16

LAPTOP_CLOCK_LEAD = 5000.0
"""Lead of the laptop's clock over the world's, s."""

UPLINK_DELAY = 0.0005
"""Delay of the brick's messages, s."""

POLL_PERIOD = 0.005
"""Period at which the server polls for calls while nobody waits in `select`, s."""

MAX_TURN_PERIOD = 0.1
"""Greatest time until its pings and timeouts are handled though nobody called, s."""

MAX_JITTER_MEANS = 6
"""Greatest jitter, as a multiple of its mean; more is cut off."""

LINK_TIMEOUT = 1.0
"""Greatest time for a new client to link, s."""

GARBAGE = (
    b"\x00\xff\xfe no text",
    b"HTTP/1.1 400 Bad Request",
    b'{"kind":"observation","camera":"A","seq":999999999,"t":',
    b'{"kind":"pong","id":999999999,"received":0,"sent":0}',
    b"[" * 1000,
    b"9" * 3000,
)
"""Lines of a flood: too long, not JSON, or a lie."""


@dataclass(frozen=True)
class FrameChain:
    """Chain by which frames come from the cameras to the brick.

    fps      frames/s
    latency  from capture until the brick can read it, s; of all cameras, or by camera
    jitter   mean of what comes on top (exponential, at most MAX_JITTER_MEANS times as much), s
    drops    share of the frames that get lost, 0..1
    """

    fps: float = 30.0
    latency: float | Mapping[str, float] = 0.06
    jitter: float = 0.0
    drops: float = 0.0


class VirtualTracker:
    """A camera, a tracker and its server for one brick in a World.

    Camera by camera, frame k is taken at phase + k / fps, where the phase is drawn. Its markers can
    be read by the brick `latency` and some jitter later, in the order of the frames.

    Args:
        world: whose time it lives in.
        see: `see(camera, index, t)` is called when the world is AT the capture time t (s) of a
            frame, and gives {name: (u, v, confidence) or None where not seen}, px; None drops
            the frame. It must not let time pass.
        chain: how they come.
        cameras: names.
        seed: draws phases, jitter and drops.
        pictures: where `see` asks for its pictures, see `rendered`; None: what it shows is a
            picture by itself.

    Attributes:
        pictures: PictureFaults: freezes them, or lets them come again.
        port: where the server listens, at HOST.
        code: its pairing code.
        key: SaltedKey of the code, for bricks that have paired before.
        server: the TrackingServer; after `restart` another one.
        frames: per camera, how many were taken.
    """

    def __init__(
        self,
        world: World,
        see: See,
        chain: FrameChain = FrameChain(),  # noqa: B008 (it does not change)
        cameras: Sequence[str] = ("A",),
        seed: int = 0,
        pictures: PictureFaults | None = None,
    ) -> None:
        self.world = world
        self.pictures = pictures or PictureFaults()
        self._see_is_picture = pictures is None  # the picture is what `see` gives
        self.see = see
        self.fps = chain.fps
        late = chain.latency
        self.latency = dict(late) if isinstance(late, Mapping) else dict.fromkeys(cameras, late)
        self.jitter = chain.jitter
        self.drops = chain.drops
        self.code = CODE
        self.key = SaltedKey(SALT, pairing.key_of(CODE, SALT))
        self.frames = dict.fromkeys(cameras, 0)
        self._clients: list[TrackingClient] = []
        self._due: list[float] = []  # when something of ours happens; a heap
        self._called = False  # and the turn that follows is on its way
        self._next_turn = 0.0
        self._silent_until = 0.0
        self._flood = 0.0  # lines/s
        self._garbage = 0.0  # lines said so far
        self._reserved: socket.socket | None = None
        self._loopback = Loopback()
        self._closed = False

        self.server = self._serve(0)
        self.port = self.server.port
        self._start = world.now()
        for camera in self.frames:
            rng = random.Random(f"{seed}/{camera}")
            self._expose(camera, rng, world.now() + rng.random() / self.fps, 0.0)
        self._at(world.now() + POLL_PERIOD, self._poll)
        world.select = self.select

    def __enter__(self) -> VirtualTracker:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def client(
        self,
        clock: Any = None,
        say: Callable[[str], None] = lambda line: None,
        make: Callable[..., TrackingClient] = TrackingClient,
    ) -> TrackingClient:
        """Return a client for the caller's thread; linked, unless a fault prevents it.

        Args:
            clock: the world if None.
            say: as for TrackingClient.
            make: TrackingClient, or that of a Program.
        """
        clock = clock or self.world
        memory = _Memory(self.key)
        client = make(HOST, self.port, self.code, clock, memory, say=say, select=self.select)
        self._clients.append(client)
        end = clock.now() + LINK_TIMEOUT
        while not client.linked and clock.now() < end:
            client.poll(0.01)
        return client

    def select(
        self,
        rlist: Sequence[Any],
        wlist: Sequence[Any],
        xlist: Sequence[Any],
        timeout: float | None = None,
    ) -> tuple[list[Any], list[Any], list[Any]]:
        """Wait as select.select does, while the world goes on."""
        world = self.world
        deadline = math.inf if timeout is None else world.now() + timeout
        while True:
            self._loopback.connect(wlist)
            self._loopback.settle()
            found = real_select.select(rlist, wlist, xlist, 0)
            if any(found):
                return found
            now = world.now()
            if now >= deadline:
                return found
            if not self._called and self._hears() and self.server.has_work():
                self._called = True
                self._at(now + UPLINK_DELAY, self._answer)
            while self._due and self._due[0] <= now:
                heapq.heappop(self._due)
            wake = min(deadline, self._due[0]) if self._due else deadline
            # A program of several threads may be woken later, or by a signal.
            world.sleep((wake if wake < math.inf else now + POLL_PERIOD) - now)

    def close(self) -> None:
        """Close the server and the clients made here, and take no more pictures."""
        if self._closed:
            return
        self._closed = True
        self.world.select = None
        for client in self._clients:
            client.close()
        self.server.close()
        if self._reserved is not None:
            self._reserved.close()

    # Faults

    def cut(self) -> None:
        """Reset the connection to the brick, as when the laptop's network goes down and up."""
        served = self._served()
        if served is not None:
            # Closed with this option, a socket says RST at once.
            served.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            served.sock.close()
            served.link.reason = "cut"
            self.server.serve_once()
            self._loopback.settle()

    def silence(self, seconds: float = math.inf) -> None:
        """Say and read nothing for so long, with every socket open: the laptop is out of reach."""
        self._silent_until = self.world.now() + seconds

    def flood(self, rate: float) -> None:
        """Put `rate` lines/s of garbage between what is said to the served brick; 0 ends it."""
        self._flood = rate
        self._garbage = 0.0

    def restart(self, after: float) -> None:
        """End the server as Ctrl-C does, and start it again at the same port `after` s later."""
        self.server.close()
        self._loopback.settle()
        # Bound, but not listening: who connects is refused, and no other program gets the port.
        self._reserved = socket.socket()
        self._reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._reserved.bind((HOST, self.port))
        self._at(self.world.now() + after, self._return)

    def _return(self) -> None:
        if self._reserved is not None:
            self.server = self._serve(self.port)
            self._reserved.close()
            self._reserved = None

    # The cameras

    def _expose(self, camera: str, rng: random.Random, first: float, arrival: float) -> None:
        """Have the next frame taken; `arrival` is when the one before gets to the brick."""
        index = self.frames[camera]
        t = first + index / self.fps

        def expose() -> None:
            if self._closed:
                return
            self.frames[camera] = index + 1
            markers = self._seen(camera, index, t)
            lost = rng.random() < self.drops
            late = self.jitter * min(rng.expovariate(1.0), MAX_JITTER_MEANS)
            when = max(arrival, t + self.latency[camera] + late)
            self._expose(camera, rng, first, when)
            if markers is not None and not lost:
                observation = Observation(index, camera, t + LAPTOP_CLOCK_LEAD, dict(markers))
                self._at(when, lambda: self._publish(observation))

        self.world.at(t, expose)

    def _seen(self, camera: str, index: int, t: float) -> Markers | None:
        if not self._see_is_picture:
            return self.see(camera, index, t)
        return self.pictures.shown(camera, lambda: self.see(camera, index, t))

    def _publish(self, observation: Observation) -> None:
        if self._hears():
            self.server.publish(observation)

    # The server's turns

    def _serve(self, port: int) -> TrackingServer:
        server = TrackingServer(
            HOST,
            port,
            self.code,
            lambda: self.world.t + LAPTOP_CLOCK_LEAD,
            threaded=False,
            salt=self.key.salt,
        )
        self._loopback.listen(server._listener)
        return server

    def _at(self, t: float, action: Callable[[], None]) -> None:
        """Do something at t that a client may notice."""
        due = self._due

        def act() -> None:
            while due and due[0] <= t:
                heapq.heappop(due)
            if not self._closed:
                self._loopback.settle()
                action()
                self._loopback.settle()

        heapq.heappush(due, t)
        self.world.at(t, act)

    def _poll(self) -> None:
        now = self.world.t
        self._at(now + POLL_PERIOD, self._poll)
        if self._hears():
            if now >= self._next_turn or self.server.has_work():
                self._turn()
            if self._flood:
                self._pollute()

    def _answer(self) -> None:
        self._called = False
        if self._hears():
            self._turn()

    def _turn(self) -> None:
        self._next_turn = self.world.t + MAX_TURN_PERIOD
        self.server.serve_once()

    def _hears(self) -> bool:
        """Return True if there is a server at all, and it is within reach."""
        return self._reserved is None and self.world.t >= self._silent_until

    def _served(self) -> Any:
        """Return the server's end of the connection to the brick, where faults act."""
        return self.server._served

    def _pollute(self) -> None:
        first, self._garbage = self._garbage, self._garbage + self._flood * POLL_PERIOD
        lines = [GARBAGE[n % len(GARBAGE)] for n in range(int(first), int(self._garbage))]
        served = self._served()
        if served is not None and lines:
            with contextlib.suppress(OSError):  # full, or gone
                served.sock.send(b"\n".join([*lines, b""]))


class _Memory:
    """A client's memory, without a file; it has paired before."""

    def __init__(self, key: SaltedKey) -> None:
        self._tracker: ServerAddress | None = None
        self._key = key

    def load(self) -> ServerAddress | None:
        """Return what was saved last."""
        return self._tracker

    def load_key(self, code: str) -> SaltedKey:
        """Return the key of the only code that there is."""
        return self._key

    def save(self, tracker: ServerAddress, key: SaltedKey) -> None:
        """Keep them until the program ends."""
        self._tracker, self._key = tracker, key
