"""Signatures of a link's lines, against change, replay, loss and reordering.

    {"kind":"stop","reason":"enough"}5f0c1d2e3b4a5968

The last 16 bytes are the first 8, in hex digits, of HMAC-SHA256 (RFC 2104) over the number of the
line, counted from 0 on in this direction, a blank, and the message. The number itself is not sent:
both sides count. So a line that is replayed, left out or out of order fails the check: its number
differs. Each direction has a key of its own (shared.pairing), so that no line can be sent
back to its sender. The keys are new in every connection: a line of an earlier one is worth nothing.

    HMAC(K, m) = H((K xor opad) || H((K xor ipad) || m))

Only 64 bits are sent, fewer than the 80 that RFC 2104 (section 5) recommends: the first forged line
ends the connection, so an attacker has one guess in 2^64. A CRC
would find damage, but anybody can compute it; a public-key signature costs the brick far more.
"""

from shared.framing import TAG_LENGTH

MYPY = False
if MYPY:
    from typing import Deque, List, Tuple, TypeVar  # noqa: F401

    Arrival = TypeVar("Arrival")  # what stands beside a line

BLOCK = 64
"""Block length of SHA-256, bytes."""

_TAG = -TAG_LENGTH  # where the signature begins in a line


class LineSigner(object):
    """Signer of the lines of one direction, or checker of their signatures: one object does one.

    `hmac` is written in Python, and slow on the brick. So the hash states that depend on the key
    alone are computed here once, and copied for each line.

    Args:
        key: bytes, at most BLOCK.
    """

    def __init__(self, key):
        # type: (bytes) -> None
        import hashlib  # not above: on the brick the arm is ready sooner without
        import hmac

        padded = bytearray(key.ljust(BLOCK, b"\0"))
        self._inner = hashlib.sha256(bytes([value ^ 0x36 for value in padded]))
        self._outer = hashlib.sha256(bytes([value ^ 0x5C for value in padded]))
        self._is_same = hmac.compare_digest
        self._count = 0

    def sign(self, line):
        # type: (bytes) -> bytes
        """Return the next line with its signature; both end in a newline."""
        message = line[:-1]
        return message + self._tag(message) + b"\n"

    def checked(self, lines):
        # type: (Deque[Tuple[bytes, Arrival]]) -> List[Tuple[bytes, Arrival]]
        """Take the lines with valid signatures off the left of a deque of (line, x).

        Args:
            lines: deque of (line without its newline, anything).

        Returns:
            List of (message, x). The first invalid line, and all after it, stay in the deque.
        """
        found = []
        while lines:
            line, x = lines[0]
            message = line[:_TAG]
            if not self._is_same(self._tag(message), line[_TAG:]):
                break
            lines.popleft()
            found.append((message, x))
        return found

    def _tag(self, message):
        # type: (bytes) -> bytes
        inner, outer = self._inner.copy(), self._outer.copy()
        inner.update(b"%d %s" % (self._count, message))
        outer.update(inner.digest())
        self._count += 1
        return outer.hexdigest()[:TAG_LENGTH].encode()
