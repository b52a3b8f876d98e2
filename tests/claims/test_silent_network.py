"""The network that can fall silent between a browser and its page."""

import socket
import struct
import threading

from waiting import PATIENCE, until

from tests.claims.silent_network import silent_network


def through(network, port):
    """A connection through the network to a port of this computer."""
    sock = socket.create_connection(network.server_address, timeout=PATIENCE)
    sock.sendall(b"\5\1\0")
    assert sock.recv(2) == b"\5\0"
    host = b"127.0.0.1"
    sock.sendall(b"\5\1\0\3" + bytes([len(host)]) + host + port.to_bytes(2, "big"))
    assert sock.recv(10) == b"\5\0\0\1" + bytes(6)
    return sock


def test_what_came_before_a_reset_is_passed_on_once_and_its_threads_end():
    before = threading.active_count()
    with silent_network() as network, socket.create_server(("127.0.0.1", 0)) as server:
        near = through(network, server.getsockname()[1])
        far, _ = server.accept()
        far.settimeout(PATIENCE)
        near.sendall(b"once")
        assert far.recv(100) == b"once"
        near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        near.close()  # this resets it
        assert far.recv(100) == b""
        far.close()
    until(lambda: threading.active_count() <= before, "the end of its threads")
