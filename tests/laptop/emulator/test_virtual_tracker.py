"""The real link in virtual time: a frame's way from its exposure to the program, and its faults.

The oracle is when the frame was asked for, and where the emulated arm truly was then.
"""

import contextlib
import math
import os
import queue
import random
import signal
import socket
import threading
import time

import pytest

from laptop.emulator import virtual_tracker
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World
from laptop.emulator.virtual_tracker import HOST, LINK_TIMEOUT, FrameChain, VirtualTracker
from laptop.see.serve.server import TrackingServer
from robot import tracking_client
from robot.tracking import MAX_PAUSE, MIN_PAUSE
from robot.tracking_client import Memory, ServerAddress
from shared.arm_description import find_arm, read_arm
from shared.link import SILENCE_TIMEOUT
from shared.peer_clock import FAST_PING

ARM = read_arm(find_arm("planar"))
WATCHER = """
import os
from robot.clock import Clock
from robot.tracking_client import TrackingClient

clock = Clock()
client = TrackingClient(os.environ["HOST"], int(os.environ["PORT"]), os.environ["CODE"], clock)
end = clock.now() + 3.0
while clock.now() < end:
    for seen in client.poll(0.5).values():
        print(seen.seq, seen.t, clock.now())
    clock.sleep(0.02)
client.close()
"""


class Watched:
    """A world with a tracker, and when each frame was taken."""

    def __init__(self, cameras=("A",), seed=0, **chain):
        self.world = World()
        self.taken = {}
        self.tracker = VirtualTracker(self.world, self.see, FrameChain(**chain), cameras, seed)

    def see(self, camera, index, t):
        assert self.world.now() == t
        self.taken[camera, index] = t
        return {"effector": (100.0 + index, 50.5, 0.9), "goal": None}

    def look(self, client, seconds, timeout=0.05):
        """What the client sees for so long: a list of (observation, when it was read)."""
        seen = []
        end = self.world.now() + seconds
        while self.world.now() < end:
            seen += [(one, self.world.now()) for one in client.poll(timeout).values()]
        return seen


@pytest.fixture
def watched():
    made = []

    def make(**options):
        made.append(Watched(**options))
        return made[-1]

    yield make
    for one in made:
        one.tracker.close()


def until(condition, client, world, limit):
    """Look until something is so; how long it took, s."""
    start = world.now()
    while not condition():
        assert world.now() < start + limit, f"not within {limit} s: {client.why}"
        client.poll(0.01)
    return world.now() - start


# Time


@pytest.mark.short(every=3)
@pytest.mark.parametrize("latency", [0.03, 0.12, 0.25, 0.4])
@pytest.mark.parametrize(("jitter", "drops"), [(0.0, 0.0), (0.005, 0.1)])
def test_an_observation_is_dated_right_and_comes_not_before_its_time(
    watched, latency, jitter, drops
):
    world = watched(latency=latency, jitter=jitter, drops=drops, seed=3)
    client = world.tracker.client()
    seen = world.look(client, 6.0)
    assert len(seen) > (165 if drops == 0 else 130)
    assert client.round_trip <= 0.002
    for one, read in seen:
        taken = world.taken["A", one.seq]
        assert one.t == pytest.approx(taken, abs=0.001)
        assert one.markers == {"effector": (100.0 + one.seq, 50.5, 0.9), "goal": None}
        assert read >= taken + latency
        if jitter == 0:
            assert read == pytest.approx(taken + latency, abs=0.001)
    numbers = [one.seq for one, _ in seen]
    assert numbers == sorted(set(numbers))
    lost = 1 - len(seen) / (numbers[-1] - numbers[0] + 1)
    assert lost == 0 if drops == 0 else 0.03 < lost < 0.2


def test_two_runs_are_alike_and_another_seed_is_not(watched):
    def run(seed):
        world = watched(jitter=0.02, drops=0.3, cameras=("A", "B"), seed=seed)
        client = world.tracker.client()
        return [
            world.look(client, 0.7),
            world.tracker.cut(),
            world.look(client, 1.0, timeout=0.007),
            sorted(world.taken.items()),
        ]

    first = run(1)
    assert run(1) == first
    assert run(2) != first


class LateLoopback:
    """A busy system: what is sent in this process arrives up to 4 ms of the wall's clock later."""

    def __init__(self, monkeypatch):
        self._send, self._queue, self._rng = socket.socket.send, queue.Queue(), random.Random(1)
        self.sent = 0
        thread = threading.Thread(target=self._hand_over, daemon=True)
        monkeypatch.setattr(
            socket.socket, "send", lambda *args: self._send_later(*args), raising=False
        )
        thread.start()

    def _send_later(self, sock, data, *flags):
        self.sent += 1
        self._queue.put((self._rng.uniform(0, 0.004), sock.dup(), bytes(data)))
        return len(data)

    def _hand_over(self):
        while True:
            late, sock, data = self._queue.get()
            time.sleep(late)
            with sock, contextlib.suppress(OSError):  # nobody is there any more
                self._send(sock, data)


def test_a_busy_computer_makes_no_difference(watched, monkeypatch):
    def run():
        world = watched(jitter=0.02, drops=0.3, cameras=("A", "B"), seed=1)
        client = world.tracker.client()
        seen = world.look(client, 0.7)
        world.world.sleep(0.02)  # nothing is on its way to the tracker
        world.tracker.cut()
        return [seen, world.look(client, 1.0, timeout=0.007), client.counters]

    idle = run()
    busy = LateLoopback(monkeypatch)
    assert run() == idle
    assert busy.sent > 60


def test_frames_keep_their_order_and_cameras_their_own_time(watched):
    world = watched(fps=50.0, jitter=0.1, cameras=("A", "B"), seed=5)
    client = world.tracker.client()
    seen = world.look(client, 3.0)
    assert client.counters["out_of_sequence"] == 0
    for camera in "AB":
        times = [one.t for one, _ in seen if one.camera == camera]
        assert len(times) > 20
        assert times == sorted(times)
        steps = {
            round(world.taken[camera, k + 1] - world.taken[camera, k], 9)
            for k in range(world.tracker.frames[camera] - 1)
        }
        assert steps == {0.02}
    assert 0.001 < abs(world.taken["A", 0] - world.taken["B", 0]) < 0.02


def test_a_frame_in_which_nothing_is_found_out_is_not_published(watched):
    world = watched()
    world.tracker.see = lambda camera, index, t: {"goal": None} if index % 3 else None
    seen = world.look(world.tracker.client(), 1.0)
    assert len(seen) > 15
    assert all(one.seq % 3 for one, _ in seen)


def test_who_looks_without_waiting_gets_the_newest_and_the_link_lasts(watched):
    """So does a control loop: it looks every few ms and waits elsewhere."""
    world = watched()
    client = world.tracker.client()
    ages = []
    while world.world.now() < 5.0:
        world.world.sleep(0.012)
        ages += [world.world.now() - one.t for one in client.poll().values()]
    assert client.linked
    assert len(ages) > 140
    assert max(ages) <= 0.06 + 0.015


def test_the_example_shows_the_arm_where_it_truly_was():
    lines = virtual_tracker.__doc__.splitlines()
    names = {}
    exec("\n".join(line[4:] for line in lines if line.startswith("    ") or not line), names)
    before, after, world = names["before"], names["after"], names["rig"].world
    rows = names["rig"].record  # one per 5 ms
    for seen in (before, after):
        near = rows[int(200 * seen.t) : int(200 * seen.t) + 2]
        (u0, v0), (u1, v1) = ((320 + 12 * row.x, 400 - 12 * row.y) for row in near)
        u, v, _ = seen.markers["effector"]
        assert min(u0, u1) - 0.01 <= u <= max(u0, u1) + 0.01
        assert min(v0, v1) - 0.01 <= v <= max(v0, v1) + 0.01
    assert math.dist(before.markers["effector"][:2], after.markers["effector"][:2]) > 50
    assert 0.06 <= world.now() - after.t < 0.1


# Programs


@pytest.fixture
def run(tmp_path_factory, monkeypatch, capsys):
    """Run a program beside a tracker: the outcome, what it said, stderr, when frames were taken."""

    def run(script, args=(), **options):
        world = World()
        brick = EmulatedBrick(world, ARM)
        taken = {}

        def see(camera, index, t):
            taken[index] = t
            return {"effector": (100.0, 50.5, 0.9), "goal": None}

        with VirtualTracker(world, see) as tracker:
            state = {"PORT": str(tracker.port), "CODE": tracker.code, "HOST": HOST}
            state["BRICKSERVO_STATE"] = str(tmp_path_factory.mktemp("state"))
            for name, value in state.items():
                monkeypatch.setenv(name, value)
            address = ServerAddress(HOST, tracker.port, tracker.code)
            Memory(state["BRICKSERVO_STATE"]).save(address, tracker.key)
            outcome = run_script(brick, script, [arg.format(**state) for arg in args], **options)
        out, err = capsys.readouterr()
        return outcome, out.splitlines(), err, taken

    return run


def test_a_program_sees_the_same_in_every_run(run, tmp_path, monkeypatch):
    script = tmp_path / "watcher.py"
    script.write_text(WATCHER)
    outcome, lines, err, taken = run(str(script))
    assert (outcome.status, err) == (0, "")
    assert lines[0].startswith("linked to")
    assert len(lines) > 80
    for line in lines[1:]:
        number, t, read = line.split()
        # The first ping meets a program that is busy with what it does for the first time.
        # Later ones are signed and checked before they are answered, but after they were read.
        known = 0.0015 if float(read) > float(lines[1].split()[2]) + FAST_PING else 0.025
        assert float(t) - UPTIME - outcome.start == pytest.approx(taken[int(number)], abs=known)
        assert 0.06 - known <= float(read) - float(t) < 0.1
    again = run(str(script))[1]
    assert again[1:] == lines[1:]  # but for the port
    LateLoopback(monkeypatch)
    on_busy = run(str(script))[1]
    assert on_busy[1:] == lines[1:]


def test_the_client_on_the_brick_runs_as_it_is_and_heeds_a_signal(run):
    place = ["{HOST}:{PORT}", "--code", "{CODE}"]
    outcome, lines, err, _ = run(tracking_client.__file__, place, signals=[(2.0, signal.SIGTERM)])
    assert outcome.t == pytest.approx(2.0, abs=0.01)
    assert outcome.status != 0
    assert err == "tracking_client.py: stopped by SIGTERM\n"
    assert sum("effector 100.00,50.50 px (0.90)" in line for line in lines) > 15


# Faults


def test_a_cut_link_is_noticed_at_once_and_comes_back(watched):
    world = watched()
    printed = []
    client = world.tracker.client(say=printed.append)
    world.look(client, 0.5)
    world.world.sleep(0.02)  # nothing is on its way to the tracker
    world.tracker.cut()
    cut = world.world.now()
    assert client.poll(1.0) == {}
    assert not client.linked
    assert world.world.now() - cut < 0.001
    assert "reset" in printed[-1]
    back = until(lambda: client.linked, client, world.world, 1.0)
    assert MIN_PAUSE <= back < MIN_PAUSE + 0.05
    assert len(world.look(client, 0.5)) >= 12
    assert "cut" in world.tracker.server.state().lost


def test_a_silent_tracker_is_given_up_after_two_seconds_and_comes_back(watched):
    world = watched()
    client = world.tracker.client()
    world.look(client, 0.5)
    world.tracker.silence(4.0)
    start = world.world.now()
    silent = until(lambda: not client.linked, client, world.world, 3.0)
    assert SILENCE_TIMEOUT - 0.5 <= silent <= SILENCE_TIMEOUT + 0.1
    assert "nothing heard for 2.0 s" in client.why
    assert world.look(client, start + 3.99 - world.world.now()) == []
    until(lambda: client.linked, client, world.world, SILENCE_TIMEOUT + MAX_PAUSE)
    seen = world.look(client, 0.5)
    assert len(seen) >= 12
    assert min(one.t for one, _ in seen) > start + 4.0 - 0.06


def test_nobody_links_to_a_silent_tracker_and_nobody_waits_for_it_for_ever(watched):
    world = watched()
    world.tracker.silence()
    client = world.tracker.client()
    assert not client.linked
    assert world.world.now() == pytest.approx(LINK_TIMEOUT, abs=0.02)


@pytest.mark.parametrize("rate", [100, 20000])
def test_a_line_that_the_tracker_did_not_sign_ends_the_link_which_comes_back(watched, rate):
    world = watched()
    client = world.tracker.client()
    assert len(world.look(client, 1.0)) >= 29
    world.tracker.flood(rate)
    until(lambda: not client.linked, client, world.world, 0.1)
    assert client.why.endswith("a message was changed or repeated on the way")
    world.tracker.flood(0)
    until(lambda: client.linked, client, world.world, 1.0)
    assert len(world.look(client, 0.5)) >= 12
    assert client.counters["bad"] == 0


def test_a_tracker_that_is_restarted_is_found_again(watched):
    world = watched()
    client = world.tracker.client()
    before = world.tracker.server
    world.tracker.restart(1.5)
    is_unlinked = until(lambda: not client.linked, client, world.world, 0.1)
    assert is_unlinked < 0.01
    assert "the tracker has ended" in client.why
    world.look(client, 1.0)
    assert "cannot reach" in client.why
    back = until(lambda: client.linked, client, world.world, 5.0)
    assert back < 0.5 + MAX_PAUSE
    assert world.tracker.server is not before
    assert len(world.look(client, 0.5)) >= 12


def test_while_a_tracker_is_away_nobody_else_gets_its_port(watched):
    tracker = watched().tracker
    tracker.restart(1.0)
    with socket.socket() as other, pytest.raises(OSError, match="in use"):
        other.bind((HOST, tracker.port))


# The end


def descriptors():
    return sorted(int(name) for name in os.listdir("/dev/fd"))


def test_closing_leaves_no_socket_open(watched):
    before = descriptors()
    for fault in ("none", "cut", "silence", "restart"):
        world = watched()
        clients = [world.tracker.client() for _ in range(2)]
        assert clients[0].linked
        assert len(descriptors()) > len(before)
        if fault == "restart":
            world.tracker.restart(1.0)
            clients[0].poll(0.01)
        elif fault != "none":
            getattr(world.tracker, fault)()
        world.tracker.close()
        world.tracker.close()
        assert descriptors() == before
        frames = dict(world.tracker.frames)
        world.world.sleep(3.0)
        assert world.tracker.frames == frames
        assert world.world.select is None
        assert descriptors() == before
    with TrackingServer(HOST, world.tracker.port, "ABCDEFGHJKMN", threaded=False):
        pass  # the port is free again
