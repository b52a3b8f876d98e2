"""`track`: cameras are watched and the brick is served, with a page and a brick of its own."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click

from laptop.cli.options import on_the_page
from shared.arm_description import ArmError
from shared.state import state_folder

SERVO = Path(__file__).resolve().parents[2] / "robot" / "visual_servoing.py"
FOREVER = 1e6
"""For an emulated brick that ends with the tracker, s."""
BESIDE = """
import os, signal, sys, threading
def follow():
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)
threading.Thread(target=follow, daemon=True).start()
from laptop.cli.main import main
sys.exit(main())
"""
"""A command in a process that ends with the one that has the other end of its input."""


@click.command()
@click.option(
    "--camera",
    multiple=True,
    default=("0",),
    show_default=True,
    metavar="SOURCE",
    help="A webcam's number, a video file, a folder of pictures, a stream (http://, rtsp://) or "
    "synthetic; several times for several cameras, A, B, ...",
)
@click.option(
    "--effector",
    metavar="SPEC",
    help="The arm's marker: [disc:|ball:]COLOUR, aruco:ID, or a markers file.",
)
@click.option(
    "--goal",
    multiple=True,
    metavar="SPEC|[A:]U,V",
    help="The goal's marker, or a fixed point in px (one for each camera, A:U,V, B:U,V, ...).",
)
@click.option(
    "--pick",
    multiple=True,
    metavar="NAME=U,V@FRAME",
    help="Learn a marker's colour where it is in a frame of the first camera, or from a rectangle, "
    "NAME=U0,V0,U1,V1@FRAME; it is kept in the markers file.  --effector ball (or disc) beside it "
    "says the kind.",
)
@click.option(
    "--markers",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="The markers file; all of its markers are tracked.  "
    "[default: effector and goal of ~/.brickservo/markers.ini]",
)
@click.option(
    "--scene",
    default="",
    metavar="KEY=VALUE,...",
    help="Of the synthetic cameras; B.KEY=VALUE is for camera B alone.",
)
@click.option(
    "--csv",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="One row per frame and marker: frame,t,marker,u,v,confidence; of several cameras with "
    "another column, camera.",
)
@click.option(
    "--serve/--no-serve",
    default=True,
    help="Serve the brick (default); without it, files are gone through as fast as possible.",
)
@click.option("--host", default="", metavar="H", help="Address to listen at.  [default: all]")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    metavar="P",
    help="Port to listen at, 0 for any.  [default: 7711]",
)
@click.option(
    "--fps",
    type=click.FloatRange(0.1, 1000),
    metavar="F",
    help="Asked of a webcam; the pace of files instead of their own.",
)
@click.option("--size", metavar="WxH", help="Asked of a webcam, px.  [default: 640x480]")
@click.option(
    "--picture",
    metavar="FILE.png[@FRAME]",
    help="Write the tracker's view of a frame (the last one if not said); of several cameras "
    "FILE-A.png, FILE-B.png, ...",
)
@click.option(
    "--page/--no-page",
    default=None,
    help="Serve a web page to watch, pick, aim and stop from; its address is printed.  "
    "[default: with --serve]",
)
@on_the_page
@click.option(
    "--brick/--no-brick",
    default=True,
    help="Before a synthetic camera, an emulated brick comes when the page is first opened and "
    "none has called (default).",
)
def track(page: bool | None, brick: bool, **orders: Any) -> None:
    """Find the markers in every frame, and serve the brick.

    Ends with the last video, once nobody has the page open, or by Ctrl-C.
    """
    from laptop.tracking import track as tracking  # OpenCV is slow to import

    shown = orders["serve"] if page is None else page
    # The page brings an emulated brick along; its arm is there from the beginning.
    usual = "spatial" if shown and orders["camera"].count("synthetic") > 1 else "planar"
    arm = os.environ.get("BRICKSERVO_ARM", usual)
    if orders["open"] and not shown:
        raise click.UsageError("--open opens the page; leave --no-page out.")
    try:
        status = tracking.command(
            tracking.Orders(page=shown, **orders),
            partial(_synthetic, arm),
            own_brick=partial(_own_brick, arm) if brick else None,
        )
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    sys.exit(status)


@contextlib.contextmanager
def _own_brick(arm: str, place: str, code: str) -> Iterator[Callable[[], str]]:
    """An emulated brick that waits for orders; its lines go to its folder in the state folder.

    Gives what tells why it has ended, "" as long as it has not.
    """
    home = Path(state_folder()) / "emulated-brick"
    home.mkdir(parents=True, exist_ok=True)
    words = ["simulate", "--realtime", "--timeout", f"{FOREVER:g}", "--arm", arm]
    words += ["--out", str(home), str(SERVO), place, "--code", code, "--arm", arm, "--wait"]
    with open(home / "lines.txt", "wb") as lines:
        brick = subprocess.Popen(
            [sys.executable, "-c", BESIDE, *words],
            cwd=SERVO.parent.parent,
            stdin=subprocess.PIPE,
            stdout=lines,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is the tracker's, who then ends this
        )

    def why() -> str:
        if brick.poll() is None:
            return ""
        return f"the emulated brick has ended; what it said is in {home / 'lines.txt'}"

    try:
        yield why
    finally:
        brick.terminate()
        try:
            brick.wait(5.0)
        except subprocess.TimeoutExpired:
            brick.kill()
        brick.communicate()


def _synthetic(arm: str, name: str, scene: str, fps: float | None) -> tuple[Any, dict[str, str]]:
    """The synthetic camera of this name, and how the markers in its scene look."""
    from laptop.simulator.scene.rendered_tracker import marker_specs
    from laptop.simulator.scene.synthetic_camera import open_live

    text = ",".join([*([scene] if scene else []), *([f"fps={fps}"] if fps else [])])
    camera = open_live(text, camera=name, resting=arm)
    return camera, marker_specs(camera.constants)
