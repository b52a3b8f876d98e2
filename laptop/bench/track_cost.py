"""Cost per frame of the tracker and the usual recipes, and of serving a brick."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from laptop.bench.track_methods import (
    ENCLOSING,
    HOUGH,
    blur_and_enclose,
    hough,
    hsv_contours,
    hsv_moments,
)
from laptop.bench.track_precision import FPS
from laptop.emulator.scene.marker_items import ARUCO_IDS
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.server import TrackingServer
from robot import tracking_client
from shared.arm_description import find_arm, read_arm
from shared.messages import Observation
from shared.pairing import new_code
from shared.state import CODE, STATE

TURNS = 40
"""Number of rounds in which everything is timed."""
LAP_FRAMES = 8
"""Number of pictures of a lap."""
FULL_FRAME_RECIPES = ("HSV, gate, moments", "HSV, gate, contours")
"""Names of the usual recipes on a whole frame."""
ABSENT = "ours, searching the whole frame"
"""Name of the tracker without its marker."""


@dataclass(frozen=True)
class Cost:
    """Time per frame, us (median, 95th percentile), and share of frames with the marker seen."""

    method: str
    median: float
    p95: float
    seen: float


def lap(text: str) -> list[np.ndarray]:
    """Return pictures (640x480) of an arm whose marker goes round a small, closed circle."""
    arm = read_arm(find_arm("planar"))

    def angles(t: float) -> tuple[float, float]:
        phase = 2 * math.pi * FPS * t / LAP_FRAMES
        return 0.3 + 0.015 * math.cos(phase), -0.8 + 0.03 * math.sin(phase)

    scene = Scene(arm, read_scene(f"{text},fps_wander=0,seed=5"))
    camera = SyntheticCamera(scene, ScriptedPoses(arm, angles), start=0.0)
    return [camera.capture(k).image for k in range(LAP_FRAMES)]


def contenders() -> dict[str, tuple[list[np.ndarray], Callable[[np.ndarray, float], Any]]]:
    """Return the work that is timed: its pictures, and a function of one of them."""
    discs, balls, arucos = (lap(f"marker={kind}") for kind in ("disc", "ball", "aruco"))
    nothing = lap("effector=blue,goal=none")

    def learned(name: str, kind: str, image: np.ndarray) -> Marker:
        arm = read_arm(find_arm("planar"))
        scene = Scene(arm, read_scene(f"marker={kind},seed=5"))
        u, v = scene.truth((0.315, -0.8))[name]
        return learn(name, image, (round(u), round(v)), kind)

    red, green = (learned(name, "disc", discs[0]) for name in ("effector", "goal"))
    ball = learned("effector", "ball", balls[0])
    aruco = Marker("effector", "aruco", id=ARUCO_IDS["effector"])
    color = red.color
    assert color is not None
    copy = np.empty_like(discs[0])
    radius = 13.0

    def tracking(*markers: Marker) -> Callable[[np.ndarray, float], Any]:
        tracker = Tracker(markers)
        return lambda image, t: all(tracker.find(image, t).values()) or None

    def copying(image: np.ndarray, t: float) -> bool:
        np.copyto(copy, image)
        return True

    return {
        "np.copyto of the frame": (discs, copying),
        "ours, one disc": (discs, tracking(red)),
        "ours, two discs": (discs, tracking(red, green)),
        "ours, one ball": (balls, tracking(ball)),
        "ours, one ArUco marker": (arucos, tracking(aruco)),
        ABSENT: (nothing, tracking(red)),
        FULL_FRAME_RECIPES[0]: (discs, lambda image, t: hsv_moments(image, color)),
        FULL_FRAME_RECIPES[1]: (discs, lambda image, t: hsv_contours(image, color)),
        ENCLOSING: (discs, lambda image, t: blur_and_enclose(image, color)),
        HOUGH: (discs, lambda image, t: hough(image, radius)),
    }


def costs(turns: Iterable[int], clock: Callable[[], int] = time.perf_counter_ns) -> list[Cost]:
    """Time all of them in turn, on one thread, so that a disturbance meets all.

    A turn is two laps, of which the second counts: in the first one the marker is searched for, and
    the caches are filled.

    Args:
        turns: their numbers, from 0.
        clock: gives the time, ns.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        timed = contenders()
        spent: dict[str, list[int]] = {name: [] for name in timed}
        seen = dict.fromkeys(timed, 0)
        for turn in turns:
            for name, (images, work) in timed.items():
                for k, image in enumerate([*images, *images]):
                    t = (2 * turn * LAP_FRAMES + k) / FPS
                    begin = clock()
                    found = work(image, t)
                    end = clock()
                    if k >= len(images):
                        spent[name].append(end - begin)
                        seen[name] += found is not None
    finally:
        cv2.setNumThreads(threads)
    return [
        Cost(
            name,
            float(np.median(times)) / 1000,
            float(np.percentile(times, 95)) / 1000,
            seen[name] / len(times),
        )
        for name, times in spent.items()
    ]


def serving(fps: float = 60.0, seconds: float = 5.0) -> float:
    """Return the part of a core that serving a brick `fps` observations a second costs.

    The brick's own client runs in another process, over TCP; what the bare loop costs is taken off.

    Raises:
        RuntimeError: the client did not come.
    """
    seen = {"effector": (311.27, 208.41, 0.97), "goal": (400.12, 96.35, 1.0)}

    def spent(publish: Callable[[Observation], None]) -> float:
        begin, start = time.process_time(), time.monotonic()
        for k in range(round(fps * seconds)):
            time.sleep(max(0.0, start + k / fps - time.monotonic()))
            publish(Observation(k, "A", time.monotonic(), seen))
        return (time.process_time() - begin) / (time.monotonic() - start)

    bare = spent(lambda observation: None)
    code = new_code()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        server = TrackingServer("127.0.0.1", 0, code)
        stack.callback(server.close)
        client = subprocess.Popen(
            [sys.executable, tracking_client.__file__, f"127.0.0.1:{server.port}"],
            env={**os.environ, STATE: folder, CODE: code},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(client.wait)
        stack.callback(client.terminate)
        deadline = time.monotonic() + 10
        while server.state().client is None:
            if time.monotonic() > deadline:
                raise RuntimeError("the client did not connect within 10 s")
            time.sleep(0.01)
        return spent(server.publish) - bare


def full_frame_cost(timed: Iterable[Cost]) -> float:
    """Return the time of the usual full-frame recipe, us: the quicker of its two variants."""
    return min(cost.median for cost in timed if cost.method in FULL_FRAME_RECIPES)
