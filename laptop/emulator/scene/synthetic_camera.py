"""A camera that looks at the emulated arm: sensor and timing around `scene`.

Frame k is taken at its due time, which strays slowly around k / fps; `t` is the middle of its
exposure, so a marker that moves evenly is seen where it was at `t`.  It is handed over `delay` and
some jitter later, never before.  Everything random comes from the seed and k: the same pose gives
the same bytes.
"""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Sequence
from typing import Any

from laptop.emulator.live import Pose
from laptop.emulator.pace import BUSY_PACE, Member, PacedClock, PaceMeter, in_words
from laptop.emulator.scene.poses import LivePoses, Poses, RecordedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import CAMERAS, read_scene
from laptop.emulator.scene.sensor import Sensor
from laptop.see.camera.frames import Frame
from shared.arm_description import find_arm, read_arm
from shared.state import default_arm

RATE_DRIFT_PERIOD = 20.0
"""Period in which the rate strays and comes back, s."""

MAX_JITTER_MEANS = 6
"""Greatest jitter, times its mean; beyond, it is cut off."""

PAINT_LEAD = 0.01
"""Lead before its due time at which a picture is painted, s: its pose has been reported by then."""

MIN_WAIT = 1e-4
"""Shortest wait for a picture to be due, s."""

MAX_TRACKING_TIME = 0.01
"""Time for which the world goes on while a picture is tracked and sent, s; then it waits."""

MAX_POSE_SPACING = 1.0
"""Greatest distance of a moving marker between two poses of one exposure, px."""
MAX_POSES = 16
"""Greatest number of poses of one exposure."""


class SyntheticCamera:
    """Pictures of a scene at their times.

    Args:
        scene: what it sees; another arm's scene takes its place when a pose is of another arm.
        poses: the arm's pose at a time, s.
        now, sleep: its clock; `read` waits with `sleep`.
        start: when frame 0 is taken, s; now if None.
        world: the clock of a world in real time, which can wait for the pictures; None: there is
            none.

    Attributes:
        name, fps: as of every camera.
        ended: whether it has been closed.
    """

    def __init__(
        self,
        scene: Scene,
        poses: Poses,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        start: float | None = None,
        world: PacedClock | None = None,
    ) -> None:
        self.scene = scene
        self.constants = scene.constants
        self.name = f"synthetic {self.constants['camera']}"
        self.fps: float = self.constants["fps"]
        self.ended = False
        self._poses = poses
        self.now, self._sleep = now, sleep
        self._world = world
        self._member: Member | None = None
        self._pace = world and PaceMeter(world)
        self._start = now() if start is None else start
        self._sensor = Sensor(self.constants)
        self._next = 0
        self._ready: Frame | None = None

    @property
    def notes(self) -> list[str]:
        """Notes for people on the pictures."""
        c = self.constants
        return [
            *self._poses.notes,
            f"exposure {1000 * c['exposure']:g} ms and white balance are fixed",
        ]

    def keep_pace(self) -> None:
        """Let the world wait for the reader of the pictures, until the camera is closed."""
        if self._world and self._member is None and not self.ended:
            self._member = self._world.join(self.name)

    @property
    def slowness(self) -> str:
        """Note for people on the pace, or ""."""
        pace = self._pace.sample() if self._pace else 1.0
        return in_words(pace) if pace < BUSY_PACE else ""

    # Time

    def time_of(self, index: int) -> float:
        """Return the capture time of a frame, s: the middle of its exposure."""
        c = self.constants
        frames = RATE_DRIFT_PERIOD * c["fps"]
        stray = math.sin(2 * math.pi * index / frames) * frames / (2 * math.pi)
        return float(self._start + (index + c["fps_wander"] * stray) / c["fps"])

    def due(self, index: int) -> float:
        """Return the time at which a frame is handed over, s; frames never overtake one another."""
        lookback = math.ceil(MAX_JITTER_MEANS * self.constants["jitter"] * self.fps * 1.5)
        return max(self._arrival(k) for k in range(max(0, index - lookback), index + 1))

    @property
    def _readout_end(self) -> float:
        """Time from the middle of the exposure to the end of the last row's, s."""
        return float(self.constants["exposure"] + self.constants["readout"]) / 2

    @property
    def _least_delay(self) -> float:
        return float(max(self.constants["delay"], self._readout_end))

    def _arrival(self, index: int) -> float:
        late = (
            min(self._rng(index, 0).expovariate(1.0), MAX_JITTER_MEANS) * self.constants["jitter"]
        )
        return float(self.time_of(index) + self._least_delay + late)

    def _rng(self, index: int, what: int) -> random.Random:
        c = self.constants
        source = (c["seed"] << 4) + CAMERAS.index(c["camera"])
        return random.Random((source << 36) + (index << 1) + what)

    def newest(self, t: float) -> int:
        """Return the index of the newest frame handed over by time t, s; -1 if there is none."""
        c = self.constants
        ahead = c["fps_wander"] * RATE_DRIFT_PERIOD / (2 * math.pi)
        taken_by = t - self._least_delay
        index = math.floor((taken_by - self._start + ahead) * self.fps) + 1
        while index >= 0 and (self.time_of(index) > taken_by or self.due(index) > t):
            index -= 1
        return int(max(index, -1))

    # Pictures

    def capture(self, index: int) -> Frame:
        """Return frame number `index`, whatever the time is."""
        t = self.time_of(index)
        pose = self._pose(t)
        shutter = self._shutter(t, pose)
        patch = self.scene.patch(self._exposed(t + shutter, pose), pose.ink, t - self._start)
        rng = self._rng(index, 1)
        image = self._sensor.develop(self.scene, patch, self._lamp(t), rng)
        return Frame(index, t, image)

    def frame_at(self, t: float) -> Frame | None:
        """Return the newest frame that a program can have at time t, s; None before the first."""
        index = self.newest(t)
        return None if index < 0 else self.capture(index)

    def truth(self, index: int) -> dict[str, tuple[float, float]]:
        """Return the markers' true centres in frame number `index`, (u, v) px."""
        t = self.time_of(index)
        pose = self._pose(t)
        shutter = self._shutter(t, pose)
        return self.scene.truth(self._pose(t + shutter).q if shutter else pose.q)

    def _pose(self, t: float) -> Pose:
        pose = self._poses(t)
        if pose.arm != self.scene.arm:
            self.scene = Scene(pose.arm, self.scene.asked)
        return pose

    def _shutter(self, t: float, pose: Pose) -> float:
        """Return the time by which the marker's row is taken later than the middle one, s."""
        readout = self.constants["readout"]
        if not readout:
            return 0.0
        shift = 0.0
        for _ in range(3):
            _, v = self.scene.truth(self._poses(t + shift).q)["effector"]
            share = (v + 0.5) / self.constants["height"] - 0.5
            shift = readout * min(max(share, -0.5), 0.5)
        return shift

    def _exposed(self, t: float, pose: Pose) -> list[Sequence[float]]:
        """Return joint angles, rad, spread evenly over the exposure around t, as many as needed."""
        exposure = self.constants["exposure"]
        first, last = (self._poses(t + share * exposure).q for share in (-0.5, 0.5))
        start, end = (self.scene.truth(q)["effector"] for q in (first, last))
        distance = math.dist(start, end)
        if distance < MAX_POSE_SPACING / 4:
            return [self._poses(t).q]
        count = min(1 + math.ceil(distance / MAX_POSE_SPACING), MAX_POSES)
        return [self._poses(t + ((k + 0.5) / count - 0.5) * exposure).q for k in range(count)]

    def _lamp(self, t: float) -> float:
        """Return the brightness of lamps on the mains, the mean over the exposure."""
        c = self.constants
        if not c["flicker"]:
            return 1.0
        rate = 2 * math.pi * 2 * c["mains"]
        half = rate * c["exposure"] / 2
        swing = math.sin(half) / half if half else 1.0
        return float(1 + c["flicker"] * swing * math.cos(rate * (t - self._start)))

    # As a camera

    def read(self, timeout: float = 1.0) -> Frame | None:
        """Return the newest frame not yet given, or None if there is none within `timeout` s."""
        deadline = self.now() + timeout
        while not self.ended:
            now = self.now()
            index = max(self.newest(now), self._next)
            due = self.due(index)
            if self._member:
                self._member.promise(due + 2 * MIN_WAIT)
            ready = self._ready is not None and self._ready.index == index
            begin = max(due - PAINT_LEAD, self.time_of(index) + self._readout_end)
            if not ready and now >= begin:
                self._ready = self.capture(index)
                # Painting may take longer than a frame: without a new time it would never end.
                ready, now = True, self.now()
            if ready and now >= due:
                frame, self._ready = self._ready, None
                self._next = index + 1
                if self._member:
                    self._member.promise(due + MAX_TRACKING_TIME)
                return frame
            if now >= deadline:
                return None
            self._wait(max(min(due if ready else begin, deadline), now + MIN_WAIT), now)
        return None

    def _wait(self, until: float, now: float) -> None:
        if self._world:
            self._world.sleep_until(until)
        else:
            self._sleep(until - now)

    def close(self) -> None:
        """Stop giving frames."""
        self.ended = True
        self._poses.close()
        if self._member:
            self._member.leave()
        if self._world:
            self._world.close()
            self._world = self._pace = None

    def __enter__(self) -> SyntheticCamera:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def open_live(
    text: str = "", folder: str | None = None, camera: str = "A", resting: str | None = None
) -> SyntheticCamera:
    """Return a camera on the arm of `simulate --realtime`, or on one at home if none runs.

    Args:
        text: constants, see `scene_constants.read_scene`.
        folder: see `live.PoseReader`.
        camera: its name, on which its place and its own constants in the text depend.
        resting: the arm at home, its name or file; None: as $BRICKSERVO_ARM says, else planar.
    """
    constants = read_scene(text, camera)
    poses = LivePoses(read_arm(find_arm(resting or default_arm())), folder)
    world = PacedClock(folder)
    arm = poses(world.now()).arm
    return SyntheticCamera(Scene(arm, constants), poses, world.now, world=world)


def film(brick: Any, text: str = "", camera: str = "A") -> SyntheticCamera:
    """Return a camera in the virtual time of an emulated brick: `capture`, `frame_at`, `truth`."""
    scene = Scene(brick.arm, read_scene(text, camera))
    world = brick.world
    return SyntheticCamera(scene, RecordedPoses(brick), world.now, world.sleep, start=0.0)
