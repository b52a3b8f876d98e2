"""`track`: the tracking of cameras is handed its page, synthetic cameras and emulated brick."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.command import OwnCommand
from laptop.cli.groups import in_groups
from laptop.cli.options import (
    SYNTHETIC,
    FiniteRange,
    bar_option,
    examples,
    frame_size_option,
    importing,
    in_one_line,
    listen_option,
    marker_height_option,
    on_the_page,
    replace_option,
)
from laptop.emulator.bundled_scripts import REPO_ROOT, SERVO
from laptop.see.markers.kinds import COLOR_KINDS
from laptop.see.serve.options import TrackCameraOptions, TrackOptions, read_picture
from laptop.system import platforms
from laptop.system.files import check_new
from shared import state
from shared.arm_description import find_arm, read_arm

if TYPE_CHECKING:
    from laptop.see.serve.track import PageInputs, ServedPage

LOCALHOST = "127.0.0.1"
BRICK_TIMEOUT = 1e6
"""Timeout of an emulated brick, s; it ends with the tracker in any case."""
END_TIMEOUT = 5.0
"""Longest time, s, that an emulated brick may take to terminate; then it is killed."""
RUN_WHILE_INPUT_IS_OPEN = f"""
import sys
sys.path[0] = {REPO_ROOT!r}  # in place of the folder one is in, where any file may be
import os, threading
from laptop.system import platforms
def end_with_input():
    while os.read(0, 4096):  # (sys.stdin has a lock, which the interpreter wants at its end)
        continue
    platforms.end_in_order()
threading.Thread(target=end_with_input, daemon=True).start()
from laptop.cli.start import run
run()
"""
"""Program that runs a command of ours, and ends with the process that holds its input open."""


SECTIONS = {
    "What is seen": ("--camera", "--effector", "--goal", "--pick", "--markers"),
    "The camera": ("--frame-size", "--fps", "--scene"),
    "Who is served": ("--serve", "--listen-port", "--simulate", "--arm"),
    "The page": ("--page", "--open", "--page-port", "--page-hold"),
    "A board on the table": ("--board", "--bar", "--marker-height", "--touched"),
    "What is written": ("--to", "--replace", "--json"),
}


@dataclass(frozen=True)
class LinkOptions:
    """Options of the link, as typed.

    serve      whether a brick is
    listen_at  host and port where it is waited for; None: all addresses, the usual port
    simulate   an emulated brick comes before a synthetic camera
    """

    serve: bool
    listen_at: tuple[str | None, int | None]
    simulate: bool


@dataclass(frozen=True)
class PageOptions:
    """Options of the page, as typed.

    page       whether it is served; None: where a brick is
    page_at    host and port where it is to be had; None: this computer, the usual port or any
    page_hold  whether a run is held when no page is heard
    open       what is to be seen is opened in a browser
    """

    page: bool | None
    page_at: tuple[str | None, int | None]
    page_hold: bool
    open: bool


@dataclass(frozen=True)
class TrackFiles:
    """The files that are written; with `replace` in the place of others."""

    files: tuple[str, ...]
    replace: bool


@click.command(
    cls=OwnCommand,
    short_help="Find the markers in a camera's pictures, and serve the brick.",
    sections=SECTIONS,
    epilog=examples(
        "track --effector ball:green --goal 320,120",
        "track --camera film.mp4 --no-serve --to seen.csv",
    ),
)
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
    "--arm",
    "arm_file",
    envvar=state.ARM,
    show_envvar=True,
    metavar="FILE",
    help="Arm that the page draws with, and that stands before a synthetic camera.  [default: "
    "planar; before two of these spatial]",
)
@click.option(
    "--effector",
    metavar="SPEC",
    help=f"The arm's marker: [{':|'.join(COLOR_KINDS)}:]COLOUR, aruco:ID, or a markers file.",
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
    "--to",
    "files",
    multiple=True,
    metavar="FILE",
    help="FILE.csv: one row per frame and marker: frame,t,marker,u,v,confidence; of several "
    "cameras with another column, camera; with --board x and y on it, cm, with --touched "
    "arm_x and arm_y, of several cameras z and gap.  FILE.png[@FRAME]: the tracker's view of a "
    "frame, the last one if not said; of several cameras FILE-A.png, FILE-B.png, ...",
)
@click.option(
    "--board",
    is_flag=True,
    help="A printed board lies on the table (markers --board): once it is seen, markers are told "
    "in cm on it, too.",
)
@bar_option
@marker_height_option(
    "Of the arm's marker over the table, for --board and drawings on the page.  [default: 0; of "
    "several cameras: two that see it measure it; drawings: it is asked for, or found by the board]"
)
@click.option(
    "--touched",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="What touching the board's crosses gave, for --board: the pen's place is told, on the "
    "board and in the arm's frame.",
)
@click.option(
    "--serve/--no-serve",
    default=True,
    help="Serve the brick (default); without it, files are gone through as fast as possible.",
)
@listen_option(
    "--listen-port",
    "listen_at",
    "Where the brick is waited for, P 0 for any.  [default: 7711, at all addresses]",
)
@click.option(
    "--fps",
    type=FiniteRange(0.1, 1000),
    metavar="F",
    help="Asked of a webcam; the pace of files instead of their own.",
)
@frame_size_option
@click.option(
    "--page/--no-page",
    default=None,
    help="Serve a web page to watch, pick, aim and stop from; its address is printed.  "
    "[default: with --serve]",
)
@on_the_page
@click.option(
    "--page-hold/--no-page-hold",
    default=True,
    help="Hold a run that was started on the page when no page is heard for 2 s (default).",
)
@click.option(
    "--simulate/--no-simulate",
    default=True,
    help="Before a synthetic camera, an emulated brick comes when the page is first opened and "
    "none has called (default).",
)
@click.option(
    "--json",
    "announce",
    is_flag=True,
    help="Announce events to programs: standard output bears one JSON object per line, with its "
    '"event": cameras (name, source, size, fps), serving (host, port, code, addresses), page '
    "(url), ready, end (status, reason).  All else goes to standard error.",
)
@replace_option
@in_groups(
    camera_options=TrackCameraOptions, link=LinkOptions, page=PageOptions, written=TrackFiles
)
def track(
    arm_file: str | None,
    camera_options: TrackCameraOptions,
    link: LinkOptions,
    page: PageOptions,
    written: TrackFiles,
    announce: bool,
) -> None:
    """Find the markers in every frame, and serve the brick.

    Ends with the last video, once nobody has the page open, or by Ctrl-C.
    """
    with importing():  # OpenCV
        from rich.console import Console

        from laptop.see.serve import announcements, track

    shown = link.serve if page.page is None else page.page
    # The page brings an emulated brick along; its arm is there from the beginning.
    usual = "spatial" if shown and camera_options.camera.count(SYNTHETIC) > 1 else "planar"
    arm = arm_file or usual
    with in_one_line():
        csv, picture = _outputs(written.files, written.replace)
        watch_boards = None
        if camera_options.board:
            from laptop.see.table.table_watch import watch_tables

            watch_boards = watch_tables(
                camera_options.bar,
                camera_options.height,
                camera_options.touched,
                read_arm(find_arm(arm)),
            )
        host, port = link.listen_at
        is_real = SYNTHETIC not in camera_options.camera
        open_page = partial(_open_page, page, is_real, arm, camera_options.height)
        status = track.track(
            TrackOptions(
                csv=csv,
                picture=picture,
                serve=link.serve,
                host=host or "",
                port=port,
                open=page.open,
                **vars(camera_options),
            ),
            partial(open_synthetic, arm),
            Console(stderr=announce),
            start_brick=partial(start_brick, arm) if link.simulate else None,
            open_page=open_page if shown else None,
            announce=announcements.json_lines(sys.stdout) if announce else announcements.silence,
            watch_boards=watch_boards,
        )
    sys.exit(status)


def _outputs(files: tuple[str, ...], replace: bool) -> tuple[Path | None, str | None]:
    """Return the table and the picture (FILE.png[@FRAME]) that are to be written."""
    tables, pictures = [], []
    for file in files:
        if Path(file).suffix.lower() == ".csv":
            tables.append(Path(file))
            check_new(tables[-1], (".csv",), replace)
        else:
            check_new(read_picture(file)[0], (".csv", ".png", ".jpg"), replace)
            pictures.append(file)
    if max(len(tables), len(pictures)) > 1:
        raise click.UsageError(f"--to {files[1]}: write one .csv and one .png; leave this one out.")
    return next(iter(tables), None), next(iter(pictures), None)


def _open_page(
    asked: PageOptions, real: bool, arm: str, height: float | None, stack: contextlib.ExitStack
) -> Callable[[PageInputs], ServedPage]:
    """Take the page's port; gives a function that serves the page there, see OpenPage.

    Args:
        asked: of the page.
        real: whether a real brick may be called from it.
        arm: that draws, its name or file.
        height: of its marker over the table, mm, or None.
        stack: closes all.
    """
    from laptop.page import process
    from laptop.page.brick_call import ComingBricks
    from laptop.page.camera_feed import CameraFeed
    from laptop.page.controller import PageController
    from laptop.page.marker_height import HEIGHTS_FILE, DrawingArm, HeightMemory, given_height
    from laptop.see.serve.track import ServedPage

    host = asked.page_at[0] or LOCALHOST
    listener = stack.enter_context(process.listen(host, asked.page_at[1]))

    def serve(inputs: PageInputs) -> ServedPage:
        server = inputs.server

        def start_on_brick() -> Callable[[], str]:
            assert server is not None
            return stack.enter_context(run_on_brick(server.port))

        description = read_arm(find_arm(arm))
        emulated = {} if real else getattr(inputs.pipelines[0].camera, "constants", {})
        file = Path(state.state_folder()) / HEIGHTS_FILE
        memory = HeightMemory(file, description.name) if real else None
        cameras = zip(inputs.pipelines, inputs.trackers, inputs.sources, strict=True)
        controller = PageController(
            [CameraFeed(*camera) for camera in cameras],
            server,
            inputs.file,
            ComingBricks(inputs.start_brick, start_on_brick if real and server else None),
            DrawingArm(description, given_height(height, emulated), memory),
            inputs.now,
            hold_on_timeout=asked.page_hold,
        )
        stack.callback(controller.drawings.close)
        page = process.PageProcess(controller, listener, host, inputs.report, inputs.invite)
        stack.callback(page.close)
        return ServedPage(
            page.address, page.warning, lambda: controller.has_viewers, controller.expect_viewer
        )

    return serve


@contextlib.contextmanager
def start_brick(arm: str, place: str) -> Iterator[Callable[[], str]]:
    """Start an emulated brick that waits for orders; its output goes to the state folder.

    Gives a function that tells why it has ended, "" while it has not.

    Args:
        arm: its name or file.
        place: HOST:PORT of the tracker, of which it knows the code.
    """
    out_dir = Path(state.state_folder()) / state.BRICK_FOLDER
    out_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
    args = ["simulate", "--realtime", "--timeout", f"{BRICK_TIMEOUT:g}", "--arm", arm]
    args += ["--out", str(out_dir), SERVO, place, "--arm", arm, "--wait"]
    with _beside(args, out_dir / "lines.txt", "the emulated brick") as why_ended:
        yield why_ended


@contextlib.contextmanager
def run_on_brick(port: int, name: str = "") -> Iterator[Callable[[], str]]:
    """Start the program on the real brick over ssh; its output goes to the state folder.

    Gives a function as `start_brick` does.

    Args:
        port: of the tracker.
        name: of the brick; "": the last one.
    """
    file = Path(state.state_folder()) / state.CALLED_BRICK_FILE
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    which = ["--brick", name] if name else []
    args = ["brick", "run", *which, os.path.basename(SERVO), f":{port}", "--wait"]
    with _beside(args, file, "brick run") as why_ended:
        yield lambda: why_ended() and f"{why_ended()}, at last: {_last_line(file)}"


def _last_line(file: Path) -> str:
    lines = file.read_text(encoding="utf-8", errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "nothing")


@contextlib.contextmanager
def _beside(args: list[str], file: Path, name: str) -> Iterator[Callable[[], str]]:
    """Run a command of ours beside the tracker, and end it with a `with` block.

    Gives a function that tells why it has ended, "" while it has not.

    Args:
        args: the command.
        file: for its output.
        name: of it, for people.
    """
    with open(file, "wb") as lines:
        process = subprocess.Popen(
            [sys.executable, "-c", RUN_WHILE_INPUT_IS_OPEN, *args],
            stdin=subprocess.PIPE,
            stdout=lines,
            stderr=subprocess.STDOUT,
            **platforms.own_group(),  # Ctrl-C is the tracker's, who then ends this
        )

    def why_ended() -> str:
        if process.poll() is None:
            return ""
        from laptop.see.serve.process_signals import killed_by

        signal_name = killed_by(process.returncode)
        what = f"was killed ({signal_name})" if signal_name else "has ended"
        return f"{name} {what}; what it said is in {file}"

    try:
        yield why_ended
    finally:
        process.terminate()
        try:
            process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
        process.communicate()


def open_synthetic(
    arm: str, name: str, scene: str, fps: float | None
) -> tuple[Any, dict[str, str]]:
    """Open the synthetic camera of this name, see OpenSynthetic."""
    from laptop.emulator.rendered_tracker import marker_specs
    from laptop.emulator.scene.synthetic_camera import open_live

    text = ",".join([*([scene] if scene else []), *([f"fps={fps}"] if fps else [])])
    camera = open_live(text, camera=name, resting=arm)
    return camera, marker_specs(camera.constants)
