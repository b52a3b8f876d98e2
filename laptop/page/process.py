"""The page's process: made to listen, started and ended by the tracker, and never waited for.

What the page needs to look nice is slow to import, so that only its own process does.  One that
dies or stands still is replaced: the tracker keeps its port, its logins and STOP.
"""

from __future__ import annotations

import errno
import importlib.util
import multiprocessing
import signal
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection, wait

from laptop.page.controller import PageController, keep_heartbeat
from laptop.page.login import LoginKey
from laptop.page.rpc import serve_requests
from laptop.page.stop_gate import StopGate
from laptop.see.serve.listening import is_loopback, own_addresses
from laptop.system import platforms
from shared.arm_description import ArmError

HOST, PORT = "127.0.0.1", 7780
"""Default address of the page; another free port if this one is taken."""
EXIT_TIMEOUT = 2.0
"""Time, s, that the page's process has to terminate; then it is killed."""
PAGE_NICENESS = 5
"""Increment of the page's niceness: tracker and brick come first."""
WATCH_PERIOD = 0.25
"""Period of checks whether the page's process lives, s."""
FROZEN_TIMEOUT, STARTING_TIMEOUT = 15.0, 60.0
"""Time, s, without a word of the page's process, after which it is replaced; at its start.  It is
long, for a busy machine is no reason: the run is held by then, and STOP does not need the page."""
STOPPED_TIMEOUT = 1.0
"""Time, s, without a word of a page's process that a signal has stopped: no busy machine does
that."""
RESTART_PAUSE = 1.0
"""Time to wait, s, before one that did not live for RESTART_PERIOD, s, is replaced."""
RESTART_PERIOD = 10.0
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
            }.get(number_of, f"cannot be had; give --page-port HOST:P with HOST one of {here}")
            raise NoPage(f"page: {host} port {number} {advice}") from None
    raise AssertionError("there is always a port to try")


def listen_for_stop(host: str, port: int) -> socket.socket:
    """Return a socket for the gate of STOP: at the port after the page's, or else at any.

    Args:
        host: address where the page listens.
        port: and its TCP port.
    """
    try:
        return listen(host, port + 1 if port < 65535 else 0)
    except NoPage:
        return listen(host, 0)


def hosts(host: str, port: int) -> list[str]:
    """Return the names HOST:PORT by which browsers may call the page.

    By other names somebody else may have led them here.

    Args:
        host: address where the page listens.
        port: and its TCP port.
    """
    if host in ANY_HOST:
        names = ["localhost", HOST, *own_addresses(), socket.gethostname()]
    elif is_loopback(host):
        names = ["localhost", host]
    else:
        names = [host]
    bracketed = [f"[{name}]" if ":" in name else name for name in names]
    return [f"{name}:{port}".lower() for name in bracketed]


class PageProcess:
    """Page of a controller, in a process of its own, and the gate of STOP in this one.

    Args:
        controller: of what it shows.
        listener: see `listen`; the page takes it over.
        host: where that listens.
        say: tells people a line.
        invite: is given each new address.

    Attributes:
        address: to type into a browser; holds the token that lets one in.
        warning: danger that people must know, or "".
        process: the present one, or None before the first.
    """

    def __init__(
        self,
        controller: PageController,
        listener: socket.socket,
        host: str,
        report: Callable[[str], None] = lambda line: None,
        invite: Callable[[str], None] = lambda address: None,
    ) -> None:
        port = listener.getsockname()[1]
        self._names = hosts(host, port)
        self._shown = self._names[0] if host in ANY_HOST else self._names[-1]
        if host in ANY_HOST and own_addresses():
            self._shown = f"{own_addresses()[0]}:{port}"
        self.warning = (
            ""
            if is_loopback(host)
            else f"page: others in its network can reach it at {host}, unencrypted; who reads "
            "the address along can move the arm"
        )
        self._controller, self._listener, self._report = controller, listener, report
        admission = controller.admission
        admission.on_renewal = lambda: invite(self.address)
        gate = listen_for_stop(host, port)
        self._gate_port = gate.getsockname()[1]
        self._gate = StopGate(
            lambda browser: controller.runs.stop(controller.steering.name(browser)),
            admission.key,
            gate,
            hosts(host, self._gate_port),
            self._names,
        )
        self._closing = threading.Event()
        self._heartbeat = threading.Thread(
            target=keep_heartbeat, args=(controller, self._closing), daemon=True
        )
        self._heartbeat.start()
        # Where it can be had: a process that has all imported already, and makes copies of itself.
        known = multiprocessing.get_all_start_methods()
        self._context = multiprocessing.get_context("forkserver" if "forkserver" in known else None)
        self._context.set_forkserver_preload(["laptop.page.server"])
        self.process: multiprocessing.process.BaseProcess | None = None
        controller.watch.why_page_not_running = self._why_not_running
        self._watcher = threading.Thread(target=self._supervise, name="page watcher", daemon=True)
        self._watcher.start()

    @property
    def address(self) -> str:
        """To type into a browser; it holds a token that lets one in, once."""
        return f"http://{self._shown}/?token={self._controller.admission.token}"

    def close(self) -> None:
        """End the page's process."""
        self._closing.set()
        self._gate.close()
        self._watcher.join(2 * EXIT_TIMEOUT)
        self._heartbeat.join(EXIT_TIMEOUT)
        self._listener.close()

    def _supervise(self) -> None:
        """Have a page's process until it is over; for a thread of its own."""
        while not self._closing.is_set():
            rpc_threads = self._start()
            began = time.monotonic()
            why = self._watch()
            self._end(rpc_threads)
            if why:
                self._report(f"page: its process {why}; it starts anew")
                self._controller.lose_page(why)
                if time.monotonic() - began < RESTART_PERIOD:
                    self._closing.wait(RESTART_PAUSE)

    def _start(self) -> dict[threading.Thread, Connection]:
        """Start a process; return the threads that serve it here, each with its pipe."""
        # Several: a STOP waits neither for the next picture nor for a frame to be read from a disk.
        cameras = self._controller.cameras
        pipes = [multiprocessing.Pipe() for _ in range(3 + len(cameras))]
        rpc_threads = {
            threading.Thread(
                target=serve_requests, args=(self._controller, parent_end), daemon=True
            ): parent_end
            for parent_end, _ in pipes
        }
        for thread in rpc_threads:
            thread.start()
        quick, slow, pulse, *camera_pipes = child_ends = [pipe for _, pipe in pipes]
        # A fork of this process would share the cameras, and threads that hold locks.
        self.process = self._context.Process(
            target=_serve_page,
            args=(
                quick,
                slow,
                pulse,
                dict(zip(cameras, camera_pipes, strict=True)),
                self._listener,
                self._controller.admission.key,
                self._names,
                self._gate_port,
            ),
            daemon=True,
        )
        self.process.start()
        for pipe in child_ends:
            pipe.close()
        return rpc_threads

    def _watch(self) -> str:
        """Wait until the process has ended or hangs, or this is closing; return why, or ""."""
        process, steering = self.process, self._controller.steering
        assert process is not None
        first = last_beats = steering.beats
        # Times, s, by this thread's periods: a standstill of the tracker does not count.
        silent = stopped = 0.0
        while not self._closing.is_set():
            if wait([process.sentinel], WATCH_PERIOD):
                process.join()
                code = process.exitcode or 0
                if self._closing.is_set():
                    return ""
                return f"was ended by {_signal_name(-code)}" if code < 0 else f"ended with {code}"
            stopped = stopped + WATCH_PERIOD if platforms.is_stopped(process.pid or 0) else 0.0
            if stopped > STOPPED_TIMEOUT:
                return f"was stopped by a signal {stopped:.0f} s ago"
            silent = silent + WATCH_PERIOD if last_beats == steering.beats else 0.0
            last_beats = steering.beats
            if silent > (STARTING_TIMEOUT if last_beats == first else FROZEN_TIMEOUT):
                return f"has not answered for {silent:.0f} s"
        return ""

    def _why_not_running(self) -> str:
        """Return what keeps the present process from going on, or ""."""
        process = self.process
        stopped = process is not None and platforms.is_stopped(process.pid or 0)
        return "was stopped by a signal" if stopped else ""

    def _end(self, rpc_threads: Mapping[threading.Thread, Connection]) -> None:
        """End the process, and all that waits for it."""
        assert self.process is not None
        # A stopped process would not receive a signal to terminate.
        if not platforms.is_stopped(self.process.pid or 0):
            self.process.terminate()
            self.process.join(EXIT_TIMEOUT if self._closing.is_set() else WATCH_PERIOD)
        if self.process.is_alive():
            self.process.kill()
            self.process.join(EXIT_TIMEOUT)
        for thread, pipe in rpc_threads.items():
            thread.join(EXIT_TIMEOUT)  # each ends as the other end is closed
            pipe.close()


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _serve_page(
    quick: Connection,
    slow: Connection,
    pulse: Connection,
    camera_pipes: Mapping[str, Connection],
    listener: socket.socket,
    key: LoginKey,
    names: Sequence[str],
    gate_port: int,
) -> None:
    """Serve the page until the tracker's process is no more; the page's process does no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the tracker's, who then ends this
    platforms.lower_priority(PAGE_NICENESS)
    from laptop.page import server
    from laptop.page.async_controller import AsyncController

    controller = AsyncController(quick, slow, camera_pipes)
    threading.Thread(
        target=server.serve,
        args=(controller, pulse, listener, key, names, gate_port),
        daemon=True,
    ).start()
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
