"""Arms, logs and figures there and back, over Debian's sshd."""

import asyncio
import json
import shutil
import subprocess
from dataclasses import replace

import pytest
from places import ROOT
from ssh_brick import Proxy

from laptop.brick import BrickProblem
from laptop.brick.connection import Dialogue, connected, read_address
from laptop.brick.remote_files import put


@pytest.fixture
def here(ssh_brick, tmp_path):
    """A folder of somebody's with an arm, and `brick` run in it."""
    folder = tmp_path / "mine"
    folder.mkdir()
    shutil.copy(ROOT / "shared" / "arms" / "geared.ini", folder / "mine.ini")

    def run(*args):
        return ssh_brick.run(*args, cwd=folder, env={"PYTHONPATH": str(ROOT)})

    run.folder = folder
    return run


@pytest.mark.long
def test_an_arm_goes_there_and_back_and_none_is_lost(ssh_brick, here):
    arms = ssh_brick.home / ".brickservo" / "arms"
    assert "arms of its own: none" in here("arm")[2]
    assert here("arm", "mine.ini")[0] == 0
    assert (arms / "mine.ini").read_text() == (here.folder / "mine.ini").read_text()
    with open(arms / "mine.ini", "a") as file:
        file.write("# found out there\n")
    status, _, errors = here("arm", "mine.ini")
    assert (status, errors.count("\n")) == (1, 1)
    assert "another mine.ini is on" in errors
    assert (
        "mine.ini is there already; choose another name, or give --replace"
        in here("arm", "--fetch", "mine")[2]
    )
    assert here("arm", "--fetch", "mine", "--replace")[0] == 0
    assert (here.folder / "mine.ini").read_text().endswith("# found out there\n")
    assert "there are: mine" in here("arm", "--fetch", "other")[2]
    assert here("install")[0] == 0
    assert (arms / "mine.ini").read_text().endswith("# found out there\n")
    assert here("run", "driver.py", "--arm", "mine", "inverse", "10,0")[0] == 0


def test_a_file_whose_sending_is_cut_leaves_the_old_one_whole(ssh_brick):
    address = read_address(ssh_brick.place)
    there = ssh_brick.home / "folder" / "file"

    async def send(address, data):
        async with connected(address, Dialogue(lambda line: None)) as brick:
            await put(brick, "folder/file", data)

    asyncio.run(send(address, b"old"))
    cable = Proxy(ssh_brick.port, most=100_000)
    with pytest.raises(BrickProblem, match="is cut"):
        asyncio.run(send(replace(address, port=cable.port), bytes(1_000_000)))
    ssh_brick.wait_for_sessions()
    assert there.read_bytes() == b"old"
    asyncio.run(send(address, b"new"))
    assert there.read_bytes() == b"new"
    cable.close()


@pytest.mark.long
def test_figures_that_have_no_place_here_are_not_measured(ssh_brick, here):
    (here.folder / "file").touch()
    status, _, errors = here("bench", "--json", "file/brick.json")
    assert status == 1
    assert "there is no folder file; make it first" in errors
    assert not any("bench_brick.py" in args for args in ssh_brick.python_starts)


@pytest.mark.long
def test_a_file_that_is_no_arm_does_not_get_there(here):
    (here.folder / "mine.ini").write_text("[arm]\nchain = round\n")
    status, _, errors = here("arm", "mine.ini")
    assert (status, "mine.ini: [arm] chain = round" in errors) == (1, True), errors


@pytest.mark.long
def test_an_own_arm_is_found_by_its_name_there(ssh_brick, here):
    assert here("arm", "mine.ini")[0] == 0
    assert here("install")[0] == 0
    program = "from shared.arm_description import find_arm; print(find_arm('mine'))"
    found = subprocess.run(
        ["python3", "-c", program],
        cwd=ssh_brick.home,
        env={"HOME": str(ssh_brick.home), "PATH": "/usr/bin:/bin", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
    )
    assert found.stdout == f"{ssh_brick.home}/.brickservo/arms/mine.ini\n", found.stderr


@pytest.mark.long
def test_the_last_runs_leave_logs_and_the_oldest_go(ssh_brick, here):
    assert "has no logs" in here("log")[2]
    logs = ssh_brick.home / ".brickservo" / "logs"
    logs.mkdir(parents=True)
    for day in range(1, 13):
        (logs / f"2026-01-{day:02}-120000-servo.jsonl").touch()
    (ssh_brick.home / "brickservo-draw.err.log").write_text("trouble\n")
    ssh_brick.emulate("--scene=")
    assert here("run", "driver.py", "home", "--seek")[0] == 0
    assert here("run", "visual_servoing.py", "--tolerance", "20")[0] == 0
    status, _, errors = here("log", "--out", "all of them")
    assert status == 0, errors
    everything = sorted(path.name for path in (here.folder / "all of them").iterdir())
    runs = [name for name in everything if name.endswith(".txt")]
    assert [name[18:] for name in runs] == ["driver.txt", "visual_servoing.txt"]
    homed = (here.folder / "all of them" / runs[0]).read_text()
    assert f" brick run driver.py home --seek\non {ssh_brick.place}, " in homed
    assert "tip at " in homed
    assert homed.endswith(" s: status 0\n")
    fetched = [name for name in everything if name not in runs]
    assert len(fetched) == 10 + 1
    assert fetched[-1] == "brickservo-draw.err.log"
    assert fetched[0] == "2026-01-04-120000-servo.jsonl"
    lines = (here.folder / "all of them" / fetched[-2]).read_text().splitlines()
    assert all(isinstance(json.loads(line), dict) for line in lines)
    assert len(lines) > 10


def test_what_cannot_be_written_here_is_told_before_the_brick_is_asked(ssh_brick, here):
    status, _, errors = here("bench", "--json", "nowhere/it.json", "planar")
    assert (status, "there is no folder nowhere; make it" in errors) == (1, True), errors
    status, _, errors = here("log", "--out", "mine.ini")
    assert (status, "'mine.ini' is a file" in errors) == (2, True), errors
    assert ssh_brick.connections == 0


@pytest.mark.long
def test_what_the_bench_measures_comes_here(here):
    status, out, errors = here("bench", "planar", "--json", "it.json")
    assert status == 0, out + errors
    assert "planar: tick, line" in out
    assert isinstance(json.loads((here.folder / "it.json").read_text()), dict)
