"""The pictures of the documentation: each by a command that its page names, or by a function here.

All are made in virtual time, and come out the same twice on one machine.  (Those of the page are
taken in a real browser: `python -m tests.claims.page_pictures laptop/docs/pictures`.)
"""

from __future__ import annotations

import functools
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np

from laptop.course.basins import draw_basins
from laptop.course.drawing import draw_plan
from laptop.course.handouts import BASINS_GOAL
from laptop.drawing.lettering import Lettering
from laptop.drawing.sources import read_source
from laptop.drawing.test_patterns import draw_test_pattern
from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.rig import Rig
from laptop.emulator.scene.camera_rig import CameraRig
from laptop.emulator.scene.servo_truth import truth_of
from laptop.measure.demo.goals import Goal, choose_goals, servo_args
from laptop.record.figures.home_pose import write_home_pose
from laptop.record.figures.sheet import INK, new_figure, png_of
from laptop.record.servo.figures import Scenery, draw_cameras, draw_errors
from laptop.record.servo.servo_log import read_log
from laptop.record.servo.servo_run import ServoRun, run_of_log
from laptop.see.camera.frames import Frame
from laptop.see.markers import view
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from robot.motion import kinematics
from shared import state
from shared.arm_description import ArmError, find_arm, read_arm

ROOT = Path(__file__).resolve().parents[2]
FOLDER = Path(__file__).resolve().parent / "pictures"
QUALITY = 85
"""Of JPEGs."""
REPORT = ("--method=report", "--budget=180")
"""Options of the lab report's method, with time enough to arrive."""
COMMANDS: Mapping[str, tuple[str, str]] = {
    "house.gif": ("draw house --simulate --to house.gif", "house.gif"),
    "house.png": ("draw house --simulate", "picture.png"),
    "lines.png": ("simulate robot/driver.py", "picture.png"),
    "learning.png": (
        'draw --line "10,0 5,10" --trials 3 --simulate --plant backlash=3,zero_error=1.5,load=0.01',
        "learning.png",
    ),
}
"""By its name each picture that a command leaves: the command, and the file that it is there."""


def by_command(name: str, file: Path) -> None:
    """Make a picture by its command, in a folder and with a state of its own.

    Raises:
        ArmError: the command failed; with what it said.
    """
    words, left = COMMANDS[name]
    with tempfile.TemporaryDirectory() as folder:
        typed = shlex.split(words.replace("robot/", f"{ROOT}/robot/"))
        here = {key: value for key, value in os.environ.items() if key != state.ARM}
        here |= {"PYTHONPATH": str(ROOT), state.STATE: folder}
        done = subprocess.run(
            [sys.executable, "-m", "laptop", *typed], cwd=folder, env=here, capture_output=True
        )
        found = sorted(Path(folder).rglob(left))
        if done.returncode or len(found) != 1:
            raise ArmError(f"brickservo {words}: {done.stderr.decode().strip()}")
        shutil.copyfile(found[0], file)


def lines_then_goals(file: Path) -> None:
    """Draw the ways to three goals on the planar arm, and to the first by the report's method."""
    runs, seen = _servoing("planar")
    baseline, _ = _servoing("planar", *REPORT, goals=1)
    _keep(file, draw_cameras(runs, Scenery(_viewed(seen, "disc")), baseline[0]))


def errors(file: Path) -> None:
    """Draw the distance from these goals against time."""
    runs, _ = _servoing("planar")
    baseline, _ = _servoing("planar", *REPORT, goals=1)
    _keep(file, draw_errors(runs, baseline[0]))


def in_space(file: Path) -> None:
    """Draw the ways to three goals in space, before two cameras."""
    runs, seen = _servoing("spatial")
    _keep(file, draw_cameras(runs, Scenery(_viewed(seen, "ball"))))


@functools.cache
def _servoing(name: str, *words: str, goals: int = 3) -> tuple[list[ServoRun], dict[str, Frame]]:
    """Let an arm draw its three lines, then go to goals; return these runs and the last frames."""
    arm = read_arm(find_arm(name))
    text, chosen = choose_goals(arm, 0)
    runs = []
    with tempfile.TemporaryDirectory() as folder, Rig(name, cameras=text) as rig:
        rig.run("driver.py")
        for goal in chosen[:goals]:
            log = Path(folder, f"{goal.name}.jsonl")
            runs.append(_to_goal(rig, CameraRig(arm, text), goal, log, *words))
        return runs, rig.see()


def _to_goal(rig: Rig, cameras: CameraRig, goal: Goal, file: Path, *words: str) -> ServoRun:
    """Let the servo go to a goal; return the run as it truly was."""
    before = len(rig.record)
    run = rig.run("visual_servoing.py", *servo_args(goal), f"--log={file}", *words)
    log = read_log(file)
    began = log.run["clock"] - UPTIME - (run.outcome.start or 0.0)
    rows = list(rig.record)[before:]
    return run_of_log(goal.name, log, truth_of(cameras, rows, log, began, goal.pixels))


def _viewed(frames: Mapping[str, Frame], kind: str) -> dict[str, cv2.typing.MatLike]:
    """Return each camera's frame with what the tracker finds there, a disc or a ball each."""
    shown = {}
    for camera, frame in frames.items():
        tracker = Tracker(
            [read_spec("effector", f"{kind}:red"), read_spec("goal", f"{kind}:green")]
        )
        found = tracker.find(frame.image, frame.t)
        shown[camera] = view.draw(view.AnnotatedFrame(frame, found, tracker.why, {}))
    return shown


def tracker_view(file: Path) -> None:
    """Draw what the tracker sees once the planar arm has drawn its lines."""
    with Rig("planar", cameras="seed=3") as rig:
        rig.run("driver.py")
        _keep(file, _viewed(rig.see(), "disc")["A"])


def views_in_space(file: Path) -> None:
    """Show the arm in space by both of its cameras."""
    with Rig("spatial", cameras="") as rig:
        rig.run("driver.py", "move", "12,6,8")
        seen = rig.see()
    _keep(file, np.hstack([seen["A"].image, np.full((480, 6, 3), 255, np.uint8), seen["B"].image]))


def home_poses(name: str, file: Path) -> None:
    """Draw where to put an arm by hand."""
    arm = read_arm(find_arm(name))
    write_home_pose(file, arm, kinematics.joint_positions(arm, [one.home for one in arm.joints]))


def sheet_of_drawings(file: Path) -> None:
    """Draw six that can be drawn: three that come along, a text, a picture, a test card."""
    arm = read_arm(find_arm("planar"))
    text = "Brick\nServo\ndraws\nGr\u00fc\u00dfe".encode()
    artworks = [
        *(read_source(name) for name in ("owl", "knot", "rose")),
        read_source(text, "text", lettering=Lettering(font="script")),
        read_source(_ball(), "ball.png"),
        draw_test_pattern("reach", arm=arm),
    ]
    with new_figure(1100) as figure:
        for axes, artwork in zip(figure.subplots(2, 3).flat, artworks, strict=True):
            for stroke in artwork.strokes:
                axes.plot(*stroke.T, color=INK, lw=1.4)
            axes.set_aspect("equal")
            axes.axis("off")
        figure.subplots_adjust(0.01, 0.01, 0.99, 0.99, 0.05, 0.05)
        file.write_bytes(png_of(figure))


def _ball() -> bytes:
    """Return a picture of a ball in the light from above, as PNG."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.2, 1.2, 500)])
    z = np.sqrt(np.clip(1 - x * x - y * y, 0, None))
    light = np.clip(-0.5 * x - 0.6 * y + 0.62 * z, 0, 1)
    grey = np.where(x * x + y * y < 1, 30 + 225 * light, 255)
    return bytes(cv2.imencode(".png", grey.astype(np.uint8))[1])


def _keep(file: Path, picture: bytes | cv2.typing.MatLike | None) -> None:
    """Write a PNG's bytes, or a picture, in the format of the file's name."""
    assert picture is not None
    if isinstance(picture, bytes):
        picture = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
    cv2.imwrite(str(file), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


PICTURES: Mapping[str, Callable[[Path], object]] = {
    **{name: functools.partial(by_command, name) for name in COMMANDS},
    "servo.jpg": lines_then_goals,
    "errors.png": errors,
    "space.jpg": in_space,
    "tracker.jpg": tracker_view,
    "views.jpg": views_in_space,
    "home-planar.png": functools.partial(home_poses, "planar"),
    "home-spatial.png": functools.partial(home_poses, "spatial"),
    "drawings.png": sheet_of_drawings,
    "basins.png": lambda file: file.write_bytes(
        draw_basins(read_arm(find_arm("planar")), BASINS_GOAL)
    ),
    "guide.svg": lambda file: file.write_text(draw_plan(read_arm(find_arm("planar"))).svg, "utf-8"),
}
"""By the name of its file each picture, and what makes it."""
