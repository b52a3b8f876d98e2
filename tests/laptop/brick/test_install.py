"""`install`, over Debian's sshd: what is there afterwards, also when something goes wrong."""

import asyncio
import fcntl
import hashlib
import os
import shutil
import subprocess

import pytest
from places import ROOT
from ssh_brick import Proxy
from waiting import until

from laptop.brick import BrickProblem
from laptop.brick import install as installing
from laptop.brick.connection import Dialogue, connected, read_address
from laptop.brick.program_files import program_files, version_of

LONG = pytest.mark.long


def put(brick, clone=ROOT, port=None):
    """Install what lies in a clone; the lines that were said of it."""
    lines = []
    dialogue = Dialogue(lines.append)
    address = read_address(brick.place.replace(str(brick.port), str(port or brick.port)))

    async def talk():
        async with connected(address, dialogue) as connection:
            await installing.install(connection, address, dialogue)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(installing, "program_files", lambda: program_files(clone))
        asyncio.run(talk())
    return [line for line in lines if "first contact" not in line and "remembered" not in line]


def problem(brick, **options):
    """The line in which it is refused."""
    with pytest.raises(BrickProblem) as caught:
        put(brick, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def tree(folder):
    """Path -> mode and digest of each file in a folder, without what Python has compiled."""
    return {
        path.relative_to(folder).as_posix(): (
            path.stat().st_mode & 0o777,
            hashlib.sha256(path.read_bytes()).hexdigest(),
        )
        for path in folder.rglob("*")
        if path.is_file() and path.suffix != ".pyc" and path.name != installing.MANIFEST
    }


def wanted(clone=ROOT):
    """The same, as it should be on a brick."""
    return {name: (file.mode, file.digest) for name, file in program_files(clone).items()}


def program(brick):
    """The folder that counts."""
    return brick.home / ".brickservo" / "program"


def versions(brick):
    return sorted(os.listdir(brick.home / ".brickservo" / "versions"))


def grow(clone):
    """Let all of robot/ be other and longer, so that some 700 kB have to be sent."""
    for path in (clone / "robot").rglob("*.py"):
        path.write_bytes(path.read_bytes() + b"# " + os.urandom(10_000).hex().encode() + b"\n")


@pytest.fixture
def clone(tmp_path):
    """A checkout of one's own, to change."""
    folder = tmp_path / "clone"
    for room in ("robot", "shared"):
        shutil.copytree(ROOT / room, folder / room, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_only_what_has_changed_is_sent_and_python_starts_only_then(ssh_brick, clone):
    first = put(ssh_brick, clone)
    assert f"{len(wanted())} files are sent and compiled" in first[0]
    assert tree(program(ssh_brick)) == wanted(clone)
    modes = [(ssh_brick.home / "robot" / f"{name}.py").stat().st_mode for name in ("driver", "api")]
    assert [mode & 0o777 for mode in modes] == [0o755, 0o644]
    compiled = [path for path in program(ssh_brick).rglob("*.pyc") if path.stat().st_size]
    assert len(compiled) == len([name for name in wanted() if name.endswith(".py")])

    connections, starts = ssh_brick.connections, len(ssh_brick.python_starts)
    again = put(ssh_brick, clone)
    here = version_of(program_files(clone))
    assert f"{here} is there and here: nothing to do" in again[0]
    assert ssh_brick.connections == connections + 1
    assert len(ssh_brick.python_starts) == starts

    before = program(ssh_brick).resolve()
    with open(clone / "robot" / "driver.py", "a") as file:
        file.write("# changed\n")
    changed = put(ssh_brick, clone)
    assert "1 file is sent (robot/driver.py)" in changed[0]
    assert tree(program(ssh_brick)) == wanted(clone)
    assert tree(before)["robot/driver.py"] == wanted()["robot/driver.py"]  # the old one is whole
    unchanged = "robot/api.py"
    assert (before / unchanged).samefile(program(ssh_brick) / unchanged)
    assert len(ssh_brick.python_starts) == starts + 1


@pytest.mark.long
def test_a_cut_cable_leaves_the_old_program_whole(ssh_brick, clone):
    put(ssh_brick)
    old, before = versions(ssh_brick), tree(program(ssh_brick))
    grow(clone)
    proxy = Proxy(ssh_brick.port, most=300_000)  # half of the archive
    line = problem(ssh_brick, clone=clone, port=proxy.port)
    proxy.close()
    assert "the program there is whole" in line
    ssh_brick.wait_for_sessions()
    assert tree(program(ssh_brick)) == before
    until(lambda: versions(ssh_brick) == old, "the end of the other one, of which nothing is left")
    put(ssh_brick, clone)
    assert tree(program(ssh_brick)) == wanted(clone)


@LONG
@pytest.mark.parametrize("most", [3000, 15000, 25000, 100_000, 600_000])
def test_wherever_it_is_cut(ssh_brick, clone, most):
    put(ssh_brick)
    before = tree(program(ssh_brick))
    grow(clone)
    proxy = Proxy(ssh_brick.port, most=most)
    problem(ssh_brick, clone=clone, port=proxy.port)
    proxy.close()
    ssh_brick.wait_for_sessions()
    assert tree(program(ssh_brick)) == before


@LONG
def test_a_clone_of_windows_is_the_same_program(ssh_brick, clone):
    for path in clone.rglob("*.*"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
        path.chmod(0o666)
    assert "sent and compiled" in put(ssh_brick, clone)[0]
    assert tree(program(ssh_brick)) == wanted(ROOT)
    assert "nothing to do" in put(ssh_brick, ROOT)[0]


@LONG
def test_what_is_gone_here_is_removed_there_and_what_is_somebodys_own_stays(ssh_brick, clone):
    stale = clone / "robot" / "old_module.py"
    stale.write_text("print('stale')\n")
    put(ssh_brick, clone)
    mine = ssh_brick.home / "robot" / "my_own.py"
    mine.write_text("not Python\n")
    stale.unlink()
    lines = put(ssh_brick, clone)
    assert "1 file is removed (robot/old_module.py)" in lines[0]
    assert mine.read_text() == "not Python\n"
    assert not list(program(ssh_brick).rglob("old_module*"))
    assert "nothing to do" in put(ssh_brick, clone)[0]


@LONG
def test_what_was_spoilt_there_is_put_right(ssh_brick):
    put(ssh_brick)
    (ssh_brick.home / "robot" / "driver.py").chmod(0o644)
    (ssh_brick.home / "shared" / "ini.py").write_text("spoilt")
    (ssh_brick.home / "robot" / "clock.py").unlink()
    (ssh_brick.home / "brickservo-draw").unlink()
    lines = put(ssh_brick)
    assert "3 files are sent (robot/clock.py, robot/driver.py, shared/ini.py)" in lines[0]
    assert tree(program(ssh_brick)) == wanted()
    (ssh_brick.home / "robot").unlink()
    put(ssh_brick)
    assert (ssh_brick.home / "robot" / "clock.py").is_file()
    assert "nothing to do" in put(ssh_brick)[0]


@LONG
def test_folders_of_an_earlier_copy_are_renamed_and_never_deleted(ssh_brick):
    for name in ("robot", "shared", "robot.before-1"):
        (ssh_brick.home / name).mkdir()
        (ssh_brick.home / name / "mine.txt").write_text(name)
    lines = put(ssh_brick)
    assert "~/robot there was somebody's own: it is robot.before-2 now" in lines
    assert (ssh_brick.home / "robot.before-1" / "mine.txt").read_text() == "robot.before-1"
    assert (ssh_brick.home / "robot.before-2" / "mine.txt").read_text() == "robot"
    assert (ssh_brick.home / "shared.before-1" / "mine.txt").read_text() == "shared"
    assert (ssh_brick.home / "robot" / "driver.py").is_file()


@LONG
def test_old_versions_go_and_own_arms_stay(ssh_brick, clone):
    arms = ssh_brick.home / ".brickservo" / "arms"
    for k in range(4):
        (clone / "robot" / "clock.py").write_text(f"# {k}\n")
        put(ssh_brick, clone)
        (arms / f"{k}.ini").write_text("mine\n")
    assert len(versions(ssh_brick)) == 2  # this one, and the one before for what runs of it
    assert len(list(arms.iterdir())) == 4


@LONG
def test_two_computers_do_not_install_at_the_same_time(ssh_brick, clone):
    put(ssh_brick)
    (clone / "robot" / "clock.py").write_text("# other\n")
    with open(ssh_brick.home / ".brickservo" / "install.lock") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert "another computer is just installing there" in problem(ssh_brick, clone=clone)
    assert tree(program(ssh_brick)) == wanted()


@LONG
def test_a_computer_without_python_is_no_brick(ssh_brick):
    ssh_brick.take_python_away()
    assert "there is no python3, so its card is not one with ev3dev" in problem(ssh_brick)


@LONG
def test_a_full_card_leaves_the_old_program_whole(ssh_brick, clone):
    mount = ["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", str(ssh_brick.home)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a small file system stands for a full card, and only root may mount one")
    try:
        put(ssh_brick)
        before, old = tree(program(ssh_brick)), versions(ssh_brick)
        with open(ssh_brick.home / "film", "wb", buffering=0) as film:
            while film.write(bytes(1 << 20)) == 1 << 20:  # what there is room for is taken
                continue
        (clone / "robot" / "clock.py").write_text("# " + "long " * 9999)
        line = problem(ssh_brick, clone=clone)
        assert "its card is full" in line
        assert line.endswith(f"{version_of(program_files())} is there, as before")
        assert tree(program(ssh_brick)) == before
        assert versions(ssh_brick) == old
        (ssh_brick.home / "film").unlink()
        put(ssh_brick, clone)
        assert tree(program(ssh_brick)) == wanted(clone)
    finally:
        subprocess.run(["umount", "--lazy", str(ssh_brick.home)], check=True)


@pytest.mark.long
def test_a_card_that_gets_full_on_the_way_leaves_the_old_program_whole(ssh_brick, clone):
    """Also where no small file system can be had: what unpacks it there ends as on a full card."""
    put(ssh_brick)
    before, old = tree(program(ssh_brick)), versions(ssh_brick)
    (clone / "robot" / "clock.py").write_text("# other\n")
    tar = ssh_brick.folder / "bin" / "tar"
    tar.write_text('#!/bin/sh\n/usr/bin/tar "$@" && exec cat robot/clock.py >/dev/full\n')
    tar.chmod(0o755)
    line = problem(ssh_brick, clone=clone)
    assert "its card is full; delete files of yours there" in line
    assert line.endswith(f"{version_of(program_files())} is there, as before")
    assert (tree(program(ssh_brick)), versions(ssh_brick)) == (before, old)
    tar.unlink()
    put(ssh_brick, clone)
    assert tree(program(ssh_brick)) == wanted(clone)


def test_what_a_brick_tells_is_read_and_what_it_does_not_tell_is_skipped():
    text = "link robot .brickservo/program/robot\nfolder versions/0123-ab\nours robot/a b.py\n"
    text += "mode 755 robot/a b.py\nsum 99  ./robot/a b.py\nmode x y\nlast login: never\n\n"
    found = installing.parse_installed(text)
    assert found == installing.Installed(
        "versions/0123-ab", {"robot/a b.py"}, {"robot/a b.py": 0o755}, {"robot/a b.py": "99"},
        {"robot": ".brickservo/program/robot"},
    )  # fmt: skip
    assert found.version == "0123"
    assert installing.parse_installed("").version == ""
