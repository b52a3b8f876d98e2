"""`driver.py job`, `order` and `jobs`, as typed: what is drawn, what is said, what is refused."""

import json
import math
import os

import jobs
import pytest
from rig import Shell

from laptop.emulator.device.buttons import read_press
from laptop.emulator.host import linux
from robot.job_commands import in_minutes, in_strokes
from robot.jobs.progress import SavedProgress, save_progress
from shared.job import Job, write_job

TWO = [[(9.0, 2.0), (13.0, 6.0)], [(8.0, 6.0), (6.0, 10.0)]]


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    return Shell(tmp_path, monkeypatch, capsys)


def store(tmp_path, name="two", strokes=TWO):
    """Put a job where a laptop puts it."""
    (tmp_path / "jobs").mkdir(exist_ok=True)
    return jobs.write(tmp_path / "jobs", strokes, name=name)


def status(tmp_path):
    return json.loads((tmp_path / "jobs" / "status").read_text())


def test_a_job_is_drawn_by_its_name(shell, tmp_path):
    path = store(tmp_path)
    shown = shell.run("job", "two")
    assert (shown.status, shown.err) == (0, "")
    assert shown.out.startswith("two: 2 strokes, 10 cm, 0:")
    assert shown.out.splitlines()[-1] == "done at 100 %, stroke 2 of 2"
    assert len(shell.ink()) == 2
    stored = status(tmp_path)
    assert stored["state"] == "done"
    assert stored["crc"] == Job(path).crc
    assert stored["volts"] == pytest.approx(8.0, abs=0.5)
    assert shell.on_file()["parked"], "its place is on record for the next program"
    assert not [name for name in os.listdir(str(tmp_path / "jobs")) if name.endswith(".progress")]


def test_the_buttons_pause_and_resume_it(shell, tmp_path):
    store(tmp_path)
    presses = [read_press("enter@5"), read_press("enter@8")]
    shown = shell.run("job", "two", presses=presses)
    assert shown.status == 0
    assert "CENTRE: pause, resume" in shown.out
    assert "paused at" in shown.out
    assert max(len(line) for line in shown.out.splitlines() if "tick" not in line) < 40


@pytest.mark.long
def test_no_press_is_lost_whatever_the_brick_is_at(shell, tmp_path):
    short = [[(8.0 + 0.4 * k, 2.0 + 0.3 * (k % 5)), (9.0 + 0.4 * k, 6.0)] for k in range(12)]
    store(tmp_path, strokes=short)
    times = [3.0 + 2.57 * k for k in range(30)]
    shown = shell.run("job", "two", presses=[read_press(f"enter@{t:.2f}+0.04") for t in times])
    assert shown.status == 0
    assert shown.out.count("paused at") == 15
    assert len(shell.ink()) >= 12


def test_what_is_left_is_resumed_after_a_signal(shell, tmp_path):
    store(tmp_path, strokes=TWO + [[(10.0, 8.0), (12.0, 8.0)]])
    shown = shell.run("job", "two", signals=[(7.0, 15)])
    assert shown.status == 143
    assert "stopped by SIGTERM" in shown.err
    assert status(tmp_path)["state"] == "stopped"
    before = shell.ink()
    assert "two: 3 strokes" in shell.run("jobs").out
    assert "begun, goes on with stroke 2: driver.py job two --resume" in shell.run("jobs").out
    shown = shell.run("job", "two", "--resume")
    assert shown.status == 0, shown.err
    assert "goes on with stroke 2 of 3" in shown.out
    assert "the zero is that of before" in shown.out
    assert len(shell.ink()) - len(before) == 2
    shown = shell.run("job", "two", "--resume")
    assert shown.status == 1
    assert "leave --resume out" in shown.err


def test_a_crash_between_two_times_goes_on_with_the_next_time(shell, tmp_path):
    job = Job(store(tmp_path))
    save_progress(job.crc, SavedProgress(3, 1, {}, 0.0))
    shown = shell.run("job", "two", "--resume", "--repeat", "2")
    assert shown.status == 0, shown.err
    assert "goes on with stroke 1 of 2" in shown.out
    assert "the zero was found anew: the two parts may be up to " in shown.out
    assert len(shell.ink()) == 2


def test_it_begins_where_it_is_told_to(shell, tmp_path):
    store(tmp_path)
    shown = shell.run("job", "two", "--from", "60%", "--speed-percent", "50", "--repeat", "2")
    assert shown.status == 0, shown.err
    assert "begins with stroke 2 of 2" in shown.out
    assert "time 2 of 2" in shown.out
    assert len(shell.ink()) == 3


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["job"], "required: FILE"),
        (["job", "lily"], "there is no job lily"),
        (["job", "two", "--from", "x"], "must be a number from 0 to 100 %"),
        (["job", "two", "--from", "101"], "from 0 to 100 %"),
        (["job", "two", "--repeat", "0"], "from 1 to"),
        (["job", "two", "--speed-percent", "200"], "from 25 to 100 %"),
        (["job", "two", "--resume"], "leave --resume out"),
        (["job", "two", "--resume", "--from", "3"], "leave it or --from out"),
        (["job", "two", "--arm", "spatial"], "plan it for this one"),
        (["job", "junk"], "is no job, or is damaged"),
        (["order", "pause"], "no job is drawn now"),
        (["order", "jump"], "is no order"),
        (["order", "speed", "5"], "from 25 to 100 per cent"),
        (["order"], "required: ORDER"),
        (["jobs", "--remove"], "takes the NAME"),
        (["jobs", "lily", "--remove"], "there is no job lily"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line_and_nothing_moves(
    shell, tmp_path, args, message
):
    store(tmp_path)
    (tmp_path / "jobs" / "junk.job").write_text("{}")
    shown = shell.run(*args)
    assert shown.status in (1, 2)
    assert message in shown.err
    assert len(shown.err.splitlines()) == 1
    assert shell.writes == []


def test_without_a_zero_nothing_moves(tmp_path, monkeypatch, capsys):
    shell = Shell(tmp_path, monkeypatch, capsys, homed=False)
    store(tmp_path)
    shown = shell.run("job", "two")
    assert shown.status == 1
    assert "has not been homed" in shown.err


def test_orders_come_through_the_file(shell, tmp_path):
    store(tmp_path)

    def say(line):
        with open(str(tmp_path / "jobs" / "orders"), "a") as file:
            file.write(line + "\n")

    for t, line in ((6.0, "pause"), (6.2, "speed 5"), (8.0, "pen -3"), (10.0, "abort")):
        shell.world.at(t, lambda line=line: say(line))
    shown = shell.run("job", "two")
    assert shown.status == 1
    assert "'speed 5': speed takes a number" in shown.out
    assert shown.out.splitlines()[-1].startswith("aborted at")
    assert status(tmp_path)["pen"] == -3
    assert not shell.brick.plant.pen_down


def test_an_order_is_appended_while_a_job_runs(shell, tmp_path):
    (tmp_path / "jobs").mkdir()
    (tmp_path / "jobs" / "status").write_text(
        json.dumps({"state": "paused", "pid": linux.PID, "job": "rose", "crc": 7})
    )
    shown = shell.run("order", "pen", "-5")
    assert (shown.status, shown.out) == (0, "pen -5: told rose\n")
    shell.run("order", "resume")
    assert (tmp_path / "jobs" / "orders").read_text() == "pen -5\nresume\n"


def test_jobs_are_listed_for_people_and_programs_and_removed(shell, tmp_path):
    assert shell.run("jobs").out.startswith("no jobs in ")
    path = store(tmp_path)
    (tmp_path / "jobs" / "junk.job").write_text("{}")
    lines = shell.run("jobs").out.splitlines()
    assert lines[0].startswith("junk: ")
    assert "damaged" in lines[0]
    assert lines[1].startswith("two: 2 strokes, 10 cm, 0:")
    spoilt, listed = map(json.loads, shell.run("jobs", "--json").out.splitlines())
    assert spoilt["state"] == "spoilt"
    assert (listed["crc"], listed["state"], listed["next"]) == (Job(path).crc, "", 1)
    shown = shell.run("jobs", "two", "--remove")
    assert shown.status == 0, shown.err
    assert not os.path.exists(path)
    other = jobs.write(tmp_path)
    assert "remove it by hand" in shell.run("jobs", other, "--remove").err
    assert os.path.exists(other)


def test_a_share_within_the_first_stroke_is_told_to_begin_there(shell, tmp_path):
    store(tmp_path, strokes=TWO[:1])
    shown = shell.run("job", "two", "--from", "60%")
    assert shown.status == 0, shown.err
    assert "begins with stroke 1 of 1" in shown.out
    assert len(shell.ink()) == 1


def test_one_stroke_is_not_told_as_many():
    assert [in_strokes(count) for count in (1, 2)] == ["1 stroke", "2 strokes"]


def test_a_time_is_told_in_minutes():
    assert [in_minutes(t) for t in (0, 59.6, 130)] == ["0:00", "1:00", "2:10"]


@pytest.mark.parametrize(
    ("stations", "offsets", "message"),
    [
        ([0.0, math.sqrt(32)], [0.0, 1.0], "a joint is moved by 57.3 deg, and 20 are the most"),
        ([0.0, 99.0], [0.0, 0.0], "they are of 99.00 cm"),
        (
            [0.0, 2.0, math.sqrt(32)],
            [0.0, float("nan"), 0.0],
            "or is damaged: it holds NaN",
        ),
        ([0.0, 2.0], [0.0], "offsets of another arm"),
    ],
)
def test_a_hostile_offset_is_refused_before_anything_moves(
    shell, tmp_path, stations, offsets, message
):
    path = store(tmp_path, strokes=TWO[:1])
    job = Job(path)
    learned = job.stroke(1)._replace(offsets=[(stations, [offsets, offsets])])
    write_job(path, job.header, [learned])
    shown = shell.run("job", "two")
    assert shown.status != 0
    assert message in shown.err
    assert len(shown.err.strip().splitlines()) == 1
    assert not shell.ink()
