"""What the synthetic camera sees: a table, a sheet of paper, ink, the arm, its marker and the goal.

Rules:
1. The world is three-dimensional: cm, x forward, y left, z up, z = 0 on the table.  Everything gets
   into the picture vertex by vertex through one camera model, lens distortion included, so that
   `truth` is exact: where a marker's centre projects to.
2. Colours are amounts of light (linear, 1 = as bright as the sensor can say at gain 1), never sRGB.
   An edge covers each pixel by the exact area of the polygon in it.
3. What stands still is painted once, the ground; ink is added to it; per frame only what moves is
   painted, on a cut-out of it.

Pixel centres have integer coordinates, u right, v down, as OpenCV has them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.simulator.scene.optics import (
    COLOURS,
    LAMP,
    Box,
    Pinhole,
    Point,
    alike,
    ball_light,
    bit_rings,
    box_of,
    circle,
    coverage,
    coverages,
    light_of,
    rectangle,
)
from laptop.simulator.scene.solids import (
    BEAM,
    HOLE,
    SIDE,
    Item,
    Skeleton,
    ball,
    in_order,
    stadium,
    stand,
)
from robot.motion import kinematics
from shared.arm_description import Arm, ArmError

BRICKS = ("red", "blue", "yellow", "green", "white", "black", "orange", "lime", "grey", "cyan")

MARKERS = ("disc", "ball", "aruco")
ARUCO_IDS = {"effector": 0, "goal": 1}
ARUCO_SIDE = 3.0
"""Side of the black square of an ArUco marker, in marker radii: a bit takes as much as it needs."""

MOST_TILT = 85.0
"""Flat markers are seen up to here, deg."""

SAMPLES = 13
"""Of each joint of an arm in space, to find its workspace: off by less than the marker's room."""

PASS = 2.0
"""How long the hand takes to come, rest and go, s."""


class Constant(NamedTuple):
    """What a key of `read_scene` may be: `allowed` is a range, or a tuple of words."""

    default: float | str | None
    allowed: tuple
    unit: str
    meaning: str


WORDS = tuple(COLOURS)
CONSTANTS = {
    "width": Constant(640, (64, 1920), "px", "of the picture"),
    "height": Constant(480, (48, 1440), "px", "of the picture"),
    "fps": Constant(30.0, (1.0, 240.0), "Hz", "pictures per second"),
    "fps_wander": Constant(0.02, (0.0, 0.3), "", "the rate slowly strays by this fraction"),
    "delay": Constant(0.030, (0.0, 2.0), "s", "from the capture to the program, at least"),
    "jitter": Constant(0.003, (0.0, 0.5), "s", "mean of what comes on top of the delay"),
    "exposure": Constant(0.008, (0.0, 0.2), "s", "how long a picture gathers light"),
    "readout": Constant(0.0, (0.0, 0.1), "s", "rolling shutter: the last row is so much later"),
    "gain": Constant(1.0, (0.01, 10.0), "x", "brightness"),
    "warm": Constant(0.0, (-0.6, 0.6), "", "white balance: red gains this fraction, blue loses it"),
    "gradient": Constant(0.15, (0.0, 0.9), "", "the light falls off by this fraction to the right"),
    "flicker": Constant(0.0, (0.0, 1.0), "", "depth to which lamps flicker at twice the mains"),
    "mains": Constant(50.0, (16.0, 60.0), "Hz", "mains frequency of the lamps"),
    "blur": Constant(0.7, (0.0, 10.0), "px", "sigma of the lens's point spread"),
    "noise": Constant(2.0, (0.0, 50.0), "DN", "sigma of the noise of a pixel, of 255"),
    "jpeg": Constant(90, (0, 100), "", "quality of the camera's JPEG; 0 for none"),
    "tilt": Constant(None, (0.0, 90.0), "deg", "0 looks straight down, 90 across the table"),
    "azimuth": Constant(
        None, (-180.0, 180.0), "deg", "0: stands on the right of the arm, so x points right; ccw"
    ),
    "roll": Constant(0.0, (-180.0, 180.0), "deg", "the camera turned about its axis, clockwise"),
    "focal": Constant(650.0, (50.0, 10000.0), "px", "focal length"),
    "distance": Constant(
        None, (5.0, 1000.0), "cm", "to what it aims at; the arm's whole workspace fits if not given"
    ),
    "aim_x": Constant(None, (-500.0, 500.0), "cm", "where it aims at; as above if not given"),
    "aim_y": Constant(None, (-500.0, 500.0), "cm", "where it aims at; as above if not given"),
    "aim_z": Constant(None, (-500.0, 500.0), "cm", "where it aims at; as above if not given"),
    "k1": Constant(-0.06, (-0.5, 0.5), "", "lens distortion, barrel if negative"),
    "k2": Constant(0.0, (-0.5, 0.5), "", "lens distortion of fourth order"),
    "marker": Constant(None, MARKERS, "", "kind of both markers; in space a ball"),
    "effector": Constant("red", WORDS, "", "colour of the marker on the tip"),
    "goal": Constant("green", (*WORDS, "none"), "", "colour of the marker on the paper"),
    "goal_x": Constant(12.0, (-200.0, 200.0), "cm", "where the goal is"),
    "goal_y": Constant(-9.0, (-200.0, 200.0), "cm", "where the goal is"),
    "goal_z": Constant(None, (0.0, 200.0), "cm", "in space, the height of the goal's centre"),
    "marker_radius": Constant(
        1.1, (0.1, 20.0), "cm", "of disc and ball; an ArUco's side is 3 of it"
    ),
    "marker_height": Constant(2.5, (0.0, 50.0), "cm", "in the plane, of the tip's marker"),
    "rim": Constant(0.35, (0.0, 5.0), "cm", "white rim around a disc"),
    "clutter": Constant(8, (0, 60), "", "LEGO bricks lying about, with brick and cable"),
    "decoys": Constant(0, (0, 30), "", "bricks in the markers' own colours"),
    "shadow": Constant(0.4, (0.0, 0.95), "", "light that the arm's shadow takes"),
    "occlusion": Constant(
        0.0, (0.0, 600.0), "s", "a hand comes that often, over the goal, over the tip...; 0: never"
    ),
    "seed": Constant(0, (0, 2**31 - 1), "", "draws clutter, noise and jitter"),
}


CAMERAS = "ABCDEFGH"
"""Names of cameras: a constant belongs to one of them alone with its name and a dot before it."""

WORLD = tuple(CONSTANTS)[tuple(CONSTANTS).index("marker") :]
"""What all cameras see alike; any other constant a camera may have of its own."""

ROUND = (60.0, -60.0, 120.0, -120.0, 180.0, 0.0)
VIEWS = {"A": (15.0, 0.0), "B": (90.0, 0.0), **{c: (60.0, a) for c, a in zip(CAMERAS[2:], ROUND)}}
"""Tilt and azimuth of cameras on an arm in space, deg: from above, from the side, and askew."""


class BadScene(ArmError, ValueError):
    """A constant of scene or camera that is unknown or out of range."""


def read_scene(text: str = "", camera: str = "A") -> dict[str, Any]:
    """The constants of a text such as `tilt=40,marker=ball,B.fps=60`, for one camera.

    What is written for a camera alone, as `B.fps=60`, goes before what is written for all.

    Returns:
        dict, name -> number, word, or None (not given, and the default depends on the arm, see
        `completed`); "camera" -> the camera's name.

    Raises:
        BadScene: naming the key, the value and what is allowed.
    """
    given: dict[str, dict[str, Any]] = {name: {} for name in ("", *CAMERAS)}
    for item in filter(None, (part.strip() for part in text.split(","))):
        written, equals, value = (part.strip() for part in item.partition("="))
        name, dot, key = written.rpartition(".")
        if key not in CONSTANTS:
            raise BadScene(f"camera: no constant '{written}'; known: {', '.join(CONSTANTS)}")
        if name not in given or bool(dot) != bool(name):
            raise BadScene(f"camera '{written}': no camera '{name}'; known: {', '.join(CAMERAS)}")
        if name and key in WORLD:
            raise BadScene(f"camera '{written}': all cameras see the same {key}; write {key}=VALUE")
        if not equals:
            raise BadScene(f"camera '{item}': write {written}=VALUE")
        given[name][key] = _read(written, CONSTANTS[key], value)
    defaults = {key: constant.default for key, constant in CONSTANTS.items()}
    values: dict[str, Any] = {**defaults, **given[""], **given[camera], "camera": camera}
    if values["exposure"] > 1 / values["fps"]:
        raise BadScene(
            f"camera exposure = {values['exposure']:g}: must be at most 1/fps = "
            f"{1 / values['fps']:.4f} s"
        )
    if 0 < values["occlusion"] < PASS:
        raise BadScene(
            f"camera occlusion = {values['occlusion']:g}: must be 0 (never) or from {PASS:g} to "
            f"{CONSTANTS['occlusion'].allowed[1]:g} s"
        )
    return values


def cameras(arm: Arm, text: str = "") -> str:
    """Names of the cameras that see an arm: one, or two in space, and those that a text names."""
    read_scene(text)  # refuses what is wrong
    prefixes = {item.partition("=")[0].rpartition(".")[0].strip() for item in text.split(",")}
    usual = "A" if kinematics.coordinates(arm) == 2 else "AB"
    return "".join(name for name in CAMERAS if name in prefixes.union(usual))


def _read(key: str, constant: Constant, text: str) -> float | str:
    if isinstance(constant.allowed[0], str):
        if text not in constant.allowed:
            allowed = ", ".join(constant.allowed)
            raise BadScene(f"camera {key} = {text}: must be one of {allowed}")
        return text
    lower, upper = constant.allowed
    whole = isinstance(lower, int)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not lower <= value <= upper or (whole and value != int(value)):
        kind = "a whole number" if whole else "a number"
        unit = f" {constant.unit}" if constant.unit else ""
        raise BadScene(
            f"camera {key} = {text}: must be {kind} from {lower:g} to {upper:g}{unit} "
            f"({constant.meaning})"
        )
    return int(value) if whole else value


def _reached(arm: Arm, count: int) -> np.ndarray:
    """Points (n, coordinates), cm, that the tip gets to; each joint in `count` places."""
    grids = [np.linspace(joint.lower, joint.upper, count) for joint in arm.joints]
    poses = np.stack(np.meshgrid(*grids), axis=-1).reshape(-1, len(grids))
    return np.array([kinematics.forward(arm, tuple(q)) for q in poses])


def _workspace(arm: Arm) -> np.ndarray:
    """Outline (n, 2), cm, of where the tip can get within the joint limits."""
    tips = _reached(arm, 25)
    return cv2.convexHull(tips.astype(np.float32)).reshape(-1, 2).astype(float)


def completed(arm: Arm, constants: dict[str, Any]) -> dict[str, Any]:
    """The constants with the defaults that depend on arm and camera.

    Raises:
        BadScene: the arm cannot be shown so.
    """
    if kinematics.coordinates(arm) == 2:
        tilt, azimuth, marker, height = 25.0, 0.0, "disc", 0.0
    else:
        tilt, azimuth = VIEWS[constants["camera"]]
        marker, height = "ball", 9.0
    usual = {"tilt": tilt, "azimuth": azimuth, "marker": marker, "goal_z": height}
    values = {**constants, **{k: v for k, v in usual.items() if constants[k] is None}}
    if kinematics.coordinates(arm) == 3 and values["marker"] != "ball":
        raise BadScene(
            f"camera marker = {values['marker']}: {arm.name} moves in space, where a flat marker is"
            " not seen from the side; write marker=ball"
        )
    if kinematics.coordinates(arm) == 2 and values["goal_z"]:
        raise BadScene(
            f"camera goal_z = {values['goal_z']:g}: {arm.name} moves in the plane, and its goal"
            " lies on the paper; leave goal_z out"
        )
    if kinematics.coordinates(arm) == 2 and values["tilt"] > MOST_TILT:
        raise BadScene(
            f"camera tilt = {values['tilt']:g}: must be at most {MOST_TILT:g} deg for {arm.name},"
            " whose markers lie flat"
        )
    return values


def marker_centre(arm: Arm, constants: dict[str, Any], q: Sequence[float]) -> np.ndarray:
    """Centre (3,), cm, of the marker on the tip with the joints at q, rad."""
    tip = kinematics.forward(arm, q)
    if len(tip) == 3:
        return np.array(tip)
    return np.array([*tip, constants["marker_height"] + _lift(constants)])


def _lift(constants: dict[str, Any]) -> float:
    """Of a marker's centre above what it lies on, cm."""
    return float(constants["marker_radius"]) if constants["marker"] == "ball" else 0.0


def _shown(arm: Arm, constants: dict[str, Any]) -> np.ndarray:
    """Points (n, 3), cm, that are all in a picture when the tip is wherever it can get."""
    wide = constants["marker_radius"] * 1.5
    corners = np.array([(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)])
    if kinematics.coordinates(arm) == 2:
        # Every corner of the widest marker, at the tip's and at the paper's height.
        around = (_workspace(arm)[:, None] + corners).reshape(-1, 2)
        heights = 0.0, constants["marker_height"]
        return np.concatenate([np.c_[around, np.full(len(around), z)] for z in heights])
    tips = _reached(arm, SAMPLES)
    tips = tips[tips[:, 2] >= 0]
    # The outermost in many directions stand for all of them.
    directions = np.random.default_rng(0).normal(size=(300, 3))
    tips = tips[np.unique((tips @ directions.T).argmax(axis=0))]
    cube = [np.c_[corners, np.full(4, z)] for z in (-wide, wide)]
    return (tips[:, None] + np.concatenate(cube)).reshape(-1, 3)


def place_camera(arm: Arm, constants: dict[str, Any]) -> Pinhole:
    """The camera as the constants have it; what they leave open, so that the workspace fits.

    In space that is all above the table; with a distance given, its middle is in the middle.

    Raises:
        BadScene: the arm cannot be shown so.
    """
    constants = completed(arm, constants)
    size = constants["width"], constants["height"]
    tilt, azimuth, roll = (math.radians(constants[key]) for key in ("tilt", "azimuth", "roll"))
    angles = tilt, azimuth, roll
    lens = constants["focal"], size, constants["k1"], constants["k2"]
    body = _shown(arm, constants)
    # In the plane it aims at the table, on which a step sideways is longer than in the picture.
    space = kinematics.coordinates(arm) == 3
    longer = np.ones(3) if space else np.array([1.0, max(0.2, math.cos(tilt)), math.inf])
    given = [constants[key] for key in ("aim_x", "aim_y", "aim_z")]
    free = np.array([value is None for value in given])
    fixed = np.array([0.0 if value is None else value for value in given])

    def fitted(distance: float) -> tuple[Pinhole, bool]:
        aim = start = np.where(free, body.mean(axis=0) * (1, 1, space), fixed)
        for _ in range(8):
            camera = Pinhole.aimed(aim, distance, angles, *lens)
            if space and camera.seen(body)[:, 2].min() < distance / 4:
                aim = start  # so near that what is seen says little about where the middle is
                break
            shown = camera.project(body)
            off = (shown.min(axis=0) + shown.max(axis=0)) / 2 - camera.centre
            # Sideways by what the middle is off.
            step = camera.rotation[:2].T @ (off / camera.focal * distance)
            aim = aim + np.where(free, step / longer, 0.0)
        camera = Pinhole.aimed(aim, distance, angles, *lens)
        shown = camera.project(body)
        x, y, z = camera.seen(body).T
        in_front = z.min() > 1 and (np.hypot(x, y) < camera.widest * z).all()
        inside = (shown >= 2).all() and (shown <= np.array(size) - 3).all()
        return camera, bool(in_front and inside)

    near, far = 1.0, constants["distance"] or 2000.0
    while constants["distance"] is None and far - near > 0.05:
        middle = (near + far) / 2
        near, far = (near, middle) if fitted(middle)[1] else (middle, far)
    camera = fitted(far)[0]
    if camera.position[2] <= 0:
        raise BadScene(
            f"camera {constants['camera']} stands {-camera.position[2]:.1f} cm below the table;"
            " take another aim_z or less tilt"
        )
    return camera


def _put(outline: np.ndarray, origin: Point, angle: float, z: float) -> np.ndarray:
    """An outline (n, 2) turned, moved and raised: (n, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    placed = np.empty((len(outline), 3))
    placed[:, 0] = outline[:, 0] * c - outline[:, 1] * s + origin[0]
    placed[:, 1] = outline[:, 0] * s + outline[:, 1] * c + origin[1]
    placed[:, 2] = z
    return placed


PENUMBRA = 2.0
"""Softness of the shadows, px; of those in space, which fall from higher up, twice that."""

PEN = 0.28
INK_WIDTH = 0.13
STUD = 0.24

TABLE = 2.4
"""Half the side of the table of an arm in space, in reaches; behind it is a wall."""

PAPER = light_of("#efeee9")
INK = light_of("#23262e")


class Patch(NamedTuple):
    """What moves, painted on a cut-out of the ground: `pixels` are those of `outer`.

    Beyond `inner` the ground is as it was; between the two there is room for blur.
    """

    inner: Box
    outer: Box
    pixels: np.ndarray


@functools.lru_cache(maxsize=4)
def _wood(seed: int) -> np.ndarray:
    """How much lighter it is here and there, as a logarithm."""
    draw = np.random.default_rng([seed, 2])
    grain = draw.normal(size=(512, 512)).astype(np.float32)
    streaks = cv2.GaussianBlur(grain, (0, 0), 24, sigmaY=1.6, borderType=cv2.BORDER_REFLECT)
    blotches = cv2.GaussianBlur(grain, (0, 0), 30, borderType=cv2.BORDER_REFLECT)
    return np.asarray(0.10 * streaks / streaks.std() + 0.05 * blotches / blotches.std())


class Scene:
    """One camera's view of an arm at work.

    Args:
        arm: its description.
        constants: from `read_scene`.

    Attributes:
        asked: the constants as they were given.
        constants: the same, completed for this arm.
        camera: Pinhole.
        ground: float32 (height, width, 3), light of all that stands still, with the ink so far.
        changes: Boxes of the ground that were painted over, in order; the first is all of it.
    """

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self.arm = arm
        self.asked = constants
        self.constants = completed(arm, constants)
        self.camera = place_camera(arm, constants)
        self.frame = Box(0, 0, *self.camera.size)
        self.reach = kinematics.reach(arm)[1]
        self._in_space = kinematics.coordinates(arm) == 3
        self._penumbra = PENUMBRA * (2 if self._in_space else 1)
        self._rays = self.camera.rays().astype(np.float32)
        self._bit_rings = {name: bit_rings(number) for name, number in ARUCO_IDS.items()}
        near = any(
            alike("yellow", constants[key]) for key in ("effector", "goal") if self._has(key)
        )
        self._beam_light = light_of("grey" if near else "yellow")
        if self._in_space:
            self._skeleton = Skeleton(arm, self._beam_light, self.constants["marker_radius"])
        self._bare = self._paint_ground()
        self.ground = self._bare.copy()
        self.changes = [self.frame]
        self._ink_cover = np.zeros(self.ground.shape[:2], np.float32)
        self._inked: list[Sequence[float]] = []

    def _has(self, name: str) -> bool:
        return bool(self.constants[name] != "none")

    # Where things are

    def project(self, points: np.ndarray) -> np.ndarray:
        """Where points (n, 3), cm, are in the picture: (n, 2), px."""
        return self.camera.project(points)

    def centres(self, q: Sequence[float]) -> dict[str, np.ndarray]:
        """The markers' centres (3,), cm, with the joints at q, rad."""
        c = self.constants
        centres = {"effector": marker_centre(self.arm, c, q)}
        if self._has("goal"):
            lift = _lift(c) if kinematics.coordinates(self.arm) == 2 else 0.0
            centres["goal"] = np.array([c["goal_x"], c["goal_y"], c["goal_z"] + lift])
        return centres

    def truth(self, q: Sequence[float]) -> dict[str, tuple[float, float]]:
        """Where the markers' centres are in the picture, (u, v) px, hidden or not."""
        centres = self.centres(q)
        places = self.project(np.array(list(centres.values())))
        return {name: (float(u), float(v)) for name, (u, v) in zip(centres, places)}

    def visible(self, q: Sequence[float], t: float = 0.0) -> dict[str, float]:
        """Which part of each marker can be seen, 0 .. 1, neither hidden nor beyond the edge."""
        still = [] if self._in_space else self._goal_items()
        items = still + self._moving_items(q, t)
        outlines = self._outlines(items)
        seen = {}
        for name in self.centres(q):
            at = min(k for k, item in enumerate(items) if item.name == name)
            rings = outlines[at]
            box = box_of(np.concatenate(rings), self.frame)
            if box.empty:
                seen[name] = 0.0
                continue
            left = coverage(rings, box)
            for item, above in zip(items[at + 1 :], outlines[at + 1 :]):
                if item.kind != "shadow" and item.name != name:
                    left = left * (1 - coverage(above, box))
            seen[name] = float(left.sum()) / sum(abs(_area(ring)) for ring in rings)
        return seen

    # What the camera sees

    def image(self, q: Sequence[float], ink: Sequence = (), t: float = 0.0) -> np.ndarray:
        """The light (height, width, 3) that falls on the sensor.

        Args:
            q: joint angles, rad.
            ink: segments (x0, y0, x1, y1), cm, drawn so far.
            t: s, when (for the hand).
        """
        patch = self.patch([q], ink, t)
        image = self.ground.copy()
        patch.outer.cut(image)[:] = patch.pixels
        return image

    def patch(self, poses: Sequence[Sequence[float]], ink: Sequence, t: float) -> Patch:
        """What moves, as the mean of several poses q (rad) of one exposure."""
        self._lay_ink(ink)
        margin = 1 + math.ceil(4 * self.constants["blur"])
        layers = [self._moving_items(q, t) for q in poses]
        items = [item for layer in layers for item in layer]
        outlines = self._outlines(items)
        points = np.concatenate([ring for rings in outlines for ring in rings])
        inner = box_of(points, self.frame, margin + math.ceil(3 * self._penumbra))
        outer = inner.grown(margin, self.frame)
        if inner.empty:
            return Patch(inner, outer, outer.cut(self.ground))
        total = np.zeros_like(outer.cut(self.ground))
        covered = iter(self._covered(items, outlines, outer))
        for layer in layers:
            pixels = outer.cut(self.ground).copy()
            for _ in layer:
                self._lay(pixels, outer, *next(covered))
            cv2.add(total, pixels, dst=total)
        total *= np.float32(1 / len(layers))
        return Patch(inner, outer, total)

    # Painting

    def _outlines(self, items: Sequence[Item]) -> list[list[np.ndarray]]:
        """The polygons of each item in the picture, px."""
        rings = [ring for item in items for ring in item.rings]
        places = self.project(np.concatenate(rings))
        bounds = np.cumsum([0, *map(len, rings)])
        placed = iter([places[a:b] for a, b in zip(bounds, bounds[1:])])
        outlines = []
        for item in items:
            own = [next(placed) for _ in item.rings]
            if item.kind == "hull":
                hull = cv2.convexHull(np.concatenate(own).astype(np.float32))
                own = [hull.reshape(-1, 2).astype(float)]
            outlines.append(own)
        return outlines

    def _draw(self, pixels: np.ndarray, items: Sequence[Item]) -> None:
        """Paint items, the farthest first, on a whole picture."""
        for painted in self._covered(items, self._outlines(items), self.frame):
            self._lay(pixels, self.frame, *painted)

    def _covered(
        self, items: Sequence[Item], outlines: Sequence[list[np.ndarray]], window: Box
    ) -> list[tuple[Item, Box, np.ndarray]]:
        """Each item with the pixels of a window that it spans and how it covers them."""
        soft = math.ceil(3 * self._penumbra)
        boxes = [
            box_of(np.concatenate(rings), window, item.kind == "shadow" and soft)
            for item, rings in zip(items, outlines)
        ]
        shown = [k for k, box in enumerate(boxes) if not box.empty]
        covers = [np.zeros((0, 0), np.float32)] * len(items)
        for k, cover in zip(shown, coverages([(outlines[k], boxes[k]) for k in shown])):
            covers[k] = cover
        return list(zip(items, boxes, covers))

    def _lay(
        self, pixels: np.ndarray, window: Box, item: Item, box: Box, cover: np.ndarray
    ) -> None:
        """Lay one item over `pixels`, which are those of `window`."""
        if box.empty:
            return
        local = box.seen_from(window).cut(pixels)
        if item.kind == "shadow":
            local *= (1 - item.light * cv2.GaussianBlur(cover, (0, 0), self._penumbra))[..., None]
            return
        light = item.light if item.ball is None else self._shaded(item, box)
        local += cover[..., None] * (np.asarray(light, np.float32) - local)

    def _shaded(self, item: Item, box: Box) -> np.ndarray:
        """Light (height, width, 3) of a ball: Lambert's cosine, and a highlight (Blinn 1977)."""
        assert item.ball is not None
        centre, radius = item.ball
        middle = self.camera.seen(centre[None])[0]
        ray = np.dstack(
            [box.cut(self._rays), np.ones((box.bottom - box.top, box.right - box.left))]
        )
        ray = ray / np.linalg.norm(ray, axis=2, keepdims=True)
        along = ray @ middle
        # Rays that miss the ball by the part of a pixel take what its limb shows.
        depth = along - np.sqrt(np.maximum(along**2 - middle @ middle + radius**2, 0))
        return ball_light(
            item.light, depth[..., None] * ray - middle, -ray, self.camera.rotation @ LAMP
        )

    # What moves

    def _moving_items(self, q: Sequence[float], t: float) -> list[Item]:
        """The arm, its shadow, its marker and perhaps a hand; what is on top comes last."""
        return self._items_in_space(q, t) if self._in_space else self._items_in_plane(q, t)

    def _items_in_space(self, q: Sequence[float], t: float) -> list[Item]:
        """The same with the goal, which the arm may hide, or be hidden by."""
        eye, radius = self.camera.position, self.constants["marker_radius"]
        centres = self.centres(q)
        balls = {
            name: [ball(item) for item in self._marker_items(name, centre, 0.0)]
            for name, centre in centres.items()
        }
        groups = [self._skeleton.solids(q, eye) + balls["effector"]]
        if "goal" in centres:
            goal = stand(centres["goal"], radius, eye) + balls["goal"]
            # Where the balls are inside one another, the tip's is over the goal's, as in the plane.
            met = math.dist(centres["effector"], centres["goal"]) < 2 * radius
            groups = [goal, *groups] if met else [goal + groups[0]]
        solids = [solid for group in groups for solid in in_order(group, self.camera)]
        items = [item for solid in solids for item in solid.items]
        hand = self._hand_items(q, t)
        if self.constants["shadow"]:
            bodies = [np.concatenate(solid.items[0].rings) for solid in solids]
            fallen = [_hull_ring(_fallen(points)) for points in bodies]
            items.insert(0, Item(fallen, self.constants["shadow"], "shadow"))
        return items + hand

    def _items_in_plane(self, q: Sequence[float], t: float) -> list[Item]:
        h = self.constants["marker_height"]
        base, *middle = [np.array(p[:2]) for p in kinematics.joint_positions(self.arm, q)]
        joints = [base, *middle]
        grey, dark = light_of("#b9bcbf"), light_of("#4a4d51")
        tip = joints[-1]
        items: list[Item] = []
        shadows: list[np.ndarray] = []
        count = len(joints) - 1
        # Each link lies on the one before it, the last just under the marker.
        levels = [h * (0.28 + 0.68 * k / count) for k in range(count)]
        thick = 0.6 * h / count
        for k, (a, b) in enumerate(zip(joints, joints[1:])):
            length = float(np.linalg.norm(b - a))
            angle = math.atan2(b[1] - a[1], b[0] - a[0])
            top, bottom = levels[k] + thick, levels[k]
            beam = stadium(length, BEAM)
            raised, lowered = _put(beam, a, angle, top), _put(beam, a, angle, bottom)
            if k + 1 < count:
                body = rectangle(length - 3.2, -1.1, length + 1.2, 1.1, 2)
                foot, lid = (_put(body, a, angle, z) for z in (bottom - 0.25 * h, bottom))
                items.append(Item([foot, lid], grey * SIDE, "hull"))
                items.append(Item([lid], grey))
                shadows.append(_fallen(lid))
            else:
                foot, lid = (_put(circle(PEN, 12), tip, 0, z) for z in (0.0, bottom))
                items.append(Item([foot, lid], dark * 0.6, "hull"))
                shadows.append(_hull_ring(np.concatenate([_fallen(foot), _fallen(lid)])))
            items.append(Item([lowered, raised], self._beam_light * SIDE, "hull"))
            items.append(Item([raised], self._beam_light))
            holes = max(1, round(length / BEAM / 2))
            hole = circle(0.24, 10)
            rings = [_put(hole, a + (b - a) * j / holes, 0, top) for j in range(1, holes)]
            if rings:
                items.append(Item(rings, self._beam_light * HOLE))
            shadows.append(_fallen(raised))
            hub = levels[k] + thick
            items.append(Item([_put(circle(0.55, 20), a, 0, hub)], dark))
            items.append(Item([_put(circle(0.26, 14), a, 0, hub)], grey))
        angle = math.atan2(tip[1] - joints[-2][1], tip[0] - joints[-2][0])
        items += self._marker_items("effector", self.centres(q)["effector"], angle)
        shadows.append(_fallen(_put(circle(self._marker_size(), 32), tip, 0, h)))
        hand = self._hand_items(q, t)
        shadows += [_fallen(item.rings[0]) for item in hand]
        items += hand
        if self.constants["shadow"]:
            items.insert(0, Item(shadows, self.constants["shadow"], "shadow"))
        return items

    def _marker_size(self) -> float:
        c = self.constants
        if c["marker"] == "disc":
            return float(c["marker_radius"] + c["rim"])
        return float(c["marker_radius"] * (1.4 if c["marker"] == "aruco" else 1.0))

    def _marker_items(self, name: str, centre: np.ndarray, angle: float) -> list[Item]:
        c = self.constants
        radius = c["marker_radius"]
        light = light_of(c[name])
        if c["marker"] == "ball":
            return [Item([self._limb(centre, radius)], light, "ball", name, (centre, radius))]
        white = light_of("white")
        if c["marker"] == "aruco":
            half = ARUCO_SIDE / 2 * radius
            edge = half * 4 / 3
            square = [_put(rectangle(-s, -s, s, s), centre, angle, centre[2]) for s in (edge, half)]
            bits = [_put(half * ring, centre, angle, centre[2]) for ring in self._bit_rings[name]]
            black = light_of("black")
            return [
                Item(square[:1], white),
                Item(square[1:], black, name=name),
                Item(bits, white, name=name),
            ]
        rim = _put(circle(radius + c["rim"], 64), centre, 0, centre[2])
        disc = _put(circle(radius, 128), centre, 0, centre[2])
        return ([Item([rim], white)] if c["rim"] else []) + [Item([disc], light, name=name)]

    def _limb(self, centre: np.ndarray, radius: float) -> np.ndarray:
        """The circle (n, 3), cm, on a ball that the camera sees as its outline."""
        view = self.camera.position - centre
        distance = float(np.linalg.norm(view))
        view = view / distance
        share = radius / distance
        one = np.cross(view, (1.0, 0.0, 0.0) if abs(view[0]) < 0.8 else (0.0, 1.0, 0.0))
        one = one / np.linalg.norm(one)
        flat = circle(radius * math.sqrt(1 - share**2), 128)
        return centre + radius * share * view + flat @ np.array([one, np.cross(view, one)])

    def _goal_items(self) -> list[Item]:
        if not self._has("goal"):
            return []
        return self._marker_items("goal", self.centres(self._home())["goal"], 0.0)

    def _home(self) -> tuple[float, ...]:
        return tuple(joint.home for joint in self.arm.joints)

    def _hand_items(self, q: Sequence[float], t: float) -> list[Item]:
        """A hand that reaches out over the goal, the next time over the tip, and goes again."""
        every = self.constants["occlusion"]
        if not every:
            return []
        turn, phase = divmod(t, every)
        phase = (phase - (every - PASS)) / PASS
        if phase < 0:
            return []
        c = self.constants
        tip = self.centres(q)["effector"]
        target = tip if turn % 2 else np.array([c["goal_x"], c["goal_y"], c["goal_z"]])
        # In by 0.35, out from 0.65 on, smoothly.
        share = min(1.0, min(phase, 1 - phase) / 0.35)
        share = share * share * (3 - 2 * share)
        # In space it comes from above in the picture, before all that is in it.
        angle = math.radians(-112 if self._in_space else 112)
        way = np.array([math.cos(angle), math.sin(angle)])
        palm = (0 if self._in_space else target[:2]) - (1 - share) * 3 * self.reach * way
        z = c["marker_height"] + (2 * c["marker_radius"] if c["marker"] == "ball" else 0.0) + 0.8
        size = max(1.0, c["marker_radius"] / 1.1)
        skin = light_of("#c98f6b")
        parts = [(stadium(60, 2.9 * size), palm, angle + math.pi)]
        parts.append((circle(4.2 * size, 32) * (1.0, 0.9), palm, angle))
        for spread, length in ((-0.42, 6.6), (-0.14, 7.6), (0.12, 7.3), (0.38, 6.0), (1.1, 5.6)):
            parts.append((stadium(length * size, 0.85 * size), palm, angle + spread))
        outlines = [_put(outline, at, turned, z) for outline, at, turned in parts]
        if self._in_space:
            right, down, _ = self.camera.rotation
            outlines = [target + o[:, :2] @ np.array([right, -down]) for o in outlines]
        return [Item([outline], skin) for outline in outlines]

    # What stands still

    def _paint_ground(self) -> np.ndarray:
        ground = self._table().astype(np.float32)
        r = self.reach
        paper = [_put(rectangle(-0.36 * r, -0.78 * r, 1.06 * r, 1.22 * r, 16), (0, 0), 0.02, 0.0)]
        items = [Item([ring + (0.12, -0.15, 0)], light_of("#4b3a29")) for ring in paper]
        items += [Item(paper, PAPER), *([] if self._in_space else self._goal_items())]
        self._draw(ground, items)
        draw = np.random.default_rng([self.constants["seed"], 1])
        blocks = self._bricks(draw)
        if self.constants["clutter"]:
            blocks.append((self._controller(), np.array([-0.85 * r, -0.55 * r, 0.0])))
        if not self._in_space:
            body = rectangle(-6.5, -1.5, 1.3, 1.5, 3)
            height = 0.28 * self.constants["marker_height"]
            shoulder = self._block(body, (0, 0), 0.0, height, light_of("#b9bcbf"))
            blocks.append((shoulder, np.zeros(3)))
        # The farthest first.
        blocks.sort(key=lambda block: -float(np.linalg.norm(block[1] - self.camera.position)))
        shadows = [i for items, _ in blocks for i in items if i.kind == "shadow"]
        rest = [i for items, _ in blocks for i in items if i.kind != "shadow"]
        if self.constants["clutter"]:
            rest = self._cable() + rest
        if shadows and self.constants["shadow"]:
            rings = [ring for item in shadows for ring in item.rings]
            rest.insert(0, Item(rings, self.constants["shadow"], "shadow"))
        if rest:
            self._draw(ground, rest)
        return ground

    def _table(self) -> np.ndarray:
        """Wood, looked up for each pixel where its ray meets the table."""
        wood = _wood(self.constants["seed"])
        if not self.constants["clutter"]:
            wood = np.zeros_like(wood)
        side = len(wood)
        ray = np.dstack([self._rays, np.ones(self._rays.shape[:2], np.float32)])
        ray = ray @ self.camera.rotation.astype(np.float32)
        depth = self.camera.position[2] / np.maximum(-ray[..., 2], 1e-3)
        x = self.camera.position[0] + depth * ray[..., 0]
        y = self.camera.position[1] + depth * ray[..., 1]
        scale = side / (8 * self.reach)
        looked_up = cv2.remap(
            wood,
            (x * scale + side / 2).astype(np.float32),
            (y * scale + side / 2).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REFLECT,
        )
        table = light_of("#a98358") * np.exp(looked_up)[..., None]
        wall = ray[..., 2] > -0.02
        if self._in_space:
            wall |= np.maximum(np.abs(x), np.abs(y)) > TABLE * self.reach
        table[wall] = light_of("#8d9299")
        return np.asarray(table)

    def _block(
        self, outline: np.ndarray, at: Point, angle: float, height: float, light: Any
    ) -> list[Item]:
        """A solid on the table: shadow, sides, top."""
        foot, lid = _put(outline, at, angle, 0.0), _put(outline, at, angle, height)
        return [
            Item([_hull_ring(np.concatenate([foot, _fallen(lid)]))], 1.0, "shadow"),
            Item([foot, lid], light * SIDE, "hull"),
            Item([lid], light),
        ]

    def _bricks(self, draw: np.random.Generator) -> list[tuple[list[Item], np.ndarray]]:
        """LEGO bricks beside the paper, none of a marker's colour but the decoys."""
        c = self.constants
        markers = [c[name] for name in ("effector", "goal") if self._has(name)]
        if c["marker"] == "aruco":
            markers = []
        plain = [word for word in BRICKS if not any(alike(word, other) for other in markers)]
        words = [plain[draw.integers(len(plain))] for _ in range(c["clutter"])]
        words += [markers[k % len(markers)] for k in range(c["decoys"] if markers else 0)]
        blocks: list[tuple[list[Item], np.ndarray]] = []
        places: list[np.ndarray] = []
        r = self.reach
        area = (-1.6 * r, -1.1 * r), (1.7 * r, 1.2 * r)
        if self._in_space:
            area = (-1.7 * r, -1.7 * r), (1.7 * r, 1.7 * r)
        for word in words:
            for _ in range(200):
                at = draw.uniform(*area)
                on_paper = -0.52 * r < at[0] < 1.18 * r and -0.9 * r < at[1] < 1.35 * r
                on_controller = abs(at[0] + 0.85 * r) < 7 and abs(at[1] + 0.55 * r) < 9
                apart = all(np.linalg.norm(at - other) > 4.2 for other in places)
                # Where it cannot hide an arm in space, nor what that reaches for.
                within = self._in_space and np.linalg.norm(at) < 1.15 * r
                if apart and not on_paper and not on_controller and not within:
                    break
            places.append(at)
            across, along = int(draw.integers(1, 3)), int(draw.integers(2, 5))
            angle = float(draw.uniform(0, math.pi))
            w, d = 0.4 * along, 0.4 * across
            light = light_of(word)
            items = self._block(rectangle(-w, -d, w, d, 3), at, angle, 0.96, light)
            c_, s_ = math.cos(angle), math.sin(angle)
            studs = []
            for i in range(along):
                for j in range(across):
                    x, y = -w + 0.4 + 0.8 * i, -d + 0.4 + 0.8 * j
                    studs.append(at + (c_ * x - s_ * y, s_ * x + c_ * y))
            for place in studs:
                ring = circle(STUD, 14)
                low, high = (_put(ring, place, 0, z) for z in (0.96, 1.13))
                items += [Item([low, high], light * SIDE, "hull"), Item([high], light * 1.05)]
            blocks.append((items, np.append(at, 0.0)))
        return blocks

    def _controller(self) -> list[Item]:
        """The brick itself, with screen and buttons."""
        at = (-0.85 * self.reach, -0.55 * self.reach)
        angle, height = 0.25, 3.0
        items = self._block(
            rectangle(-3.6, -5.5, 3.6, 5.5, 3), at, angle, height, light_of("#c9cccd")
        )
        for outline, code in (
            (rectangle(-2.6, 0.6, 2.6, 4.4), "#5d6b58"),
            (rectangle(-2.8, -5.5, 2.8, -4.6), "#3c3f42"),
            (circle(1.9, 24) + (0, -2.0), "#6a6e72"),
            (rectangle(-0.7, -2.7, 0.7, -1.3), "#2e3033"),
        ):
            items.append(Item([_put(outline, at, angle, height)], light_of(code)))
        return items

    def _cable(self) -> list[Item]:
        """From the controller to the shoulder's motor."""
        r = self.reach
        share = np.linspace(0, 1, 40)[:, None]
        a, b = np.array([-0.75 * r, -0.3 * r]), np.array([-6.3, 0.0])
        path = a + share * (b - a)
        path = path + np.sin(share * 7) * (1 - share) * np.array([0.02 * r, 0.09 * r])
        along = np.gradient(path, axis=0)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        across = 0.25 * across / np.linalg.norm(across, axis=1, keepdims=True)
        outline = np.concatenate([path + across, (path - across)[::-1]])
        return [
            Item([np.c_[outline + (0.2, -0.2), np.zeros(80)]], light_of("#4b3a29")),
            Item([np.c_[outline, np.full(80, 0.3)]], light_of("#26282b")),
        ]

    def _lay_ink(self, ink: Sequence) -> None:
        """Bring the ink on the ground to these segments (n, 4), cm."""
        known = len(self._inked)
        if len(ink) < known or (known and tuple(ink[known - 1]) != tuple(self._inked[-1])):
            self._ink_cover[:] = 0
            self.ground[:] = self._bare
            self.changes.append(self.frame)
            self._inked, known = [], 0
        fresh = list(ink[known:])
        if not fresh:
            return
        self._inked += fresh
        a, b = np.array(fresh, float).reshape(-1, 2, 2).transpose(1, 0, 2)
        along = b - a
        length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        across = INK_WIDTH / 2 / length * np.stack([-along[:, 1], along[:, 0]], axis=1)
        corners = np.stack([a + across, b + across, b - across, a - across], axis=1)
        flat = np.c_[corners.reshape(-1, 2), np.zeros(4 * len(a))]
        rings = list(self.project(flat).reshape(-1, 4, 2))
        box = box_of(np.concatenate(rings), self.frame)
        if box.empty:
            return
        cover = box.cut(self._ink_cover)
        cover[:] = np.minimum(cover + coverage(rings, box), 1)
        bare = box.cut(self._bare)
        box.cut(self.ground)[:] = bare + 0.92 * cover[..., None] * (INK.astype(np.float32) - bare)
        self.changes.append(box)


def _fallen(points: np.ndarray) -> np.ndarray:
    """The shadow of points (n, 3) on the table."""
    return points - points[:, 2:] * (LAMP / LAMP[2])


def _hull_ring(points: np.ndarray) -> np.ndarray:
    """The hull of points (n, 3) that all lie on the table."""
    hull = cv2.convexHull(points[:, :2].astype(np.float32)).reshape(-1, 2)
    return np.c_[hull, np.zeros(len(hull))]


def _area(ring: np.ndarray) -> float:
    after = np.roll(ring, -1, axis=0)
    return float(ring[:, 0] @ after[:, 1] - after[:, 0] @ ring[:, 1]) / 2
