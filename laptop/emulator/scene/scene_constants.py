"""The constants of the synthetic cameras and of their scene, as people write them.

`tilt=40,marker=ball,B.fps=60` sets one constant for all cameras, or for one of them alone.
"""

from __future__ import annotations

from typing import Any

from laptop.emulator.constants import Constant, ConstantTable, Owners, Wording
from laptop.emulator.scene.optics import COLOURS
from laptop.see.markers.board import BOARDS
from shared.arm_description import ArmError

CAMERAS = "ABCDEFGH"
"""Names of cameras: a constant belongs to one of them alone with its name and a dot before it."""

MARKERS = ("disc", "ball", "aruco")
"""Kinds of markers."""

HAND_PASS = 2.0
"""Duration in which the hand comes, rests and goes, s."""

WORDS = tuple(COLOURS)
"""Names of colours."""
CONSTANTS = {
    "width": Constant(640, (64, 1920), "px", "of the picture", int),
    "height": Constant(480, (48, 1440), "px", "of the picture", int),
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
    "jpeg": Constant(90, (0, 100), "", "quality of the camera's JPEG; 0 for none", int),
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
    "marker": Constant(None, MARKERS, "", "kind of both markers; in space a ball", str),
    "effector": Constant("red", WORDS, "", "colour of the marker on the tip", str),
    "goal": Constant("green", (*WORDS, "none"), "", "colour of the marker on the paper", str),
    "goal_x": Constant(12.0, (-200.0, 200.0), "cm", "where the goal is"),
    "goal_y": Constant(-9.0, (-200.0, 200.0), "cm", "where the goal is"),
    "goal_z": Constant(None, (0.0, 200.0), "cm", "in space, the height of the goal's centre"),
    "marker_radius": Constant(
        1.1, (0.1, 20.0), "cm", "of disc and ball; an ArUco's side is 3 of it"
    ),
    "marker_height": Constant(2.5, (0.0, 50.0), "cm", "in the plane, of the tip's marker"),
    "rim": Constant(0.35, (0.0, 5.0), "cm", "white rim around a disc"),
    "marker_stray": Constant(
        0.0, (0.0, 2.0), "cm", "the tip's marker sits so far off the pen, where the seed has it"
    ),
    "board": Constant("none", ("none", *BOARDS), "", "printed board on the table", str),
    "board_x": Constant(9.0, (-200.0, 200.0), "cm", "where the board's middle is"),
    "board_y": Constant(0.0, (-200.0, 200.0), "cm", "where the board's middle is"),
    "board_turn": Constant(0.0, (-180.0, 180.0), "deg", "to which its x points from the arm's"),
    "board_scale": Constant(1.0, (0.5, 2.0), "x", "size of its print; 0.97: its bar is 97 mm long"),
    "clutter": Constant(8, (0, 60), "", "LEGO bricks lying about, with brick and cable", int),
    "decoys": Constant(0, (0, 30), "", "bricks in the markers' own colours", int),
    "shadow": Constant(0.4, (0.0, 0.95), "", "light that the arm's shadow takes"),
    "occlusion": Constant(
        0.0, (0.0, 600.0), "s", "a hand comes that often, over the goal, over the tip...; 0: never"
    ),
    "seed": Constant(0, (0, 2**31 - 1), "", "draws clutter, noise and jitter", int),
}

COMMON = tuple(CONSTANTS)[tuple(CONSTANTS).index("marker") :]
"""Keys of constants that all cameras share; a camera may have any other of its own."""


class BadScene(ArmError, ValueError):
    """A constant of scene or camera that is unknown or out of range."""


TABLE = ConstantTable(
    "camera",
    CONSTANTS,
    BadScene,
    Wording("camera: no constant '{key}'; known: {known}"),
    owners=Owners(CAMERAS, COMMON),
)


def read_scene(text: str = "", camera: str = "A") -> dict[str, Any]:
    """Read the constants of a text such as `tilt=40,marker=ball,B.fps=60`, for one camera.

    What is written for a camera alone, as `B.fps=60`, goes before what is written for all.

    Returns:
        dict, name -> number, word, or None (not given, and the default depends on the arm, see
        `workcell.completed`); "camera" -> the camera's name.

    Raises:
        BadScene: naming the key, the value and what is allowed.
    """
    given = TABLE.parse(text)
    values: dict[str, Any] = {key: constant.default for key, constant in CONSTANTS.items()}
    for owner in ("", camera):
        values.update((key, value) for key, (value,) in given[owner].items())
    values["camera"] = camera
    if values["exposure"] > 1 / values["fps"]:
        raise BadScene(
            f"camera exposure = {values['exposure']:g}: must be at most 1/fps = "
            f"{1 / values['fps']:.4f} s"
        )
    if 0 < values["occlusion"] < HAND_PASS:
        raise BadScene(
            f"camera occlusion = {values['occlusion']:g}: must be 0 (never) or from {HAND_PASS:g} "
            f"to {CONSTANTS['occlusion'].allowed[1]:g} s"
        )
    return values


def named_cameras(text: str) -> set[str]:
    """Return the names of the cameras that a text has constants for."""
    return {name for name, given in TABLE.parse(text).items() if name and given}
