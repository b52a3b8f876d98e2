"""`run`, over Debian's sshd on the emulated brick: its output and status, and how it is stopped."""

import asyncio
import contextlib
import csv
import fcntl
import glob
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from pathlib import Path

import pytest
from run_json import run_in
from ssh_brick import Proxy
from waiting import PATIENCE, until

from laptop.brick import install as installing
from laptop.brick import running
from laptop.brick.connection import Dialogue, connected, read_address

LINE = "run", "driver.py", "line", "--speed", "0.5", "10,0", "5,10"
"""Twenty seconds of drawing, so that there is a middle."""


def test_a_script_runs_there_with_its_output_and_status(ssh_brick):
    status, out, errors = ssh_brick.run("run", "driver.py", "line", "10,0")
    assert status == 2
    assert out.startswith("driver.py: ")  # as on a terminal: there is one output
    assert "is installed" in errors
    assert ssh_brick.python_starts[-1] == "robot/driver.py line 10,0"


@pytest.mark.long
def test_scripts_are_found_by_path_name_and_file(ssh_brick, tmp_path):
    for script in ("robot/driver.py", "driver.py", "driver"):
        assert ssh_brick.run("run", script, "line", "10,0")[0] == 2
    mine = tmp_path / "my own.py"
    mine.write_bytes(
        b"import sys\r\nfrom robot.api import find_arm\r\n"
        b"print(sys.argv[1:], find_arm('planar'))\r\n"
        b"print('you typed', repr(sys.stdin.readline()))\r\nsys.exit(7)\r\n"
    )
    status, out, errors = ssh_brick.run("run", mine, "a b", "$HOME", "--help")
    assert status == 7, out + errors
    assert f"['a b', '$HOME', '--help'] {ssh_brick.home}" in out
    assert "you typed ''" in out  # there is nothing to type from
    status, _, errors = ssh_brick.run("run", "nothing.py")
    assert (status, errors.count("\n")) == (1, 1)
    assert "there is no script nothing.py here; give a file, or one of bench_brick.py, d" in errors


def test_a_script_that_is_not_there_is_told_before_the_brick_is_looked_for(ssh_brick):
    status, _, errors = ssh_brick.run("run", "nothing.py")
    assert (status, errors.count("\n")) == (1, 1)
    assert "there is no script nothing.py here" in errors
    assert ssh_brick.connections == 0


ENDS_BY_SIGHUP = """
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGHUP])  # it waits, however early it comes
open(sys.argv[1], "w").close()
print("ready", flush=True)
signal.sigwait([signal.SIGHUP])
open(sys.argv[1], "w").write("hung up")
sys.exit(129)
"""


@pytest.fixture
def waiting_script(ssh_brick, tmp_path):
    """A script that does nothing until it is hung up on; not even Ctrl-C ends it."""
    ssh_brick.use_plain_python()
    script = tmp_path / "waits.py"
    script.write_text(ENDS_BY_SIGHUP)
    return script


@pytest.mark.long
def test_the_third_ctrl_c_leaves_a_program_to_itself(ssh_brick, waiting_script, tmp_path):
    process = ssh_brick.command("run", waiting_script, tmp_path / "ended")
    assert process.stdout.readline() == "ready\n"
    for _ in range(3):
        process.send_signal(signal.SIGINT)
        # (Signals that come at the same time are one.)
        until(lambda: not pending(process.pid), "the signal's being taken")
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, errors
    assert "left to itself at the third Ctrl-C" in errors.splitlines()[-1]
    assert "is lost" not in errors
    ssh_brick.wait_for_sessions()
    assert (tmp_path / "ended").read_text() == "hung up"


def pending(number):
    """The signals that wait for a process, as the system shows them."""
    with open(f"/proc/{number}/status") as file:
        lines = dict(line.split(":\t") for line in file.read().splitlines() if ":\t" in line)
    return int(lines["SigPnd"], 16) | int(lines["ShdPnd"], 16)


@pytest.mark.long
def test_two_programs_at_once_are_each_stopped_where_the_laptop_falls_silent(
    ssh_brick, waiting_script, tmp_path, monkeypatch
):
    async def fall_silent(watch, dialogue):
        """Once both run; the end of what is said is a silence that need not be waited for."""
        while len(list(tmp_path.glob("ended-*"))) < 2:
            await asyncio.sleep(0.01)
        watch.stdin.write_eof()

    monkeypatch.setattr(running, "_beat", fall_silent)
    address, said = read_address(ssh_brick.place), []
    dialogue = Dialogue(said.append)

    async def run(k):
        async with connected(address, dialogue) as brick:
            return await running.run(
                brick, address, dialogue, str(waiting_script), (str(tmp_path / f"ended-{k}"),)
            )

    async def both():
        async with connected(address, dialogue) as brick:
            await running.update(brick, address, dialogue)
        return await asyncio.wait_for(asyncio.gather(run(1), run(2)), PATIENCE)

    assert asyncio.run(both()) == [129, 129]
    assert [path.read_text() for path in tmp_path.glob("ended-*")] == ["hung up", "hung up"]
    reported = [line for line in said if "heard nothing of this computer for 15 s" in line]
    assert len(reported) == 2
    ssh_brick.wait_for_sessions()


@pytest.mark.long
def test_a_version_stays_while_something_runs_of_it(ssh_brick, tmp_path, monkeypatch):
    ssh_brick.use_plain_python()
    script = tmp_path / "late.py"
    script.write_text(
        "import robot.clock\nprint('ready', flush=True)\ninput()\n"
        "import robot.motion.parking\nprint(robot.motion.parking.__file__)\n"
    )
    process = ssh_brick.command("run", script, stdin=-1)
    assert process.stdout.readline() == "ready\n", process.communicate()[1]
    before = (ssh_brick.home / ".brickservo" / "program").resolve()
    for k in range(3):
        files = running.program_files()
        files["robot/clock.py"] = type(files["robot/clock.py"])(b"# %d\n" % k)
        with monkeypatch.context() as patch:
            patch.setattr(installing, "program_files", lambda files=files: files)
            update(ssh_brick)
    out, errors = process.communicate("\n", timeout=PATIENCE)
    assert (process.returncode, out.strip()) == (0, str(before / "robot/motion/parking.py")), errors
    update(ssh_brick)
    assert not before.exists()  # once it is left


def update(brick):
    """Install what `program_files` gives."""
    address, dialogue = read_address(brick.place), Dialogue(lambda line: None)

    async def talk():
        async with connected(address, dialogue) as connection:
            await running.update(connection, address, dialogue)

    asyncio.run(talk())


@pytest.fixture
def drawing(ssh_brick):
    """Begins a slow line on the brick in real time, and waits for its middle."""
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    processes = []

    def begin(**options):
        processes.append(ssh_brick.command(*LINE, **options))
        until(lambda: ssh_brick.pen_samples() > 100, "the middle of the line")
        return processes[-1]

    yield begin
    for process in processes:
        process.kill()
        process.communicate()


def assert_stopped_in_mid_line(brick, status):
    """The arm was stopped in order, by what the emulator has seen of it."""
    brick.wait_for_sessions()
    summary = run_in(brick.last_run)
    assert summary["status"] == status
    assert not any(motor["driven"] for motor in summary["motors"].values())
    with open(brick.last_run / "trace.csv", newline="") as file:
        trace = [tuple(map(float, row.values())) for row in csv.DictReader(file)]
    drawn = [row[4] for row in trace if row[5]]
    assert 0 < max(drawn) - min(drawn) < 8  # of 10 cm in y
    still = [row[1:3] for row in trace[-20:]]  # 0.1 s
    assert max(abs(a - b) for q in still for a, b in zip(q, still[-1])) < 1e-3


@pytest.mark.long
def test_ctrl_c_stops_the_arm_and_its_end_is_waited_for(ssh_brick, drawing):
    process = drawing()
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, out + errors
    assert "driver.py: stopped by SIGINT" in out
    assert_stopped_in_mid_line(ssh_brick, 130)


@pytest.mark.long
def test_a_cable_that_is_pulled_in_mid_line_stops_the_arm(ssh_brick, drawing):
    cable = Proxy(ssh_brick.port)
    process = drawing(place=ssh_brick.by_way_of(cable))
    cable.cut()
    out, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1
    assert "is lost; the program there is asked to stop the arm" in errors
    assert_stopped_in_mid_line(ssh_brick, 128 + signal.SIGHUP)
    cable.close()


@pytest.mark.long
def test_a_laptop_that_is_killed_stops_the_arm(ssh_brick, drawing):
    drawing().kill()
    assert_stopped_in_mid_line(ssh_brick, 128 + signal.SIGHUP)


@pytest.mark.long
def test_a_laptop_that_falls_asleep_stops_the_arm(ssh_brick, drawing):
    """Nothing tells the brick that the other side is gone, but the watch."""
    cable = Proxy(ssh_brick.port)
    drawing(place=ssh_brick.by_way_of(cable))
    cable.fall_silent()
    until(lambda: (ssh_brick.last_run / "run.json").exists(), "the end of the line")
    cable.close()
    assert_stopped_in_mid_line(ssh_brick, 128 + signal.SIGHUP)


def test_a_watch_ends_its_own_program_though_another_has_begun_since(tmp_path):
    """Its laptop goes without a word, as one that falls asleep."""

    (tmp_path / ".brickservo" / "program").mkdir(parents=True)
    environment = {**os.environ, "HOME": str(tmp_path)}

    def begin(args, **places):
        command = ["sh", "-c", args.format(**places)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, env=environment)

    programs = [
        begin(running.PROGRAM, token=token, before="", command="cat")
        for token in ("first", "second")
    ]
    watch = begin(running.WATCH, timeout=PATIENCE, token="first", asked=running.ASKED_STATUS)
    try:
        for program in programs:  # each is what it becomes
            until(lambda number=program.pid: words_of(number) == b"cat\0", "the program")
        watch.stdin.close()
        assert programs[0].wait(PATIENCE) == -signal.SIGHUP
        assert watch.wait(PATIENCE) == running.ASKED_STATUS
        assert programs[1].poll() is None
    finally:
        for process in (watch, *programs):
            process.kill()
            process.communicate()


def words_of(number):
    """The command line of a process."""
    with open(f"/proc/{number}/cmdline", "rb") as file:
        return file.read()


@pytest.mark.long
def test_a_program_without_its_watch_is_said_to_be_and_keeps_its_status(ssh_brick, tmp_path):
    script = tmp_path / "waits.py"
    script.write_text("import sys\nprint('ready', flush=True)\nsys.exit(len(input()))\n")
    (ssh_brick.folder / "bin" / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    process = ssh_brick.command("run", script, stdin=subprocess.PIPE)
    assert process.stdout.readline() == "ready\n"
    watches = [number for number in ssh_brick.running() if b"read -r -t" in words_of(number)]
    for number in watches:
        os.kill(number, signal.SIGKILL)
    until(lambda: not set(watches) & set(ssh_brick.running()), "the watch's end")
    out, errors = process.communicate("seven!!\n", timeout=PATIENCE)
    assert process.returncode == 7, out + errors


@pytest.mark.long
def test_a_reader_who_has_gone_is_not_a_cable_that_is_pulled(ssh_brick):
    for args in (("run", "driver.py", "--help"), ("doctor",)):
        reads, writes = os.pipe()
        os.close(reads)
        process = ssh_brick.command(*args, stdout=writes)
        os.close(writes)
        _, errors = process.communicate(timeout=PATIENCE)
        assert "connection to" not in errors
        assert process.returncode == 141, errors


@pytest.mark.long
def test_keys_go_there_one_by_one_and_the_terminal_is_as_before(ssh_brick, tmp_path):
    script = tmp_path / "keys.py"
    script.write_text(
        "import sys\nprint('ready')\nprint('line', repr(sys.stdin.readline()))\n"
        "sys.stdin.readline()\n"
    )
    ssh_brick.use_plain_python()
    terminal = Terminal()
    before = termios.tcgetattr(terminal.inside)
    process = ssh_brick.command("run", script, **terminal.options)
    try:
        until(lambda: terminal.shows(b"ready\r\n"), "the script")
        terminal.type(b"ab\x7fc\r")  # with a correction
        until(lambda: terminal.shows(b"line 'ac\\n'\r\n"), "the line")
        terminal.type(b"\x03")
        until(lambda: terminal.shows(b"") and process.poll() is not None, "the end")
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 130, bytes(terminal.read)
    assert termios.tcgetattr(terminal.inside) == before
    terminal.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_is_told_to_end_leaves_the_terminal_as_it_was(ssh_brick, number):
    terminal = Terminal()
    before = termios.tcgetattr(terminal.inside)
    process = ssh_brick.command("shell", **terminal.options)
    try:
        until(lambda: termios.tcgetattr(terminal.inside) != before, "keys that go there one by one")
        process.send_signal(number)
        _, errors = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 128 + number, errors
    assert termios.tcgetattr(terminal.inside) == before
    terminal.close()


SHOWS_ITS_SIZE = """
import os, signal, sys
def show():
    size = os.get_terminal_size()
    print(size.columns, "by", size.lines, flush=True)
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGWINCH])  # it waits, however early it comes
show()
signal.sigwait([signal.SIGWINCH])
show()
sys.exit(4)
"""


@pytest.mark.long
def test_a_window_that_is_resized_is_resized_there(ssh_brick, tmp_path):
    ssh_brick.use_plain_python()
    script = tmp_path / "size.py"
    script.write_text(SHOWS_ITS_SIZE)
    terminal = Terminal(columns=90, lines=30)
    process = ssh_brick.command("run", script, **terminal.options)
    try:
        until(lambda: terminal.shows(b"90 by 30\r\n"), "its size")
        terminal.resize(columns=132, lines=40)
        process.send_signal(signal.SIGWINCH)  # as the system does where it is its own terminal
        until(lambda: terminal.shows(b"132 by 40\r\n"), "the other size")
        until(lambda: terminal.shows(b"") and process.poll() is not None, "the end")
    finally:
        process.kill()
        process.communicate()
        terminal.close()
    assert process.returncode == 4, bytes(terminal.read)


class Terminal:
    """A window that somebody types in."""

    def __init__(self, columns=80, lines=24):
        self._here, self.inside = pty.openpty()
        self.resize(columns, lines)
        self.read = bytearray()

    @property
    def options(self):
        """For a command that runs in it."""
        ends = dict.fromkeys(("stdin", "stdout"), self.inside)
        return {**ends, "env": {"TERM": "vt100"}, "start_new_session": True}

    def resize(self, columns, lines):
        size = struct.pack("HHHH", lines, columns, 0, 0)
        fcntl.ioctl(self.inside, termios.TIOCSWINSZ, size)

    def shows(self, args):
        """Whether it has shown these words so far."""
        while select.select([self._here], [], [], 0)[0]:
            self.read.extend(os.read(self._here, 4096))
        return args in self.read

    def type(self, keys):
        os.write(self._here, keys)

    def close(self):
        os.close(self._here)
        os.close(self.inside)


@pytest.mark.parametrize(
    ("script", "args", "code", "left"),
    [
        ("robot/visual_servoing.py", (), "OWN", ()),
        ("robot/visual_servoing.py", (":7712", "--wait"), "OWN", (":7712", "--wait")),
        ("robot/visual_servoing.py", ("--wait",), "OWN", ("--wait",)),
        ("robot/visual_servoing.py", ("192.168.0.7",), None, ("192.168.0.7",)),
        ("robot/visual_servoing.py", ("a", "--code", "TYPED"), "TYPED", ("a",)),
        ("robot/visual_servoing.py", ("--code=TYPED", "--wait"), "TYPED", ("--wait",)),
        ("robot/tracking_client.py", (), "OWN", ()),
        ("robot/driver.py", ("check", "--camera"), "OWN", ("check", "--camera")),
        ("robot/driver.py", ("check", "10.0.0.2"), None, ("check", "10.0.0.2")),
        (
            "robot/driver.py",
            ("check", "--camera", "10.0.0.2"),
            None,
            ("check", "--camera", "10.0.0.2"),
        ),
        ("robot/visual_servoing.py", ("--wait", "10.0.0.2"), None, ("--wait", "10.0.0.2")),
        ("robot/visual_servoing.py", ("--arm", "mine"), "OWN", ("--arm", "mine")),
        ("robot/visual_servoing.py", ("--arm", "mine", "a"), None, ("--arm", "mine", "a")),
        ("robot/visual_servoing.py", ("a", "--cod", "TYPED"), "TYPED", ("a",)),
        ("robot/visual_servoing.py", ("--code",), "OWN", ("--code",)),
        ("robot/driver.py", ("line", "10,0"), None, ("line", "10,0")),
        ("", ("--code", "x"), None, ("--code", "x")),
    ],
)
def test_the_code_that_a_script_may_need_leaves_its_words(monkeypatch, script, args, code, left):
    monkeypatch.delenv("BRICKSERVO_CODE", raising=False)
    assert running.code_for(script, args, "OWN") == (code, left)


def test_a_code_in_the_environment_is_ahead_of_ones_own(monkeypatch):
    monkeypatch.setenv("BRICKSERVO_CODE", "TOLD")
    servo = "robot/visual_servoing.py"
    assert running.code_for(servo, ("a",), "OWN") == ("TOLD", ("a",))
    assert running.code_for(servo, ("--code", "TYPED"), "OWN") == ("TYPED", ())


def test_codes_that_nobody_took_are_swept_away_and_no_others(tmp_path):
    folder = tmp_path / ".brickservo"
    folder.mkdir()
    for name, age in (("code-1", 300), ("code-2", 0), ("arm.json", 300)):
        (folder / name).write_text("ABCD")
        then = time.time() - age
        os.utime(folder / name, (then, then))
    subprocess.run(["sh", "-c", running.SWEEP_CODES], cwd=tmp_path, check=True)
    assert sorted(file.name for file in folder.iterdir()) == ["arm.json", "code-2"]


@pytest.mark.long
def test_the_code_is_in_no_command_line(ssh_brick):
    """Neither here nor on the brick: its processes are looked at all the time."""
    seen, over = set(), threading.Event()

    def look():
        while not over.is_set():
            for process in glob.glob("/proc/[0-9]*/cmdline"):
                with contextlib.suppress(OSError):
                    seen.add(Path(process).read_bytes())

    looking = threading.Thread(target=look)
    looking.start()
    reported = {"BRICKSERVO_CODE": "ABCD-EFGH-JKMN"}
    args = ("run", "visual_servoing.py", ":9", "--budget", "2")
    _, out, errors = ssh_brick.run(*args, env=reported)
    over.set()
    looking.join()
    assert any(b"visual_servoing.py\x00:9" in args for args in seen)
    assert not [args for args in seen if b"ABCD-EFGH" in args or b"ABCDEFGH" in args]
    assert "pairing" not in out + errors  # it had the code, and found nobody there
    assert not list((ssh_brick.home / ".brickservo").glob("code-*"))
