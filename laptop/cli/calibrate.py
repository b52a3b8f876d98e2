"""`measure arm`: an arm measures itself by a camera, and its file says what it found."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.command import OwnCommand
from laptop.cli.options import (
    SYNTHETIC,
    FiniteRange,
    arm_option,
    calibration_option,
    call_option,
    camera_option,
    cameras_of,
    examples,
    importing,
    in_one_line,
    json_option,
    leave,
    listen_port_option,
    marker_height_option,
    out_option,
    sources_argument,
    typed_words,
)
from laptop.cli.rigs import RigOptions, live_rig
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.run import RunFile
from laptop.record.run_folder import run_folder
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.measure.arm.arm_fit import TouchSight
    from laptop.measure.arm.measured_numbers import Measured
    from laptop.measure.live_rig import LiveRig
    from laptop.see.table.camera_fit import Calibration

LOOK_S = 1.0
"""The marker is looked at so long while the pen stands on a cross, s."""


@click.command(
    cls=OwnCommand,
    short_help="An arm's own numbers: links, zeros, backlash.",
    epilog=examples(
        "measure arm --camera 0 --bar 97 --marker-height 25 --crosses 1,3,4,6,7,9",
        "measure arm --simulate --seed 3",
    ),
)
@sources_argument
@camera_option
@arm_option("Calibrate this arm")
@click.option(
    "--bar",
    type=FiniteRange(50, 200),
    metavar="MM",
    help="Length of the board's printed bar as measured.  [default: 100, not measured]",
)
@calibration_option("What `measure camera` wrote, of several views; it has not moved since.")
@marker_height_option(
    "Of the marker over the table, in space of the shoulder's axis, by a ruler.",
)
@click.option(
    "--crosses",
    "touch",
    default="",
    metavar="N,N,...",
    help="Set the pen by hand on these crosses of the board before the arm moves.",
)
@click.option(
    "--board-square",
    type=click.Choice(["0", "90", "180", "270"]),
    metavar="DEG",
    help="The board's edge lies along the arm's x: its own x is turned from that by 0, 90, ..., "
    "counter-clockwise.",
)
@click.option("--timeout", "seconds", type=FiniteRange(60, 900), default=180, show_default=True,
              metavar="S", help="The arm moves for so long at the most.")  # fmt: skip
@out_option
@click.option(
    "--preview", "dry_run", is_flag=True, help="Measure, and leave the arm's file as it is."
)
@call_option
@listen_port_option
@click.option("--effector", metavar="SPEC", help="The marker on the arm, as for track.")
@click.option("--simulate", is_flag=True, help="An emulated arm before an emulated camera.")
@click.option("--plant", metavar="KEY=VALUE,...", help="Of the emulated arm, as for simulate.")
@click.option("--built", metavar="FILE", help="The emulated arm is built as this file says.")
@click.option(
    "--scene",
    metavar="KEY=VALUE,...",
    help="The emulated camera's pictures are rendered, as for simulate, and really looked at.",
)
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Of all that is emulated.")
@json_option
def calibrate(
    sources: tuple[str, ...],
    cameras: tuple[str, ...],
    arm_file: str,
    bar: float | None,
    calibration: Path | None,
    height: float | None,
    touch: str,
    board_square: str | None,
    seconds: float,
    out: Path | None,
    dry_run: bool,
    call: str | None,
    port: int | None,
    effector: str | None,
    simulate: bool,
    plant: str | None,
    built: str | None,
    scene: str | None,
    seed: int | None,
) -> None:
    """Let an arm measure itself by a camera: links, zeros, backlash, and its marker's place.

    The printed board lies within the arm's reach, and the camera sees it and all of the arm.  The
    pen is up.  What comes out is written into the arm's file; the old one is kept beside it.  An
    emulated arm leaves the real one's file alone.
    """
    with importing():
        from laptop.measure.arm import measured_numbers as numbers
        from laptop.measure.arm.arm_model import ArmModel, CameraPrior, MeasuredByHand
        from laptop.measure.arm.calibrating import (
            CalibrationSetup,
            MarkerUnseen,
            go_home,
            identify,
        )
        from laptop.measure.arm.calibration_record import RESTS, calibration_run
        from laptop.measure.arm.emulated_setups import SCENE, by_formula, rendered
        from laptop.see.table.arm_file import check_writable, own_file

    with in_one_line(), ExitStack() as stack:
        sources = cameras_of(cameras, sources)
        arm = read_arm(find_arm(arm_file))
        square = None if board_square is None else int(board_square) // 90
        crosses = _crosses(touch, arm)
        known = MeasuredByHand(None if height is None else height / 10, square)
        text = plant or "cpu=1"
        text += "" if "seed=" in text else f",seed={seed or 0}"
        unreal = simulate or SYNTHETIC in sources
        if not (dry_run or unreal):
            check_writable(own_file(arm))
        folder = stack.enter_context(run_folder("measure-arm", out, RESTS))
        own = folder.path / f"{arm.name}.ini" if unreal else None
        if own and not dry_run:
            check_writable(own)

        def finish(setup: CalibrationSetup) -> None:
            for line in _board(setup.camera):
                click.echo(line)
            model = ArmModel(arm, {"A": CameraPrior.of(setup.camera.camera)}, known)
            try:
                result = identify(setup.rig, model, setup.touches, click.echo, seconds)
            except MarkerUnseen:
                setup.check()  # why, the picture may tell
                raise
            setup.check()
            numbers.check_scale(result.fit, setup.camera.bar)
            go_home(setup.rig)
            rows = numbers.measured(result.fit)
            for line in _table(rows):
                click.echo(line)
            # First: where the arm's file is refused, no record says that it is calibrated.
            new = None if dry_run else numbers.write_measured(result.fit, rows, date.today(), own)
            told, files = calibration_run(result, rows, setup.camera)
            told.typed, told.arm = typed_words(), numbers_of(arm)
            if unreal:
                told.on_emulated_brick(text if simulate else "")
            if simulate:
                told.seeds["camera"] = seed or 0
                told.built = numbers_of(truth) if built else None
            if own and new:
                told.files = [RunFile(own.name)]
            click.echo(leave(folder, told, files))
            if new is None:
                click.echo("the arm's file was left as it is, as wished")
                return
            old = f"; the old one is {new.before}" if new.before else ""
            click.echo(f"written: {new.file}{old}")
            if not unreal and any(row.key == "home" and not row.why for row in rows):
                click.echo(
                    "the arm stands where its home pose was; so that the brick takes over its "
                    "zero, leave it there and type: driver.py home --here"
                )

        if simulate:
            truth = read_arm(find_arm(built)) if built else arm
            if scene is None:
                finish(by_formula(arm, truth, text, seed or 0, bar, crosses, known))
            else:
                finish(rendered(arm, truth, text, seed or 0, bar, crosses, scene))
            return
        pictures = f"{SCENE},{scene or ''}" if unreal else ""
        if unreal and port is None:
            port = 0  # an emulated brick is told which
        calls = None if crosses else call
        asked = RigOptions(sources, arm_file, pictures, effector, port=port, call=calls)
        with live_rig(asked) as rig:
            found, check = _calibrated(rig, calibration, bar)
            finish(CalibrationSetup(rig, found, _touched(rig, crosses), check))


def _crosses(text: str, arm: Arm) -> list[tuple[float, float]]:
    """Read the numbers of the board's crosses."""
    from laptop.see.markers.board import CROSSES

    numbers = [part.strip() for part in text.split(",") if part.strip()]
    if numbers and arm.chain != "planar":
        raise click.UsageError("--crosses is for an arm in the plane, with a pen; leave it out")
    if not all(one.isdecimal() and 1 <= int(one) <= len(CROSSES) for one in numbers):
        raise click.UsageError(
            f"--crosses {text}: the crosses have numbers from 1 to {len(CROSSES)}, like 1,3,7,9"
        )
    if len(set(map(int, numbers))) < len(numbers):
        raise click.UsageError(f"--crosses {text}: touch each cross once, others tell more")
    if numbers and len(numbers) < 3:
        raise click.UsageError(f"--crosses {text}: 3 different crosses are the least, 6 are better")
    return [(float(x), float(y)) for x, y in (CROSSES[int(one) - 1] for one in numbers)]


def _board(found: Calibration) -> list[str]:
    from laptop.see.table.camera_report import describe

    return describe(found)


def _table(rows: list[Measured]) -> list[str]:
    """Lines of a table: number, was, is, its standard uncertainty."""
    wide = max(len(row.name) for row in rows)
    lines = [f"{'':{wide}}  {'was':>9}  {'is':>9}  +- sigma"]
    for row in rows:
        start = f"{row.name:{wide}}  {row.was:9.3f}  "
        if row.why:
            lines.append(f"{start}{'unknown':>9}  {row.why}")
        else:
            lines.append(f"{start}{row.found:9.3f}  {row.sigma:.3f} {row.unit}")
    return lines


def _calibrated(
    rig: LiveRig, camera_file: Path | None, bar: float | None
) -> tuple[Calibration, Callable[[], None]]:
    """Return the camera, and what raises if it or the board has moved by the end."""
    from laptop.measure.arm.calibrating import check_sharp, seen_board
    from laptop.see.markers.finders.board import find_board
    from laptop.see.table.camera_file import read_camera
    from laptop.see.table.camera_fit import calibrate as fit_camera
    from laptop.see.table.camera_report import shift_since

    view = seen_board(rig.image())
    if camera_file:
        found = read_camera(camera_file)
        if bar is not None and bar != found.bar:
            raise click.UsageError(f"--bar is that of {camera_file}: leave it out here")
    else:
        found = fit_camera([view], bar)

    def check() -> None:
        image = rig.image()
        check_sharp(image)
        now = find_board(image)
        if now is None:
            return  # the arm may hide it
        shift = shift_since(found, now)
        if shift.moved:
            raise click.ClickException(f"{shift}; nothing was written")

    if camera_file:
        check()
    return found, check


def _touched(rig: LiveRig, crosses: list[tuple[float, float]]) -> list[TouchSight]:
    """Ask for the pen on each cross, and look."""
    from laptop.measure.arm.touching import touch_sight

    found = []
    if crosses and not sys.stdin.isatty():
        raise click.ClickException("--crosses asks somebody; there is no terminal to answer at")
    for x, y in crosses:
        click.pause(f"set the pen on the cross at {x:g}, {y:g} cm, hands off, and press a key")
        found.append(touch_sight((x, y), rig.look(LOOK_S)["A"]))
    return found
