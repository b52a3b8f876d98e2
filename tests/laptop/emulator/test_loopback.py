"""Connections within this process: what is on its way is waited for, and nothing else is."""

import gc
import socket
import time

import pytest

from laptop.emulator.loopback import Loopback


class Far:
    """A socket that connects to another computer."""

    def getsockname(self):
        return "192.0.2.7", 40000

    def getpeername(self):
        raise OSError("not connected yet")

    def fileno(self):
        raise AssertionError("it is waited for")


def linked(listener):
    """A Loopback, and both ends of a connection that it counts."""
    loopback = Loopback()
    loopback.listen(listener)
    client = socket.create_connection(listener.getsockname())
    client.setblocking(False)
    loopback.connect([client, Far()])
    loopback.settle()
    return loopback, client, listener.accept()[0]


def test_who_connects_to_another_computer_is_not_waited_for_and_our_own_is_told_of():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        loopback, client, server = linked(listener)
        with client, server:
            client.send(b"one")
            server.send(b"two")
            loopback.settle()
            assert (server.recv(9), client.recv(9)) == (b"one", b"two")


@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_socket_that_nobody_holds_any_more_hangs_up():
    """As that of a program that was killed: its system closes it."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        loopback, client, server = linked(listener)
        with server:
            del client
            gc.collect()
            loopback.settle()
            assert server.recv(9) == b""


def test_where_nothing_is_on_its_way_it_goes_on_at_once():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        loopback, client, server = linked(listener)
        with client, server:
            client.send(b"x" * 5000)
            before = time.monotonic()
            for _ in range(100):
                loopback.settle()
            assert time.monotonic() - before < 0.5
            assert len(server.recv(9999)) == 5000
        loopback.settle()
        assert not loopback._connections, "they are forgotten"
