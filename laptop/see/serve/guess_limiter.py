"""Delays after wrong pairing codes, which grow with every guess."""

from __future__ import annotations

import ipaddress

MAX_DELAY = 60.0
"""Longest delay after wrong codes, s: 1, 2, 4, ... and no more than this."""

FORGIVE_TIME = 600.0
"""Time without another wrong code after which the delay begins at 1 s again, s."""

MAX_SENDERS = 256
"""Greatest number of senders of wrong codes that are remembered."""


def sender_of(address: str) -> str:
    """Name of the sender against whom a wrong code counts.

    That is the address, or of IPv6 the network: a machine there has as many addresses as it likes.
    """
    ip = ipaddress.ip_address(address.partition("%")[0])
    return str(ip if ip.version == 4 else ipaddress.ip_network((ip, 64), strict=False))


class GuessLimiter:
    """Senders of wrong codes, and how long each has to wait: 1, 2, 4, ... s."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[int, float, float]] = {}  # failures, last one, wait until

    def wait(self, sender: str, now: float) -> float:
        """Return the time that `sender` still has to wait, s; `now` is on any one clock, s."""
        return max(0.0, self._known[sender][2] - now) if sender in self._known else 0.0

    def add(self, sender: str, now: float) -> float:
        """Note a wrong code at `now` (s); return the time that `sender` has to wait, s."""
        failures, last, _ = self._known.pop(sender, (0, now, now))
        failures = 1 if now - last > FORGIVE_TIME else failures + 1
        if len(self._known) >= MAX_SENDERS:
            del self._known[min(self._known, key=lambda known: self._known[known][2])]
        delay = min(MAX_DELAY, 2.0 ** min(failures - 1, 10))
        self._known[sender] = failures, now, now + delay
        return delay

    def forgive(self, sender: str) -> None:
        """Forget the wrong codes of a sender that knows the right one."""
        self._known.pop(sender, None)
