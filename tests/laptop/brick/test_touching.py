"""Touching over sshd on the emulated brick: points come here as they are taken."""

import asyncio
import json
import math
import re

import pytest
from terminal_keys import keys_for

from laptop.brick import BrickProblem, touching
from laptop.brick.connection import Dialogue, connected, read_address
from laptop.see.table.marker_offset import BadTouches


@pytest.fixture
def typed(monkeypatch):
    """Hands keys to whoever touches."""
    return keys_for(monkeypatch, touching)


def touch(ssh_brick, take, typed, at_ready=b"\r", skip=lambda: False, args=()):
    """Touch on the brick, with some keys once it is ready; what was said."""
    said = []

    async def talk():
        loop, address = asyncio.get_running_loop(), read_address(ssh_brick.place)

        def say(line):
            said.append(line)
            if line.startswith("lead the arm"):
                for k, key in enumerate(at_ready):
                    loop.call_later(0.5 + 1.5 * k, typed, bytes((key,)))

        async with connected(address, Dialogue(said.append)) as brick:
            await touching.touch(brick, address, Dialogue(say), args, take, skip)

    asyncio.run(talk())
    return said


@pytest.fixture
def homed(ssh_brick):
    assert ssh_brick.run("run", "driver.py", "home", "--here")[0] == 0
    ssh_brick.emulate("--realtime")
    return ssh_brick


@pytest.mark.long
def test_enter_here_takes_points_until_there_are_enough(homed, typed):
    points = []

    def take(line):
        points.append(json.loads(line))
        return len(points) == 2

    said = touch(homed, take, typed, b"\r\r")
    assert len(points) == 2
    assert points[1]["t"] > points[0]["t"] + 0.5
    assert any("lead the arm by hand" in line for line in said)
    assert not any(line.startswith("point ") for line in said)
    status, out, _ = homed.run("run", "driver.py", "where")
    assert status == 0, "it was parked in order"
    where = [float(x) for x in re.search(r"tip at (\S+) cm", out).group(1).split(",")]
    for point in points:
        assert math.dist(point["p"], where) < 0.3


@pytest.mark.long
def test_what_is_wrong_with_a_point_ends_it_in_order(homed, typed):
    def take(line):
        raise BadTouches("the camera has moved")

    with pytest.raises(BadTouches, match="the camera has moved"):
        touch(homed, take, typed)
    assert homed.run("run", "driver.py", "where")[0] == 0


@pytest.mark.long
def test_s_skips_and_ctrl_c_gives_up(homed, typed):
    skipped = []
    with pytest.raises(BrickProblem, match="stopped: nothing is written") as problem:
        touch(homed, lambda line: False, typed, b"s\x03", lambda: bool(skipped.append(1)))
    assert problem.value.status == 130
    assert skipped == [1]


@pytest.mark.long
def test_an_arm_that_was_not_homed_says_why(ssh_brick, typed):
    ssh_brick.emulate("--realtime")
    with pytest.raises(BrickProblem, match="touch has ended: .*has not been homed"):
        touch(ssh_brick, lambda line: True, typed)
