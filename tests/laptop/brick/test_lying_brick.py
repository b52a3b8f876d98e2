"""Bricks that lie: what comes of it is a sentence, soon, and little memory."""

import asyncio
import os
import re
import signal
import subprocess
import sys
import threading
import time
import tracemalloc

import lying_brick
import pytest
from click.testing import CliRunner
from lying_brick import HANGS, LIES, LyingBrick, said, silence, words_of
from places import ROOT
from waiting import PATIENCE, until

from laptop.brick import BrickProblem, answers
from laptop.brick.connection import Dialogue, connected, read_address
from laptop.cli.main import laptop


@pytest.fixture
def lying(tmp_path, monkeypatch):
    """`lying(lies)` makes a LyingBrick; the laptop's home is the test's folder."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    monkeypatch.chdir(tmp_path)
    made = []

    def make(lies):
        made.append(LyingBrick(tmp_path, lies))
        return made[-1]

    yield make
    for brick in made:
        brick.close()


@pytest.mark.long
@pytest.mark.parametrize("name", LIES)
def test_a_lie_is_a_sentence(lying, tmp_path, name):
    command, lies, sentence = LIES[name]
    before = {path for path in tmp_path.rglob("*") if "state" not in path.parts}
    result = CliRunner().invoke(laptop, words_of(command, lying(lies).place))
    assert isinstance(result.exception, (SystemExit, type(None))), result.exception
    assert re.search(sentence, result.output), result.output
    assert "\x1b" not in result.output
    assert all(line.isprintable() for line in result.output.splitlines())
    assert not any(line.startswith("port A    large motor") for line in result.output.splitlines())
    left = {path for path in tmp_path.rglob("*") if "state" not in path.parts}
    assert not {path for path in left - before if path.is_file() and ".ssh" not in path.parts}


def ask_it(brick, command="echo", **options):
    """What `ask` gets from a brick that lies, by the sentence."""

    async def talk():
        address = read_address(brick.place)
        async with connected(address, Dialogue(lambda line: None)) as there:
            return await answers.ask(there, command, **options)

    return asyncio.run(talk())


def test_an_answer_without_end_takes_no_more_than_it_may(lying):
    brick = lying({"read": lying_brick.forever(b"A" * 65536)})
    tracemalloc.start()
    with pytest.raises(BrickProblem, match="says more than 1049 kB where much less is due"):
        ask_it(brick, "head -c 10")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 16e6


@pytest.mark.long
def test_a_brick_without_a_word_is_waited_for_only_so_long(lying):
    brick = lying({"read": said(b"first", then=silence), "arms": silence})
    for command in ("head -c 10", "ls -1"):
        began = time.monotonic()
        with pytest.raises(BrickProblem, match=r"has not said a word for 0\.5 s"):
            ask_it(brick, command, silence=0.5)
        assert time.monotonic() - began < 20


def test_a_command_that_is_given_up_is_ended_there(lying):
    ended = threading.Event()

    async def until_closed(process):
        await process.channel.wait_closed()
        ended.set()

    brick = lying({"read": until_closed})

    async def talk():
        async with connected(read_address(brick.place), Dialogue(lambda line: None)) as there:
            with pytest.raises(answers.NoAnswer):
                await answers.ask(there, "head -c 10", silence=0.2)
            return await asyncio.to_thread(ended.wait, PATIENCE)

    assert asyncio.run(talk())


@pytest.mark.long
def test_a_brick_that_takes_nothing_is_waited_for_only_so_long(lying):
    brick = lying({"install": silence})
    with pytest.raises(BrickProblem, match="has not said a word for"):
        ask_it(brick, "install.lock", given=bytes(1 << 24), silence=0.5)


@pytest.mark.long
def test_one_that_answers_word_by_word_is_waited_for_only_so_long(lying, monkeypatch):
    async def drip(process):
        while True:
            process.stdout.write(b".")
            await asyncio.sleep(0.05)

    monkeypatch.setattr(answers, "MAX_ANSWER_TIME", 1.0)
    with pytest.raises(BrickProblem, match="has not come to its end; is the network so slow"):
        ask_it(lying({"read": drip}), "head -c 10")


@pytest.mark.long
@pytest.mark.parametrize("name", ["silence of its doctor"])
def test_a_command_says_so(lying, name):
    command, lies, sentence = HANGS[name]
    result = CliRunner().invoke(laptop, words_of(command, lying(lies).place))
    assert result.exit_code == 1
    assert re.search(sentence, result.output), result.output
    assert len(result.output.splitlines()) < 5


@pytest.mark.long
def test_a_log_is_written_over_nothing(lying, tmp_path):
    brick = lying({"logs": said(b".brickservo/logs/job.log\n"), "read": said(b"of the brick\n")})
    args = ["brick", "log", "--brick", brick.place, "here"]
    there = tmp_path / "here"
    there.mkdir()
    own = there / "job.log"
    own.write_text("of somebody\n")
    for _ in range(2):  # the second time it is there already
        assert CliRunner().invoke(laptop, args).exit_code == 0
        assert own.read_text() == "of somebody\n"
        assert (there / "job-2.log").read_text() == "of the brick\n"
        assert len(list(there.iterdir())) == 2
    own.unlink()
    own.symlink_to(tmp_path / "elsewhere")
    assert CliRunner().invoke(laptop, args).exit_code == 0
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_who_ends_a_command_leaves_no_folder_of_its_own(lying, tmp_path, number):
    brick = lying({"is on": silence})
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-m", "laptop", "draw", "rose", "--brick", brick.place],
        env={**os.environ, "TMPDIR": str(temporary), "PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
        stderr=subprocess.PIPE,
    )
    until(lambda: list(temporary.rglob("*.job")), "the job's file")
    process.send_signal(number)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number
    assert list(temporary.iterdir()) == []
