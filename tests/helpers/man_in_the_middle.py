"""Somebody between laptop and brick on real TCP, who reads all that passes and changes it.

    python tests/helpers/man_in_the_middle.py 1000      so many attacks, a table by kind

Both ends are the real ones, with real clocks; what one has sent and what the other has taken is
held against each other.
"""

import collections
import random
import select
import socket
import sys
import tempfile
import time
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from laptop.see.serve.server import TrackingServer
from robot.clock import Clock
from robot.tracker_address import Memory, SaltedKey, ServerAddress
from robot.tracking_client import TrackingClient
from shared import pairing
from shared.link import SILENCE_TIMEOUT
from shared.messages import Observation, Start, Stop, encode

CODE, SALT = "ABCDEFGHJKMN", "5a" * 16
KEY = SaltedKey(SALT, pairing.key_of(CODE, SALT))
FRAME = 0.003
"""Time between two observations, s: a hundred in a moment."""
LIMIT = SILENCE_TIMEOUT + 1.5
"""Within which both sides must have noticed, s."""


def _forged(message, luck):
    """The line of a message of the attacker's own, with a signature that is a guess."""
    return encode(message)[:-1] + b"%016x\n" % luck.getrandbits(64)


def _own(message):
    """Put a message in, with the signature of the line that it takes the place of."""
    return lambda lines, luck, past: [encode(message)[:-1] + lines[0][-17:], *lines[1:]]


def _moved(lines, luck, past):
    number = luck.choice([k for k, line in enumerate(lines) if b'"markers"' in line])
    digit = lines[number].index(b"[") + luck.choice((1, 2, 3))
    other = luck.choice([d for d in b"123456789" if d != lines[number][digit]])
    lines[number] = lines[number][:digit] + bytes([other]) + lines[number][digit + 1 :]
    return lines


def _swapped(lines, luck, past):
    return [lines[1], lines[0], *lines[2:]]


def _bit(lines, luck, past):
    changed = bytearray(lines[0])
    changed[luck.randrange(len(changed) - 1)] ^= 1 << luck.randrange(7)
    return [bytes(changed), *lines[1:]]


ATTACKS = {
    "position rewritten": ("down", _moved),
    "one bit changed": ("down", _bit),
    "status changed": ("up", _bit),
    "stop put in": ("down", lambda lines, luck, past: [_forged(Stop("now"), luck), *lines]),
    "start put in": ("down", lambda lines, luck, past: [_forged(Start(), luck), *lines]),
    "unsigned stop": ("down", lambda lines, luck, past: [encode(Stop("now")), *lines]),
    "stop, signed as another": ("down", _own(Stop("now"))),
    "start, signed as another": ("down", _own(Start())),
    "repeated at once": ("down", lambda lines, luck, past: [lines[0], *lines]),
    "repeated later": ("down", lambda lines, luck, past: [luck.choice(past["down"]), *lines]),
    "of an earlier connection": (
        "down", lambda lines, luck, past: [luck.choice(past["before"]), *lines]
    ),
    "sent back": ("down", lambda lines, luck, past: [luck.choice(past["up"]), *lines]),
    "reordered": ("down", _swapped),
    "left out": ("down", lambda lines, luck, past: lines[1:]),
    "status left out": ("up", lambda lines, luck, past: lines[1:]),
    "cut in mid-line": ("down", lambda lines, luck, past: [lines[0][: len(lines[0]) // 2], None]),
    "cut": ("down", lambda lines, luck, past: [None]),
}  # fmt: skip
"""Kind -> direction (down: to the brick), and what becomes of lines: `attack(lines, luck, past)`
gives those that are passed on, None for the end of the connection."""


class Attacker:
    """Listens where the brick believes the tracker to be."""

    def __init__(self, server):
        self.port = None
        self._server = server
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.setblocking(False)
        self.port = self._listener.getsockname()[1]
        self.before = []
        self.reset()

    def reset(self):
        """Forget the last connection, but for what can be repeated."""
        self._ends = None
        self._rest = {"down": b"", "up": b""}
        self.past = {"down": [], "up": [], "before": self.before}
        self.plan = None  # (direction, attack, luck)
        self.struck = False

    def pump(self):
        """Pass on what there is, attacked where that is planned."""
        if self._ends is None:
            try:
                brick, _ = self._listener.accept()
            except BlockingIOError:
                return
            laptop = socket.create_connection(("127.0.0.1", self._server.port))
            self._ends = {"down": (laptop, brick), "up": (brick, laptop)}
            for end in (laptop, brick):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not all(self._pass(direction, *ends) for direction, ends in self._ends.items()):
            self._pass("up", *self._ends["up"])  # a farewell of the brick, which may have left
            self.close()

    def _pass(self, direction, source, sink):
        try:
            if not select.select([source], [], [], 0)[0]:
                return True
            data = source.recv(65536)
            if not data:
                return False
            *lines, self._rest[direction] = (self._rest[direction] + data).split(b"\n")
            lines = [line + b"\n" for line in lines]
            fitting = len(lines) > 1 and any(b'"markers"' in line for line in lines)
            if self.plan and not self.struck and self.plan[0] == direction:
                if direction == "down" and not fitting:
                    self._rest[direction] = b"".join(lines) + self._rest[direction]
                    return True  # until there are enough to do it with
                self.struck = True
                lines = self.plan[1](lines, self.plan[2], self.past)
            for line in lines:
                if line is None:
                    return False
                self.past[direction].append(line)
                sink.sendall(line)
        except OSError:
            return False
        return True

    def close(self):
        """Close the connection, on both sides."""
        for end in self._ends["down"] if self._ends else ():
            end.close()
        self._ends = {}
        self.before = [line for line in self.past["down"] if b'"markers"' in line] or self.before

    def end(self):
        """Listen no longer."""
        self.close()
        self._listener.close()


Result = collections.namedtuple("Result", "kind taken brick laptop seconds")
Result.__doc__ = (
    """An attack: what was taken that had not been sent, why each side ended, and when."""
)


class Stage:
    """A laptop, a brick, and the attacker between them."""

    def __init__(self, folder):
        self._clock = Clock()
        self._server = TrackingServer("127.0.0.1", 0, CODE, self._clock.now, salt=SALT)
        self._attacker = Attacker(self._server)
        self._memory = Memory(folder)
        self._memory.save(ServerAddress("127.0.0.1", self._attacker.port, CODE), KEY)
        self._seq = 0

    def attack(self, kind, luck):
        """Link, let positions flow, and attack once; a Result."""
        attacker, server = self._attacker, self._server
        attacker.reset()
        client = TrackingClient(
            "127.0.0.1", attacker.port, CODE, self._clock, self._memory, say=lambda line: None
        )
        sent, taken, moves, stop_at = {}, [], 0, None
        quiet = time.monotonic() + 10
        try:
            after = luck.randrange(3, 30)
            while True:
                now = time.monotonic()
                if server.state().client is not None:
                    self._seq += 1
                    u, v = round(luck.uniform(100, 600), 3), round(luck.uniform(100, 400), 3)
                    sent[self._seq] = {"effector": (u, v, 0.98), "goal": (v, u, 0.97)}
                    server.publish(Observation(self._seq, "A", self._clock.now(), sent[self._seq]))
                attacker.pump()
                for seen in client.poll(0.0).values():
                    if sent.get(seen.seq) != seen.markers:
                        taken.append(seen)
                    moves += 1
                    client.report((0.1,), 5.0, "going", moves=moves)
                taken += client.commands()
                status = server.state().status
                if status is not None and not (status.q == (0.1,) and 0 < status.moves <= moves):
                    taken.append(status)
                if attacker.plan is None and moves > after and attacker.before:
                    attacker.plan = (*ATTACKS[kind], luck)
                elif attacker.plan is None and moves > after:
                    attacker.before = [x for x in attacker.past["down"] if b'"markers"' in x]
                if attacker.struck and stop_at is None:
                    stop_at = now
                if stop_at and not client.linked and server.state().client is None:
                    return Result(kind, taken, client.why, server.state().lost, now - stop_at)
                if now > (stop_at + LIMIT if stop_at else quiet):
                    return Result(kind, taken, client.why, server.state().lost, float("inf"))
                time.sleep(FRAME)
        finally:
            client.close()
            attacker.close()
            while server.state().client is not None and time.monotonic() < quiet:
                time.sleep(0.001)

    def close(self):
        """End the laptop's side and the attacker."""
        self._attacker.end()
        self._server.close()


def attacks(count, seed=1):
    """Results of so many attacks, each kind as often as the others."""
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(folder)
        try:
            for number in range(count):
                kind = list(ATTACKS)[number % len(ATTACKS)]
                yield stage.attack(kind, random.Random(f"{seed}/{number}"))
        finally:
            stage.close()


def _main(count):
    results = list(attacks(count))
    print("{:26}{:>6}{:>7}{:>9}{:>9}  {}".format("", "n", "taken", "noticed", "at most", "why"))
    for kind in ATTACKS:
        mine = [result for result in results if result.kind == kind]
        noticed = [result for result in mine if result.seconds < LIMIT]
        whys = {(r.brick.split(": ", 1)[-1], r.laptop.split(": ", 1)[-1]) for r in mine}
        print(
            "{:26}{:>6}{:>7}{:>9}{:>7.2f} s  {}".format(
                kind, len(mine), sum(len(result.taken) for result in mine), len(noticed),
                max(result.seconds for result in mine),
                "; ".join("brick: {} / laptop: {}".format(*why) for why in sorted(whys)),
            )
        )  # fmt: skip
    taken = sum(bool(result.taken) for result in results)
    noticed = sum(result.seconds < LIMIT for result in results)
    print(f"{len(results)} attacks: {taken} taken, {noticed} noticed on both sides")


if __name__ == "__main__":
    _main(int(sys.argv[1]))
