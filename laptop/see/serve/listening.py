"""Sockets that listen at an address of this machine, and which addresses it has."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import socket

import ifaddr

from shared.arm_description import ArmError
from shared.messages import PORT

BACKLOG = 128
"""Number of connections that the system queues for the thread."""


class CannotListen(ArmError, OSError):
    """The port or the address is not to be had."""


def own_addresses() -> list[str]:
    """Return the addresses at which others may reach this machine, loopback left out."""
    found = [str(ip.ip) for card in ifaddr.get_adapters() for ip in card.ips if ip.is_IPv4]
    return [address for address in found if not ipaddress.ip_address(address).is_loopback]


def is_loopback(host: str) -> bool:
    """Return True if a host is this machine's own, seen from itself alone."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens, and never blocks.

    Args:
        host: address or name of this machine; "" for all.
        port: 0 takes any free one.

    Raises:
        CannotListen: in one line with the next step.
    """
    if not 0 <= port <= 65535:
        raise CannotListen(f"{port} is no port; --listen-port takes 1 to 65535")
    try:
        listener = _bind(host, port)
    except (socket.gaierror, UnicodeError):
        raise CannotListen(
            f"there is no host {ascii(host)[:40]}; give --listen-port HOST:PORT with an "
            f"address of this machine, one of "
            f"{', '.join(['127.0.0.1', *own_addresses()])}, or leave it out"
        ) from None
    except OSError as error:
        raise CannotListen(_why_not(host, port, error)) from None
    listener.setblocking(False)
    return listener


def _bind(host: str, port: int) -> socket.socket:
    if not host:
        # IPv6 and IPv4 in one, where the system has IPv6 at all.
        with contextlib.suppress(OSError):
            if socket.has_dualstack_ipv6():
                return socket.create_server(
                    ("", port), family=socket.AF_INET6, backlog=BACKLOG, dualstack_ipv6=True
                )
        return socket.create_server(("", port), backlog=BACKLOG)
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    family, _, _, _, address = found[0]
    return socket.create_server(
        (str(address[0]), port), family=socket.AddressFamily(family), backlog=BACKLOG
    )


def _why_not(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} is in use, perhaps by another tracker; "
            f"end that, or take another port: --listen-port {port + 1 if port < 65535 else PORT}"
        )
    if error.errno == errno.EACCES:
        return f"port {port} is not for everybody; take one from 1024 on, like --listen-port {PORT}"
    if error.errno == errno.EADDRNOTAVAIL:
        return (
            f"this machine has not the address {host}; give --listen-port HOST:PORT with one of "
            f"{', '.join(['127.0.0.1', *own_addresses()])}, or leave it out"
        )
    return f"cannot listen at {host or 'any address'}, port {port}: {error.strerror}"
