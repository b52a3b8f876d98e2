"""Two real processes: `track` on a real file, and a client under the oldest Python at hand."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
FPS, FRAMES, START, SPEED = 60, 210, 40.0, 1.0

# What a program on the brick does: as many observations as come, then with pauses of half a second.
CLIENT = """
import json, sys, time
from robot.clock import Clock
from robot.tracking_client import TrackingClient, find_tracker
clock = Clock()
client = TrackingClient(*find_tracker(sys.argv[1], sys.argv[2]), clock=clock, say=sys.stderr.write)
began = None
while client.lost_since is None or began is None:
    pausing = began is not None and clock.now() - began > 1.5
    if pausing:
        time.sleep(0.5)
    for seen in client.look(0.0 if pausing else 0.2).values():
        began = began or clock.now()
        print(json.dumps([pausing, seen.seq, seen.t, clock.now(), seen.markers]), flush=True)
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


def video(file):
    """A red disc that moves by SPEED px per frame: where it is tells which frame it is in."""
    out = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"MJPG"), FPS, (320, 240))
    for frame in range(FRAMES):
        image = np.full((240, 320, 3), 150, np.uint8)
        center = round((START + SPEED * frame) * 16), 120 * 16
        cv2.circle(image, center, 12 * 16, (40, 40, 200), -1, cv2.LINE_AA, shift=4)
        out.write(image)
    out.release()


@pytest.fixture(scope="module")
def received(tmp_path_factory):
    """What a client got of a served file, and when each frame was taken as the CSV has it."""
    folder = tmp_path_factory.mktemp("loopback")
    video(folder / "film.avi")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    tracker = subprocess.Popen(
        [sys.executable, "-m", "laptop", "track", "--camera", str(folder / "film.avi")]
        + ["--effector", "disc:red", "--goal", "300,20", "--host", "127.0.0.1", "--port", "0"]
        + ["--csv", str(folder / "film.csv")],
        cwd=ROOT,
        env={**environment, "BRICKSERVO_STATE": str(folder / "laptop")},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        for line in tracker.stdout:
            told = re.search(r"(127\.0\.0\.1:\d+) --code (\S+)", line)
            if told:
                break
        client = subprocess.run(
            [oldest_python(), "-c", CLIENT, told[1], told[2]],
            env={**environment, "BRICKSERVO_STATE": str(folder / "brick")},
            capture_output=True,
            text=True,
            timeout=30,
        )
        tracker.communicate(timeout=30)
    finally:
        tracker.kill()
        tracker.wait()
        tracker.stdout.close()
    assert (client.returncode, tracker.returncode) == (0, 0), client.stderr
    assert "Traceback" not in client.stderr
    rows = [line.split(",") for line in (folder / "film.csv").read_text().splitlines()[1:]]
    told = {int(frame): float(t) for frame, t, marker, *_ in rows if marker == "effector"}
    return [json.loads(line) for line in client.stdout.splitlines()], told


def test_the_position_received_is_that_of_its_frame(received):
    observations, _ = received
    assert len(observations) > 50
    for _, seq, _, _, markers in observations:
        u, v, confidence = markers["effector"]
        assert u == pytest.approx(START + SPEED * seq, abs=0.2)
        assert v == pytest.approx(120, abs=0.2)
        assert confidence > 0.9
        assert markers["goal"] == [300, 20, 1]


def test_the_capture_time_received_is_true_to_5_ms_on_the_receivers_clock(received):
    observations, told = received
    first = told[min(told)] - min(told) / FPS
    for _, seq, t, now, _ in observations:
        assert t == pytest.approx(told[seq], abs=0.005)
        assert t == pytest.approx(first + seq / FPS, abs=0.005)
        assert t < now


def test_a_receiver_that_sleeps_gets_the_newest_only(received):
    observations, _ = received
    pausing = [row for row in observations if row[0]]
    assert len(pausing) >= 2
    for _, _, t, now, _ in pausing[1:]:
        assert now - t < 0.25  # half a second of older ones waited in the line
    for before, after in zip(pausing[1:], pausing[2:]):
        assert after[1] - before[1] > 20


def test_every_frame_comes_once_and_in_order(received):
    observations, _ = received
    numbers = [row[1] for row in observations]
    assert numbers == sorted(set(numbers))
    awake = [row[1] for row in observations if not row[0]]
    assert len(awake) > 0.5 * (awake[-1] - awake[0])
