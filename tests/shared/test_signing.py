"""Signatures: those of openssl, and none that holds for another line."""

import collections
import hashlib
import hmac

import pytest

from shared.framing import TAG_LENGTH
from shared.signing import LineSigner

KEY = bytes.fromhex("6645369630b3a02007467d2bb8ed62c5a94bae13fdd27c3ec792dbb48e92ca75")
STOP, PING = b'{"kind":"stop","reason":"enough"}', b'{"kind":"ping","id":7}'


def checked(signer, *lines):
    return [message for message, _ in signer.checked(collections.deque((x, 0) for x in lines))]


def test_a_signature_is_hmac_sha256_as_openssl_has_it():
    """Worked out with the openssl command: printf '0 {...}' | openssl dgst -sha256 -mac HMAC."""
    signer = LineSigner(KEY)
    assert signer.sign(STOP + b"\n") == STOP + b"be88a1dccac26c63\n"
    assert signer.sign(PING + b"\n") == PING + b"5b095b09e68b9579\n"


@pytest.mark.parametrize("key", [b"", b"x", KEY, b"\xff" * 64])
@pytest.mark.parametrize("length", [0, 1, 52, 53, 54, 61, 62, 63, 64, 200, 2048])
def test_a_signature_is_that_of_the_hmac_module(key, length):
    signer = LineSigner(key)
    for count in range(12):
        message = bytes([65 + count]) * length
        expected = hmac.new(key, str(count).encode() + b" " + message, hashlib.sha256).hexdigest()
        assert signer.sign(message + b"\n") == message + expected[:16].encode() + b"\n"


def test_lines_are_taken_as_far_as_they_are_the_next_ones():
    signer, receiver = LineSigner(KEY), LineSigner(KEY)
    lines = [signer.sign(line + b"\n")[:-1] for line in (STOP, PING, STOP)]
    waiting = collections.deque([(lines[0], 1.5), (lines[1], 2.5), (lines[0], 3.5), (PING, 4.5)])
    assert receiver.checked(waiting) == [(STOP, 1.5), (PING, 2.5)]
    assert list(waiting) == [(lines[0], 3.5), (PING, 4.5)]


def test_no_bit_of_a_line_may_change():
    line = LineSigner(KEY).sign(STOP + b"\n")[:-1]
    for place in range(len(line)):
        for bit in range(8):
            changed = bytearray(line)
            changed[place] ^= 1 << bit
            assert checked(LineSigner(KEY), bytes(changed)) == []
    assert checked(LineSigner(KEY), line) == [STOP]


@pytest.mark.parametrize("line", [b"", b"x", b"0" * TAG_LENGTH, b"0" * 15, "é".encode() * 20])
def test_what_is_too_short_or_no_text_is_no_line(line):
    assert checked(LineSigner(KEY), line) == []
