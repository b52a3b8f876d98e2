"""Two real processes: `track` on real files, and a client under the oldest Python at hand."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from announced import wait_for_event
from places import ROOT
from waiting import PATIENCE

pytestmark = pytest.mark.long  # frames come in real time

START, SPEED, LAP = 40.0, 1.0, 240
RATES = {"A": 20, "B": 5}  # frames per second of either camera
LASTS = 60  # s, if nobody ends it: a slow machine needs long to begin
PAUSES = 4

# What a program on the brick does: as many observations as come, then with pauses of half a second.
CLIENT = """
import json, sys, time
from robot.clock import Clock
from robot.tracking_client import TrackingClient, find_tracker
clock = Clock()
client = TrackingClient(*find_tracker(sys.argv[1], sys.argv[2]), clock=clock, say=sys.stderr.write)
began = None
deadline = clock.now() + 300.0
while client.lost_since is None or began is None and clock.now() < deadline:
    pausing = began is not None and clock.now() - began > 1.5
    if pausing:
        time.sleep(0.5)
    round_trip = client.round_trip or 0.0
    for seen in client.poll(0.0 if pausing else 0.2).values():
        began = began or clock.now()
        round_trip = max(round_trip, client.round_trip or 0.0)
        row = [seen.camera, pausing, round_trip, seen.seq, seen.t, clock.now(), seen.markers]
        print(json.dumps(row), flush=True)
client.close()
"""


def oldest_python():
    """The oldest CPython 3 that is at hand; this one at least."""
    folders = os.environ.get("PATH", "").split(os.pathsep)
    folders += map(str, Path.home().glob(".pyenv/versions/3.*/bin"))
    for minor in range(5, sys.version_info[1]):
        for folder in folders:
            found = shutil.which(f"python3.{minor}", path=folder)
            # (A pyenv shim may be there without the Python behind it.)
            if found and not subprocess.run([found, "-c", ""], capture_output=True).returncode:
                return found
    return sys.executable


def place(frame):
    """Where the disc is in a frame, px: to and fro."""
    return START + SPEED * (LAP - abs(LAP - frame % (2 * LAP)))


def video(file, fps, frames):
    """A red disc that moves by SPEED px per frame: where it is tells in which frame."""
    out = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"MJPG"), fps, (320, 240))
    for frame in range(frames):
        image = np.full((240, 320, 3), 150, np.uint8)
        center = round(place(frame) * 16), 120 * 16
        cv2.circle(image, center, 12 * 16, (40, 40, 200), -1, cv2.LINE_AA, shift=4)
        out.write(image)
    out.release()


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """By camera: what a client got of it, and when each frame was taken as the CSV has it."""
    folder = tmp_path_factory.mktemp("loopback")
    for name, fps in RATES.items():
        video(folder / f"{name}.avi", fps, fps * LASTS)
    python = oldest_python()  # before the film begins, which waits for nobody
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    tracker = subprocess.Popen(
        [sys.executable, "-m", "laptop", "track", "--no-page", "--effector", "disc:red"]
        + ["--camera", str(folder / "A.avi"), "--camera", str(folder / "B.avi")]
        + ["--goal", "A:300,20", "--goal", "B:100,30", "--to", str(folder / "film.csv")]
        + ["--listen-port", "127.0.0.1:0", "--json"],
        cwd=ROOT,
        env={**environment, "BRICKSERVO_STATE": str(folder / "laptop")},
        stdout=subprocess.PIPE,
        text=True,
    )
    client = None
    observations = {name: [] for name in RATES}
    try:
        serving = wait_for_event(tracker.stdout, "serving")
        place = f"{serving['host']}:{serving['port']}"
        client = subprocess.Popen(
            [python, "-c", CLIENT, place, serving["code"]],
            env={**environment, "BRICKSERVO_STATE": str(folder / "brick")},
            stdout=subprocess.PIPE,
            text=True,
        )
        for line in client.stdout:  # until the tracker has gone
            camera, *rest = json.loads(line)
            observations[camera].append(rest)
            if sum(pausing for pausing, *_ in observations["A"]) == PAUSES:
                tracker.send_signal(signal.SIGINT)
        client.wait(PATIENCE)
        tracker.communicate(timeout=PATIENCE)
    finally:
        for process in filter(None, (tracker, client)):
            process.kill()
            process.wait()
            process.stdout.close()
    assert (client.returncode, tracker.returncode) == (0, 130)
    taken = {name: {} for name in RATES}
    for row in (folder / "film.csv").read_text().splitlines()[1:]:
        frame, t, marker, *_, camera = row.split(",")
        if marker == "effector":
            taken[camera][int(frame)] = float(t)
    return {name: (observations[name], taken[name]) for name in RATES}


@pytest.fixture(scope="module")
def received(both):
    return both["A"]


def test_the_position_received_is_that_of_its_frame(received):
    observations, _ = received
    assert len(observations) > 10
    for *_, seq, _, _, markers in observations:
        u, v, confidence = markers["effector"]
        assert u == pytest.approx(place(seq), abs=0.2)
        assert v == pytest.approx(120, abs=0.2)
        assert confidence > 0.5  # less than usual after frames that were left out
        assert markers["goal"] == [300, 20, 1]


def test_the_capture_time_received_is_true_to_half_a_round_trip_on_the_receivers_clock(both):
    for name, (observations, reported) in both.items():
        first = reported[min(reported)] - min(reported) / RATES[name]
        assert len(observations) > 4
        for _, round_trip, seq, t, now, _ in observations:
            assert reported[seq] == pytest.approx(first + seq / RATES[name], abs=1e-5)
            within = round_trip / 2 + 0.001  # for the drift that is allowed for
            assert t == pytest.approx(reported[seq], abs=within)
            assert t < now + within


def test_a_receiver_that_sleeps_gets_the_newest_only(received):
    observations, taken = received
    numbers = [row[2] for row in observations if row[0]]
    assert len(numbers) >= PAUSES
    # However slow this machine is: of what the tracker looked at meanwhile all else was left out.
    left_out = [sum(a < k < b for k in taken) for a, b in zip(numbers, numbers[1:])]
    assert sum(left_out) >= PAUSES


def test_what_comes_comes_once_and_in_order(received):
    observations, _ = received
    numbers = [row[2] for row in observations]
    assert numbers == sorted(set(numbers))
    assert len([row for row in observations if not row[0]]) > 4


def test_two_cameras_have_their_own_places_and_goals(both):
    for name, goal in (("A", [300, 20, 1]), ("B", [100, 30, 1])):
        for *_, seq, _, _, markers in both[name][0]:
            assert markers["effector"][0] == pytest.approx(place(seq), abs=0.2)
            assert markers["goal"] == goal
