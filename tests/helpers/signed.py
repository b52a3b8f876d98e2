"""The bare socket at the other end of a link, whose lines are signed."""

import collections

from shared.signing import LineSigner

KEYS = b"one" * 10, b"two" * 10
"""By which the link signs what it says, and by which what it hears must be signed."""


class SignedSocket:
    """Signs each line that it sends, and takes the signatures off what it receives.

    Args:
        sock: connected to a link that was made with KEYS.
    """

    def __init__(self, sock):
        self.sock = sock
        own, theirs = KEYS[::-1]
        self.sign = LineSigner(own).sign
        self._theirs = LineSigner(theirs)

    def __getattr__(self, name):
        return getattr(self.sock, name)

    def sendall(self, data):
        """Send whole lines."""
        self.sock.sendall(b"".join(map(self.sign, data.splitlines(keepends=True))))

    def send(self, data):
        self.sendall(data)
        return len(data)

    def recv(self, size):
        """Whole lines, each of which must be the next one."""
        found = []
        for line in self.sock.recv(size).splitlines():
            entries = self._theirs.checked(collections.deque([(line, None)]))
            found.append(entries[0][0] + b"\n")
        return b"".join(found)
