"""`run`, over Debian's sshd on the emulated brick: its output and status, and how it is stopped."""

import csv
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios

import pytest
from ssh_brick import Proxy
from waiting import PATIENCE, until

from laptop.brick.running import PROGRAM, WATCH

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
    assert "there is no script nothing.py; give a file, or one of bench_brick.py, doctor" in errors


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
    summary = json.loads((brick.last_run / "summary.json").read_text())
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
    until(lambda: (ssh_brick.last_run / "summary.json").exists(), "the end of the line")
    cable.close()
    assert_stopped_in_mid_line(ssh_brick, 128 + signal.SIGHUP)


def test_a_watch_ends_its_own_program_though_another_has_begun_since():
    """Its laptop goes without a word, as one that falls asleep."""

    def begin(words, **places):
        return subprocess.Popen(["sh", "-c", words.format(**places)], stdin=subprocess.PIPE)

    programs = [begin(PROGRAM, token=token, command="cat") for token in ("first", "second")]
    watch = begin(WATCH, timeout=PATIENCE, token="first")
    try:
        for program in programs:  # each is what it becomes
            until(lambda number=program.pid: words_of(number) == b"cat\0", "the program")
        watch.stdin.close()
        assert programs[0].wait(PATIENCE) == -signal.SIGHUP
        assert watch.wait(PATIENCE) == 0
        assert programs[1].poll() is None
    finally:
        for process in (watch, *programs):
            process.kill()
            process.communicate()


def words_of(number):
    """The command line of a process."""
    with open(f"/proc/{number}/cmdline", "rb") as file:
        return file.read()


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


def test_a_reader_who_has_gone_is_not_a_cable_that_is_pulled(ssh_brick):
    for words in (("run", "driver.py", "--help"), ("doctor",)):
        reads, writes = os.pipe()
        os.close(reads)
        process = ssh_brick.command(*words, stdout=writes)
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
    (ssh_brick.folder / "bin" / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    here, there = pty.openpty()
    before = termios.tcgetattr(there)
    process = ssh_brick.command(
        "run", script, stdin=there, stdout=there, env={"TERM": "vt100"}, start_new_session=True
    )
    read = bytearray()

    def shows(words):
        while select.select([here], [], [], 0)[0]:
            read.extend(os.read(here, 4096))
        return words in read

    try:
        until(lambda: shows(b"ready\r\n"), "the script")
        os.write(here, b"ab\x7fc\r")  # with a correction
        until(lambda: shows(b"line 'ac\\n'\r\n"), "the line")
        os.write(here, b"\x03")
        until(lambda: shows(b"") and process.poll() is not None, "the end")
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 130, bytes(read)
    assert termios.tcgetattr(there) == before
    os.close(here)
    os.close(there)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_is_told_to_end_leaves_the_terminal_as_it_was(ssh_brick, number):
    here, there = pty.openpty()
    before = termios.tcgetattr(there)
    process = ssh_brick.command("shell", stdin=there, stdout=there, start_new_session=True)
    try:
        until(lambda: termios.tcgetattr(there) != before, "keys that go there one by one")
        process.send_signal(number)
        _, errors = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == -number, errors
    assert termios.tcgetattr(there) == before
    os.close(here)
    os.close(there)
