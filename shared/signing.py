"""Signatures of the lines of a link: without the key nobody can change, repeat or leave out one.

    {"kind":"stop","reason":"enough"}5f0c1d2e3b4a5968

The last 16 bytes are the first 8, in hex digits, of HMAC-SHA256 (RFC 2104) over the number of the
line, counted from 0 on in this direction, a blank, and the message. The number itself is not sent:
both sides count. Each direction has a key of its own, so that no line can be sent back.
"""

from shared.framing import TAG_LENGTH

MYPY = False
if MYPY:
    from typing import Deque, List, Tuple, TypeVar  # noqa: F401

    Arrival = TypeVar("Arrival")  # what is told of a line beside it

BLOCK = 64
"""Of SHA-256, bytes."""

_TAG = -TAG_LENGTH  # where the signature begins in a line


class LineSigner(object):
    """Signs the lines of one direction, or checks their signatures: one object does one of both.

    `hmac` is written in Python, and dear on the brick. So what depends on the key alone is worked
    out here, and copied for each line.

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
        """The next line, which ends in a newline, with its signature."""
        message = line[:-1]
        return message + self._tag(message) + b"\n"

    def checked(self, lines):
        # type: (Deque[Tuple[bytes, Arrival]]) -> List[Tuple[bytes, Arrival]]
        """Take out of a deque of (line without its newline, x) those that are the next ones.

        Returns:
            List of (message, x). The first one that is not as it was sent stays in the deque.
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
