"""The link, over real sockets, with a clock that the tests turn: what it refuses and survives."""

import contextlib
import fcntl
import select
import socket
import struct
import termios
import threading
import time

import pytest
from clocks import FakeClock
from one_run import one_run
from signed import KEYS, SignedSocket
from waiting import PATIENCE, until

from shared import link as link_module
from shared import messages, pairing
from shared.framing import TAG_LENGTH
from shared.link import (
    FORGED,
    MAX_AGE,
    MAX_BAD_LINES,
    MAX_QUEUE,
    SILENCE_TIMEOUT,
    Link,
)
from shared.messages import (
    BRICK,
    MAX_CAMERAS,
    MAX_LINE,
    VERSION,
    BadMessage,
    Challenge,
    Hello,
    Observation,
    Ping,
    Pong,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
    decode,
    encode,
)
from shared.peer_clock import MAX_DRIFT, MAX_SAMPLES, SLOW_PING, PeerClock
from shared.signing import LineSigner

AHEAD = 5000.0
"""By which the laptop's clock is ahead of the brick's, s."""


def tcp_pair():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        # Small buffers, that are soon full.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16384)
        one = socket.create_connection(listener.getsockname())
        one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16384)
        return one, listener.accept()[0]


class Counted:
    """A socket that counts the bytes that go through it."""

    def __init__(self, sock):
        self._sock = sock
        self.sent = self.received = 0

    def __getattr__(self, name):
        return getattr(self._sock, name)

    def send(self, data):
        count = self._sock.send(data)
        self.sent += count
        return count

    def recv(self, size):
        data = self._sock.recv(size)
        self.received += len(data)
        return data

    def there(self):
        """How many bytes have come in so far."""
        waiting = fcntl.ioctl(self._sock.fileno(), termios.FIONREAD, b"\0" * 4)
        return self.received + struct.unpack("i", waiting)[0]


class Wire:
    """Two linked sides with clocks of their own; time passes only by `pass_time`."""

    def __init__(self, pair):
        self.laptop_clock = FakeClock(AHEAD + 100.0)
        self.brick_clock = FakeClock(100.0)
        self.socks = laptop, brick = tuple(map(Counted, pair))
        self.is_tcp = laptop.family == socket.AF_INET
        self.laptop = Link(laptop, self.laptop_clock.now, KEYS)
        self.brick = Link(brick, self.brick_clock.now, KEYS[::-1])
        self.seq = 0

    def turn(self, seconds):
        self.laptop_clock.t += seconds
        self.brick_clock.t += seconds

    def poll(self):
        """Until all that is under way has arrived: thrice, for ping, pong, and what follows."""
        for _ in range(3):
            self.brick.poll()
            self.laptop.poll()
            if not (self.laptop.closed or self.brick.closed):
                until(self.has_arrived, "what is under way")

    def has_arrived(self):
        """Whether all that was sent has come in, or as much as there is room for."""
        one, other = self.socks
        return all(
            a.sent == b.there() or b.there() - b.received >= MAX_LINE
            for a, b in ((one, other), (other, one))
        )

    def pass_time(self, seconds, step=0.1):
        for _ in range(int(round(seconds / step))):
            self.turn(step)
            self.poll()

    def observation(self, age=0.0, camera="A", **changes):
        """What the laptop's camera saw `age` s ago."""
        self.seq += 1
        seen = Observation(
            self.seq, camera, self.laptop_clock.t - age, {"effector": (1.0, 2.0, 0.5)}
        )
        return seen._replace(**changes)

    def brick_says(self, message):
        """Past the link, which would look for what has come in."""
        self.brick._sock.send(self.brick._outgoing._sign(encode(message)))

    def close(self):
        self.laptop.close()
        self.brick.close()


@pytest.fixture(params=[socket.socketpair, tcp_pair], ids=["socketpair", "tcp"])
def wire(request):
    """Both sides know each other's clocks."""
    wire = Wire(request.param())
    wire.poll()
    yield wire
    wire.close()


@pytest.fixture
def raw():
    """The brick's end of a link, the bare socket at its other end, and the brick's clock."""
    sock, other = socket.socketpair()
    clock = FakeClock(100.0)
    link = Link(sock, clock.now, KEYS)
    yield link, SignedSocket(other), clock
    link.close()
    other.close()


def test_a_link_ends_whose_socket_refuses_and_gives_no_reason_of_the_system():
    class Gone:
        family = socket.AF_INET

        def setblocking(self, blocking):
            pass

        def setsockopt(self, *option):
            raise OSError("gone")

    link = Link(Gone(), FakeClock(100.0).now)
    assert link.closed
    assert link.reason == "gone"


def say(sock, link, *lines):
    """Send lines or messages to a link, and let it look."""
    sock.sendall(b"".join(line if isinstance(line, bytes) else encode(line) for line in lines))
    link.poll()


def know_the_clock(link, sock, clock, offset=AHEAD):
    """Answer the link's ping as a side would whose clock is ahead by `offset`."""
    link.poll()
    for line in sock.recv(65536).splitlines():
        if line and isinstance(decode(line), Ping):
            say(sock, link, Pong(decode(line).id, clock.t + offset, clock.t + offset))
    assert link.clock.offset == pytest.approx(offset, abs=1e-5)


# What arrives


def test_an_observation_arrives_dated_by_the_receivers_clock(wire):
    wire.laptop.send(wire.observation(age=0.04))
    wire.poll()
    seen = wire.brick.newest()
    assert list(seen) == ["A"]
    assert seen["A"].t == pytest.approx(wire.brick_clock.t - 0.04, abs=1e-5)
    assert seen["A"].markers == {"effector": (1.0, 2.0, 0.5)}
    assert wire.brick.newest() == {}


def test_a_receiver_that_sleeps_gets_the_newest_only(wire):
    for _ in range(30):
        wire.turn(1 / 60.0)
        wire.laptop.send(wire.observation())
    wire.poll()
    assert wire.brick.newest()["A"].seq == 30
    assert wire.brick.counters["skipped"] == 29
    assert wire.brick.newest() == {}


def test_every_camera_has_a_slot_of_its_own(wire):
    for camera in ("A", "B", "A", "C"):
        wire.laptop.send(wire.observation(camera=camera))
    wire.poll()
    assert {camera: seen.seq for camera, seen in wire.brick.newest().items()} == {
        "A": 3,
        "B": 2,
        "C": 4,
    }


def test_every_camera_is_soon_read_by_the_short_way(wire, monkeypatch):
    plain, ways = messages._plain_observation, []

    def watched(values, usual):
        seen = plain(values, usual)
        ways.append((values["camera"], seen is not None))
        return seen

    monkeypatch.setattr(messages, "_plain_observation", watched)
    for camera in ("A", "B") * 2:
        wire.laptop.send(wire.observation(camera=camera))
        wire.poll()
    assert ways == [("A", False), ("B", False), ("A", True), ("B", True)]


def test_observations_go_both_ways_and_so_do_orders(wire):
    wire.brick.send(Status(wire.brick_clock.t, (0.5,), 3.0, ""))
    wire.laptop.send(Start())
    wire.laptop.send(Stop("enough"))
    wire.poll()
    assert wire.laptop.receive() == Status(100.0, (0.5,), 3.0, "")
    assert isinstance(wire.brick.receive(), Start)
    assert isinstance(wire.brick.receive(), Stop)
    assert wire.brick.receive() is None


def test_tcp_sends_at_once(wire):
    for side in (wire.laptop, wire.brick):
        if wire.is_tcp:
            assert side._sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


# What is refused


@pytest.mark.parametrize("together", [True, False], ids=["in one piece", "one by one"])
def test_an_observation_out_of_sequence_is_dropped(wire, together):
    for seq in (5, 3, 4):
        wire.laptop.send(wire.observation(seq=seq))
        if not together:
            wire.poll()
    wire.poll()
    assert wire.brick.newest()["A"].seq == 5
    assert wire.brick.counters["skipped" if together else "out_of_sequence"] == 2


def test_an_observation_whose_time_goes_back_is_dropped(wire):
    wire.laptop.send(wire.observation(age=0.1))
    wire.poll()
    wire.laptop.send(wire.observation(age=0.2))
    wire.poll()
    assert wire.brick.newest()["A"].seq == 1
    assert wire.brick.counters["out_of_sequence"] == 1


def test_a_stale_observation_is_dropped(wire):
    wire.laptop.send(wire.observation(age=MAX_AGE + 0.01))
    wire.poll()
    assert wire.brick.newest() == {}
    assert wire.brick.counters["stale"] == 1


def test_an_observation_that_goes_stale_while_it_waits_is_not_handed_over(wire):
    wire.laptop.send(wire.observation())
    wire.poll()
    wire.turn(MAX_AGE + 0.01)
    assert wire.brick.newest() == {}
    assert wire.brick.counters["stale"] == 1


def test_an_observation_from_the_future_is_refused_and_spoils_nothing(wire):
    wire.laptop.send(wire.observation(age=-0.1, seq=1000))
    wire.poll()
    assert wire.brick.newest() == {}
    assert wire.brick.counters["future"] == 1
    wire.pass_time(0.2)
    wire.laptop.send(wire.observation())
    wire.poll()
    assert wire.brick.newest()["A"].seq == 2


def test_no_observation_is_handed_over_before_the_clocks_are_known(raw):
    link, other, clock = raw
    say(other, link, Observation(1, "A", AHEAD + clock.t, {}))
    assert link.newest() == {}
    assert link.counters["undated"] == 1
    know_the_clock(link, other, clock)
    say(other, link, Observation(2, "A", AHEAD + clock.t, {}))
    assert link.newest()["A"].t == pytest.approx(clock.t, abs=1e-5)


def test_no_observation_is_handed_over_while_the_clocks_are_known_badly(raw):
    link, other, clock = raw
    link.poll()
    clock.t += 0.3  # the pong is slow: the offset may be off by 150 ms
    say(other, link, Pong(1, AHEAD + clock.t, AHEAD + clock.t), Observation(1, "A", AHEAD, {}))
    assert link.clock.is_known
    assert link.newest() == {}
    assert link.counters["undated"] == 1


@pytest.mark.parametrize(
    "line",
    [
        b"garbage\n",
        b"\xff\n",
        b"\n",
        b'{"kind":"observation","camera":"A","seq":1,"t":NaN,"markers":{}}\n',
        b'{"kind":"observation","camera":"A","seq":1,"t":5100.0,"markers":{"goal":[1,2,"3"]}}\n',
        b'{"kind":"observation","camera":"A","seq":1,"t":1e999,"markers":{}}\n',
        b'{"kind":"observation","camera":"A"\n',
        b"[" * 2000 + b"\n",
        encode(Hello(VERSION, BRICK, "0" * 32)),
        encode(Welcome("0" * 64)),
        encode(Pong(77, 1.0, 1.0)),
    ],
    ids=lambda line: repr(line[:50]),
)
def test_a_bad_line_is_counted_and_the_next_one_is_heard(raw, line):
    link, other, clock = raw
    know_the_clock(link, other, clock)
    say(other, link, line)
    say(other, link, Observation(2, "A", AHEAD + clock.t, {}))
    assert link.counters["bad"] == 1
    assert link.newest()["A"].seq == 2
    assert not link.closed


def test_twenty_bad_lines_in_a_row_end_the_connection(raw):
    link, other, clock = raw
    say(other, link, *[b"x\n"] * (MAX_BAD_LINES - 1))
    say(other, link, Start(), *[b"x\n"] * (MAX_BAD_LINES - 1))
    assert not link.closed
    say(other, link, b"x\n", Start())
    assert link.reason == "20 bad lines in a row"
    assert isinstance(link.receive(), Start)  # from before
    assert link.receive() is None


def test_a_line_without_end_takes_no_memory_and_ends_the_connection(raw):
    link, other, clock = raw
    say(other.sock, link, b"x" * (MAX_LINE + TAG_LENGTH))
    assert not link.closed
    say(other.sock, link, b"x")
    assert link.buffer_sizes["unfinished bytes"] == link.buffer_sizes["lines"] == 0
    assert link.reason == FORGED


def test_a_line_that_grows_slowly_ends_by_silence(raw):
    link, other, clock = raw
    for _ in range(30):
        clock.t += 0.1
        if not link.closed:
            say(other.sock, link, b"x" * 60)
            assert link.buffer_sizes["lines"] == 0
    assert "nothing heard" in link.reason


def test_more_cameras_than_there_may_be_are_refused(raw):
    link, other, clock = raw
    know_the_clock(link, other, clock)
    for number in range(MAX_CAMERAS + 5):
        say(other, link, Observation(1, f"c{number}", AHEAD + clock.t, {}))
    assert sorted(link.newest()) == [f"c{number}" for number in range(MAX_CAMERAS)]
    assert link.buffer_sizes["cameras"] == MAX_CAMERAS
    assert link.counters["bad"] == 5


def test_orders_that_nobody_takes_are_bounded_and_the_last_ones_stay(raw):
    link, other, _ = raw
    for number in range(3 * MAX_QUEUE):
        say(other, link, Stop(str(number)))
    reasons = []
    message = link.receive()
    while message:
        reasons.append(int(message.reason))
        message = link.receive()
    assert reasons == list(range(2 * MAX_QUEUE, 3 * MAX_QUEUE))
    assert link.counters["dropped"] == 2 * MAX_QUEUE


def test_a_bad_message_of_our_own_is_not_sent(wire):
    with pytest.raises(BadMessage):
        wire.laptop.send(wire.observation(t=float("nan")))
    wire.poll()
    assert wire.brick.counters["bad"] == 0


# Ends


def test_a_half_open_connection_ends_after_two_seconds(wire):
    wire.pass_time(1.0)
    for _ in range(21):  # the laptop has lost its power: nothing comes, nothing is acknowledged
        wire.brick_clock.t += 0.1
        wire.brick.poll()
    assert wire.brick.reason == "nothing heard for 2.1 s"
    assert wire.brick.fileno() == -1


def test_two_that_are_idle_stay_linked(wire):
    wire.pass_time(10 * SILENCE_TIMEOUT, step=0.25)
    assert not wire.laptop.closed
    assert not wire.brick.closed


def test_a_program_that_did_not_look_for_long_reads_before_it_judges(wire):
    wire.turn(10 * SILENCE_TIMEOUT)
    wire.laptop.send(Start())
    wire.poll()
    assert not wire.brick.closed


def test_pings_are_fast_at_first_and_slow_later(raw):
    link, other, clock = raw
    counts = []
    for _ in range(2):
        count = 0
        for _ in range(1000):
            clock.t += 0.01
            say(other, link, Start())
            link.receive()
            assert link.buffer_sizes["pings"] <= MAX_SAMPLES  # nobody answers
            count += other.recv(65536).count(b"ping") if select.select([other], [], [], 0)[0] else 0
        counts.append(count)
    assert 28 <= counts[0] <= 32  # 20 in 5 s, 10 in 5 s
    assert 19 <= counts[1] <= 21


def test_a_bye_tells_why(wire):
    wire.laptop.close("the tracker has ended")
    wire.poll()
    assert wire.brick.reason == "the other side said: the tracker has ended"


def test_the_last_words_arrive_though_much_was_left_unread(wire):
    """Closing a socket with unread data makes TCP drop what was sent last."""
    for _ in range(10):
        wire.brick.send(Status(1.0, (), None, ""))
    wire.laptop.close("enough")
    wire.poll()
    assert wire.brick.reason == "the other side said: enough"


def test_a_connection_that_was_cut_says_so(raw):
    link, other, _ = raw
    other.sendall(encode(Start()))
    other.close()
    link.poll()
    assert link.reason == "the other side closed the connection"
    assert isinstance(link.receive(), Start)


def test_a_connection_that_was_reset_says_so():
    ours, theirs = tcp_pair()
    link = Link(ours, FakeClock(1.0).now, KEYS)
    theirs.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    theirs.close()
    select.select([ours], [], [], PATIENCE)
    link.poll()
    assert "reset" in link.reason.lower()


def test_a_closed_link_takes_calls_in_silence(wire):
    wire.brick.close()
    wire.brick.close()
    wire.brick.send(Start())
    wire.brick.poll(1.0)
    assert wire.brick.newest() == {}
    assert wire.brick.reason == "closed"


# Who sits between the two


class Between:
    """What the laptop says, on its way to the brick; it can read all of it, and change it."""

    def __init__(self):
        (laptop, one), (brick, other) = tcp_pair(), tcp_pair()
        self._ends = one, other
        self.laptop_clock, self.clock = FakeClock(AHEAD + 100.0), FakeClock(100.0)
        self.laptop = Link(laptop, self.laptop_clock.now, KEYS)
        self.brick = Link(brick, self.clock.now, KEYS[::-1])
        for _ in range(3):
            self.brick.poll()
            self.pass_back()
            self.pass_on(self.lines())
        assert self.brick.clock.is_known
        self.seq = 0

    def lines(self):
        """What the laptop has said since."""
        self.laptop.poll()
        lines = []
        while select.select([self._ends[0]], [], [], 0.02)[0]:
            data = self._ends[0].recv(65536)
            if not data:
                break
            lines += data.splitlines(keepends=True)
        return lines

    def pass_on(self, lines):
        self._ends[1].sendall(b"".join(lines))
        select.select([self.brick], [], [], 0.02 if not lines else PATIENCE)
        self.brick.poll()

    def pass_back(self):
        """What the brick has said, as it is."""
        while select.select([self._ends[1]], [], [], 0.02)[0]:
            data = self._ends[1].recv(65536)
            if not data:
                break
            self._ends[0].sendall(data)
        select.select([self.laptop], [], [], 0.02)
        self.laptop.poll()

    def observe(self, *cameras):
        for camera in cameras:
            self.seq += 1
            self.laptop.send(
                Observation(self.seq, camera, self.laptop_clock.t, {"goal": (1.0, 2.0, 0.5)})
            )

    def close(self):
        for end in (self.laptop, self.brick, *self._ends):
            end.close()


@pytest.fixture
def between():
    between = Between()
    yield between
    between.close()


def test_one_in_between_who_changes_nothing_is_not_noticed(between):
    between.observe("A", "B", "A")
    between.laptop.send(Stop("enough"))
    between.pass_on(between.lines())
    assert isinstance(between.brick.receive(), Stop)
    assert sorted(between.brick.newest()) == ["A", "B"]
    assert not between.brick.closed


@pytest.mark.parametrize(
    ("forge", "good"),
    [
        (lambda a, b, c: [a.replace(b"1.0", b"9.0"), b, c], 0),
        (lambda a, b, c: [a, b, c[:-2] + (b"0" if c[-2:-1] != b"0" else b"1") + b"\n"], 2),
        (lambda a, b, c: [a, b, c[: -1 - TAG_LENGTH] + b"\n"], 2),
        (lambda a, b, c: [a, b, encode(Stop("now"))], 2),
        (lambda a, b, c: [a, b, encode(Stop("now"))[:-1] + c[-1 - TAG_LENGTH :]], 2),
        (lambda a, b, c: [a, a, b, c], 1),
        (lambda a, b, c: [a, b, c, a], 3),
        (lambda a, b, c: [b, a, c], 0),
        (lambda a, b, c: [a, c], 1),
        (lambda a, b, c: [a, b"\n", b, c], 1),
        (lambda a, b, c: [a, b"x" * 5000 + b"\n", b, c], 3),
        (lambda a, b, c: [a, b[:-1] + c], 1),
        (lambda a, b, c: [a, b[:20] + b"\n" + b[20:], c], 1),
    ],
    ids=[
        "changed", "its signature changed", "unsigned", "put in unsigned", "put in, another's",
        "repeated at once", "repeated later", "reordered", "left out", "empty", "overlong",
        "joined", "parted",
    ],
)  # fmt: skip
def test_a_line_that_is_not_the_next_one_ends_the_connection_on_both_sides(between, forge, good):
    between.observe("A", "B", "C")
    lines = between.lines()
    assert len(lines) == 3
    between.pass_on(forge(*lines))
    assert sorted(between.brick.newest()) == ["A", "B", "C"][:good]  # what came before is good
    assert between.brick.receive() is None
    assert between.brick.reason == FORGED == "a message was changed or repeated on the way"
    between.pass_back()
    assert between.laptop.reason == "the other side said: " + FORGED


def test_what_one_said_oneself_is_no_answer(between):
    """Each direction has its own key: a line sent back is foreign, though its number fits."""
    between.brick.send(Stop("to the laptop"))
    between.brick.poll()
    lines = between._ends[1].recv(65536).splitlines(keepends=True)
    between.pass_on(lines)
    assert between.brick.receive() is None
    assert between.brick.reason == FORGED


def test_observations_that_were_replaced_unsent_leave_no_gap(wire):
    """Numbers are given as lines begin to go out."""
    fill(wire)
    for _ in range(10):
        wire.laptop.send(wire.observation())
    assert wire.laptop.counters["replaced"] >= 9
    for _ in range(2000):
        wire.poll()
        if not wire.laptop.blocked:
            break
    wire.poll()
    assert not wire.brick.closed
    assert wire.brick.newest()["A"].seq == wire.seq


def test_a_key_of_another_connection_signs_nothing_here(between):
    other = LineSigner(pairing.session_keys(b"key", "1" * 32, "2" * 32)[1])
    between.pass_on([other.sign(encode(Stop("now")))])
    assert between.brick.receive() is None
    assert between.brick.reason == FORGED


# A receiver that never reads


def fill(wire):
    """Send until the laptop's end takes no more; how many it took."""
    for number in range(100000):
        wire.laptop.send(wire.observation())
        if wire.laptop.blocked:
            # Is it full, or only slow? Nothing tells but time; a wrong guess makes more rounds.
            select.select([], [wire.laptop], [], 0.05 if wire.is_tcp else 0)
            wire.laptop.poll()
            if wire.laptop.blocked:
                return number
    raise AssertionError("it never fills")


def test_a_receiver_that_never_reads_costs_no_memory_and_is_cut_off(wire):
    for _ in range(100):
        fill(wire)
        before = wire.laptop.counters["replaced"]
        for _ in range(1000):
            wire.laptop.send(wire.observation())
            wire.laptop.send(wire.observation(camera="B"))
        if wire.laptop.counters["replaced"] - before >= 1998:
            break
    else:
        pytest.fail("it never fills")
    # One of each camera, and the rest of one that has begun to go out.
    assert wire.laptop.buffer_sizes["unsent bytes"] <= 3 * (
        len(encode(wire.observation())) + TAG_LENGTH
    )
    for _ in range(21):
        wire.laptop_clock.t += 0.1
        wire.laptop.poll()
    assert wire.laptop.closed


def test_one_that_talks_but_never_reads_is_cut_off_too(wire):
    fill(wire)
    for _ in range(25):
        wire.turn(0.1)
        if not wire.laptop.closed:
            wire.brick_says(Status(1.0, (), None, ""))
            select.select([wire.laptop], [], [], PATIENCE)
            wire.laptop.poll()
    assert wire.laptop.reason == "the other side takes no data"


def test_pings_of_one_that_does_not_read_are_not_answered(wire):
    """Late, an answer is worth nothing, and many would fill the queue for orders."""
    fill(wire)
    unsent = wire.laptop.buffer_sizes["unsent bytes"]
    for number in range(3 * MAX_QUEUE):
        wire.brick_says(Ping(1000 + number))
    select.select([wire.laptop], [], [], PATIENCE)
    wire.laptop.poll()
    assert wire.laptop.buffer_sizes["unsent bytes"] == unsent
    assert not wire.laptop.closed


def test_waiting_while_the_other_side_takes_nothing_is_not_spinning(wire):
    fill(wire)
    wire.laptop_clock.t += 1.0  # a ping is due, and cannot go out
    waits = []
    wire.laptop._wait = waits.append
    wire.laptop.poll(0.7)
    assert waits == [0.7]


def test_orders_that_cannot_be_sent_end_the_connection(wire):
    fill(wire)
    for _ in range(MAX_QUEUE + 1):
        wire.laptop.send(Stop("now"))
    assert wire.laptop.reason == "the other side takes no data"


def test_what_was_half_sent_is_finished_and_then_the_newest_goes_out(wire):
    fill(wire)
    for _ in range(50):
        wire.laptop.send(wire.observation())
    wire.laptop.send(Stop("now"))
    for _ in range(2000):
        wire.poll()
        order = wire.brick.receive()
        if order:
            break
    wire.poll()
    assert isinstance(order, Stop)
    assert wire.brick.counters["bad"] == 0
    assert wire.brick.newest()["A"].seq == wire.seq


# Clocks


def test_the_offset_is_that_of_the_quickest_answer():
    clock = PeerClock()
    assert clock.add(0.0, AHEAD + 0.020, AHEAD + 0.021, 0.041)  # symmetric, slow
    assert clock.add(1.0, AHEAD + 1.001, AHEAD + 1.002, 1.003)  # symmetric, quick
    assert clock.add(2.0, AHEAD + 2.060, AHEAD + 2.061, 2.062)  # one way took long
    assert clock.offset == pytest.approx(AHEAD, abs=1e-6)
    assert clock.round_trip == pytest.approx(0.002)
    assert clock.uncertainty(1.003) == pytest.approx(0.001)
    assert clock.uncertainty(11.003) == pytest.approx(0.001 + 10 * MAX_DRIFT)
    assert clock.jumps == 0


def test_a_quick_answer_is_forgotten_when_the_window_has_passed():
    clock = PeerClock()
    clock.add(0.0, AHEAD, AHEAD, 0.001)
    for number in range(1, MAX_SAMPLES + 1):
        clock.add(number, AHEAD + number, AHEAD + number, number + 0.010)
    assert clock.round_trip == pytest.approx(0.010)
    assert clock.jumps == 0


def test_clocks_that_drift_are_followed():
    clock = PeerClock()
    rate = 1 + 50e-6
    for number in range(2000):
        t = number * 0.5
        clock.add(t, AHEAD + (t + 0.001) * rate, AHEAD + (t + 0.001) * rate, t + 0.002)
    assert clock.jumps == 0
    assert clock.offset == pytest.approx(AHEAD + t * rate - t, abs=0.0005)


@pytest.mark.parametrize("jump", [-30.0, -0.05, 0.05, 30.0])
def test_a_jump_is_noticed_by_the_next_answer(jump):
    clock = PeerClock()
    for t in (1.0, 2.0, 3.0):
        clock.add(t, AHEAD + t, AHEAD + t, t + 0.002)
    clock.add(4.0, AHEAD + 4 + jump, AHEAD + 4 + jump, 4.020)
    assert clock.jumps == 1
    assert clock.offset == pytest.approx(AHEAD + jump, abs=0.011)


@pytest.mark.parametrize(
    "times", [(1.0, 5.0, 4.9, 1.1), (1.0, 5.0, 5.2, 1.1), (1.0, 5.0, 5.0, 0.9)]
)
def test_impossible_times_teach_nothing(times):
    clock = PeerClock()
    assert not clock.add(*times)
    assert not clock.is_known


@pytest.mark.parametrize("jump", [-60.0, -0.3, -0.02, 0.3, 1.5])
def test_after_the_senders_clock_has_jumped_nothing_is_dated_wrong(wire, jump):
    """Forwards it is the future that tells, backwards that time went back from frame to frame."""
    wrong = []
    after = 0
    for number in range(60):
        wire.turn(1 / 60.0)
        if number == 33:  # when no ping is due anyway
            wire.laptop_clock.t += jump
        wire.laptop.send(wire.observation())
        wire.poll()
        for seen in wire.brick.newest().values():
            after += number > 45
            if abs(seen.t - wire.brick_clock.t) > 0.002:
                wrong.append(seen)
    assert wrong == []
    assert wire.brick.clock.jumps == 1
    assert after > 10


def test_a_clock_that_leaps_ahead_ends_the_link_rather_than_dating_wrong(wire):
    """As when a laptop has slept: its clock stood, and the brick's comes from ahead."""
    wire.laptop_clock.t += 60.0
    wire.laptop.send(wire.observation())
    wire.poll()
    assert wire.laptop.reason == "nothing heard for 60.0 s"
    assert wire.brick.newest() == {}
    assert wire.brick.closed


def test_a_clock_that_leaps_back_does_not_put_off_what_is_due(wire):
    wire.brick_clock.t -= 60.0
    wire.brick.poll()
    for _ in range(22):
        wire.brick_clock.t += 0.1
        wire.brick.poll()
    assert wire.brick.reason.startswith("nothing heard for 2.")


def test_an_answer_from_before_a_jump_does_not_clear_the_clock(raw):
    link, other, clock = raw
    know_the_clock(link, other, clock)
    clock.t += 0.3
    say(other, link, Observation(1, "A", AHEAD + clock.t, {}))
    before = Pong(2, AHEAD + clock.t, AHEAD + clock.t)
    jumped = AHEAD - 0.02
    clock.t += 0.01
    say(other, link, Observation(2, "A", jumped + clock.t, {}))  # time went back: in doubt
    say(other, link, before, Observation(3, "A", jumped + clock.t + 0.015, {}))
    assert link.clock.jumps == 0
    assert link.counters["undated"] == 1
    clock.t += 0.2
    link.poll()
    say(other, link, Pong(3, jumped + clock.t, jumped + clock.t))
    say(other, link, Observation(4, "A", jumped + clock.t, {}))
    assert link.newest()["A"].t == pytest.approx(clock.t, abs=1e-4)


def test_an_observation_that_waits_when_a_jump_is_noticed_is_not_handed_over(raw):
    link, other, clock = raw
    know_the_clock(link, other, clock)
    clock.t += 0.3
    jumped = AHEAD - 0.3
    say(other, link, Observation(1, "A", jumped + clock.t, {}))
    say(other, link, Pong(2, jumped + clock.t, jumped + clock.t))
    assert link.clock.jumps == 1
    assert link.newest() == {}


def test_after_the_receivers_clock_has_jumped_it_finds_back(wire):
    wire.pass_time(3.0)
    wire.brick_clock.t += 0.6
    wire.pass_time(1.0)
    wire.laptop.send(wire.observation(age=0.04))
    wire.poll()
    seen = wire.brick.newest()["A"]
    assert seen.t == pytest.approx(wire.brick_clock.t - 0.04, abs=1e-4)
    assert wire.brick.clock.jumps == 1


# Strangers


def test_a_stranger_is_heard_one_message_at_a_time():
    sock, other = socket.socketpair()
    clock = FakeClock(100.0)
    link = Link(sock, clock.now)
    signed = SignedSocket(other)
    first = encode(Challenge("0" * 32, "a" * 32)), encode(Welcome("1" * 64))
    say(other, link, *first, signed.sign(encode(Ping(1))), signed.sign(encode(Start())))
    assert isinstance(link.receive(), Challenge)
    assert isinstance(link.receive(), Welcome)
    link.activate(*KEYS)
    assert isinstance(link.receive(), Start)
    link.poll()
    assert [type(decode(line)) for line in signed.recv(65536).splitlines()] == [Pong, Ping]
    link.close()
    other.close()


def test_what_a_stranger_said_in_advance_must_be_signed_too():
    sock, other = socket.socketpair()
    link = Link(sock, FakeClock(100.0).now)
    say(other, link, Welcome("1" * 64), Start())
    assert isinstance(link.receive(), Welcome)
    link.activate(*KEYS)
    assert link.receive() is None
    assert link.reason == FORGED
    link.close()
    other.close()


def test_what_was_said_before_the_trust_goes_out_without_a_signature():
    """The other side cannot check it yet; here it waits, as the other side takes nothing."""
    sock, other = tcp_pair()
    link = Link(sock, FakeClock(100.0).now)
    sent = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            sent += sock.send(b"x" * 4096)
    link.send(Welcome("1" * 64))
    link.activate(*KEYS)
    link.send(Stop("enough"))
    assert link.blocked
    received = b""
    other.settimeout(PATIENCE)
    while not received.endswith(b"\n") or received.count(b"\n") < 2:
        received += other.recv(65536)
        link.poll()
    first, second = received[sent:].splitlines()[:2]
    assert first + b"\n" == encode(Welcome("1" * 64))
    assert second.startswith(encode(Stop("enough"))[:-1])
    assert len(second) == len(encode(Stop("enough"))) - 1 + TAG_LENGTH
    link.close()
    other.close()


@pytest.mark.parametrize(
    "line",
    [b"GET / HTTP/1.1\r\n", encode(Observation(1, "A", 1.0, {})), encode(Ping(1)), encode(Start())],
    ids=repr,
)
def test_a_stranger_that_says_anything_but_the_handshake_is_cut_off(line):
    sock, other = socket.socketpair()
    link = Link(sock, FakeClock(1.0).now)
    say(other, link, line, Start())
    assert link.receive() is None
    link.poll()
    assert link.reason == "it does not speak our language"
    assert link.newest() == {}
    assert other.recv(100) == b""  # and not a word was said
    other.close()


def test_a_stranger_that_floods_is_not_read_ahead():
    sock, other = socket.socketpair()
    link = Link(sock, FakeClock(1.0).now)
    other.setblocking(False)
    sent = 0
    for _ in range(2000):
        try:
            sent += other.send(encode(Refused("busy", "", 0.0)) * 10)
        except BlockingIOError:
            break
        link.poll()
    assert link.buffer_sizes["line bytes"] + link.buffer_sizes["unfinished bytes"] <= 2 * MAX_LINE
    assert link.buffer_sizes["messages"] == 1
    link.close()
    other.close()


def test_the_last_word_of_one_that_hangs_up_is_heard():
    sock, other = socket.socketpair()
    link = Link(sock, FakeClock(1.0).now)
    other.sendall(encode(Refused("busy", "the tracker serves another", 0.0)))
    other.close()
    link.poll()
    assert link.receive().cause == "busy"
    link.poll()
    assert link.reason == "the other side closed the connection"


def test_bye_is_not_said_to_a_stranger():
    sock, other = socket.socketpair()
    Link(sock, FakeClock(1.0).now).close("secret")
    assert other.recv(100) == b""
    other.close()


# Waiting


def test_the_answer_to_a_ping_is_waited_for():
    """Found at the next look, 0.5 s later, it would put the clocks 0.25 s apart."""
    one, other = tcp_pair()
    brick = Link(one, time.monotonic, KEYS, patience=5.0)
    laptop = Link(other, time.monotonic, KEYS[::-1])
    done = threading.Event()

    def serve():
        while not done.is_set():
            select.select([other], [], [], 0.01)
            laptop.poll()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        brick.poll()
        assert brick.clock.is_known
        assert abs(brick.clock.offset) <= brick.clock.round_trip
    finally:
        done.set()
        thread.join()
        brick.close()
        laptop.close()


def test_an_answer_is_waited_for_longer_while_nothing_can_be_dated():
    sock, other = socket.socketpair()
    clock = FakeClock(100.0)
    waits = []

    def wait(reading, writing, broken, seconds):
        waits.append(seconds)
        clock.t += seconds

    other = SignedSocket(other)
    link = Link(sock, clock.now, KEYS, patience=0.005, select=wait)
    link.poll()
    assert waits[:1] == pytest.approx([0.05])
    waits.clear()
    say(other, link, Pong(1, AHEAD + 100.0, AHEAD + clock.t))
    assert link.clock.offset == pytest.approx(AHEAD)
    clock.t += 0.3
    link.poll()
    assert waits[:1] == pytest.approx([0.005])
    link.close()
    other.close()


def test_poll_returns_as_soon_as_something_comes_in():
    one, other = socket.socketpair()
    link = Link(one, FakeClock(1.0).now, KEYS)
    link.poll()  # the first ping
    SignedSocket(other).sendall(encode(Start()))
    begin = time.monotonic()
    link.poll(2 * PATIENCE)
    assert isinstance(link.receive(), Start)
    assert time.monotonic() - begin < PATIENCE
    link.close()
    other.close()


SCRIPT = """
import socket, time
from shared.link import Link
from shared.messages import Observation

one, other = socket.socketpair()
keys = b"one", b"two"
laptop = Link(one, lambda: time.monotonic() + 77, keys)
brick = Link(other, time.monotonic, keys[::-1], patience=0.005)
for n in range(200):
    laptop.send(Observation(n, "A", time.monotonic() + 77 - 0.03, {"goal": None}))
    laptop.poll()
    brick.poll(0.05)
    seen = brick.newest()
    time.sleep(0.02)
print("seen %d, %.4f s old" % (seen["A"].seq, time.monotonic() - 0.02 - seen["A"].t))
silent = time.monotonic()
while not brick.closed:
    brick.poll(0.5)
print("%s; %.1f s" % (brick.reason[:13], time.monotonic() - silent))
laptop.close()
"""


def test_on_the_emulated_brick_it_waits_in_the_bricks_time(tmp_path, capsys):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    outcome = one_run("planar", script).outcome
    assert (outcome.status, outcome.reason) == (0, "ended")
    out, err = capsys.readouterr()
    assert err == ""
    first, second = out.splitlines()
    assert first.startswith("seen 199, 0.0"), first
    assert second.startswith("nothing heard; 2."), second
    assert outcome.t > 4


def test_the_numbers_of_the_module_fit_together():
    assert 2 * SLOW_PING < SILENCE_TIMEOUT
    assert link_module.READ_SIZE > MAX_LINE
