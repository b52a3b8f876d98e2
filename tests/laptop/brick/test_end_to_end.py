"""All of it, as somebody with a new brick would do it: by real ssh, and in real time at the end."""

import csv
import os
import signal
import subprocess
import sys

import pytest
from announced import wait_for_event
from places import ROOT
from run_json import run_in
from waiting import PATIENCE, until

from laptop.brick import choosing
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.cli.track import run_on_brick
from laptop.see.serve.server import TrackingServer
from shared import pairing

CODE = "ABCDEFGHJKMN"


@pytest.mark.long
def test_the_page_has_the_brick_run_its_program_and_ends_it(ssh_brick, monkeypatch):
    assert ssh_brick.run("run", "driver.py", "home", "--seek")[0] == 0  # and it is remembered
    ssh_brick.emulate("--realtime")
    with TrackingServer("127.0.0.1", 0, CODE) as server:
        monkeypatch.setenv("BRICKSERVO_CODE", pairing.show_code(CODE))
        with run_on_brick(server.port) as why_ended:
            until(lambda: server.state().client or why_ended(), "the brick")
            assert why_ended() == ""
        ssh_brick.wait_for_sessions()
    summary = run_in(ssh_brick.last_run)
    assert summary["status"] == 128 + signal.SIGHUP
    assert not any(motor["driven"] for motor in summary["motors"].values())


@pytest.mark.long
def test_a_call_that_leads_nowhere_says_why(ssh_brick):
    choosing.remember(BrickAddress("127.0.0.1", 1), Dialogue(print))
    with run_on_brick(7711) as why_ended:
        line = until(why_ended, "the end")
    assert "brick run has ended; what it said is in " in line
    assert "at last: laptop: 127.0.0.1:1 is there, but takes no ssh at port 1" in line


@pytest.mark.long
def test_install_doctor_home_draw_and_servo_by_a_live_tracker(ssh_brick):
    ssh_brick.be_new()
    done = ssh_brick.run("install")
    assert done[0] == 0, done
    _, out, _ = ssh_brick.run("doctor")
    assert "port B    large motor at 0 counts, elbow: fine" in out
    assert "is there and here: fine" in out
    done = ssh_brick.run("run", "driver.py", "home", typed="\n")
    assert (done[0], "never checked; nothing moves until then" in done[1]) == (1, True), done
    done = ssh_brick.run("run", "driver.py", "check", typed="\nslel")
    assert done[0] == 0, done
    assert "checked: shoulder at port A, elbow at port B; next: driver.py home" in done[1]
    done = ssh_brick.run("run", "driver.py", "home", typed="\n")
    assert done[0] == 0, done
    for line in (("10,0", "5,10"), ("14,4", "14,-4"), ("8,4", "16,4")):
        done = ssh_brick.run("run", "driver.py", "line", *line)
        assert done[0] == 0, done
        summary = run_in(ssh_brick.last_run)
        assert summary["paths"][0]["greatest mm"] < 3

    ssh_brick.emulate("--realtime")
    args = (
        "--camera",
        "synthetic",
        "--listen-port",
        "127.0.0.1:0",
        "--no-page",
        "--json",
    )
    args += "--scene", "marker_height=0"  # no parallax between the tip and the goal on the paper
    tracker = subprocess.Popen(
        [sys.executable, "-m", "laptop", "track", *args, "--no-simulate"],
        cwd=ROOT,
        env={**os.environ, "BRICKSERVO_STATE": str(ssh_brick.home / ".brickservo")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        serving = wait_for_event(tracker.stdout, "serving")
        wait_for_event(tracker.stdout, "ready")
        # (HOST is left out: it is the computer that ssh comes from.)
        place, reported = f":{serving['port']}", {"BRICKSERVO_CODE": serving["code"]}
        done = ssh_brick.run("run", "visual_servoing.py", place, env=reported)
        assert done[0] == 0, done
        assert "converged" in done[1]
    finally:
        tracker.send_signal(signal.SIGINT)
        tracker.communicate(timeout=PATIENCE)
    with open(ssh_brick.last_run / "trace.csv", newline="") as file:
        *_, last = csv.DictReader(file)
    off = ((float(last["x"]) - 12) ** 2 + (float(last["y"]) + 9) ** 2) ** 0.5  # the scene's goal
    print(f"the tip truly is {10 * off:.1f} mm from the goal")
    assert off < 0.5  # cm; the servo stops at 5 px, some 3 mm
