"""A connection to a brick: Debian's sshd, and where passwords are needed a server of asyncssh."""

import asyncio
import contextlib
import errno
import os
import socket
import threading

import asyncssh
import pytest
from ssh_brick import PasswordServer, Proxy

from laptop.brick import BrickProblem, choosing, connection, login_key
from laptop.brick.connection import BrickAddress, Dialogue, connected, read_address
from laptop.brick.known_hosts import KnownHosts

WRONG = "that was a wrong password"


class Person:
    """Somebody who reads all, and types these passwords."""

    def __init__(self, *passwords):
        self.read, self._passwords, self.asked = [], list(passwords), 0
        self.dialogue = Dialogue(self.read.append, self._type if passwords else None)

    def _type(self, prompt):
        self.asked += 1
        return self._passwords.pop(0)


def said(address, person, command="echo here"):
    """What a command says there."""

    async def talk():
        async with connected(address, person.dialogue) as brick:
            return (await brick.run(command)).stdout

    return asyncio.run(talk())


def refused(address, person=None, command="echo here"):
    """The line in which a connection is refused."""
    with pytest.raises(BrickProblem) as caught:
        said(address, person or Person(), command)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A laptop on which nobody has keys."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    return tmp_path


@contextlib.contextmanager
def password_server(password, folder):
    server = PasswordServer(password, folder)
    try:
        yield server
    finally:
        server.close()


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("ev3dev.local", BrickAddress("ev3dev.local")),
        ("anna@10.42.0.3:2222", BrickAddress("10.42.0.3", 2222, "anna")),
        ("[fe80::1%usb0]:2222", BrickAddress("fe80::1%usb0", 2222)),
        ("fe80::1%usb0", BrickAddress("fe80::1%usb0")),
    ],
)
def test_an_address_is_read_and_written(text, address):
    assert read_address(text) == address
    assert read_address(str(address)) == address


@pytest.mark.parametrize(
    "text", ["", "a b", "a:b", "a:0", "a:65536", "@a", "-x;y", "$(id)", "a:1:", "a/b"]
)
def test_what_is_no_address_is_refused(text):
    with pytest.raises(BrickProblem, match="is no brick's address"):
        read_address(text)


def test_a_first_key_is_shown_and_kept_and_another_one_is_refused(ssh_brick):
    address = read_address(ssh_brick.place)
    first, again = Person(), Person()
    assert said(address, first) == "here\n"
    key = asyncssh.read_private_key(str(ssh_brick.folder / "host_key"))
    known = ssh_brick.laptop / ".ssh" / "known_hosts"
    assert first.read == [
        f"first contact with {address}: its key is {key.get_fingerprint()}",
        f"it is remembered in {known}",
    ]
    assert said(address, again) == "here\n"
    assert again.read == []

    ssh_brick.renew_host_key()
    problem = refused(address)
    other = asyncssh.read_private_key(str(ssh_brick.folder / "host_key"))
    assert f"its key was {key.get_fingerprint()}, this one has {other.get_fingerprint()}" in problem
    assert f"brickservo brick forget --brick {address}" in problem
    choosing.forget(str(address), first.dialogue)
    assert first.read[-1] == f"forgotten of {address}: 1 key in {known}"
    assert said(address, again) == "here\n"
    assert again.read[0].startswith("first contact")


def test_without_a_home_folder_it_is_said_where_ssh_would_look(monkeypatch):
    def nobody(number):
        raise KeyError(number)

    monkeypatch.delenv("HOME")
    monkeypatch.setattr("pwd.getpwuid", nobody)
    for look in (KnownHosts, lambda: login_key._own_key(None)):
        with pytest.raises(BrickProblem) as failed:
            look()
        assert str(failed.value) == (
            "this computer tells of no home folder of yours, where ssh has its keys; set HOME to it"
        )


def test_other_keys_and_lines_stay_when_one_is_forgotten(tmp_path):
    file = tmp_path / "known_hosts"
    key = asyncssh.generate_private_key("ssh-ed25519").convert_to_public()
    other = (
        "# a note\nnot a line of ours\ngit.example.org ssh-ed25519 "
        + (key.export_public_key().decode().split()[1])
    )
    file.write_text(other)  # (and no newline at its end)
    known = KnownHosts(file)
    known.add("ev3dev.local", 22, key)
    known.add("10.42.0.3", 2222, key)
    assert known.keys_of("ev3dev.local", 22) == [key]
    assert known.keys_of("10.42.0.3", 22) == []
    assert known.forget("ev3dev.local", 22) == 1
    assert known.keys_of("ev3dev.local", 22) == []
    assert known.keys_of("10.42.0.3", 2222) == [key]
    assert known.forget("10.42.0.3", 2222) == 1
    assert file.read_text() == other + "\n"


def test_the_usual_password_is_tried_with_its_being_said_and_kept_nowhere(home):
    with password_server("maker", home) as server:
        person = Person()
        assert said(BrickAddress("127.0.0.1", server.port), person) == ""
    assert server.tried == [("robot", "maker")]
    assert "no ssh key lets in: trying ev3dev's usual password" in person.read
    stored = [path for path in home.rglob("*") if path.is_file() and b"maker" in path.read_bytes()]
    assert stored == []


def test_the_usual_password_is_for_the_usual_user_alone(home):
    with password_server("maker", home) as server:
        address = BrickAddress("127.0.0.1", server.port, "anna")
        assert "does not let anna in by your ssh keys; nobody can be asked" in refused(address)
    assert server.tried == []


def test_a_password_is_asked_for_and_a_wrong_one_is_wrong(home):
    with password_server("secret", home) as server:
        address = BrickAddress("127.0.0.1", server.port)
        problem = refused(address)
        assert "neither by your ssh keys nor by ev3dev's usual password" in problem
        assert problem.endswith(f"type once in a terminal: brickservo brick key --brick {address}")
        person = Person("wrong", "secret")
        assert said(address, person) == ""
        assert person.asked == 2
        assert person.read[-2:] == ["no ssh key lets in: trying ev3dev's usual password", WRONG]
        assert "wrong password for robot" in refused(address, Person("a", "b", "c", "d"))
        gives_up = Person(None)
        with pytest.raises(BrickProblem, match="stopped") as caught:
            said(address, gives_up)
        assert caught.value.status == 130


def test_a_brick_that_takes_keys_alone_is_told_from_one_that_takes_passwords(ssh_brick, home):
    problem = refused(BrickAddress("127.0.0.1", ssh_brick.port, "nobody-here"))
    assert (
        "does not let nobody-here in by your ssh keys, and takes no passwords; is nobody-here"
        in problem
    )


def test_a_way_that_is_not_there_is_told_by_the_system_s_reason():
    error = OSError(errno.ENETUNREACH, "Connect call failed ('10.42.0.3', 22)")
    line = connection.unreached(BrickAddress("10.42.0.3"), error)
    assert line.startswith("there is no way to 10.42.0.3: Network is unreachable; is the cable in")


def test_a_key_lets_in_from_now_on_and_stands_there_once(ssh_brick, home, monkeypatch):
    address, new = read_address(ssh_brick.place), home / "new"
    there = ssh_brick.home / ".ssh" / "authorized_keys"
    there.parent.mkdir()
    there.write_text("ssh-ed25519 somebody's")  # (and no newline at its end)

    async def trust(person):
        async with connected(address, person.dialogue) as brick:
            monkeypatch.setenv("HOME", str(new))  # of somebody who has no key yet
            await login_key.trust(brick, address, person.dialogue)

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(ssh_brick.laptop))
        person = Person()
        asyncio.run(trust(person))
    monkeypatch.setenv("HOME", str(new))
    file = new / ".ssh" / "id_ed25519"
    assert person.read[-2:] == [
        f"a key is made for this computer: {file}",
        f"{address} lets this computer in by {file} from now on, without a password",
    ]
    assert file.stat().st_mode & 0o777 == 0o600
    asyncio.run(trust(Person()))  # is let in by it
    lines = there.read_text().splitlines()
    assert lines == ["ssh-ed25519 somebody's", file.with_suffix(".pub").read_text().strip()]

    key = asyncssh.generate_private_key("ssh-ed25519")
    file.write_bytes(key.export_private_key("pkcs8-pem", passphrase="secret"))
    with pytest.raises(BrickProblem, match="a key with a passphrase is for your ssh"):
        login_key._own_key(person.dialogue)


def test_who_is_not_there_is_told_from_who_is_no_brick(home, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    assert "is there, but takes no ssh" in refused(BrickAddress("127.0.0.1", port))
    assert "nobody here knows no-brick.invalid" in refused(BrickAddress("no-brick.invalid"))

    def answer(listener, words):
        with listener.accept()[0] as sock:
            sock.sendall(words)
            if words:
                sock.recv(1)
                sock.recv(1 << 16)  # until the other side has had enough

    for words, problem in (
        (b"SSH-1.5-of long ago\r\n", "speaks no ssh that is understood here"),
        (b"", "took the connection and ended it"),
    ):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            thread = threading.Thread(target=answer, args=(listener, words))
            thread.start()
            assert problem in refused(BrickAddress("127.0.0.1", listener.getsockname()[1]))
            thread.join()


def test_keys_that_cannot_be_read_are_not_a_bricks_fault(home):
    (home / ".ssh" / "known_hosts").mkdir(parents=True)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        problem = refused(BrickAddress("127.0.0.1", listener.getsockname()[1]))
    assert problem.startswith(f"cannot read {home}/.ssh/known_hosts: Is a directory")


def test_a_brick_is_reached_by_the_addresses_that_this_computer_has(ssh_brick, monkeypatch):
    """A name may have one of IPv6, too."""
    address, real_socket = read_address(ssh_brick.place), socket.socket

    async def both(loop, host, port, **rest):
        ends = [("::1", port, 0, 0), ("127.0.0.1", port)]
        families = socket.AF_INET6, socket.AF_INET
        return [(f, socket.SOCK_STREAM, 6, "", end) for f, end in zip(families, ends, strict=True)]

    def without_ipv6(family=socket.AF_INET, *rest, **more):
        if family == socket.AF_INET6:
            raise OSError(errno.EAFNOSUPPORT, os.strerror(errno.EAFNOSUPPORT))
        return real_socket(family, *rest, **more)

    monkeypatch.setattr(asyncio.BaseEventLoop, "getaddrinfo", both)
    monkeypatch.setattr(socket, "socket", without_ipv6)
    assert said(address, Person()) == "here\n"


def test_who_does_not_answer_is_not_waited_for_forever(home, monkeypatch):
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", 0.2)
    with contextlib.ExitStack() as stack:
        full = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(3):  # so many wait at its door
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(full.getsockname())
        problem = refused(BrickAddress("127.0.0.1", full.getsockname()[1]))
    assert "does not answer within 0.2 s" in problem


def test_a_connection_that_is_cut_is_said_to_be(ssh_brick):
    proxy = Proxy(ssh_brick.port)
    address = read_address(ssh_brick.place.replace(str(ssh_brick.port), str(proxy.port)))

    async def talk():
        async with connected(address, Person().dialogue) as brick:
            process = await brick.create_process("echo begun; cat")
            assert await process.stdout.readline() == "begun\n"
            proxy.cut()
            await process.stdout.read()

    with pytest.raises(BrickProblem, match=r"the connection to .* is cut"):
        asyncio.run(talk())
    proxy.close()


def test_the_last_brick_is_remembered_and_what_is_spoilt_is_told(home):
    person = Person()
    assert choosing.last_brick() is None
    choosing.remember(BrickAddress("10.42.0.3"), person.dialogue)
    assert choosing.last_brick() == BrickAddress("10.42.0.3")
    choosing.forget(None, person.dialogue)
    assert person.read == ["forgotten of 10.42.0.3: that it was the last one"]
    assert choosing.last_brick() is None
    with pytest.raises(BrickProblem, match="no brick is remembered here"):
        choosing.forget(None, person.dialogue)
    (home / "state" / "brick").write_text("a b c")
    with pytest.raises(BrickProblem, match="delete it"):
        choosing.last_brick()
    choosing.remember(BrickAddress("10.42.0.3"), person.dialogue)
    assert person.read[-1].endswith(
        "delete it, and say which brick: --brick NAME; now it is replaced"
    )
    assert choosing.last_brick() == BrickAddress("10.42.0.3")


def test_a_state_folder_that_is_none_is_told_once(home):
    (home / "state").write_text("in the way")
    person = Person()
    choosing.remember(BrickAddress("10.42.0.3"), person.dialogue)
    assert person.read == [f"cannot remember 10.42.0.3: File exists: {home / 'state' / 'brick'}"]
    with pytest.raises(BrickProblem, match=r"cannot read .*: Not a directory; put that right, or"):
        choosing.last_brick()


def test_a_bare_name_is_looked_for_on_the_local_network():
    assert choosing.named("blue") == BrickAddress("blue.local")
    assert choosing.named("10.42.0.3") == BrickAddress("10.42.0.3")
    assert choosing.named("localhost:22") == BrickAddress("localhost")
