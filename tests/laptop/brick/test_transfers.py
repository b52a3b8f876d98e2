"""Arms, logs and figures there and back, over Debian's sshd."""

import json
import shutil
import subprocess

import pytest
from places import ROOT


@pytest.fixture
def here(ssh_brick, tmp_path):
    """A folder of somebody's with an arm, and `brick` run in it."""
    folder = tmp_path / "mine"
    folder.mkdir()
    shutil.copy(ROOT / "shared" / "arms" / "geared.ini", folder / "mine.ini")

    def run(*words):
        return ssh_brick.run(*words, cwd=folder, env={"PYTHONPATH": str(ROOT)})

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
    assert "another mine.ini is here" in here("arm", "--fetch", "mine")[2]
    assert here("arm", "--fetch", "mine", "--replace")[0] == 0
    assert (here.folder / "mine.ini").read_text().endswith("# found out there\n")
    assert "there are: mine" in here("arm", "--fetch", "other")[2]
    assert here("install")[0] == 0
    assert (arms / "mine.ini").read_text().endswith("# found out there\n")
    assert here("run", "driver.py", "--arm", "mine", "inverse", "10,0")[0] == 0


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
    assert (status, "there is no folder nowhere for it.json" in errors) == (2, True), errors
    status, _, errors = here("log", "--out", "mine.ini")
    assert (status, "'mine.ini' is a file" in errors) == (2, True), errors
    assert ssh_brick.connections == 0


@pytest.mark.long
def test_what_the_bench_measures_comes_here(here):
    status, out, errors = here("bench", "planar", "--json", "it.json")
    assert status == 0, out + errors
    assert "planar: tick, line" in out
    assert isinstance(json.loads((here.folder / "it.json").read_text()), dict)
