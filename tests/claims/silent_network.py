"""A network between a browser and all else that can fall silent: nothing passes, nor is closed."""

from __future__ import annotations

import socket
import socketserver
import threading
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress


class SilentNetwork(socketserver.ThreadingTCPServer):
    """A SOCKS proxy; what comes while `passes` is clear waits for it.

    Put another in its place, and the connections that there are pass on nothing again.

    Attributes:
        url: for the browser.
        passes: an Event.
        ports: such events for single ports, for which all must pass.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Connection)
        self.passes = _set_event()
        self.ports: defaultdict[int, threading.Event] = defaultdict(_set_event)
        self.url = f"socks5://127.0.0.1:{self.server_address[1]}"


class _Connection(socketserver.StreamRequestHandler):
    """One of SOCKS 5: no authentication, CONNECT to a host by its name, as Chromium asks."""

    server: SilentNetwork

    def handle(self) -> None:
        with suppress(OSError):  # either end may be gone
            passes = self.server.passes
            self.rfile.read(self.rfile.read(2)[1])
            self.request.sendall(b"\5\0")
            host = self.rfile.read(self.rfile.read(5)[4])
            port = int.from_bytes(self.rfile.read(2), "big")
            events = passes, self.server.ports[port]
            with socket.create_connection((host.decode(), port)) as other:
                self.request.sendall(b"\5\0\0\1" + bytes(6))
                threading.Thread(
                    target=_pass_on, args=(other, self.request, events), daemon=True
                ).start()
                _pass_on(self.request, other, events)


def _set_event() -> threading.Event:
    event = threading.Event()
    event.set()
    return event


def _pass_on(source: socket.socket, sink: socket.socket, events: Sequence[threading.Event]) -> None:
    data = b"."
    while data:
        try:
            data = source.recv(65536)
        except OSError:  # it was reset
            data = b""
        for event in events:
            event.wait()
        with suppress(OSError):
            sink.sendall(data) if data else sink.shutdown(socket.SHUT_WR)


@contextmanager
def silent_network() -> Iterator[SilentNetwork]:
    """Provide a network; it passes everything at first."""
    with SilentNetwork() as network:
        threading.Thread(target=network.serve_forever).start()
        try:
            yield network
        finally:
            for event in (network.passes, *network.ports.values()):
                event.set()
            network.shutdown()
