"""The brick's end of the link, against a tracker that the tests play, over loopback TCP."""

import errno
import json
import os
import re
import select
import signal
import socket
import stat
import subprocess
import sys

import pytest
from clocks import FakeClock
from refusals import refused
from waiting import PATIENCE

from robot import program, tracking, tracking_client, tracking_commands
from robot.clock import Clock
from robot.tracker_address import NotPaired, SaltedKey
from robot.tracking import CONNECT_TIMEOUT, MAX_PAUSE
from robot.tracking_client import (
    Memory,
    ServerAddress,
    TrackingClient,
    find_tracker,
    main,
    read_place,
)
from shared import pairing
from shared.arm_description import ArmError
from shared.link import SILENCE_TIMEOUT, Link
from shared.message_fields import MAX_TEXT
from shared.messages import (
    BRICK,
    LAPTOP,
    PORT,
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
    encode,
)

CODE = "ABCDEFGHJKMN"
SALT = "5a" * 16
KEY = pairing.key_of(CODE, SALT)
SALTED = SaltedKey(SALT, KEY)
WRONG = pairing.key_of("NMKJHGFEDCBA", SALT)
AHEAD = 5000.0
SCRIPT = tracking_client.__file__
ROUNDS = 2000
"""Of at most some 5 ms each, until something that must happen has happened."""


class FakeTracker:
    """Listens on loopback, and does step by step what it is told to."""

    def __init__(self, clock, port=0, key=KEY, answer=None):
        self.clock = clock
        self.key = key
        self.answer = answer  # sent in place of a challenge
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind(("127.0.0.1", port))
        self.listener.listen(5)
        self.listener.setblocking(False)
        self.port = self.listener.getsockname()[1]
        self.link = None
        self.calls = 0
        self.nonces = []
        self.heard = []

    def now(self):
        return self.clock.t + AHEAD

    def step(self):
        if self.link is None:
            try:
                sock, _ = self.listener.accept()
            except BlockingIOError:
                return
            self.calls += 1
            self.link = Link(sock, self.now)
            self.nonces = []
        self.link.poll()
        message = self.link.receive()
        while message is not None:
            if isinstance(message, Hello):
                self.nonces = [message.nonce, pairing.new_nonce()]
                self.link.send(
                    Challenge(self.nonces[1], SALT) if self.answer is None else self.answer
                )
            elif isinstance(message, Proof):
                assert pairing.is_proof(message.proof, KEY, BRICK, *self.nonces)
                self.link.send(Welcome(pairing.proof(self.key, LAPTOP, *self.nonces)))
                brick_key, laptop_key = pairing.session_keys(self.key, *self.nonces)
                self.link.activate(laptop_key, brick_key)
            else:
                self.heard.append(message)
            message = self.link.receive()
        if self.link.closed:
            self.link = None

    def vanish(self):
        """Close without a word."""
        self.link.abort()
        self.link = None

    def close(self):
        if self.link is not None:
            self.link.close("the tracker has ended")
        self.listener.close()


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    """Whose clock stands, and who is answered by the same thread, had better not wait."""
    monkeypatch.setattr(tracking, "PING_TIMEOUT", 0.0)


@pytest.fixture
def clock():
    return FakeClock()


@pytest.fixture
def memory(tmp_path):
    return Memory(str(tmp_path / "state"))


@pytest.fixture
def output():
    return []


@pytest.fixture
def make(clock, memory, output):
    """Makes trackers and clients, and closes them in the end."""
    made = []

    def make_one(kind, *args, **options):
        if kind is TrackingClient:
            options = dict({"memory": memory, "say": output.append}, **options)
            one = TrackingClient("127.0.0.1", args[0], CODE, clock, **options)
        else:
            one = FakeTracker(clock, *args, **options)
        made.append(one)
        return one

    yield make_one
    for one in made:
        one.close()


def until(condition, client, tracker=None):
    """Let both go on until something is so; the last observations."""
    for _ in range(ROUNDS):
        seen = client.poll(0.002)
        if tracker is not None:
            tracker.step()
        if condition():
            return seen
    raise AssertionError("never: " + client.why)


def linked(make, **options):
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port, **options)
    until(lambda: client.linked and client.round_trip is not None, client, tracker)
    return client, tracker


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


# The library


def test_it_pairs_and_hands_over_observations_in_the_bricks_time(make, clock):
    client, tracker = linked(make)
    assert client.why == ""
    assert client.lost_since is None
    assert client.age("A") == float("inf")
    tracker.link.send(Observation(1, "A", tracker.now() - 0.04, {"goal": (1.0, 2.0, 0.9)}))
    seen = {}
    for _ in range(ROUNDS):
        seen = client.poll(0.002)
        if seen:
            break
    assert seen["A"].t == pytest.approx(clock.t - 0.04, abs=0.01)
    assert client.age("A") == pytest.approx(0.04, abs=0.01)
    clock.t += 0.5
    assert client.age("A") == pytest.approx(0.54, abs=0.01)
    assert client.poll() == {}


def test_reports_go_out_five_times_a_second_and_a_verdict_at_once(make, clock):
    client, tracker = linked(make)
    client.report((0.5, -0.5), None)
    client.report((0.6, -0.5), 7.0)  # too soon
    clock.t += 0.21
    client.report((0.7, -0.5), 6.0)
    client.report((0.8, -0.5), 0.5, "converged")
    until(lambda: len(tracker.heard) == 3, client, tracker)
    assert [(status.q[0], status.verdict) for status in tracker.heard] == [
        (0.5, ""),
        (0.7, ""),
        (0.8, "converged"),
    ]
    assert isinstance(tracker.heard[0], Status)


def test_the_same_verdict_on_another_run_goes_out_at_once(make):
    client, tracker = linked(make)
    client.report((), None, "refused", run=1)
    client.report((), None, "refused", run=1)
    client.report((), None, "refused", run=2)
    until(lambda: len(tracker.heard) == 2, client, tracker)
    assert [status.run for status in tracker.heard] == [1, 2]


def test_a_reason_is_cut_to_one_line_and_the_rest_is_told_as_it_is(make):
    client, tracker = linked(make, battery=lambda: 7.4)
    client.report((0.5,), 5.0, "limit", "a\n" * 200, {"A.u": -3.0}, 12.5, moves=7, run=3)
    until(lambda: tracker.heard, client, tracker)
    ((_, *reported),) = tracker.heard
    reason = reported.pop(3)
    assert reported == [(0.5,), 5.0, "limit", {"A.u": -3.0}, 12.5, 7, 3, 7.4]
    assert reason.startswith("a a a")
    assert len(reason) == MAX_TEXT


@pytest.mark.parametrize(
    ("q", "error"),
    [
        ((0.5, -0.5), float("nan")),
        ((0.5, -0.5), float("inf")),
        ((float("nan"), -0.5), 7.0),
        ((0.5, float("-inf")), 7.0),
        ((0.5, 1e9), 7.0),
        ((0.5, -0.5), 1e9),
    ],
)
def test_a_report_of_what_is_no_number_still_tells_the_verdict(make, q, error):
    client, tracker = linked(make)
    client.report(q, error, "singular", "why", {"A.u": 3.0}, 9.0, moves=4, run=2)
    until(lambda: tracker.heard, client, tracker)
    ((_, *reported),) = tracker.heard
    assert reported == [(), None, "singular", "why", {}, None, 4, 2, None]


def test_it_waits_only_as_it_is_told_to(make, clock):
    waits = []

    def wait(rlist, wlist, xlist, timeout):
        waits.append(timeout)
        return select.select(rlist, wlist, xlist, timeout)

    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port, select=wait)
    until(lambda: client.linked and client.round_trip is not None, client, tracker)
    del waits[:]
    client.poll(0.003)
    assert waits == [0.003]


def test_orders_come_in_and_a_lost_link_takes_them_back(make):
    """A start that was given before the cable came off must not move the arm later."""
    client, tracker = linked(make)
    tracker.link.send(Start())
    tracker.link.send(Stop("enough"))
    until(lambda: len(client._commands) == 2, client)
    assert [type(order) for order in client.commands()] == [Start, Stop]
    assert client.commands() == []
    tracker.link.send(Start())
    until(lambda: client._commands, client)
    tracker.vanish()
    until(lambda: not client.linked, client)
    assert client.commands() == []


def test_orders_that_nobody_takes_are_bounded(make):
    client, tracker = linked(make)
    for number in range(100):
        tracker.link.send(Stop(str(number)))
        client.poll()
    until(lambda: client._commands[-1].reason == "99", client)
    assert len(client._commands) == tracking.MAX_COMMANDS


def test_a_lost_link_is_told_and_dated(make, clock, output):
    client, tracker = linked(make)
    tracker.vanish()
    until(lambda: not client.linked, client)
    assert client.lost_since == pytest.approx(clock.t, abs=0.1)
    assert "closed the connection" in client.why
    assert output[-1] == "not linked: " + client.why


def test_a_tracker_that_falls_silent_is_lost_after_two_seconds(make, clock):
    client, _ = linked(make)
    begin = clock.t
    while client.linked:
        clock.t += 0.1
        client.poll()
    assert 2.0 < client.lost_since - begin < 2.3
    assert "nothing heard" in client.why


def test_a_restart_of_the_tracker_is_survived(make, clock, output):
    client, tracker = linked(make)
    tracker.link.send(Observation(1000, "A", tracker.now(), {}))
    until(lambda: client.age("A") < 1, client)
    tracker.close()
    until(lambda: not client.linked, client)
    until(lambda: "refused" in client.why, client)
    clock.t += 1.0
    again = make(FakeTracker, tracker.port)
    until(lambda: client.linked and client.round_trip is not None, client, again)
    again.link.send(Observation(1, "A", again.now(), {"goal": None}))  # it counts from the start
    for _ in range(ROUNDS):
        seen = client.poll(0.002)
        if seen:
            break
    assert seen["A"].seq == 1
    assert [line.split(":")[0] for line in output] == [
        "pairing with 127.0.0.1",
        "linked to 127.0.0.1",
        "not linked",
        "not linked",
        "linked to 127.0.0.1",
    ]


def test_an_address_of_a_kind_that_the_system_has_not_is_passed_over(make, monkeypatch):
    """A name may stand for an IPv6 address where the kernel has no IPv6."""
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    real, unknown = socket.socket, 12345

    def make_socket(family=socket.AF_INET, *args, **options):
        if family == unknown:
            raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")
        return real(family, *args, **options)

    monkeypatch.setattr(tracking.socket, "socket", make_socket)
    client._addresses.insert(0, (unknown, ("::1", tracker.port, 0, 0)))
    client.poll()
    assert "not supported" in client.why
    until(lambda: client.linked, client, tracker)


def test_no_observation_is_older_than_the_one_before_it_though_the_offset_was_corrected(
    make, monkeypatch
):
    client, tracker = linked(make)
    times = [10.0, 10.05, 10.02, 10.06, 3.0]  # the last after a jump of the brick's clock
    waiting = [{"A": Observation(k, "A", t, {})} for k, t in enumerate(times)]
    monkeypatch.setattr(Link, "newest", lambda link: waiting.pop(0) if waiting else {})
    got = [seen.t for _ in times for seen in client.poll().values()]
    assert got == [10.0, 10.05, 10.06, 3.0]


def test_nothing_listening_is_said_once_and_tried_ever_more_slowly(make, clock, output):
    client = make(TrackingClient, free_port())
    tries = []
    original = client._connect
    client._connect = lambda: (tries.append(clock.t), original())
    while clock.t < 115.0:
        client.poll(0.1)
    assert len(output) == 1
    assert "refused" in output[0]
    assert output[0].endswith("brickservo track, or check the port that it prints")
    pauses = [late - early for early, late in zip(tries, tries[1:])]
    assert pauses[:3] == pytest.approx([0.25, 0.5, 1.0], abs=0.15)
    assert all(pause <= MAX_PAUSE + 0.15 for pause in pauses)
    assert not client.refused


def test_after_a_success_it_tries_quickly_again(make, clock):
    tracker = make(FakeTracker)
    port = tracker.port
    tracker.close()
    client = make(TrackingClient, port)
    while clock.t < 110.0:
        client.poll(0.1)
    tracker = make(FakeTracker, port)
    until(lambda: client.linked, client, tracker)
    tracker.vanish()
    until(lambda: not client.linked, client)
    begin = clock.t
    until(lambda: client.linked, client, tracker)
    assert clock.t - begin < 0.5


def test_a_machine_that_does_not_answer_costs_no_waiting(make, clock, output):
    """A full queue of connections that nobody accepts does not answer the next one."""
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    listener.listen(0)
    port = listener.getsockname()[1]
    crowd = []
    for _ in range(5):
        crowd.append(socket.socket())
        crowd[-1].setblocking(False)
        crowd[-1].connect_ex(("127.0.0.1", port))
    try:
        client = make(TrackingClient, port)
        client.poll()
        assert client._connecting is not None
        clock.t += CONNECT_TIMEOUT + 0.1
        client.poll()
        assert client.why.startswith(f"no answer from 127.0.0.1:{port}")
    finally:
        for sock in crowd + [listener]:
            sock.close()


def test_a_wrong_code_ends_the_trying(make, clock):
    tracker = make(FakeTracker, answer=Refused("code", "this is not the pairing code", 1.0))
    client = make(TrackingClient, tracker.port)
    until(lambda: client.refused, client, tracker)
    assert "this is not the pairing code" in client.why
    for _ in range(50):
        clock.t += 10.0
        client.poll(0.1)
        tracker.step()
    assert tracker.calls == 1


def test_another_version_ends_the_trying(make):
    tracker = make(FakeTracker, answer=Refused("version", "version 1 against 2", 0.0))
    client = make(TrackingClient, tracker.port)
    until(lambda: client.refused, client, tracker)
    assert "version 1 against 2" in client.why


def test_a_busy_tracker_is_tried_again(make, output):
    tracker = make(FakeTracker, answer=Refused("busy", "the tracker serves 192.168.0.9", 0.0))
    client = make(TrackingClient, tracker.port)
    until(lambda: tracker.calls == 3, client, tracker)
    assert not client.refused
    assert len(output) == 1
    tracker.answer = None
    until(lambda: client.linked, client, tracker)


def test_a_wait_is_waited_for(make, clock):
    tracker = make(FakeTracker, answer=Refused("wait", "wait 30 s", 30.0))
    client = make(TrackingClient, tracker.port)
    begin = clock.t
    until(lambda: tracker.calls == 1 and "wait 30 s" in client.why, client, tracker)
    while tracker.calls == 1:
        client.poll(0.1)
        tracker.step()
    assert 30.0 <= clock.t - begin < 31.0


def test_a_tracker_that_does_not_know_the_code_is_refused(make, clock, memory):
    tracker = make(FakeTracker, key=WRONG)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.refused, client, tracker)
    assert "not your tracker" in client.why
    assert not client.linked
    assert memory.load() is None


@pytest.mark.parametrize(
    "answer",
    [
        Welcome("0" * 64),  # before any proof was asked for
        Observation(1, "A", 1.0, {}),
        Bye("go away"),
        Hello(1, LAPTOP, "0" * 32),
        Start(),
    ],
    ids=lambda message: type(message).__name__,
)
def test_one_that_does_not_keep_to_the_handshake_is_not_believed(make, answer):
    tracker = make(FakeTracker, answer=answer)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.why != "not connected yet", client, tracker)
    assert not client.linked
    assert not client.refused
    assert client.commands() == []
    if isinstance(answer, (Observation, Start)):  # as any other server's greeting
        assert client.why.endswith(
            "something else than the tracker answers there; check address and port"
        )


def test_one_that_listens_but_says_nothing_is_left_after_a_while(make, clock):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(5)
        client = make(TrackingClient, listener.getsockname()[1])
        until(lambda: client._link is not None, client)
        begin = clock.t
        while client._link is not None:
            clock.t += 0.1
            client.poll()
        assert clock.t - begin < SILENCE_TIMEOUT + 0.3
        assert "nothing heard" in client.why


def test_observations_from_before_the_proof_are_not_handed_over(make):
    """Neither lost nor believed: a stranger's words after the welcome wait for the proof."""
    tracker = make(FakeTracker, key=WRONG)
    client = make(TrackingClient, tracker.port)
    seen = []
    for _ in range(50):
        seen += client.poll(0.002).values()
        tracker.step()
        if tracker.link is not None and tracker.link.proven:
            tracker.link.send(Observation(1, "A", tracker.now(), {}))
    assert client.refused
    assert seen == []


def test_host_and_code_are_remembered_once_they_have_proven_right(make, memory):
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    assert memory.load() is None
    until(lambda: client.linked, client, tracker)
    assert memory.load() == ServerAddress("127.0.0.1", tracker.port, CODE)
    assert stat.S_IMODE(os.stat(memory.file).st_mode) == 0o600
    assert os.listdir(os.path.dirname(memory.file)) == ["tracker"]


def test_the_key_is_worked_out_once_per_pairing_and_kept(make, memory, monkeypatch, output):
    worked_out = []

    def key_of(code, salt):
        worked_out.append((code, salt))
        return KEY

    monkeypatch.setattr(pairing, "key_of", key_of)
    tracker = make(FakeTracker)
    first = make(TrackingClient, tracker.port)
    until(lambda: first.linked, first, tracker)
    assert worked_out == [(CODE, SALT)]
    assert output[0].startswith("pairing with 127.0.0.1:")
    first.close()
    tracker.vanish()
    second = make(TrackingClient, tracker.port)  # as another program on the brick, later
    until(lambda: second.linked, second, tracker)
    assert len(worked_out) == 1
    assert memory.load_key(CODE) == SALTED
    assert memory.load_key("NMKJHGFEDCBA") is None


def test_a_laptop_that_is_kept_waiting_by_the_key_is_not_needed_meanwhile(make, clock, monkeypatch):
    """On the brick that takes longer than a laptop waits for a stranger to go on."""
    calls = []

    def key_of(code, salt):
        calls.append(tracker.calls)
        tracker.step()
        assert tracker.link is None  # it has been told that this call is over
        clock.t += 2 * SILENCE_TIMEOUT
        return KEY

    monkeypatch.setattr(pairing, "key_of", key_of)
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.linked, client, tracker)
    assert calls == [1]
    assert tracker.calls == 2


@pytest.mark.parametrize("paired", [True, False], ids=["paired before", "new"])
def test_a_salt_that_changes_later_is_worth_no_waiting_arm(make, memory, monkeypatch, paired):
    """Who sends other salts again and again would keep the arm from being stopped."""
    if paired:
        memory.save(ServerAddress("127.0.0.1", 1, CODE), SALTED)
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.linked, client, tracker)
    monkeypatch.setattr(pairing, "key_of", None)
    tracker.answer = Challenge("1" * 32, "b" * 32)
    tracker.vanish()
    until(lambda: client.refused, client, tracker)
    assert client.why.endswith("has another pairing code now; type the command that it prints")


@pytest.mark.parametrize(
    "change",
    [
        lambda stored: stored.pop("key"),
        lambda stored: stored.update(key=7),
        lambda stored: stored.update(key="ab"),
        lambda stored: stored.update(salt="x" * 32),
        lambda stored: stored.update(salt=None),
    ],
)
def test_a_key_that_cannot_be_is_worked_out_again(make, memory, change):
    memory.save(ServerAddress("127.0.0.1", 1, CODE), SALTED)
    with open(memory.file) as file:
        stored = json.load(file)
    change(stored)
    with open(memory.file, "w") as file:
        json.dump(stored, file)
    assert memory.load_key(CODE) is None
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.linked, client, tracker)
    assert memory.load_key(CODE) == SALTED


def test_a_remembered_code_of_an_earlier_version_is_told_and_a_new_one_replaces_it(memory):
    os.makedirs(os.path.dirname(memory.file))
    with open(memory.file, "w") as file:
        file.write('{"host": "192.168.0.5", "port": 7711, "code": "KS82DNHF"}')
    with pytest.raises(NotPaired) as error:
        find_tracker("", None, {}, memory)
    assert "12 characters" in str(error.value)
    found = find_tracker("192.168.0.5", "abcd-efgh-jkmn", {}, memory)
    assert found == ServerAddress("192.168.0.5", PORT, CODE)
    memory.save(found, SALTED)
    assert memory.load() == found


def test_an_old_tracker_says_what_to_update(make):
    """Its own words, of version 2; the brick shows them and tries no more."""
    reason = (
        "the brick's program speaks version 3, the laptop's 2; "
        "bring the laptop's checkout up to date"
    )
    tracker = make(FakeTracker, answer=Refused("version", reason, 0.0))
    client = make(TrackingClient, tracker.port)
    until(lambda: client.refused, client, tracker)
    assert client.why.endswith(reason)


def test_a_line_that_was_changed_on_the_way_is_told_on_both_sides(make, clock):
    client, tracker = linked(make)
    link = tracker.link
    link._sock.send(encode(Stop("now")))  # unsigned
    until(lambda: not client.linked, client)
    assert client.commands() == []
    assert "changed or repeated" in client.why
    until(lambda: link.closed, client, tracker)
    assert "changed or repeated" in link.reason
    clock.t += 1.0
    until(lambda: client.linked, client, tracker)


def test_a_full_disk_costs_the_memory_but_not_the_link(make, output, tmp_path):
    (tmp_path / "file").write_text("")
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port, memory=Memory(str(tmp_path / "file")))
    until(lambda: client.linked, client, tracker)
    assert "cannot be written" in output[-1]
    assert "\n" not in output[-1]


def test_a_name_that_nobody_has_is_refused_at_once(clock, memory):
    with pytest.raises(NotPaired) as error:
        TrackingClient("no such host.invalid", 7711, CODE, clock, memory)
    assert "'no such host.invalid'" in str(error.value)


def test_closing_says_bye_and_looking_again_connects_again(make, clock):
    client, tracker = linked(make)
    link = tracker.link
    client.close("the client has ended")
    select.select([link], [], [], 5.0)
    tracker.step()
    assert link.reason.endswith("the client has ended")
    assert not client.linked
    clock.t += 5.0
    until(lambda: client.linked, client, tracker)


# Where to, and with which code


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", (None, None)),
        ("192.168.0.5", ("192.168.0.5", None)),
        ("192.168.0.5:7800", ("192.168.0.5", 7800)),
        ("laptop.local:7800", ("laptop.local", 7800)),
        (":7800", (None, 7800)),
        ("fe80::1%usb0", ("fe80::1%usb0", None)),
        ("[fe80::1%usb0]:7800", ("fe80::1%usb0", 7800)),
        ("[::1]", ("::1", None)),
    ],
)
def test_a_place_is_read(text, place):
    assert read_place(text) == place


@pytest.mark.parametrize(
    "text",
    [
        "a:",
        "a:0",
        "a:65536",
        "a:7e3",
        "a:\u00b2",
        "[::1",
        "[]:5",
        "[::1]5",
        "[::1]:",
        "a\x1b",
        "a b",
    ],
)
def test_a_place_that_is_none_is_refused_in_one_line(text):
    with pytest.raises(NotPaired) as error:
        read_place(text)
    assert isinstance(error.value, ArmError)
    assert str(error.value).isprintable()


def test_the_default_is_where_ssh_came_from(memory):
    ssh = {"SSH_CLIENT": "192.168.0.5 50000 22"}
    assert find_tracker("", "abcd-efgh-jkmn", ssh, memory) == ServerAddress(
        "192.168.0.5", PORT, CODE
    )
    ssh = {"SSH_CONNECTION": "fe80::1%usb0 50000 fe80::2%usb0 22"}
    assert find_tracker(":7800", "abcd-efgh-jkmn", ssh, memory) == ServerAddress(
        "fe80::1%usb0", 7800, CODE
    )
    assert find_tracker("10.0.0.1", "abcd-efgh-jkmn", ssh, memory).host == "10.0.0.1"


def test_what_is_not_said_is_remembered(memory):
    memory.save(ServerAddress("192.168.0.5", 7800, CODE), SALTED)
    assert find_tracker("", None, {}, memory) == ServerAddress("192.168.0.5", 7800, CODE)
    ssh = {"SSH_CLIENT": "192.168.0.5 50000 22"}
    assert find_tracker("", None, ssh, memory) == ServerAddress("192.168.0.5", 7800, CODE)
    # The same laptop may have another address today; its code is the same, its port the usual.
    ssh = {"SSH_CLIENT": "192.168.0.6 50000 22"}
    assert find_tracker("", None, ssh, memory) == ServerAddress("192.168.0.6", PORT, CODE)
    assert find_tracker("", "JKMN-PQRS-TUVW", {}, memory).code == "JKMNPQRSTUVW"
    reported = {"BRICKSERVO_CODE": "JKMN-PQRS-TUVW"}
    assert find_tracker("", None, reported, memory).code == "JKMNPQRSTUVW"
    assert find_tracker("", "abcd-efgh-jkmn", reported, memory).code == CODE
    assert find_tracker("", None, {"BRICKSERVO_CODE": ""}, memory).code == CODE


def test_a_host_may_be_called_like_a_code(memory):
    assert find_tracker("mark-desk", "abcd-efgh-jkmn", {}, memory).host == "mark-desk"
    memory.save(ServerAddress("mark-desk", PORT, CODE), SALTED)
    assert find_tracker("mark-desk", None, {}, memory).host == "mark-desk"
    with pytest.raises(NotPaired, match="leave it out"):
        find_tracker("mark-deck-desk", None, {}, memory)


def test_what_is_missing_is_asked_for(memory):
    with pytest.raises(NotPaired, match="where is the tracker"):
        find_tracker("", "abcd-efgh-jkmn", {}, memory)
    with pytest.raises(NotPaired, match="type this in a terminal"):
        find_tracker("192.168.0.5", None, {}, memory)
    asked = []
    found = find_tracker(
        "a", None, {}, memory, lambda prompt: asked.append(prompt) or "abcd-efghjkmn"
    )
    assert (found.code, asked) == (CODE, ["pairing code, as the tracker on the laptop prints it: "])
    with pytest.raises(pairing.BadCode):
        find_tracker("192.168.0.5", None, {}, memory, lambda prompt: "")
    with pytest.raises(pairing.BadCode):
        find_tracker("192.168.0.5", "abc", {}, memory)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "[]",
        "[" * 5000,
        "{}",
        '{"host": null, "port": 7711, "code": "ABCDEFGHJKMN"}',
        '{"host": "", "port": 7711, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": 0, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": 1e999, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": 7711, "code": "1"}',
        '{"host": "a", "port": 7711, "code": 7}',
        '{"host": "a", "port": true, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": 77.5, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": 1' + 400 * "0" + ', "code": "ABCDEFGHJKMN"}',
        '{"host": ["a"], "port": 7711, "code": "ABCDEFGHJKMN"}',
        '{"host": "a", "port": NaN, "code": "ABCDEFGHJKMN"}',
        "\udcff",
    ],
    ids=ascii,
)
def test_a_spoilt_memory_is_told_where_it_is_needed(memory, text):
    os.makedirs(os.path.dirname(memory.file))
    with open(memory.file, "wb") as file:
        file.write(text.encode("utf-8", "surrogateescape"))
    ssh = {"SSH_CLIENT": "192.168.0.6 50000 22"}
    for place, code, environ in (("", None, {}), ("here", None, {}), ("", None, ssh)):
        with pytest.raises(NotPaired) as error:
            find_tracker(place, code, environ, memory)
        assert refused(error, memory.file, "HOST: then the code")
    assert find_tracker("here", CODE, {}, memory).host == "here"
    assert find_tracker("", CODE, ssh, memory).host == "192.168.0.6"


def test_a_spoilt_memory_is_written_anew(make, memory):
    os.makedirs(os.path.dirname(memory.file))
    os.mkfifo(memory.file)
    tracker = make(FakeTracker)
    client = make(TrackingClient, tracker.port)
    until(lambda: client.linked, client, tracker)
    assert memory.load() == ServerAddress("127.0.0.1", tracker.port, CODE)


def test_an_old_draft_that_others_may_read_is_not_written_into(memory):
    os.makedirs(os.path.dirname(memory.file))
    with open(memory.file + ".new", "w") as file:
        os.chmod(memory.file + ".new", 0o644)
        memory.save(ServerAddress("a", 1, CODE), SALTED)
        assert file.tell() == 0
    assert stat.S_IMODE(os.stat(memory.file).st_mode) == 0o600


# The command line


def start(tmp_path, *args):
    environment = dict(os.environ, BRICKSERVO_STATE=str(tmp_path / "state"))
    environment.pop("SSH_CLIENT", None)
    environment.pop("SSH_CONNECTION", None)
    return subprocess.Popen(
        [sys.executable, SCRIPT] + list(args),
        env=environment,
        cwd=str(tmp_path),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        universal_newlines=True,
    )


class RealClock:
    """The tracker's: the command is in another process, and has a clock that runs."""

    @property
    def t(self):
        return Clock().now()


def serve(process, tracker, lines):
    """Publish at every step, until the command has printed so many lines; these lines."""
    printed = []
    seq = 0
    while len(printed) < lines and process.poll() is None:
        tracker.step()
        if tracker.link is not None and tracker.link.proven:
            seq += 1
            markers = {"effector": (320.5, 240.25, 0.98), "goal": None}
            tracker.link.send(Observation(seq, "A", tracker.now() - 0.04, markers))
        if select.select([process.stdout], [], [], 0.01)[0]:
            printed.append(process.stdout.readline())
    return printed


def test_the_command_shows_what_the_camera_sees_until_it_is_stopped(tmp_path):
    tracker = FakeTracker(RealClock())
    place = f"127.0.0.1:{tracker.port}"
    process = start(tmp_path, place, "--code", "abcd-efgh-jkmn")
    printed = serve(process, tracker, 5)
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=PATIENCE)
    tracker.step()
    tracker.close()
    assert printed.pop(0) == f"pairing with {place}: a moment, this once\n"
    assert printed[0] == f"linked to {place}\n"
    pattern = r"camera A: +\d+ ms ago, effector 320\.50,240\.25 px \(0\.98\), goal not seen\n\Z"
    for line in printed[1:]:
        assert re.match(pattern, line), line
    assert err == "tracking_client.py: stopped by SIGTERM\n"
    assert process.returncode == 128 + signal.SIGTERM
    assert Memory(str(tmp_path / "state")).load() == ServerAddress("127.0.0.1", tracker.port, CODE)


def test_the_command_is_refused_in_one_line(tmp_path):
    tracker = FakeTracker(RealClock(), answer=Refused("code", "this is not the pairing code", 1.0))
    process = start(tmp_path, f"127.0.0.1:{tracker.port}", "--code", "ABCDEFGHJKMN")
    assert serve(process, tracker, 1) in ([], [""])
    out, err = process.communicate(timeout=PATIENCE)
    tracker.close()
    assert (out, process.returncode) == ("", 1)
    assert err == f"tracking_client.py: 127.0.0.1:{tracker.port}: this is not the pairing code\n"
    assert not os.path.exists(str(tmp_path / "state"))


def test_the_command_says_once_that_nothing_listens_and_gives_up_in_time(monkeypatch, capsys):
    monkeypatch.setattr(program.signal, "signal", lambda number, handler: None)
    place = f"127.0.0.1:{free_port()}"
    assert main([place, "--code", "ABCDEFGHJKMN", "--seconds", "0.6"]) == 1
    out, err = capsys.readouterr()
    assert out.count("\n") == 1
    assert out.startswith("not linked: cannot reach " + place)
    assert err.startswith("tracking_client.py: no observation in 0.6 s: cannot reach " + place)
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("argv", "prompt"),
    [
        (["127.0.0.1:99999", "--code", "ABCDEFGHJKMN"], "1 to 65535"),
        (["127.0.0.1", "--code", "ABCD"], "is no pairing code"),
        (["127.0.0.1", "--seconds", "nan"], "'nan' must be a number"),
        (["127.0.0.1", "--seconds", "0"], "0.1 to 86400 s"),
        (["127.0.0.1"], "not paired yet"),
        ([], "where is the tracker"),
        (["a", "b"], "unrecognized arguments: b"),
        (
            ["a", "--code", "ABCDEFGHJKMN", "92GS-M64M-XYZ2"],
            "unrecognized arguments: 92GS-M64M-XYZ2",
        ),
        (
            ["a", "92gsm64mxyz2"],
            "'92gsm64mxyz2' reads as a pairing code",
        ),
        (
            ["92GS-M64M-XYZ2"],
            "'92GS-M64M-XYZ2'",
        ),
    ],
)
def test_a_wrong_command_is_answered_in_one_line(argv, prompt, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(program.signal, "signal", lambda number, handler: None)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    monkeypatch.delenv("SSH_CLIENT", raising=False)
    monkeypatch.delenv("SSH_CONNECTION", raising=False)
    try:
        status = main(argv)
    except SystemExit as ended:
        status = ended.code
    out, err = capsys.readouterr()
    assert status in (1, 2)
    assert out == ""
    assert err.startswith("tracking_client.py: ")
    assert prompt in err
    assert err.count("\n") == 1


def test_the_script_can_be_started_by_its_name():
    assert os.access(SCRIPT, os.X_OK)
    with open(SCRIPT) as file:
        assert file.readline() == "#!/usr/bin/env python3\n"


def test_no_line_is_sent_that_is_longer_than_the_buffer_of_a_second():
    seen = Observation(1, "A", 1e5, {"effector": (320.5, 240.25, 0.98), "goal": None})
    assert 60 * len(encode(seen)) < tracking.RECEIVE_BUFFER


def test_after_the_link_is_lost_nothing_older_is_printed(monkeypatch, capsys):
    class FakeClient:
        linked, refused, why, looks = True, False, "gone", 0

        def __init__(self, *tracker, clock, say):
            self.clock, self.say = clock, say

        def poll(self, timeout):
            self.looks += 1
            if self.looks == 1:
                return {"A": Observation(0, "A", self.clock.now(), {"effector": None})}
            if self.looks == 2:
                self.linked = False
                self.say("not linked: gone")
            self.clock.sleep(timeout)
            return {}

        def close(self, reason):
            self.linked = False

    monkeypatch.setattr(tracking_commands, "TrackingClient", FakeClient)
    monkeypatch.setattr(tracking_commands, "find_tracker", lambda place, code, ask: ())
    monkeypatch.setattr(program, "run", lambda name, command: command())
    with pytest.raises(NotPaired):
        main(["--seconds", "0.2"])
    assert capsys.readouterr().out == "not linked: gone\n"
