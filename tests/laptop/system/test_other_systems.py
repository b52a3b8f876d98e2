"""The main commands where there is only what other systems have: names of Linux are taken away."""

import csv
import json
import signal
import subprocess
import sys
import urllib.request

import cv2
import numpy as np
import pytest
from announced import wait_for_event
from places import ROOT
from systems import lacking
from waiting import PATIENCE

SYSTEMS = pytest.mark.parametrize("system", ["windows", "macos"])
COMMANDS = "demo", "track", "simulate", "markers", "brick", "guide", "bench"


def begin(system, folder, *words):
    """Start a command in a folder of its own, whose name is no plain one."""
    home = folder / "Jörgs Läufe"
    home.mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, "-m", "laptop", *map(str, words)],
        cwd=home,
        env=lacking(system, BRICKSERVO_STATE=str(home / "Zustand"), TMPDIR=str(home)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def run(system, folder, *words):
    """Status, output and errors of a command."""
    process = begin(system, folder, *words)
    out, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, out, errors


@SYSTEMS
@pytest.mark.parametrize("command", [*COMMANDS, "bench draw"])
@pytest.mark.short("simulate-windows", "simulate-macos")
def test_every_command_says_what_it_does(system, command, tmp_path):
    status, out, errors = run(system, tmp_path, *command.split(), "--help")
    assert (status, errors) == (0, "")
    assert f"Usage: python -m laptop {command}" in out


@pytest.mark.short("windows")
@SYSTEMS
def test_a_line_is_drawn_in_a_folder_of_any_name(system, tmp_path):
    options = "--plant", "cpu=0", "--out", "Linie 1"
    line = ROOT / "robot" / "driver.py", "line", "10,0", "5,10"
    status, out, errors = run(system, tmp_path, "simulate", *options, *line)
    assert status == 0, out + errors
    assert (tmp_path / "Jörgs Läufe" / "Linie 1" / "picture.png").is_file()


@SYSTEMS
@pytest.mark.long
def test_of_two_runs_for_one_folder_the_second_is_refused(system, tmp_path):
    script = tmp_path / "waits.py"
    script.write_text("import time\nprint('here', flush=True)\ntime.sleep(1000)\n")
    words = "simulate", "--realtime", "--out", tmp_path / "out", script
    first = begin(system, tmp_path, *words)
    try:
        assert first.stdout.readline() == "here\n"
        status, _, errors = run(system, tmp_path, *words)
        assert (status, "another run is at work" in errors) == (1, True), errors
    finally:
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=PATIENCE)
    assert first.returncode == 130


@pytest.mark.short("macos")
@SYSTEMS
def test_a_marker_is_tracked_through_a_folder_of_pictures(system, tmp_path):
    pictures = tmp_path / "Bilder"
    pictures.mkdir()
    for k in range(3):
        image = np.full((480, 640, 3), 255, np.uint8)
        cv2.circle(image, (200 + 10 * k, 240), 20, (0, 0, 200), -1, cv2.LINE_AA)
        (pictures / f"{k}.png").write_bytes(cv2.imencode(".png", image)[1].tobytes())
    table = tmp_path / "gesehen.csv"
    status, out, errors = run(
        system, tmp_path, "track", "--camera", pictures, "--no-serve", "--to", table
    )
    assert status == 0, out + errors
    rows = csv.DictReader(table.read_text().splitlines())
    rows = [row for row in rows if row["marker"] == "effector"]
    assert [float(row["u"]) for row in rows] == pytest.approx([200, 210, 220], abs=0.1)


@SYSTEMS
@pytest.mark.long
def test_tracker_page_and_brick_come_and_ctrl_c_ends_them(system, tmp_path):
    words = "--camera", "synthetic", "--listen-port", "127.0.0.1:0", "--page-port", "0"
    tracker = begin(system, tmp_path, "track", *words, "--json")
    try:
        page = wait_for_event(tracker.stdout, "page")["url"]
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(page, timeout=PATIENCE) as answer:
            assert b"BrickServo" in answer.read()
        wait_for_event(tracker.stdout, "ready")
    finally:
        tracker.send_signal(signal.SIGINT)
        out, errors = tracker.communicate(timeout=PATIENCE)
    end = json.loads(out.splitlines()[-1])
    assert (tracker.returncode, end["event"], end["status"]) == (130, "end", 130), errors
    assert "Traceback" not in errors


@pytest.mark.claims
def test_the_demo_draws_and_arrives(tmp_path):
    status, out, errors = run(
        "windows", tmp_path, "demo", "--out", tmp_path / "Schau", "--seed", "7"
    )
    assert status == 0, out + errors
    assert list((tmp_path / "Schau").rglob("report.html"))
