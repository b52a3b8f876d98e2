"""A hundred thousand lines that nobody should send: nothing breaks, grows, or is believed."""

import json
import random
import socket
import tracemalloc

import pytest
from clocks import FakeClock
from hypothesis import given, settings
from hypothesis import strategies as st
from signed import KEYS, SignedSocket

from shared.framing import MAX_QUEUE
from shared.job_messages import Draw, JobStatus, Order, Want, part_of
from shared.link import COUNTERS, MAX_AGE, Link
from shared.messages import (
    BRICK,
    MAX_CAMERAS,
    MAX_LINE,
    VERSION,
    BadMessage,
    Bye,
    Challenge,
    Hello,
    Observation,
    Ping,
    Pong,
    Proof,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
    decode,
    encode,
)

AHEAD = 5000.0
VALID = [
    encode(message)[:-1]
    for message in (
        Hello(VERSION, BRICK, "0" * 32),
        Challenge("f" * 32, "5" * 32),
        Proof("a" * 64),
        Welcome("b" * 64),
        Refused("busy", "the tracker serves 192.168.0.7", 1.5),
        Ping(3),
        Pong(1, 5100.0, 5100.5),
        Observation(7, "A", 5100.0, {"effector": (320.125, 240.5, 0.98), "goal": None}),
        Observation(2**53, "B", 5099.5, {"goal": (1.0, 2.0, 0.0)}),
        Status(99.5, (0.1, -3.2), 12.25, "converged", "why", {"A.u": 3.5}, 17.5, 12, 3),
        Start(goals={"A": (400.5, 200.0)}),
        Stop("enough"),
        Draw("a rose", 123456, 40, 0xCAFE0123),
        Want(0xCAFE0123, 39),
        part_of(bytes(range(60)), 0xCAFE0123, 0),
        Order("speed", 0.5),
        JobStatus(9.5, 7, "a rose", "drawing", 3, 37, 12.25, 412.5, 99.5, True, ""),
        Bye("the tracker has ended"),
    )
]
# What stands where a value should: each is one that some parser somewhere trips over.
ODD = (
    b'NaN -Infinity 1e999 -1e999 1e-999 -0 00 1. .5 +1 0x10 1_0 true null {} [] "" "\\ud800" '
    b'"\\u0000" "\xff" "\xed\xa0\x80" 9007199254740993 -1 1e308 [[[[]]]] {"a":{}} \'1\' ,'
).split() + [b"1" * 400, b"[" * 500 + b"]" * 500, b"[" * 1900, b'"' + b"x" * 1900 + b'"', b"\xf0"]


def mutated(line, number):
    """A valid line after one accident; which one, `number` tells."""
    dice = random.Random(number)
    kind = dice.randrange(7)
    start, end = sorted(dice.randrange(len(line) + 1) for _ in range(2))
    if kind == 0:  # bytes changed
        changed = bytearray(line)
        for _ in range(dice.randrange(1, 5)):
            changed[dice.randrange(len(line))] = dice.randrange(256)
        return bytes(changed)
    if kind == 1:
        return line[:start]
    if kind == 2:
        return line[:start] + line[end:]
    if kind == 3:
        return line[:end] + line[start:]
    if kind == 4:  # another value somewhere
        values = [place for place in range(len(line)) if line[place : place + 1] in b":,["]
        place = dice.choice(values) + 1
        after = place
        while after < len(line) and line[after : after + 1] not in b",]}":
            after += 1
        return line[:place] + dice.choice(ODD) + line[after:]
    if kind == 5:  # a key more, or one twice
        key = dice.choice([b"kind", b"t", b"seq", b"camera", b"markers", b"new"])
        return line[:-1] + b',"' + key + b'":' + dice.choice(ODD) + b"}"
    return line + dice.choice(VALID)


lines = st.one_of(
    st.binary(max_size=60),
    st.text(max_size=30).map(lambda text: json.dumps(text).encode()),
    st.builds(mutated, st.sampled_from(VALID), st.integers(0, 2**64)),
    st.builds(mutated, st.sampled_from(VALID), st.integers(0, 2**64)),
)


@pytest.mark.short("2")
@pytest.mark.parametrize("thousands", [2, 100])
def test_nothing_but_bad_message_comes_out_of_decode(thousands):
    tried = []

    @settings(derandomize=True, deadline=None, database=None, max_examples=thousands)
    @given(batch=st.lists(lines, min_size=20, max_size=40), number=st.integers(0, 2**64))
    def fuzz(batch, number):
        dice = random.Random(number)
        # The lines that hypothesis thought of, and a thousand accidents that it drew the seed of.
        batch = batch + [mutated(dice.choice(VALID), dice.random()) for _ in range(1000)]
        tried.append(len(batch))
        for line in batch:
            try:
                message = decode(line)
            except BadMessage as error:
                complaint = str(error)
            else:
                complaint = ""
                assert decode(encode(message)) == message  # it could have been sent
            assert len(complaint) < 300
            assert complaint.isprintable()

    fuzz()
    assert sum(tried) >= 1000 * thousands


def fuzzed_link(proven, batches):
    """Feed batches of lines to a link, and another link whenever one has closed."""
    clock = FakeClock()
    links = []
    received = 0

    def new_link():
        sock, other = socket.socketpair()
        other.setblocking(False)
        link = Link(sock, clock.now, KEYS if proven else None)
        links.append((link, SignedSocket(other) if proven else other))
        link, other = links[-1]
        link.poll()
        if proven:
            other.send(encode(Pong(1, clock.t + AHEAD, clock.t + AHEAD)))
            link.poll()
            assert link.clock.is_known
        return links[-1]

    link, other = new_link()
    for batch in batches:
        if link.closed:
            link, other = new_link()
        clock.t += 0.01
        other.send(b"".join(line + b"\n" for line in batch))
        for _ in range(4):
            link.poll()
            message = link.receive()
            received += message is not None
            for seen in link.newest().values():
                check(seen, clock.t)
        assert link.buffer_sizes["lines"] <= len(batch)
        assert link.buffer_sizes["unfinished bytes"] <= MAX_LINE
        assert link.buffer_sizes["messages"] <= MAX_QUEUE
        assert link.buffer_sizes["cameras"] <= MAX_CAMERAS
        assert link.buffer_sizes["pings"] <= 16
        assert link.buffer_sizes["unsent bytes"] <= (MAX_QUEUE + MAX_CAMERAS + 1) * MAX_LINE
        assert set(link.counters) == set(COUNTERS)
        try:
            while getattr(other, "sock", other).recv(65536):
                pass
        except BlockingIOError:
            pass
    for link, other in links:
        link.close()
        other.close()
    return len(links), received


def check(seen, now):
    """What is handed over must be one that the laptop could have meant."""
    assert isinstance(seen, Observation)
    assert decode(encode(seen._replace(t=abs(seen.t)))).markers == seen.markers
    assert now - MAX_AGE <= seen.t <= now + 0.2


def batches_of(seed, count, size):
    """Batches of lines, most of them bad."""
    dice = random.Random(seed)
    for _ in range(count):
        yield [
            bytes(dice.randrange(256) for _ in range(dice.randrange(30))).replace(b"\n", b"")
            if dice.random() < 0.2
            else mutated(dice.choice(VALID), dice.random()).replace(b"\n", b"")
            for _ in range(size)
        ]


@settings(derandomize=True, deadline=None, database=None, max_examples=20)
@given(seed=st.integers(0, 2**64), size=st.sampled_from([1, 3, 10, 19]))
def test_nothing_wrong_gets_through_a_link(seed, size):
    links, received = fuzzed_link(True, batches_of(seed, 400 // size, size))
    assert links < 200
    fuzzed_link(False, batches_of(seed, 20, size))


@pytest.mark.long
def test_a_link_that_is_fed_garbage_does_not_grow():
    batches = list(batches_of(1, 2000, 3))
    fuzzed_link(True, batches[:200])
    tracemalloc.start()
    try:
        fuzzed_link(True, batches[:1000])
        before = tracemalloc.get_traced_memory()[0]
        fuzzed_link(True, batches[1000:])
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert grown < 100_000
