"""The page's process: made to listen, started and ended by the tracker, and never waited for.

What the page needs to look nice is slow to import, so that only its own process does.
"""

from __future__ import annotations

import errno
import importlib.util
import ipaddress
import multiprocessing
import os
import secrets
import signal
import socket
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection

from laptop.page.controller import PageController, keep_heartbeat
from laptop.page.rpc import serve_requests
from laptop.tracking.listening import own_addresses
from shared.arm_description import ArmError

HOST, PORT = "127.0.0.1", 7780
"""Default address of the page; another free port if this one is taken."""
EXIT_TIMEOUT = 2.0
"""Time, s, that the page's process has to end after it was told; then it is killed."""
PAGE_NICENESS = 5
"""Increment of the page's niceness: tracker and brick come first."""
DUAL_STACK = socket.has_dualstack_ipv6()
ANY_HOST = ("0.0.0.0", "::", "")
"""Hosts that stand for every address of this machine."""


class NoPage(ArmError):
    """A page that cannot be had."""


def listen(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens for the page.

    Args:
        host: its address.
        port: None for the usual one, or a free one.

    Raises:
        NoPage: address or port are not to be had, or what the page is made with is missing.
    """
    if importlib.util.find_spec("nicegui") is None:
        raise NoPage("nicegui is not installed here, which the page needs; install it or --no-page")
    ports = [PORT, 0] if port is None else [port]
    for number in ports:
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            return socket.create_server(
                (host, number), family=family, dualstack_ipv6=host == "::" and DUAL_STACK
            )
        except (OSError, UnicodeError) as error:
            number_of = getattr(error, "errno", 0) or 0
            if number != ports[-1] and number_of == errno.EADDRINUSE:
                continue
            here = ", ".join([HOST, *own_addresses()])
            advice = {
                errno.EADDRINUSE: "is in use; take another --page-port, or 0 for any",
                errno.EACCES: "is not for everybody; take a --page-port from 1024 on",
            }.get(number_of, f"cannot be had; give --page-host one of {here}")
            raise NoPage(f"page: {host} port {number} {advice}") from None
    raise AssertionError("there is always a port to try")


def hosts(host: str, port: int) -> list[str]:
    """Return the names HOST:PORT by which browsers may call the page.

    By other names somebody else may have led them here.

    Args:
        host, port: where the page listens.
    """
    if host in ANY_HOST:
        names = ["localhost", HOST, *own_addresses(), socket.gethostname()]
    elif _is_loopback(host):
        names = ["localhost", host]
    else:
        names = [host]
    bracketed = [f"[{name}]" if ":" in name else name for name in names]
    return [f"{name}:{port}".lower() for name in bracketed]


def _is_loopback(host: str) -> bool:
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"


class PageProcess:
    """Page of a controller, in a process of its own.

    Args:
        controller: of what it shows.
        listener: see `listen`; the page takes it over.
        host: where that listens.

    Attributes:
        address: to type into a browser; holds the token that lets one in.
        warning: danger that people must know, or "".
    """

    def __init__(self, controller: PageController, listener: socket.socket, host: str) -> None:
        port = listener.getsockname()[1]
        names = hosts(host, port)
        token = secrets.token_urlsafe(24)
        shown = names[0] if host in ANY_HOST else names[-1]
        if host in ANY_HOST and own_addresses():
            shown = f"{own_addresses()[0]}:{port}"
        self.address = f"http://{shown}/?token={token}"
        self.warning = (
            ""
            if _is_loopback(host)
            else f"page: others in its network can reach it at {host}, unencrypted; who reads "
            "the address along can move the arm"
        )
        self._over = threading.Event()
        # Several: a STOP waits neither for the next picture nor for a frame to be read from a disk.
        pipes = [multiprocessing.Pipe() for _ in range(2 + len(controller.cameras))]
        self._pipes = [ours for ours, _ in pipes]
        quick, slow, *seeing = theirs = [pipe for _, pipe in pipes]
        for ours in self._pipes:
            threading.Thread(target=serve_requests, args=(controller, ours), daemon=True).start()
        threading.Thread(target=keep_heartbeat, args=(controller, self._over), daemon=True).start()
        # A fork would share the cameras, and threads that hold locks.
        self.process = multiprocessing.get_context("spawn").Process(
            target=_serve_page,
            args=(
                quick,
                slow,
                dict(zip(controller.cameras, seeing, strict=True)),
                listener,
                token,
                names,
            ),
            daemon=True,
        )
        self.process.start()
        for pipe in theirs:
            pipe.close()
        listener.close()

    def close(self) -> None:
        """End the page's process."""
        self._over.set()
        self.process.terminate()
        self.process.join(EXIT_TIMEOUT)
        if self.process.is_alive():
            self.process.kill()
        for pipe in self._pipes:
            pipe.close()


def _serve_page(
    quick: Connection,
    slow: Connection,
    seeing: Mapping[str, Connection],
    listener: socket.socket,
    token: str,
    names: Sequence[str],
) -> None:
    """Serve the page until the tracker's process is no more; the page's process does no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the tracker's, who then ends this
    if hasattr(os, "nice"):
        os.nice(PAGE_NICENESS)
    from laptop.page import server
    from laptop.page.async_controller import AsyncController

    controller = AsyncController(quick, slow, seeing)
    threading.Thread(
        target=server.serve, args=(controller, listener, token, names), daemon=True
    ).start()
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
