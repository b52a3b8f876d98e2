"""What is kept here of the runs on bricks, and how much of it."""

import os

import pytest

from laptop.brick import run_log
from laptop.brick.connection import BrickAddress
from laptop.brick.run_log import BrickRunLog, is_of, stored_runs

BLUE = BrickAddress("10.42.0.3")


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    return tmp_path


def stored_log(*args, output=(), status=0, error=None):
    """The text that is kept of one run, and what was said."""
    said = []
    try:
        with BrickRunLog(BLUE, args, said.append) as log:
            for data in output:
                log.add(data)
            if error:
                raise error
            log.status = status
    except type(error):
        pass
    return stored_runs()[-1].read_text(), said


def test_a_run_is_kept_with_command_output_and_status():
    text, said = stored_log(
        "driver.py", "line", "10,0", "a b", output=[b"one\r", b"\ntwo\r\n"], status=2
    )
    first, second, *rest = text.splitlines()
    assert first == "brickservo brick run driver.py line 10,0 'a b'"
    assert second.startswith("on 10.42.0.3, 20")
    assert rest[:4] == ["", "one", "two", ""]
    assert rest[4].startswith("ended after ")
    assert rest[4].endswith(" s: status 2")
    assert said == []
    assert stored_runs()[-1].name.endswith("-driver.txt")


def test_what_ended_a_run_is_kept_too():
    text, _ = stored_log("driver.py", output=[b"half\n"], error=ValueError("the cable is cut"))
    assert "half\n\nended after " in text
    assert text.endswith(" s: the cable is cut\n")


@pytest.mark.parametrize("args", [("--code", "ABCD-EFGH-JKMN"), ("--code=ABCD-EFGH-JKMN",)])
def test_the_pairing_code_is_not_kept(args):
    text, _ = stored_log("visual_servoing.py", *args, "--wait")
    assert "ABCD" not in text
    assert "--code" in text
    assert "--wait" in text


def test_of_a_long_run_the_beginning_and_the_end_are_kept():
    text, _ = stored_log("a.py", output=[b"begin " + bytes(1 << 20), b"x" * (1 << 20), b" end"])
    assert len(text) < run_log.MAX_HEAD + run_log.MAX_TAIL + 1000
    assert "begin" in text
    left_out = 6 + (1 << 21) + 4 - run_log.MAX_HEAD - run_log.MAX_TAIL
    assert f"... {left_out} bytes are left out here ..." in text
    assert " end\nended after " in text


def test_the_oldest_run_goes_and_two_in_a_second_are_two():
    for _ in range(run_log.MAX_RUNS + 5):
        stored_log("driver.py")
    assert len(stored_runs()) == run_log.MAX_RUNS


def test_runs_are_told_apart_by_brick():
    stored_log("driver.py")
    assert is_of(stored_runs()[0], BLUE)
    assert not is_of(stored_runs()[0], BrickAddress("10.42.0.30"))


def test_where_nothing_can_be_kept_it_is_said_and_the_run_goes_on(state):
    (state / "brick-runs").write_text("in the way")
    said = []
    with BrickRunLog(BLUE, ("driver.py",), said.append) as log:
        log.add(b"output")
    assert said == [f"no log of this run is kept: File exists: {state / 'brick-runs'}"]


def test_a_card_that_gets_full_ends_the_log_and_not_the_run(state):
    said = []
    with BrickRunLog(BLUE, ("driver.py",), said.append) as log:
        log._file.close()
        log._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115
        log.add(b"more")
        log.add(b"and more")
    assert [line.partition(os.sep)[0] for line in said] == [
        "no log of this run is kept: No space left on device: "
    ]
