"""`measure camera`: what a picture of the printed board tells of the camera."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.command import OwnCommand
from laptop.cli.options import (
    bar_option,
    calibration_option,
    camera_option,
    cameras_of,
    examples,
    importing,
    in_one_line,
    json_option,
    print_json,
    replace_option,
    sources_argument,
)
from laptop.cli.track import open_synthetic
from laptop.system.files import check_new
from shared import state
from shared.message_fields import printable

if TYPE_CHECKING:
    from laptop.see.camera.frames import Frame
    from laptop.see.camera.live_cameras import LiveCamera
    from laptop.see.camera.recordings import Recording
    from laptop.see.markers.finders.board import BoardView

MAX_VIEWS = 30
"""Greatest number of pictures of one source that are examined."""
MAX_FAULTS = 3
"""Greatest number of pictures whose faults are reported."""
LIVE_PICTURE = 10
"""Number of the picture that counts of a live camera: by then it has set its exposure."""


@click.command(
    cls=OwnCommand,
    short_help="A camera's lens and place, by the printed board.",
    epilog=examples(
        "measure camera --camera 0 --bar 97 --to camera.json",
        "measure camera --camera tilted.jpg --camera lying.jpg",
    ),
)
@sources_argument
@camera_option
@bar_option
@click.option(
    "--to",
    "out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.json",
    help="Keep the camera in this file.",
)
@replace_option
@calibration_option("Tell whether the camera of this file has moved since, and nothing else.")
@click.option(
    "--scene", default="", metavar="KEY=VALUE,...", help="Of the synthetic camera: board=a4, ..."
)
@json_option
def camera(
    sources: tuple[str, ...],
    cameras: tuple[str, ...],
    bar: float | None,
    out: Path | None,
    replace: bool,
    calibration: Path | None,
    scene: str,
) -> None:
    """Calibrate a camera by the printed board: its lens, its place, and how sure both are.

    Pictures come from a webcam, pictures, a folder of them, or a video; several are views of the
    same camera.  The last picture says where the table is.
    """
    with importing():  # OpenCV
        from laptop.see.table import camera_file, camera_report
        from laptop.see.table.camera_fit import calibrate

    with in_one_line():
        sources = cameras_of(cameras, sources)
        before = camera_file.read_camera(calibration) if calibration else None
        if out:
            check_new(out, (".json",), replace)
        looked, views = _views(sources, scene)
        if len(views) < looked:
            click.echo(f"{len(views)} of {looked} pictures show the board")
        if before:
            if not views:
                raise click.ClickException("no marker of the board is seen; show it as it was")
            shift = camera_report.shift_since(before, views[-1])
            click.echo(shift)
            if shift.moved:
                raise SystemExit(1)
            return
        found = calibrate(views, bar)
        for line in camera_report.describe(found):
            click.echo(line)
        print_json(camera_file.calibration_values(found))
        if out:
            camera_file.write_camera(out, found)
            click.echo(out)


def _views(sources: tuple[str, ...], scene: str) -> tuple[int, list[BoardView]]:
    """Return the number of pictures, and the views of those that show the board.

    Says which could not be read, and which are left out as they are mirrored or show two boards.
    """
    from laptop.see.camera.cameras import is_live, open_camera
    from laptop.see.markers.finders.board import find_board
    from laptop.see.markers.finders.board_faults import board_fault
    from laptop.system.decoders import quiet_decoders

    if scene and "synthetic" not in sources:
        raise click.ClickException(f"--scene {scene}: only the source synthetic has a scene")
    looked, views, faults = 0, [], []
    for source in sources:
        with ExitStack() as stack:
            stack.enter_context(quiet_decoders())
            is_synthetic = source == "synthetic"
            if is_synthetic:
                one, _ = open_synthetic(state.default_arm(), "A", scene, None)
            else:
                one = open_camera(source)
            stack.callback(one.close)
            live = is_synthetic or is_live(source)
            for frame in _frames(one, live, first=LIVE_PICTURE if live and not is_synthetic else 0):
                looked += 1
                view = find_board(frame.image)
                if fault := board_fault(frame.image, view):
                    which = "" if live or one.count == 1 else f", picture {frame.index + 1}"
                    faults.append(f"{printable(source)}{which}: {fault}")
                elif view:
                    views.append(view)
            for note in () if live else one.notes:
                click.echo(f"{printable(source)}: {note}")
    if faults and not views:
        raise click.ClickException(faults[0])
    for fault in faults[:MAX_FAULTS]:
        click.echo(fault)
    if len(faults) > MAX_FAULTS:
        click.echo(f"the like in {len(faults) - MAX_FAULTS} more pictures")
    return looked, views


def _frames(camera: LiveCamera | Recording, live: bool, first: int) -> Iterator[Frame]:
    """Yield the pictures that are looked at: one of a live camera, of others MAX_VIEWS from all.

    Args:
        camera: it.
        live: whether it goes on for ever.
        first: index of the first one that counts.
    """
    every = max(1, (getattr(camera, "count", None) or 1) // MAX_VIEWS)
    taken = 0
    while taken < (1 if live else MAX_VIEWS) and not camera.ended:
        frame = camera.read(2.0)
        if frame is None:
            if live:
                raise click.ClickException(f"{camera.name} gives no picture; plug it in anew")
            continue
        if frame.index >= first and (live or not (frame.index - first) % every):
            taken += 1
            yield frame
