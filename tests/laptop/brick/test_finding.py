"""`find`: bricks that announce themselves by real mDNS, and which of them a command is for."""

import asyncio
import contextlib
import socket
import threading
import uuid

import pytest
from click.testing import CliRunner
from ssh_brick import SshBrick
from waiting import until
from zeroconf import DNSOutgoing, DNSPointer, ServiceInfo, Zeroconf, const

from laptop.brick import BrickProblem, choosing, finding
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.finding import FoundBrick
from laptop.cli.main import laptop

HOME = {"ev3dev.robot.home": "/home/robot"}


@contextlib.contextmanager
def announced(*services):
    """Announce (host, port, properties, kind) on the network, as avahi does."""
    network = Zeroconf()
    try:
        for host, port, properties, kind in services:
            name = f"{uuid.uuid4().hex[:12]}.{kind}._tcp.local."
            network.register_service(
                ServiceInfo(
                    f"{kind}._tcp.local.",
                    name,
                    addresses=[socket.inet_aton("127.0.0.1")],
                    port=port,
                    properties=properties,
                    server=f"{host}.local.",
                )
            )
        yield
    finally:
        network.close()


def found(names, count):
    """The bricks of these names, once so many are there."""

    def look():
        all_of_them = asyncio.run(finding.find())
        ours = [brick for brick in all_of_them if brick.name in names]
        return len(ours) >= count and (ours, all_of_them)

    return until(look, f"{count} bricks")


@pytest.mark.long
def test_a_brick_is_found_by_its_mark_or_name_and_nothing_else_is(ssh_brick):
    own, ev3, other = (uuid.uuid4().hex[:8] for _ in range(3))
    services = [
        (own, ssh_brick.port, HOME, "_sftp-ssh"),
        (f"ev3dev-{ev3}", 1, {}, "_ssh"),  # shows no key: nobody is there
        (other, ssh_brick.port, {}, "_ssh"),
    ]
    with announced(*services):
        ours, all_of_them = found({own, f"ev3dev-{ev3}"}, 2)
    marked, unmarked = sorted(ours, key=lambda brick: brick.name != own)
    assert marked.address == BrickAddress("127.0.0.1", ssh_brick.port)
    assert marked.key.startswith("SHA256:")
    assert unmarked.key == ""
    assert other not in {brick.name for brick in all_of_them}


@pytest.mark.long
def test_commands_find_it_by_name_and_tell_two_of_one_name_apart(ssh_brick, tmp_path):
    name = uuid.uuid4().hex[:8]
    user = ssh_brick.place.partition("@")[0]
    with announced((name, ssh_brick.port, HOME, "_sftp-ssh")):
        found({name}, 1)
        status, out, errors = ssh_brick.run("forget")  # nothing is known of it
        assert (status, "nothing is remembered" in errors) == (0, True), out
        done = ssh_brick.run("install", place=f"{user}@{name}")
        assert done[0] == 0, done
        assert (ssh_brick.home / "robot" / "driver.py").is_file()
        process = ssh_brick.command("find", place=None)
        listed, _ = process.communicate(timeout=300)
        line = next(line for line in listed.splitlines() if line.startswith(name))
        assert f"127.0.0.1:{ssh_brick.port}" in line
        assert "SHA256:" in line

        twin = SshBrick(tmp_path / "twin")
        with announced((name, twin.port, HOME, "_sftp-ssh")):
            found({name}, 2)
            status, _, errors = ssh_brick.run("install", place=f"{user}@{name}")
        twin.close()
    assert status == 1
    assert f"2 bricks are called {name}: say which by --brick 127.0.0.1:" in errors


BLUE = FoundBrick("blue", BrickAddress("10.42.0.3"), "announces itself", "SHA256:a")
RED = FoundBrick("red", BrickAddress("10.42.0.4"), "announces itself", "SHA256:b")


def chosen(monkeypatch, there, name=None):
    """Which brick is meant, and what was said."""

    async def find():
        return list(there)

    monkeypatch.setattr(finding, "find", find)
    said = []
    return asyncio.run(choosing.choose(name, Dialogue(said.append))), said


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))


def test_the_only_brick_needs_no_name_and_of_several_one_is_named(state, monkeypatch):
    address, said = chosen(monkeypatch, [BLUE])
    assert (address, said) == (BLUE.address, ["the brick is blue at 10.42.0.3"])
    with pytest.raises(BrickProblem, match="no brick is to be seen"):
        chosen(monkeypatch, [])
    with pytest.raises(BrickProblem, match="2 bricks are there; say which one: --brick NAME"):
        chosen(monkeypatch, [BLUE, RED])
    assert chosen(monkeypatch, [BLUE, RED], "red")[0] == RED.address
    assert chosen(monkeypatch, [RED], "anna@red")[0] == BrickAddress("10.42.0.4", user="anna")
    assert chosen(monkeypatch, [RED], "green")[0] == BrickAddress("green.local")


def test_the_last_brick_and_an_address_are_not_looked_for(state, monkeypatch):
    assert chosen(monkeypatch, [BLUE], "10.42.0.9")[0] == BrickAddress("10.42.0.9")
    choosing.remember(RED.address, Dialogue(print))
    assert chosen(monkeypatch, [BLUE])[0] == RED.address


def test_one_brick_on_two_ways_is_one_and_two_of_one_name_are_two():
    other_way = FoundBrick("blue", BrickAddress("fe80::1%usb0"), "announces itself", "SHA256:a")
    asked = FoundBrick("", BrickAddress("10.42.0.3"), "takes ssh on a cable", "SHA256:a")
    twin = FoundBrick("blue", BrickAddress("10.42.0.7"), "announces itself", "SHA256:c")
    assert finding._each_once([other_way, BLUE, asked, twin]) == [BLUE, twin]
    said = []
    finding.report([BLUE, twin], BLUE.address, said.append)
    assert said[0].endswith("SHA256:a  (the last one)")
    assert (
        "2 bricks are called blue: say which by --brick 10.42.0.3 or --brick 10.42.0.7" in said[2]
    )


def test_the_last_one_is_marked_whoever_logs_in():
    said = []
    finding.report([BLUE, RED], BrickAddress("10.42.0.3", user="anna"), said.append)
    assert [line.endswith("(the last one)") for line in said] == [True, False]


def test_copies_of_one_card_are_bricks_of_their_own():
    copies = [
        FoundBrick(name, BrickAddress(address), "announces itself", "SHA256:a")
        for name, address in (("ev3dev", "10.42.0.3"), ("ev3dev-2", "10.42.0.4"))
    ]
    by_cable = [
        FoundBrick("", BrickAddress(f"10.42.0.{k}"), "takes ssh on a cable", "SHA256:a")
        for k in (3, 5)
    ]
    found = finding._each_once(copies + by_cable)
    assert [str(brick.address) for brick in found] == ["10.42.0.3", "10.42.0.4", "10.42.0.5"]
    said = []
    finding.report(found, None, said.append)
    assert "several bricks have one key, so their cards are copies of one another" in said[-1]
    assert len(said) == 4
    far = FoundBrick("ev3dev-2", BrickAddress("192.168.0.4"), "announces itself", "SHA256:a")
    assert finding._each_once([copies[0], far]) == [copies[0], far]


def test_only_who_shares_a_network_over_a_cable_asks_all_in_it():
    assert len(list(finding._neighbours(["10.42.0.1"]))) == 253
    assert list(finding._neighbours(["192.168.2.17", "192.168.178.1", "127.0.0.1"])) == []


GHOSTS = 20


@contextlib.contextmanager
def ghosts():
    """Announce names for which nobody answers, some of them odd, again and again."""
    network = Zeroconf()
    over = threading.Event()

    def announce():
        while not over.wait(0.3):
            out = DNSOutgoing(const._FLAGS_QR_RESPONSE | const._FLAGS_AA)
            for k in range(GHOSTS):
                name = f"ghost{k}\x1b[2K\r{'x' * (k % 3)}._ssh._tcp.local."
                out.add_answer_at_time(
                    DNSPointer("_ssh._tcp.local.", const._TYPE_PTR, const._CLASS_IN, 4500, name), 0
                )
            network.send(out)

    thread = threading.Thread(target=announce)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        network.close()


@pytest.mark.long
def test_all_that_is_announced_is_asked_at_once(monkeypatch):
    waiting, all_asked = [], asyncio.Event()

    class NobodyAnswers:
        """Asks, and waits until all others ask, too."""

        def __init__(self, service, name):
            self.name = name

        async def async_request(self, network, timeout):
            if "ghost" in self.name:
                waiting.append(self.name)
                if len(waiting) >= GHOSTS:
                    all_asked.set()
                await asyncio.wait_for(all_asked.wait(), 60)
            return False

    monkeypatch.setattr(finding, "AsyncServiceInfo", NobodyAnswers)
    with ghosts():
        assert asyncio.run(finding._announced()) == []
    assert len(waiting) >= GHOSTS


def test_odd_names_of_others_make_no_line_of_their_own(monkeypatch):
    odd = FoundBrick("ev3\x1b[2K\r\nport A: fine", BrickAddress("10.0.0.9"), "announces itself")

    async def find():
        return [odd]

    monkeypatch.setattr(finding, "find", find)
    shown = CliRunner().invoke(laptop, ["brick", "find"])
    assert shown.exit_code == 0
    assert shown.output == (
        "ev3 [2K  port A: fine 10.0.0.9               announces itself, it shows no key\n"
    )
