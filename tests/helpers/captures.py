"""Captures that do what a test says, in the place of OpenCV's."""

import queue
import threading
from contextlib import contextmanager

import cv2
from numbered_frames import picture
from waiting import PATIENCE

from laptop.see.camera import webcams
from laptop.see.camera.cameras import open_camera


class FakeCapture:
    """A webcam whose frames come when the test says so."""

    def __init__(self, *words, now=lambda: 0.0):
        self.words = words
        self.opened, self.released = True, threading.Event()
        self.setup = 100  # frames that come by themselves, until `begin`
        self.frames = queue.Queue()
        self.hungry, self.giving = threading.Event(), threading.Lock()
        self.settings = {
            cv2.CAP_PROP_FPS: 30.0,
            cv2.CAP_PROP_EXPOSURE: 157.0,
            cv2.CAP_PROP_GAIN: 20.0,
            cv2.CAP_PROP_WB_TEMPERATURE: 4600.0,
            cv2.CAP_PROP_FOCUS: -1.0,
        }
        self.refused = set()
        self.asked = []
        self.image = picture(5)
        self.stamp = 0.0
        self.begun = False

    def isOpened(self):  # noqa: N802
        return self.opened

    def set(self, key, value):
        self.asked.append((key, value))
        if key in self.refused or self.settings.get(key) == -1:
            return False
        self.settings[key] = value
        return True

    def get(self, key):
        if key == cv2.CAP_PROP_POS_MSEC:
            return 1000 * self.stamp
        return self.settings.get(key, 0.0)

    def grab(self):
        if not self.begun:
            return True
        with self.giving:  # or it would be hungry between two frames of one gift
            if self.frames.empty():
                self.hungry.set()
        item = self.frames.get(timeout=PATIENCE)
        self.hungry.clear()
        if item is None:
            return False
        self.image, self.stamp = item
        return True

    def retrieve(self):
        return self.image is not None, self.image

    def release(self):
        self.released.set()

    def give(self, *numbers, stamp=0.0):
        """Let frames come, and wait until they have all been taken."""
        self.hungry.wait(PATIENCE)
        with self.giving:
            self.hungry.clear()
            for number in numbers:
                self.frames.put((None if number is None else picture(number), stamp))
        assert self.hungry.wait(PATIENCE)


class EndlessCapture:
    """A capture whose count is a lie, and whose time stands still."""

    grabbed = 0

    def isOpened(self):  # noqa: N802
        return True

    def grab(self):
        self.grabbed += 1
        return self.grabbed <= 3

    def retrieve(self):
        return True, picture(1)

    def get(self, key):
        return {cv2.CAP_PROP_FPS: 10.0, cv2.CAP_PROP_FRAME_COUNT: 1e8}.get(key, 0.0)

    def release(self):
        pass


@contextmanager
def fake_webcam(monkeypatch):
    """Give what opens a webcam on FakeCaptures; end them all."""
    monkeypatch.setattr(webcams, "LINUX", True)
    monkeypatch.setattr(webcams, "SETTLING_FRAMES", 3)
    monkeypatch.setattr(webcams.Webcam, "stamps", True)
    opened, made = [], []

    def plug(prepare=lambda capture: None, now=lambda: 50.0, **options):
        def make(*words):
            capture = FakeCapture(*words)
            prepare(capture)
            made.append(capture)
            return capture

        real = webcams.Webcam.open

        def open_and_begin(self):
            capture = real(self)
            capture.begun = True
            return capture

        monkeypatch.setattr(webcams.Webcam, "open", open_and_begin)
        source = open_camera("2", make=make, now=now, **options)
        opened.append(source)
        return source, made

    yield plug
    for source in opened:
        for capture in made:
            capture.frames.put(None)
        source._closing.set()
        for capture in made:
            capture.frames.put(None)
        source.close()
