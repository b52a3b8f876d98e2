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
from typing import Any, Protocol

import cv2
import numpy as np

from laptop.simulator.host.pace import BUSY, Member, Pace, PacedClock, in_words
from laptop.simulator.live import NO_RUN, Follower, History, Pose
from laptop.simulator.scene.optics import Box, light_of, marker_light, to_linear, to_srgb
from laptop.simulator.scene.scene import CAMERAS, Patch, Scene, read_scene
from laptop.vision.frames import Frame
from shared.arm_description import Arm, find_arm, read_arm
from shared.state import default_arm

STEPS = 64
"""Levels per DN before noise and rounding."""

# Encoded value (in STEPS per DN) of light in 65535ths.
ENCODED = np.round(STEPS * to_srgb(np.arange(65536) / 65535)).astype(np.int16)

WANDER = 20.0
"""The rate strays and comes back within so many seconds."""

MOST_JITTER = 6
"""Times its mean; beyond, it is cut off."""

LEAD = 0.01
"""So long before it is due a picture is painted, s: by then another process has told its pose."""

SHORTEST = 1e-4
"""Of what it waits for a picture to be due, s."""

TRACKED = 0.01
"""To be looked at and sent a picture takes what it takes, up to this, s; then the world waits."""

FINEST = 1.0
"""A moving arm is painted at least every so many px of its marker's way."""
MOST_POSES = 16

CHROMA = {
    "420": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420,
    "422": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422,
    "444": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
}


def through_jpeg(image: np.ndarray, quality: int, chroma: str = "420") -> np.ndarray:
    """The image after a JPEG of that quality (1 .. 100) and chroma subsampling."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, CHROMA[chroma]]
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", image, options)[1], cv2.IMREAD_COLOR))


def blurred(light: np.ndarray, sigma: float) -> np.ndarray:
    """Light after a lens of Gaussian point spread, sigma px."""
    if not sigma:
        return light
    size = 2 * math.ceil(3.5 * sigma) + 1
    return cv2.GaussianBlur(light, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)


def marker_frame(
    kind: str,
    u: float,
    v: float,
    radius: float,
    colour: str = "red",
    background: str | np.ndarray = "#808080",
    size: tuple[int, int] = (128, 128),
    motion: tuple[float, float] = (0.0, 0.0),
    blur: float = 0.7,
    noise: float = 3.0,
    jpeg: int = 0,
    chroma: str = "420",
    gain: float = 1.0,
    warm: float = 0.0,
    number: int = 0,
    seed: int | Sequence[int] = 0,
) -> np.ndarray:
    """A picture of one marker with its centre at (u, v), through the sensor of the camera.

    Args:
        kind: "disc", "ball" or "aruco".
        u, v, radius: px; of an ArUco the radius is half the side of its black square.
        colour: of disc and ball, a word of `optics.COLOURS` or #rrggbb.
        background: a word, #rrggbb, or a picture (BGR, uint8), which then gives the size.
        size: (width, height), px.
        motion: px (u, v) that it moves during the exposure, centred on (u, v).
        blur: sigma of the point spread, px.
        noise: sigma, DN.
        jpeg: quality; 0 for none.
        chroma: of the JPEG, "420", "422" or "444".
        gain, warm: as in `scene.CONSTANTS`.
        number: of the ArUco.
        seed: of the noise.

    Returns:
        BGR, uint8.
    """
    if isinstance(background, str):
        ground = np.broadcast_to(light_of(background), (size[1], size[0], 3))
    else:
        ground = to_linear(background)
    light = marker_light(kind, u, v, radius, light_of(colour), ground, motion, number)
    exposed = blurred(light, blur) * (gain * np.array([1 - warm, 1.0, 1 + warm], np.float32))
    values = to_srgb(exposed)
    if noise:
        values = values + noise * np.random.default_rng(seed).standard_normal(values.shape)
    image = np.clip(np.round(values), 0, 255).astype(np.uint8)
    return through_jpeg(image, jpeg, chroma) if jpeg else image


class Sensor:
    """Light becomes bytes: lens blur, exposure, sRGB, noise, 8 bit, JPEG.

    The ground is developed once and again where it changes; per frame only the patch is.
    """

    def __init__(self, constants: dict[str, Any]) -> None:
        self.constants = constants
        c = constants
        fall = np.linspace(1, 1 - c["gradient"], c["width"], dtype=np.float32)
        tint = np.array([1 - c["warm"], 1.0, 1 + c["warm"]], np.float32)
        light = (65535 * c["gain"] * fall)[:, None] * tint
        self._light = np.ascontiguousarray(
            np.broadcast_to(light, (c["height"], c["width"], 3)), np.float32
        )
        self._scene: Scene | None = None
        self._changes = 0
        self._lamp = 1.0
        self._blurred = np.zeros(0, np.float32)
        self._ground = np.zeros(0, np.int16)
        self._noise = np.zeros(0, np.int16)
        if c["noise"]:
            draw = np.random.default_rng([c["seed"], 3])
            shape = c["height"] + 67, c["width"] + 83, 3
            bank = draw.standard_normal(shape, np.float32) * (STEPS * c["noise"])
            self._noise = np.round(bank).astype(np.int16)

    def develop(self, scene: Scene, patch: Patch, lamp: float, luck: random.Random) -> np.ndarray:
        """The picture (BGR, uint8) of a scene's ground with a patch on it.

        Args:
            lamp: brightness of the lamp during this exposure, 1 on average.
            luck: draws the noise.
        """
        self._refresh(scene, lamp)
        values = self._ground.copy()
        if not patch.inner.empty:
            soft = blurred(patch.pixels, self.constants["blur"])
            inside = patch.inner.seen_from(patch.outer).cut(soft)
            patch.inner.cut(values)[:] = self._encoded(inside, patch.inner, lamp)
        image = self._read_out(values, luck)
        quality = self.constants["jpeg"]
        return through_jpeg(image, quality) if quality else image

    def _refresh(self, scene: Scene, lamp: float) -> None:
        """Have the ground as it is now under this lamp."""
        if scene is not self._scene:
            self._scene, self._changes = scene, 0
            self._blurred = np.zeros_like(scene.ground)
            self._ground = np.zeros(scene.ground.shape, np.int16)
        margin = math.ceil(3.5 * self.constants["blur"]) + 1
        for box in scene.changes[self._changes :]:
            grown = box.grown(margin, scene.frame)
            wide = grown.grown(margin, scene.frame)
            soft = blurred(wide.cut(scene.ground), self.constants["blur"])
            grown.cut(self._blurred)[:] = grown.seen_from(wide).cut(soft)
            if lamp == self._lamp:
                grown.cut(self._ground)[:] = self._encoded(grown.cut(self._blurred), grown, lamp)
        self._changes = len(scene.changes)
        if lamp != self._lamp:
            self._lamp = lamp
            self._ground = self._encoded(self._blurred, scene.frame, lamp)

    def _encoded(self, light: np.ndarray, box: Box, lamp: float) -> np.ndarray:
        exposed = cv2.multiply(light, box.cut(self._light), scale=lamp, dtype=cv2.CV_16U)
        return ENCODED[exposed]

    def _read_out(self, values: np.ndarray, luck: random.Random) -> np.ndarray:
        if not len(self._noise):
            return cv2.convertScaleAbs(values, alpha=1 / STEPS)
        height, width = values.shape[:2]
        top, left = luck.randrange(68), luck.randrange(84)
        noise = self._noise[top : top + height, left : left + width]
        sign = luck.choice((-1, 1)) / STEPS
        return cv2.addWeighted(values, 1 / STEPS, noise, sign, 0, dtype=cv2.CV_8U)


class Poses(Protocol):
    """Where a camera learns what to show."""

    @property
    def notes(self) -> list[str]:
        """What a person should know about it."""

    def __call__(self, t: float) -> Pose:
        """The pose at t, s on the camera's clock."""

    def close(self) -> None:
        """No more is asked for."""


class ScriptedPoses:
    """Poses from a function; no ink.

    Args:
        arm: Arm.
        angles: t, s -> q, rad.
    """

    def __init__(self, arm: Arm, angles: Callable[[float], Sequence[float]]) -> None:
        self.notes: list[str] = []
        self._arm, self._angles = arm, angles

    def __call__(self, t: float) -> Pose:
        """What the function says for t."""
        return Pose(self._arm, tuple(self._angles(t)), [])

    def close(self) -> None:
        """Nothing is held."""


class RecordedPoses:
    """The poses of an emulated brick in this process; t is its world's time.

    Args:
        brick: laptop.simulator.device.brick.EmulatedBrick.
    """

    def __init__(self, brick: Any) -> None:
        self._brick = brick
        self._history = History(brick.arm)
        self._taken = 0
        self.notes: list[str] = []

    def __call__(self, t: float) -> Pose:
        """The true pose at t, s."""
        record = self._brick.record
        for sample in record[self._taken :]:
            self._history.append(sample.t, sample.q, sample.pen)
        self._taken = len(record)
        return self._history.at(t)

    def close(self) -> None:
        """Nothing is held."""


class LivePoses:
    """The poses of the arm that runs in real time in another process, or of one at home.

    Args:
        arm: shown as long as none runs.
        folder: see `live.Follower`.
    """

    def __init__(self, arm: Arm, folder: str | None = None) -> None:
        self.follower = Follower(folder)
        self._resting = Pose(arm, tuple(joint.home for joint in arm.joints), [])

    def __call__(self, t: float) -> Pose:
        """The true pose at t, s on the world's clock."""
        self.follower.poll()
        return self.follower.at(t) or self._resting

    def close(self) -> None:
        """Follow no more."""
        self.follower.close()

    @property
    def notes(self) -> list[str]:
        """What is shown, in words."""
        follower = self.follower
        if follower.header is None:
            return [NO_RUN, follower.refused] if follower.refused else [NO_RUN]
        name = follower.header["script"]
        if follower.alive:
            return [f"shows {name}, process {follower.header['pid']}"]
        return [f"{name} has ended; the arm stays where it was"]


class SyntheticCamera:
    """Pictures of a scene at their times.

    Args:
        scene: what it sees; another arm's scene takes its place when a pose is of another arm.
        poses: where the arm is when.
        now, sleep: its clock; `sleep` is what `read` waits with.
        start: when frame 0 is taken, s; now if None.
        world: the clock of a world in real time, which can wait for the pictures; None: there is
            none.

    Attributes:
        name, fps: as of every camera.
        ended: it has been closed.
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
        self._pace = world and Pace(world)
        self._start = now() if start is None else start
        self._sensor = Sensor(self.constants)
        self._next = 0
        self._ready: Frame | None = None

    @property
    def notes(self) -> list[str]:
        """What a person should know about the pictures."""
        c = self.constants
        return [
            *self._poses.notes,
            f"exposure {1000 * c['exposure']:g} ms and white balance are fixed",
        ]

    def keep_pace(self) -> None:
        """From now on, until it is closed, somebody reads on and on: the world waits for that."""
        if self._world and self._member is None and not self.ended:
            self._member = self._world.join(self.name)

    @property
    def slowness(self) -> str:
        """What people should know of the pace, or ""."""
        pace = self._pace.look() if self._pace else 1.0
        return in_words(pace) if pace < BUSY else ""

    # Time

    def time_of(self, index: int) -> float:
        """Capture time of a frame, s: the middle of its exposure."""
        c = self.constants
        frames = WANDER * c["fps"]
        stray = math.sin(2 * math.pi * index / frames) * frames / (2 * math.pi)
        return self._start + (index + c["fps_wander"] * stray) / c["fps"]

    def due(self, index: int) -> float:
        """When a frame is handed over, s; frames never overtake one another."""
        lookback = math.ceil(MOST_JITTER * self.constants["jitter"] * self.fps * 1.5)
        return max(self._arrival(k) for k in range(max(0, index - lookback), index + 1))

    @property
    def _whole(self) -> float:
        """From the middle of the exposure to the end of the last row's, s."""
        return float(self.constants["exposure"] + self.constants["readout"]) / 2

    @property
    def _least_delay(self) -> float:
        return max(self.constants["delay"], self._whole)

    def _arrival(self, index: int) -> float:
        late = min(self._luck(index, 0).expovariate(1.0), MOST_JITTER) * self.constants["jitter"]
        return self.time_of(index) + self._least_delay + late

    def _luck(self, index: int, what: int) -> random.Random:
        c = self.constants
        source = (c["seed"] << 4) + CAMERAS.index(c["camera"])
        return random.Random((source << 36) + (index << 1) + what)

    def newest(self, t: float) -> int:
        """Index of the newest frame that has been handed over by time t, -1 if none has."""
        c = self.constants
        ahead = c["fps_wander"] * WANDER / (2 * math.pi)
        taken_by = t - self._least_delay
        index = math.floor((taken_by - self._start + ahead) * self.fps) + 1
        while index >= 0 and (self.time_of(index) > taken_by or self.due(index) > t):
            index -= 1
        return max(index, -1)

    # Pictures

    def capture(self, index: int) -> Frame:
        """Frame number `index`, at whatever time it is asked for."""
        t = self.time_of(index)
        pose = self._pose(t)
        shutter = self._shutter(t, pose)
        patch = self.scene.patch(self._exposed(t + shutter, pose), pose.ink, t - self._start)
        luck = self._luck(index, 1)
        image = self._sensor.develop(self.scene, patch, self._lamp(t), luck)
        return Frame(index, t, image)

    def frame_at(self, t: float) -> Frame | None:
        """The newest frame that a program can have at time t, s; None before the first."""
        index = self.newest(t)
        return None if index < 0 else self.capture(index)

    def truth(self, index: int) -> dict[str, tuple[float, float]]:
        """Where the markers' centres truly are in frame number `index`, (u, v) px."""
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
        """How much later than the middle row the marker's row is taken, s."""
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
        """Joint angles, rad, spread evenly over the exposure around t, as many as needed."""
        exposure = self.constants["exposure"]
        first, last = (self._poses(t + share * exposure).q for share in (-0.5, 0.5))
        here, there = (self.scene.truth(q)["effector"] for q in (first, last))
        way = math.dist(here, there)
        if way < FINEST / 4:
            return [self._poses(t).q]
        count = min(1 + math.ceil(way / FINEST), MOST_POSES)
        return [self._poses(t + ((k + 0.5) / count - 0.5) * exposure).q for k in range(count)]

    def _lamp(self, t: float) -> float:
        """Brightness of lamps on the mains, the mean over the exposure."""
        c = self.constants
        if not c["flicker"]:
            return 1.0
        rate = 2 * math.pi * 2 * c["mains"]
        half = rate * c["exposure"] / 2
        swing = math.sin(half) / half if half else 1.0
        return 1 + c["flicker"] * swing * math.cos(rate * (t - self._start))

    # As a camera

    def read(self, timeout: float = 1.0) -> Frame | None:
        """The newest frame not yet given, or None if there is none within `timeout` s."""
        deadline = self.now() + timeout
        while not self.ended:
            now = self.now()
            index = max(self.newest(now), self._next)
            due = self.due(index)
            if self._member:
                self._member.promise(due + 2 * SHORTEST)
            ready = self._ready is not None and self._ready.index == index
            begin = max(due - LEAD, self.time_of(index) + self._whole)
            if not ready and now >= begin:
                self._ready = self.capture(index)
                # However long that took: or who paints slower than frames come due paints for ever.
                ready, now = True, self.now()
            if ready and now >= due:
                frame, self._ready = self._ready, None
                self._next = index + 1
                if self._member:
                    self._member.promise(due + TRACKED)
                return frame
            if now >= deadline:
                return None
            self._wait(max(min(due if ready else begin, deadline), now + SHORTEST), now)
        return None

    def _wait(self, until: float, now: float) -> None:
        if self._world:
            self._world.sleep_until(until)
        else:
            self._sleep(until - now)

    def close(self) -> None:
        """Give no more frames."""
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
    """A camera that looks at the arm of `simulate --realtime`, or at one at home if none runs.

    Args:
        text: constants, see `scene.read_scene`.
        folder: see `live.Follower`.
        camera: its name, which says where it stands and what the text has for it alone.
        resting: the arm at home, its name or file; None: as $BRICKSERVO_ARM says, else planar.
    """
    constants = read_scene(text, camera)
    poses = LivePoses(read_arm(find_arm(resting or default_arm())), folder)
    world = PacedClock(folder)
    arm = poses(world.now()).arm
    return SyntheticCamera(Scene(arm, constants), poses, world.now, world=world)


def film(brick: Any, text: str = "", camera: str = "A") -> SyntheticCamera:
    """A camera in the virtual time of an emulated brick: `capture`, `frame_at`, `truth`."""
    scene = Scene(brick.arm, read_scene(text, camera))
    world = brick.world
    return SyntheticCamera(scene, RecordedPoses(brick), world.now, world.sleep, start=0.0)
