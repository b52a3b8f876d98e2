"""Stand-ins for a camera, its tracker and the server, for tests of what lies between them."""

import numpy as np

from laptop.see.camera.frames import Frame
from laptop.see.markers.tracker import Sighting


class FakeCamera:
    """Gives what the test says; None is a timeout."""

    name, fps, notes, why = "fake", 30.0, (), ""

    def __init__(self, *frames, after=None):
        self.frames = list(frames)
        self.after = after
        self.closed = False

    @property
    def ended(self):
        return not self.frames and self.after is None

    def read(self, timeout):
        if self.frames:
            return self.frames.pop(0)
        return self.after(timeout) if self.after else None

    def close(self):
        self.closed = True


class FakeTracker:
    """Sees the effector at (index, t) in the pixel's value, unless that is 0."""

    def __init__(self):
        self.why = {"effector": ""}
        self.windows = {}

    def find(self, image, t):
        value = int(image[0, 0, 0])
        self.why = {"effector": "" if value else "too dark"}
        return {"effector": Sighting(value, t, value / 100, 4.0) if value else None}


class FakeServer:
    def __init__(self):
        self.sent = []

    def publish(self, observation):
        self.sent.append(observation)


def frame(index, t, value):
    return Frame(index, t, np.full((2, 2, 3), value, np.uint8))
