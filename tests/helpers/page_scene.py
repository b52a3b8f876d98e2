"""A page's controller before cameras and a brick that do what a test says."""

import multiprocessing
import threading
from contextlib import contextmanager

import cv2
import numpy as np
from waiting import PATIENCE

from laptop.page import camera_feed
from laptop.page.brick_call import ComingBricks
from laptop.page.camera_feed import CameraFeed
from laptop.page.controller import PageController
from laptop.page.marker_height import DrawingArm
from laptop.page.rpc import RpcClient, serve_requests
from laptop.see.camera.frames import Frame
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.pipeline import CameraPipeline, PipelineOutputs
from laptop.see.serve.server_state import ServerState as LinkState
from shared.messages import EFFECTOR, GOAL, Status

WIDTH, HEIGHT = 320, 240
RED, GREEN, BLUE = (30, 30, 200), (60, 150, 30), (190, 70, 20)
PATH = [(float(u), 100.0) for u in range(50, 151, 5)]


class FakeCamera:
    name, fps, notes, ended = "fake", 30.0, (), False

    def __init__(self):
        self.frames = []

    def read(self, timeout):
        return self.frames.pop(0) if self.frames else None


class FakeServer:
    """A brick that does what the test says."""

    def __init__(self):
        self.sent = []
        self.there = True
        self.progress = None
        self.status = Status(0.0, (0.1, 0.2), None, "ready")

    def send(self, message):
        self.sent.append(message)
        return self.there

    def offer(self, offer):
        self.offered = offer
        return self.send(offer.draw)

    def publish(self, observation):
        pass

    def commands(self):
        return ["python -m laptop brick run visual_servoing.py :7711"]

    def state(self):
        client = "10.0.0.2" if self.there else None
        progress = self.progress if self.there else None
        return LinkState(
            client=client, status=self.status, progress=progress, progress_age=progress and 0.0
        )

    def tell(self, verdict, run, **more):
        self.status = Status(0.0, (0.1, 0.2), 12.5, verdict, run=run, **more)


class PageScene:
    """Cameras that show what a test wants, and the controller they belong to."""

    def __init__(
        self, folder, cameras=1, goal=None, bring=None, start_on_brick=None, arm=None, height=None,
        memory=None, **options
    ):  # fmt: skip
        self.t = 100.0
        self.server = FakeServer()
        self.file = folder / "markers.ini"
        self.trackers = [
            Tracker([read_spec(EFFECTOR, "disc:red"), read_spec(GOAL, "disc:green")])
            for _ in range(cameras)
        ]
        self.watchers = [
            CameraPipeline(
                name, FakeCamera(), tracker, goal, PipelineOutputs(self.server), now=lambda: self.t
            )
            for name, tracker in zip("AB", self.trackers, strict=False)
        ]
        self.controller = PageController(
            [
                CameraFeed(watcher, tracker, "fake")
                for watcher, tracker in zip(self.watchers, self.trackers, strict=True)
            ],
            self.server,
            self.file,
            ComingBricks(bring, start_on_brick),
            DrawingArm(arm, height, memory),
            now=lambda: self.t,
            clock=lambda: self.t,
            **options,
        )
        self.index = -1

    def show(self, tip=(100, 120), goal=(220, 60), ink=RED, light=1.0):
        """One more frame, 0.05 s later; the controller has a heartbeat."""
        self.t += camera_feed.HEARTBEAT_PERIOD
        self.index += 1
        image = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
        for where, color in ((tip, ink), (goal, GREEN)):
            if where:
                cv2.circle(image, where, 14, color, -1, cv2.LINE_AA)
        image = (image * light).astype(np.uint8)
        for watcher in self.watchers:
            watcher.camera.frames.append(Frame(self.index, self.t - 0.02, image))
            watcher.step(0)
        self.controller.heartbeat()
        return self.controller.frames.view("A")


def mark(shown, name=EFFECTOR):
    return next(mark for mark in shown.marks if mark.name == name)


def run(scene, number, verdict="converged", steps=5, orders=True, e=True, camera="A"):
    """Let the brick do a run in which the tip comes from (60, 120) to (100, 120)."""
    for k in range(steps):
        u = 60 + 10 * min(k, 4)
        off = {f"{camera}.u": u - 102.0, f"{camera}.v": 2.0} if e else {}
        scene.server.tell("", number, moves=k, e=off, condition=2.0 + k)
        for _ in range(10):
            scene.show(tip=(u, 120))
    scene.server.tell(verdict, number, moves=steps, e=off, reason="because", condition=2.0)
    scene.show(tip=(100, 120))
    scene.show(tip=(100, 120))


@contextmanager
def connected(controller):
    """A client on the other side of a pipe, as long as it lasts."""
    ours, theirs = multiprocessing.Pipe()
    thread = threading.Thread(target=serve_requests, args=(controller, theirs))
    thread.start()
    try:
        yield RpcClient(ours)
    finally:
        ours.close()
        thread.join(PATIENCE)
    assert not thread.is_alive(), "it ends with the other side"
