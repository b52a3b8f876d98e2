"""A drawing over sshd to the emulated brick: sent, watched, paused, left alone, seen again."""

import asyncio
import subprocess
import sys

import pytest
from places import ROOT
from ssh_brick import Proxy
from terminal_keys import keys_for
from waiting import PATIENCE

from laptop.brick import BrickProblem, jobs
from laptop.brick.connection import Dialogue, connected, read_address
from robot.motion import paths, trajectory
from shared.arm_description import find_arm, read_arm
from shared.job import Stroke, header_of, write_job

ARM = read_arm(find_arm("planar"))


@pytest.fixture
def typed(monkeypatch):
    """Hands keys to whoever watches."""
    return keys_for(monkeypatch, jobs)


@pytest.fixture
def job(tmp_path):
    """A job of two lines and a circle, some ten seconds."""
    strokes = []
    for shape in (
        paths.polyline([(10, 0), (10, 6)]),
        paths.circle((12, 0), 2),
        paths.polyline([(14, 4), (9, -4)]),
    ):
        pieces = [motion.numbers() for motion in trajectory.plan(ARM, shape, 4.0)]
        strokes.append(Stroke("", 6.0, 2.0, pieces))
    file = tmp_path / "my shapes.job"
    write_job(str(file), header_of(ARM, "my shapes", 4.0, strokes, 20.0, 12.0), strokes)
    return file


def on_brick(ssh_brick, command, *args):
    """What a command gives, and the lines that it said."""
    said = []

    async def talk():
        address = read_address(ssh_brick.place)
        async with connected(address, Dialogue(said.append)) as brick:
            return await command(brick, address, Dialogue(said.append), *args)

    return asyncio.run(talk()), said


@pytest.mark.long
def test_it_is_drawn_and_watched_to_its_end(ssh_brick, job):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    shown = []
    status, said = on_brick(ssh_brick, jobs.draw, job, (), shown.append)
    assert status == 0, (said, shown)
    assert {one.state for one in shown} == {"drawing", "done"}
    assert shown[-1].share == 1
    assert any("sent, and started" in line for line in said)
    assert (ssh_brick.home / ".brickservo" / "jobs" / "my_shapes.job").read_bytes() == (
        job.read_bytes()
    )


@pytest.mark.long
def test_an_arm_that_was_not_homed_draws_nothing_and_says_why(ssh_brick, job):
    ssh_brick.emulate("--realtime")
    with pytest.raises(BrickProblem, match="has not been homed"):
        on_brick(ssh_brick, jobs.draw, job, (), lambda status: None)


@pytest.mark.long
def test_ctrl_c_pauses_it_space_goes_on_and_a_second_ctrl_c_aborts(ssh_brick, job, typed):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    states = []

    def show(status):
        if not states or states[-1] != status.state:
            states.append(status.state)
            keys = {1: b"\x03", 2: b" ", 3: b"\x03", 4: b"\x03"}.get(len(states))
            if keys:
                typed(keys)

    with pytest.raises(BrickProblem, match="my shapes: aborted"):
        on_brick(ssh_brick, jobs.draw, job, (), show)
    assert states == ["drawing", "paused", "drawing", "paused", "aborted"]


@pytest.mark.long
def test_it_goes_on_when_the_laptop_has_gone_and_is_seen_again(ssh_brick, job, typed):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    status, said = on_brick(ssh_brick, jobs.draw, job, (), lambda status: typed(b"q"))
    assert (status, said[-1]) == (0, "left to draw alone; brick watch shows it again")
    with pytest.raises(BrickProblem, match="draws another job; watch it by brick watch"):
        on_brick(ssh_brick, jobs.draw, job, (), lambda status: None)
    seen = []
    assert on_brick(ssh_brick, jobs.watch, seen.append)[0] == 0
    assert seen[-1].state == "done"
    with pytest.raises(BrickProblem, match="draws no job"):
        on_brick(ssh_brick, jobs.watch, seen.append)
    assert "my_shapes" in on_brick(ssh_brick, jobs.jobs)[0]
    assert "my_shapes" in on_brick(ssh_brick, jobs.cancel, "my_shapes")[0]
    assert not (ssh_brick.home / ".brickservo" / "jobs" / "my_shapes.job").exists()
    with pytest.raises(BrickProblem, match="there is no job"):
        on_brick(ssh_brick, jobs.cancel, "my_shapes")


@pytest.mark.long
def test_a_cable_that_is_pulled_lets_it_go_on(ssh_brick, job):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    cable = Proxy(ssh_brick.port)

    async def talk():
        address = read_address(ssh_brick.by_way_of(cable))
        async with connected(address, Dialogue(print)) as brick:
            show = lambda status: cable.cut()  # noqa: E731
            await jobs.draw(brick, address, Dialogue(print), job, (), show)

    with pytest.raises(BrickProblem, match="is lost; the job goes on there"):
        asyncio.run(talk())
    cable.close()
    seen = []
    assert on_brick(ssh_brick, jobs.watch, seen.append)[0] == 0
    assert seen[-1].state == "done"


@pytest.mark.long
def test_a_drawing_is_drawn_by_what_one_types(ssh_brick, tmp_path):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0
    ssh_brick.emulate("--realtime")
    file = tmp_path / "square.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4">'
        '<rect x="0" y="0" width="3" height="3" fill="none" stroke="black"/></svg>'
    )
    args = ["draw", str(file), "--size", "4", "--brick", ssh_brick.place]
    done = subprocess.run(
        [sys.executable, "-m", "laptop", *args],
        cwd=ROOT,
        env=ssh_brick.environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("4.0 x 4.0 cm around ")
    assert any(line.startswith("square.svg: drawing, ") for line in lines)
    assert lines[-1].startswith("square.svg: done, 100 %, stroke 1 of 1, 0 s left")
    assert "sent, and started" in done.stderr
