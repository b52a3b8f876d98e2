"""The gate of STOP, and what unfinished requests cost: over real sockets, without a page."""

import http.client
import socket
import threading
import time

import pytest
from waiting import PATIENCE, until

from laptop.page import http_limits
from laptop.page.http_limits import MAX_UNFINISHED, LimitedHttp
from laptop.page.login import Admission
from laptop.page.stop_gate import StopGate

PAGE = "127.0.0.1:1"


class Gate:
    """A gate, and who has stopped by it."""

    def __init__(self):
        self.admission = Admission()
        self.stopped = []
        listener = socket.create_server(("127.0.0.1", 0))
        self.port = listener.getsockname()[1]
        self.host = f"127.0.0.1:{self.port}"
        self.cookie = "brickservo-1=" + self.admission.redeem(self.admission.token)
        self.gate = StopGate(self.stop, self.admission.key, listener, [self.host], [PAGE])

    def stop(self, browser):
        self.stopped.append(browser)
        return f"told by {browser}"

    def ask(self, method="POST", path="/stop", **headers):
        headers = {"Cookie": self.cookie, "Origin": f"http://{PAGE}", **headers}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.request(
            method, path, headers={name: text for name, text in headers.items() if text}
        )
        answer = connection.getresponse()
        reported = answer.status, dict(answer.getheaders()), answer.read().decode()
        connection.close()
        return reported


@pytest.fixture(scope="module")
def gate():
    made = Gate()
    yield made
    made.gate.close()


@pytest.mark.parametrize("served", [False, True])
def test_nothing_of_it_is_left_once_it_is_closed(served):
    made = Gate()
    if served:
        made.ask()
    made.gate.close()
    assert "stop gate" not in [thread.name for thread in threading.enumerate()]
    with pytest.raises(ConnectionRefusedError):
        made.ask()


def test_a_stop_is_taken_from_a_page_of_ours_which_may_read_the_answer(gate):
    gate.stopped.clear()
    status, headers, text = gate.ask()
    assert (status, text, gate.stopped) == (200, "told by 1", [1])
    assert headers["access-control-allow-origin"] == f"http://{PAGE}"
    assert headers["access-control-allow-credentials"] == "true"


@pytest.mark.parametrize(
    "headers",
    [
        {"Cookie": None},
        {"Cookie": "brickservo-1=guess"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Host": "evil.example"},
    ],
)
def test_nobody_else_stops_or_hears_anything(gate, headers):
    gate.stopped.clear()
    for method, path in (("POST", "/stop"), ("GET", "/pulse")):
        status, answered, _ = gate.ask(method, path, **headers)
        assert status in (400, 403)
        assert "access-control-allow-origin" not in answered
    assert gate.stopped == []


def test_there_is_nothing_else(gate):
    gate.stopped.clear()
    assert gate.ask("GET", "/")[0] == gate.ask("GET", "/stop")[0] == 404
    assert gate.ask("DELETE", "/stop")[0] == 403
    assert gate.stopped == []


def test_a_stop_that_takes_its_time_holds_up_no_other(gate, monkeypatch):
    held, stop = threading.Event(), gate.gate._stop
    first = []

    def slow(browser):
        first.append(browser)
        if len(first) == 1:
            held.wait(PATIENCE)
        return stop(browser)

    monkeypatch.setattr(gate.gate, "_stop", slow)
    thread = threading.Thread(target=gate.ask)
    thread.start()
    until(lambda: first, "the first")
    assert gate.ask()[0] == 200
    held.set()
    thread.join(PATIENCE)
    assert len(first) == 2


def test_a_page_hears_signs_of_life_for_as_long_as_it_listens(gate):
    sock = socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE)
    head = f"GET /pulse HTTP/1.1\r\nHost: {gate.host}\r\nCookie: {gate.cookie}\r\n"
    sock.sendall(f"{head}Origin: http://{PAGE}\r\n\r\n".encode())
    heard = b""
    while heard.count(b"data: .") < 4:
        more = sock.recv(4096)
        assert more, "it goes on"
        heard += more
    assert b"text/event-stream" in heard
    assert gate.gate._streams == 1
    sock.close()
    until(lambda: gate.gate._streams == 0, "its end")


# Requests that never end


def closed(sock):
    sock.settimeout(PATIENCE)
    try:
        return sock.recv(4096) == b""
    except ConnectionError:
        return True


def unfinished(gate, text=b"GET /stop HT"):
    sock = socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE)
    sock.sendall(text)
    return sock


@pytest.mark.long
def test_an_unfinished_request_ends_though_more_of_it_trickles_in(gate, monkeypatch):
    monkeypatch.setattr(http_limits, "REQUEST_TIMEOUT", 0.5)
    sock = unfinished(gate)
    over = threading.Event()

    def trickle():
        while not over.wait(0.02):
            try:
                sock.sendall(b"x")
            except OSError:
                return

    thread = threading.Thread(target=trickle)
    thread.start()
    assert closed(sock)
    over.set()
    thread.join(PATIENCE)
    silent = unfinished(gate, b"")
    assert closed(silent), "one that was never begun, too"
    for ended in (sock, silent):
        ended.close()


@pytest.mark.long
def test_of_unfinished_requests_there_are_few_and_the_oldest_has_to_go(gate):
    socks = [unfinished(gate)]
    until(lambda: len(LimitedHttp._on_their_way) == 1, "the first")
    socks += [unfinished(gate) for _ in range(MAX_UNFINISHED)]
    assert closed(socks[0])
    assert gate.ask()[0] == 200, "a request that is complete is taken all the same"
    assert len(LimitedHttp._on_their_way) <= MAX_UNFINISHED
    for sock in socks:
        sock.close()
    until(lambda: not LimitedHttp._on_their_way, "their end")


@pytest.mark.long
def test_a_connection_that_is_kept_alive_is_none_of_them(gate):
    connection = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=PATIENCE)
    for _ in range(3):
        connection.request("GET", "/nothing", headers={"Cookie": gate.cookie})
        assert connection.getresponse().read()
        time.sleep(1.2 * http_limits.GRACE)
        assert not LimitedHttp._on_their_way
    connection.close()
