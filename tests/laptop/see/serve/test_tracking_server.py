"""The laptop's end of the link: who is let in, who is not, and that nobody keeps it from its work.

Real TCP on loopback, the real client of the brick, and a clock that the tests turn.
"""

import collections
import contextlib
import os
import socket
import stat
import threading
import time

import pytest
import waiting
from clocks import FakeClock
from odd_files import ODD
from offered_jobs import job_file
from waiting import PATIENCE

from laptop.see.serve import server as tracking_server
from laptop.see.serve.guess_limiter import (
    FORGIVE_TIME,
    MAX_DELAY,
    MAX_SENDERS,
    GuessLimiter,
    sender_of,
)
from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.listening import CannotListen, own_addresses
from laptop.see.serve.pairing_file import BadPairing, Pairing, read_pairing
from laptop.see.serve.server import MAX_CALLERS, TrackingServer
from robot import tracking_client
from robot.jobs.fetching import JobFetching
from robot.tracking import MAX_PAUSE
from robot.tracking_client import Memory, TrackingClient
from shared import pairing
from shared.arm_description import ArmError
from shared.job_messages import JobStatus
from shared.link import SILENCE_TIMEOUT
from shared.messages import (
    BRICK,
    LAPTOP,
    PORT,
    VERSION,
    BadMessage,
    Challenge,
    Hello,
    Observation,
    Proof,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
    decode,
    encode,
)
from shared.signing import LineSigner

CODE = "ABCDEFGHJKMN"
SALT = "5a" * 16
KEY = pairing.key_of(CODE, SALT)
WRONG = pairing.key_of("NMKJHGFEDCBA", SALT)
AHEAD = 5000.0


class BrickClock(FakeClock):
    """The brick's clock, and by `laptop` the laptop's; only the tests turn it."""

    def laptop(self):
        return self.t + AHEAD

    def sleep(self, seconds):
        pass


class Caller:
    """A bare connection that says what it is told to."""

    def __init__(self, server):
        self.sock = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE)
        self.lines = self.sock.makefile("rb")
        self.sign, self.theirs = bytes, None

    def say(self, *lines):
        lines = (line if isinstance(line, bytes) else encode(line) for line in lines)
        self.sock.sendall(b"".join(map(self.sign, lines)))

    def hear(self):
        """The next message, or None where the connection has ended."""
        try:
            line = self.lines.readline()
        except ConnectionError:
            return None
        if line and self.theirs:
            ((line, _),) = self.theirs.checked(collections.deque([(line[:-1], None)]))
        return decode(line) if line else None

    def prove(self, key=KEY):
        """Go through the handshake; what is answered."""
        nonce = pairing.new_nonce()
        self.say(Hello(VERSION, BRICK, nonce))
        challenge = self.hear()
        if not isinstance(challenge, Challenge):
            return challenge
        nonces = nonce, challenge.nonce
        self.say(Proof(pairing.proof(key, BRICK, *nonces)))
        answer = self.hear()
        if isinstance(answer, Welcome):
            assert pairing.is_proof(answer.proof, key, LAPTOP, *nonces)
            own, theirs = pairing.session_keys(key, *nonces)
            self.sign, self.theirs = LineSigner(own).sign, LineSigner(theirs)
        return answer

    def close(self):
        self.lines.close()
        self.sock.close()


@pytest.fixture
def clock():
    return BrickClock()


@pytest.fixture
def server(clock):
    with TrackingServer("127.0.0.1", 0, CODE, clock.laptop, salt=SALT) as server:
        yield server
        assert server._thread.is_alive() or server._ending


@pytest.fixture
def call(server):
    callers = []

    def make():
        callers.append(Caller(server))
        return callers[-1]

    yield make
    for caller in callers:
        caller.close()


@pytest.fixture
def brick(server, clock, tmp_path):
    clients = []

    def make(code=CODE, port=None):
        memory = Memory(str(tmp_path / "brick"))
        client = TrackingClient(
            "127.0.0.1", port or server.port, code, clock, memory, say=lambda line: None
        )
        clients.append(client)
        return client

    yield make
    for client in clients:
        client.close()


def until(condition, *clients):
    """Wait for what the other thread does; the clients look meanwhile."""

    def look():
        for client in clients:
            client.poll()
        time.sleep(0.001)

    waiting.until(condition, "what the other thread does", look)


def linked(client):
    until(lambda: client.linked and client.round_trip is not None, client)
    return client


def observe(server, clock, seq, age=0.04):
    markers = {"effector": (320.5, 240.25, 0.98), "goal": None}
    server.publish(Observation(seq, "A", clock.laptop() - age, markers))


def received(client):
    seen = {}

    def look():
        seen.update(client.poll())
        return seen

    until(look)
    return seen


# Serving


def test_a_brick_with_the_code_is_served(server, brick, clock):
    observe(server, clock, 1)  # nobody there: nothing happens
    assert server.state().client is None
    client = linked(brick())
    observe(server, clock, 2)
    seen = received(client)["A"]
    assert seen.seq == 2
    assert seen.t == pytest.approx(clock.now() - 0.04, abs=0.001)
    assert server.send(Stop("enough"))
    until(client.commands, client)


def test_without_a_thread_the_sockets_run_only_in_its_turns(clock, tmp_path):
    threads = threading.active_count()
    with TrackingServer("127.0.0.1", 0, CODE, clock.laptop, threaded=False) as server:
        assert threading.active_count() == threads
        assert not server.has_work()
        client = TrackingClient(
            "127.0.0.1", server.port, CODE, clock, Memory(str(tmp_path)), say=lambda line: None
        )
        for _ in range(5):
            client.poll(0.01)
        assert not client.linked
        assert server.has_work(5.0)
        for _ in range(5):
            server.serve_once()
            client.poll(0.01)
        assert client.linked
        observe(server, clock, 1)  # at once, whoever's turn it is
        assert received(client)["A"].seq == 1
        assert server.state().client == "127.0.0.1"
    assert server._listener.fileno() == -1
    until(lambda: not client.linked, client)
    client.close()


def test_the_state_tells_who_is_there_and_how_it_is_doing(server, brick, clock):
    client = linked(brick())
    state = server.state()
    assert state.client == "127.0.0.1"
    assert state.since == clock.laptop()
    assert state.status is None
    client.report((0.5, 1.0), 5.0, "limit", "the elbow", {"A.u": 3.0, "A.v": -4.0}, 17.5, 6, 2)
    until(lambda: server.state().status, client)
    clock.t += 0.5
    state = server.state()
    reported = (0.5, 1.0), 5.0, "limit", "the elbow", {"A.u": 3.0, "A.v": -4.0}, 17.5, 6, 2
    assert state.status[1:] == (*reported, None)  # nobody told of a battery
    assert state.status_age == pytest.approx(0.5, abs=0.01)
    until(lambda: server.state().round_trip is not None, client)
    assert state.counters["bad"] == 0
    client.close("the client has ended")
    until(lambda: server.state().client is None)
    assert server.state().lost == "127.0.0.1: the other side said: the client has ended"
    assert server.state().status is None
    assert not server.send(Start())


def test_newest_wins_where_the_brick_sleeps(server, brick, clock):
    client = linked(brick())
    for number in range(1, 31):
        clock.t += 1 / 60
        observe(server, clock, number)
    until(lambda: not server._served.link.blocked)
    assert [seen["A"].seq for seen in [received(client)]] == [30]
    assert client.counters["skipped"] == 29
    assert client.poll() == {}


def test_a_brick_that_never_reads_costs_no_memory_and_is_cut_off(server, call, clock):
    caller = call()
    assert isinstance(caller.prove(), Welcome)
    until(lambda: server.state().client)
    link = server._served.link
    numbers = iter(range(10**9))

    def is_cut_off():
        clock.t += 0.02
        for _ in range(50):
            observe(server, clock, next(numbers))
        waiting = link.buffer_sizes["unsent bytes"]
        assert waiting < 4096
        if server.state().client is not None:
            caller.say(Status(1.0, (), None, ""))  # it talks on
        return server.state().client is None

    until(is_cut_off)
    assert link.counters["replaced"] > 1000
    assert "takes no data" in server.state().lost


def test_a_bad_observation_is_the_trackers_own_fault(server, brick):
    linked(brick())
    with pytest.raises(BadMessage, match="t is nan"):
        server.publish(Observation(1, "A", float("nan"), {}))


def test_closing_says_bye(server, brick):
    client = linked(brick())
    server.close()
    server.close()
    until(lambda: not client.linked, client)
    assert "the tracker has ended" in client.why


# Restarts


def test_a_restart_of_the_brick_is_survived(server, brick, clock):
    first = linked(brick())
    observe(server, clock, 1)
    received(first)
    first._link.abort()  # killed
    second = linked(brick())
    observe(server, clock, 2)
    assert received(second)["A"].seq == 2


def test_a_restart_of_the_tracker_is_survived(server, brick, clock):
    client = linked(brick())
    observe(server, clock, 100)
    received(client)
    server.close()
    until(lambda: not client.linked, client)
    with TrackingServer("127.0.0.1", server.port, CODE, clock.laptop, salt=SALT) as again:
        clock.t += 5.0
        linked(client)
        observe(again, clock, 1)
        assert received(client)["A"].seq == 1
        client.close()


def test_a_brick_that_lost_its_power_is_replaced_after_two_seconds(server, call, brick, clock):
    """Its end of the connection is still there for all the laptop knows."""
    ghost = call()
    assert isinstance(ghost.prove(), Welcome)
    client = brick()
    until(lambda: "another program is connected" in client.why, client)

    def is_linked():
        clock.t += 0.1 if client._link is None and client._connecting is None else 0.0
        return client.linked

    until(is_linked, client)
    assert "nothing heard" in server.state().lost


# Who is not served


def test_a_second_brick_is_refused_and_told_who_is_served(server, brick, call, clock):
    client = linked(brick())
    answer = call().prove()
    assert isinstance(answer, Refused)
    assert answer.cause == "busy"
    assert answer.reason == "another program is connected, from 127.0.0.1; end that one first"
    assert server.state().refusal == "127.0.0.1: " + answer.reason
    observe(server, clock, 1)
    assert received(client)["A"].seq == 1


def test_all_that_is_ordered_goes_to_the_one_that_is_served(server, brick):
    first, second = linked(brick()), brick()
    until(lambda: "another program is connected" in second.why, second)
    assert server.send(Start(budget=7.0))
    assert server.send(Stop("enough"))
    ordered = []

    def all_came():
        ordered.extend(first.commands())
        return len(ordered) == 2

    until(all_came, first)
    assert ordered == [Start(budget=7.0), Stop("enough")]
    second.poll(0.05)
    assert second.commands() == []


def fetch(fetching, client, clock, parts):
    """Ask for parts of a job and take them until so many are there."""

    def look():
        want = fetching.due(clock.now(), client.linked)
        if want:
            client.send(want)
        for part in client.of_job():
            fetching.handle(part, clock.now())
        return fetching.part >= parts

    until(look, client)


def test_a_job_is_offered_and_the_brick_has_what_it_asks_for(server, brick, clock, tmp_path):
    offer = JobOffer(job_file(tmp_path))
    assert not server.offer(offer)
    client = linked(brick())
    assert server.offer(offer)
    commands = []
    until(lambda: commands.extend(client.commands()) or commands, client)
    (draw,) = commands
    fetching = JobFetching(draw, str(tmp_path / "brick" / "linked.job"), clock.now())
    fetch(fetching, client, clock, 2)
    client.send(JobStatus(clock.now(), 7, "a", "fetching", 0, 0, 0.0, 0.0, None, False, ""))
    until(lambda: server.state().progress is not None, client)
    client.close()
    until(lambda: server.state().client is None)
    client.poll()
    clock.t += MAX_PAUSE
    linked(client)
    assert server.state().progress is None
    fetch(fetching, client, clock, draw.parts)
    assert fetching.complete
    assert (tmp_path / "brick" / "linked.job").read_bytes() == (tmp_path / "a.job").read_bytes()


def test_progress_is_known_with_its_age(server, brick, clock):
    client = linked(brick())
    until(lambda: server.state().round_trip is not None, client)
    reported = JobStatus(clock.now() - 0.5, 7, "rose", "drawing", 1, 9, 2.0, 30.0, 60.0, True, "")
    assert client.send(reported)
    until(lambda: server.state().progress is not None, client)
    state = server.state()
    assert state.progress == reported
    assert state.progress_age == pytest.approx(0.5, abs=0.1), "clocks are 5000 s apart"


def test_one_that_has_not_proven_itself_is_not_told_who_is_served(server, brick, call):
    linked(brick())
    answer = call().prove(WRONG)
    assert answer.cause == "code"


def test_an_old_version_is_told_both_versions_and_what_to_update(server, call):
    caller = call()
    caller.say(b'{"kind":"hello","version":0}\n')
    answer = caller.hear()
    assert answer.cause == "version"
    assert (
        f"version 0, the laptop's {VERSION}; copy robot/ and shared/ to the brick" in answer.reason
    )
    assert caller.hear() is None
    assert answer.reason in server.state().refusal


def test_a_new_version_is_told_to_update_the_laptop(server, call):
    caller = call()
    caller.say(Hello(VERSION + 1, BRICK, "0" * 32))
    assert "bring the laptop's checkout up to date" in caller.hear().reason


def test_a_wrong_code_costs_its_sender_a_growing_delay(server, call, clock):
    for delay in (1, 2, 4, 8, 16, 32, 60, 60):
        answer = call().prove(WRONG)
        assert (answer.cause, answer.wait) == ("code", delay)
        clock.t += delay - 0.5
        answer = call().prove(WRONG)
        assert (answer.cause, answer.wait) == ("wait", 0.5)
        assert answer.reason == "a wrong code came from this address; wait 1 s"
        clock.t += 0.6
    assert answer.reason in server.state().refusal
    caller = call()
    assert isinstance(caller.prove(), Welcome)
    assert server.state().refusal == ""
    caller.close()
    until(lambda: server.state().client is None)
    assert call().prove(WRONG).wait == 1  # forgiven


def test_the_right_code_never_waits_for_who_guesses_wrongly_at_its_address(server, call, clock):
    """As behind one router, or beside a forgotten program that tries an old code for ever."""
    for _ in range(8):
        while call().prove(WRONG).cause == "wait":
            clock.t += 5.0
    caller = call()
    assert isinstance(caller.prove(), Welcome)
    assert call().prove(WRONG).cause == "code"  # while it is served
    caller.close()
    until(lambda: server.state().client is None)
    assert call().prove(WRONG).cause == "wait"
    assert isinstance(call().prove(), Welcome)


def test_a_wrong_code_costs_nobody_else(server, brick, call, clock):
    client = linked(brick())
    for _ in range(3):
        call().prove(WRONG)
    observe(server, clock, 1)
    assert received(client)["A"].seq == 1
    offenders = GuessLimiter()
    offenders.add("192.168.0.9", 0.0)
    assert offenders.wait("192.168.0.9", 0.5) == 0.5
    assert offenders.wait("192.168.0.5", 0.5) == 0.0


def test_guessing_on_many_connections_at_once_is_one_guess(server, call):
    callers = [call() for _ in range(8)]
    nonces = []
    for caller in callers:
        nonces.append(pairing.new_nonce())
        caller.say(Hello(VERSION, BRICK, nonces[-1]))
    challenges = [caller.hear() for caller in callers]
    answers = []
    for caller, nonce, challenge in zip(callers, nonces, challenges, strict=True):
        caller.say(Proof(pairing.proof(WRONG, BRICK, nonce, challenge.nonce)))
        answers.append(caller.hear().cause)
    assert answers == ["code"] + ["wait"] * 7


def test_offenders_are_forgiven_after_a_long_quiet_and_never_too_many():
    offenders = GuessLimiter()
    assert [offenders.add("a", t) for t in (0.0, 1.0, 2.0)] == [1, 2, 4]
    assert offenders.add("a", 2.0 + FORGIVE_TIME + 1) == 1
    for number in range(100):
        assert offenders.add("b", number) <= MAX_DELAY
    for number in range(10 * MAX_SENDERS):
        offenders.add(str(number), 100.0)
    assert len(offenders._known) <= MAX_SENDERS


def test_an_ipv6_machine_is_one_sender_whatever_its_address():
    assert sender_of("fe80::1:2:3%eth0") == sender_of("fe80::9") != sender_of("fe81::9")
    assert sender_of("192.168.0.5") != sender_of("192.168.0.6")


def test_an_overheard_proof_is_worth_nothing(server, call):
    first, second = call(), call()
    first.say(Hello(VERSION, BRICK, "0" * 32))
    proof = Proof(pairing.proof(KEY, BRICK, "0" * 32, first.hear().nonce))
    second.say(Hello(VERSION, BRICK, "0" * 32))
    second.hear()
    second.say(proof)
    assert second.hear().cause == "code"


@pytest.mark.parametrize(
    "lines",
    [
        [b"GET / HTTP/1.1\r\n", b"Host: localhost\r\n"],
        [b"\x16\x03\x01\x02\x00\x01\xff\n"],
        [b"[" * 2000 + b"\n"],
        [b"x" * 100000],
        [Start()],
        [Observation(1, "A", 1.0, {})],
        [Hello(VERSION, LAPTOP, "0" * 32)],
        [Proof("0" * 64)],
        [Hello(VERSION, BRICK, "0" * 32), Hello(VERSION, BRICK, "0" * 32)],
        [Hello(VERSION, BRICK, "0" * 32), Welcome("0" * 64)],
        [Challenge("0" * 32, SALT)],
    ],
    ids=lambda lines: repr(lines[-1])[:30],
)
def test_a_caller_that_does_not_keep_to_the_handshake_is_sent_away(server, call, brick, lines):
    caller = call()
    caller.say(*lines)
    answer = caller.hear()
    if answer is not None:  # a hello is answered
        assert isinstance(answer, Challenge)
        assert caller.hear() is None
    linked(brick())


def test_callers_that_say_nothing_block_nobody_and_are_sent_away(server, call, brick, clock):
    silent = [call() for _ in range(3 * MAX_CALLERS)]
    client = linked(brick())
    assert len(server._callers) <= MAX_CALLERS
    clock.t += SILENCE_TIMEOUT + 0.1
    client.poll()
    until(lambda: not server._callers, client)
    assert all(caller.hear() is None for caller in silent)


def test_a_caller_that_speaks_slowly_is_sent_away(server, call, clock):
    """One letter at a time, it is never silent."""
    caller = call()
    until(lambda: server._callers)
    for letter in encode(Hello(VERSION, BRICK, "0" * 32))[:40]:
        clock.t += 0.1
        with contextlib.suppress(ConnectionError):  # it has been sent away already
            caller.say(bytes([letter]))
    assert caller.hear() is None


def test_a_port_scan_leaves_nothing_behind(server, call, brick):
    for _ in range(50):
        caller = call()
        caller.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        caller.close()
    linked(brick())
    until(lambda: not server._callers)
    assert len(server._selector.get_map()) == 3  # the bell, the listener, the brick


def test_the_one_that_has_to_go_is_of_the_sender_that_has_the_most(server, call):
    callers = [call() for _ in range(MAX_CALLERS)]
    until(lambda: len(server._callers) == MAX_CALLERS)
    with server._lock:
        for caller in server._callers[:3]:
            caller.sender = "192.168.0.5"  # the oldest, but few
    extra = call()
    assert callers[3].hear() is None
    for caller in [*callers[:3], *callers[4:], extra]:
        caller.say(Hello(VERSION, BRICK, "0" * 32))
        assert isinstance(caller.hear(), Challenge)


def test_what_had_to_wait_goes_out_as_soon_as_the_brick_reads(server, call, clock, monkeypatch):
    monkeypatch.setattr(
        tracking_server, "SERVICE_PERIOD", 60.0
    )  # so that nothing else wakes the thread
    caller = call()
    assert isinstance(caller.prove(), Welcome)
    until(lambda: server.state().client)
    link = server._served.link
    number = 0
    while link.counters["replaced"] < 100:
        number += 1
        observe(server, clock, number)
    while True:
        message = caller.hear()
        if isinstance(message, Observation) and message.seq == number:
            break


def test_no_room_for_one_more_connection_is_survived(server, call, brick, clock, monkeypatch):
    """accept() fails at once and again until some file is closed: that must not spin."""
    tries = []

    class Full:
        def accept(self):
            tries.append(1)
            raise OSError(tracking_server.errno.EMFILE, "Too many open files")

    listener = server._listener
    with server._lock:
        server._listener = listener_like = Full()
        listener_like.fileno = listener.fileno
    caller = call()
    until(lambda: tries)
    time.sleep(0.25)
    assert len(tries) == 1
    with server._lock:
        server._listener = listener
    clock.t += 1.1
    assert isinstance(caller.prove(), Welcome)


# What it costs


def test_publishing_takes_no_longer_while_the_thread_is_busy(server, brick, clock):
    """The lock is never held while waiting: not while the thread waits for sockets either."""
    linked(brick())
    done = threading.Event()

    def publish():
        for number in range(1000):
            observe(server, clock, number)
        done.set()

    thread = threading.Thread(target=publish)
    thread.start()
    thread.join(PATIENCE)
    assert done.is_set()


# The pairing code, the address, the command


def test_the_code_is_made_once_and_for_this_user_only(tmp_path):
    folder = tmp_path / "state"
    made = read_pairing(folder)
    assert pairing.read_code(made.code) == made.code
    assert read_pairing(folder) == made
    assert [file.name for file in folder.iterdir()] == ["pairing"]
    assert stat.S_IMODE((folder / "pairing").stat().st_mode) == 0o600
    assert made.salt != read_pairing(tmp_path / "other").salt


def test_the_code_is_kept_in_the_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    assert read_pairing().code == pairing.read_code(
        (tmp_path / "pairing").read_text().split("\n")[0]
    )
    monkeypatch.delenv("BRICKSERVO_STATE")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    read_pairing()
    assert (tmp_path / "home" / ".brickservo" / "pairing").is_file()


def test_a_code_that_others_may_read_is_closed_to_them(tmp_path):
    (tmp_path / "pairing").write_text(f"ABCD-EFGH-JKMN\n{SALT}\n")
    (tmp_path / "pairing").chmod(0o644)
    assert read_pairing(tmp_path) == Pairing(CODE, SALT)
    assert stat.S_IMODE((tmp_path / "pairing").stat().st_mode) == 0o600


def test_a_code_of_an_earlier_version_is_replaced_and_it_is_said(tmp_path):
    (tmp_path / "pairing").write_text("KS82-DNHF\n")
    said = []
    made = read_pairing(tmp_path, said.append)
    assert len(made.code) == 12
    assert len(said) == 1
    assert "earlier version, too short, and is replaced" in said[0]
    assert read_pairing(tmp_path, said.append) == made
    assert len(said) == 1


@pytest.mark.parametrize(
    "text",
    ["", "ABCD", "\u00c4BCD-EFGH-JKMN", "\x00" * 9, "ABCD-EFGH-JKMN\n", "ABCD-EFGH-JKMN\nsalt\n"],
)
def test_a_file_that_holds_no_code_is_named(tmp_path, text):
    (tmp_path / "pairing").write_text(text, encoding="latin-1")
    with pytest.raises(BadPairing, match=r"holds no pairing code.*; remove it") as error:
        read_pairing(tmp_path)
    assert isinstance(error.value, ArmError)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", sorted(ODD))
def test_whatever_has_become_of_the_file_is_said_at_once(tmp_path, kind):
    ODD[kind][0](str(tmp_path / "pairing"))
    with pytest.raises(BadPairing, match=r"pairing holds no pairing code.*; remove it") as error:
        read_pairing(tmp_path)
    assert "\n" not in str(error.value)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadPairing, match=r"cannot use .*pairing: .*; set BRICKSERVO_STATE"):
        read_pairing(tmp_path / "file")


def test_a_full_disk_leaves_no_half_a_code(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(BadPairing, match="No space left"):
        read_pairing(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_command_to_type(clock):
    with TrackingServer("", 0, CODE) as server:
        commands = server.commands()
        here = "brickservo brick run visual_servoing.py"
        assert commands[0] == f"{here} :{server.port}"
        assert commands[1:] == [
            f"robot/visual_servoing.py {address}:{server.port}" for address in own_addresses()
        ]
        for command in commands:  # and the brick understands it
            *_, place = command.split()
            assert tracking_client.read_place(place)[1] == server.port
            assert "ABCD" not in command  # who may see the processes sees no code


def test_the_command_has_no_port_where_it_is_the_usual(monkeypatch):
    with TrackingServer("127.0.0.1", 0, CODE) as server:
        server.port = PORT
        assert server.commands() == [
            "brickservo brick run visual_servoing.py",
            "robot/visual_servoing.py 127.0.0.1",
        ]


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_the_command_names_no_address_that_means_all_of_them(host):
    try:
        server = TrackingServer(host, 0, CODE)
    except CannotListen:
        pytest.skip("no IPv6 here")
    with server:
        addresses = [command.split()[1] for command in server.commands()[1:]]
        assert addresses == [f"{address}:{server.port}" for address in own_addresses()]


def test_all_addresses_means_ipv6_too_where_there_is_any():
    with TrackingServer("", 0, CODE) as server:
        socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE).close()
        if socket.has_dualstack_ipv6():
            socket.create_connection(("::1", server.port), timeout=PATIENCE).close()


def test_a_port_in_use_is_told_with_the_next_step(server):
    with pytest.raises(CannotListen) as error:
        TrackingServer("127.0.0.1", server.port, CODE)
    assert f"port {server.port} is in use" in str(error.value)
    assert f"--listen-port {server.port + 1}" in str(error.value)


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [
        ("no such host.invalid", 0, "there is no host 'no such host.invalid'"),
        ("x" * 300, 0, "there is no host"),
        ("192.0.2.77", 0, "this machine has not the address 192.0.2.77"),
        ("127.0.0.1", 65536, "65536 is no port"),
        ("", -1, "-1 is no port"),
    ],
)
def test_where_it_cannot_listen_it_says_why(host, port, words):
    with pytest.raises(CannotListen) as error:
        TrackingServer(host, port, CODE)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_own_addresses_can_be_listened_at():
    for address in own_addresses():
        with TrackingServer(address, 0, CODE):
            pass
