"""`measure arm`: an arm measures itself by a camera, and its file says what it found."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.command import OwnCommand
from laptop.cli.groups import in_groups
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
    listen_port_option,
    marker_height_option,
    out_option,
    sources_argument,
    typed_args,
    write_run,
)
from laptop.cli.rigs import RigOptions, live_rig
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.run import RunFile
from laptop.record.run_folder import run_folder
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.measure.arm.arm_fit import TouchSight
    from laptop.measure.arm.arm_model import MeasuredByHand
    from laptop.measure.arm.arm_result import Measured
    from laptop.measure.arm.calibrating import CalibrationSetup, Identified
    from laptop.measure.live_rig import LiveRig
    from laptop.see.table.arm_file import WrittenArm
    from laptop.see.table.camera_fit import Calibration

TOUCH_SAMPLE_S = 1.0
"""Time for which the marker is sampled while the pen stands on a cross, s."""


@dataclass(frozen=True)
class CalibrationCameraOptions:
    """Cameras before the arm, and what is known of it beforehand.

    sources       of the camera, as they were typed before
    cameras       the same, as they are typed
    bar           length of the board's bar as measured, mm; None: as printed
    calibration   file of `measure camera`; None: what the board tells
    height        of the marker, in space of the shoulder's axis, mm; None: not measured
    touch         crosses on which the pen is set by hand, as text
    board_square  how the board is turned from the arm's x, "0" to "270"; None: anyhow
    effector      the marker's SPEC, as for `track`
    scene         of an emulated camera; None: it sees by its formula
    call          the real brick's name, see RigOptions
    port          at which the brick is waited for; None: the usual one
    """

    sources: tuple[str, ...]
    cameras: tuple[str, ...]
    bar: float | None
    calibration: Path | None
    height: float | None
    touch: str
    board_square: str | None
    effector: str | None
    scene: str | None
    call: str | None
    port: int | None

    def known(self) -> MeasuredByHand:
        """Return what was measured by hand."""
        from laptop.measure.arm.arm_model import MeasuredByHand

        square = None if self.board_square is None else int(self.board_square) // 90
        return MeasuredByHand(None if self.height is None else self.height / 10, square)


@dataclass(frozen=True)
class CalibrationOptions:
    """Options of a calibration, and of what becomes of it.

    arm_file  the arm's name or file
    seconds   for which it moves at the most
    out       the run's folder; None: a new one
    dry_run   the arm's file is left as it is
    """

    arm_file: str
    seconds: float
    out: Path | None
    dry_run: bool


@dataclass(frozen=True)
class EmulatedArm:
    """An emulated arm.

    simulate  whether it is that which measures itself
    plant     constants of its brick, as text; None: the usual ones
    built     file of the arm as it was built; None: as it is described
    seed      of all that is emulated; None: 0
    """

    simulate: bool
    plant: str | None
    built: str | None
    seed: int | None

    @property
    def plant_text(self) -> str:
        """Constants of its brick, the seed among them."""
        text = self.plant or "cpu=1"
        return text if "seed=" in text else f"{text},seed={self.seed or 0}"

    def truth(self) -> Arm | None:
        """Return the arm as it was built; None: as it is described."""
        return read_arm(find_arm(self.built)) if self.built else None


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
@in_groups(
    camera_options=CalibrationCameraOptions, wished=CalibrationOptions, emulation=EmulatedArm
)
def calibrate(
    camera_options: CalibrationCameraOptions, wished: CalibrationOptions, emulation: EmulatedArm
) -> None:
    """Let an arm measure itself by a camera: links, zeros, backlash, and its marker's place.

    The printed board lies within the arm's reach, and the camera sees it and all of the arm.  The
    pen is up.  What comes out is written into the arm's file; the old one is kept beside it.  An
    emulated arm leaves the real one's file alone.
    """
    with importing():
        from laptop.measure.arm import arm_result
        from laptop.measure.arm.calibration_record import RESTS, calibration_run
        from laptop.see.table.arm_file import check_writable, own_file

    with in_one_line(), ExitStack() as stack:
        sources = cameras_of(camera_options.cameras, camera_options.sources)
        arm = read_arm(find_arm(wished.arm_file))
        crosses = _crosses(camera_options.touch, arm)
        is_emulated = emulation.simulate or SYNTHETIC in sources
        if not (wished.dry_run or is_emulated):
            check_writable(own_file(arm))
        folder = stack.enter_context(run_folder("measure-arm", wished.out, RESTS))
        own = folder.path / f"{arm.name}.ini" if is_emulated else None
        if own and not wished.dry_run:
            check_writable(own)
        built = emulation.truth() if emulation.simulate else None
        if emulation.simulate:
            setup = _emulated(arm, built or arm, emulation, camera_options, crosses)
        else:
            setup = stack.enter_context(_live(wished.arm_file, camera_options, sources, crosses))
        result, rows = _measured(setup, arm, camera_options.known(), wished.seconds)
        # First: where the arm's file is refused, no record says that it is calibrated.
        new = None
        if not wished.dry_run:
            new = arm_result.write_measured(result.fit, rows, date.today(), own)
        reported, files = calibration_run(result, rows, setup.camera)
        reported.typed, reported.arm = typed_args(), numbers_of(arm)
        reported.built = built and numbers_of(built)
        if emulation.simulate:
            reported.on_emulated_brick(emulation.plant_text)
            reported.seeds["camera"] = emulation.seed or 0
        elif is_emulated:
            reported.on_emulated_brick()
        if own and new:
            reported.files = [RunFile(own.name)]
        click.echo(write_run(folder, reported, files))
        _report_written(new)
        if new and not is_emulated and any(row.key == "home" and not row.why for row in rows):
            click.echo(
                "the arm stands where its home pose was; so that the brick takes over its "
                "zero, leave it there and type: driver.py home --here"
            )


def _emulated(
    arm: Arm,
    built: Arm,
    emulation: EmulatedArm,
    camera_options: CalibrationCameraOptions,
    crosses: list[tuple[float, float]],
) -> CalibrationSetup:
    """Return an emulated arm before an emulated camera."""
    from laptop.measure.arm.emulated_setups import ideal_camera, rendered

    seed = emulation.seed or 0
    if camera_options.scene is None:
        known = camera_options.known()
        return ideal_camera(
            arm, built, emulation.plant_text, seed, camera_options.bar, crosses, known
        )
    return rendered(
        arm, built, emulation.plant_text, seed, camera_options.bar, crosses, camera_options.scene
    )


@contextmanager
def _live(
    arm_file: str,
    camera_options: CalibrationCameraOptions,
    sources: Sequence[str],
    crosses: list[tuple[float, float]],
) -> Iterator[CalibrationSetup]:
    """Open the camera, accept the brick, and calibrate by the touched crosses."""
    from laptop.measure.arm.calibrating import CalibrationSetup
    from laptop.measure.arm.emulated_setups import SCENE_PREFIX

    scene, port = "", camera_options.port
    if SYNTHETIC in sources:
        scene = f"{SCENE_PREFIX},{camera_options.scene or ''}"
        port = 0 if port is None else port  # an emulated brick is told which
    call = None if crosses else camera_options.call
    asked = RigOptions(sources, arm_file, scene, camera_options.effector, port=port, call=call)
    with live_rig(asked) as rig:
        found, check = _calibrated(rig, camera_options.calibration, camera_options.bar)
        yield CalibrationSetup(rig, found, _touched(rig, crosses), check)


def _measured(
    setup: CalibrationSetup, arm: Arm, known: MeasuredByHand, seconds: float
) -> tuple[Identified, list[Measured]]:
    """Let the arm measure itself, report the result, and return it.

    Args:
        setup: the arm before its camera.
        arm: as it is described.
        known: what was measured by hand.
        seconds: for which it may move.
    """
    from laptop.measure.arm.arm_model import ArmModel, CameraPrior
    from laptop.measure.arm.arm_result import check_scale, measured
    from laptop.measure.arm.calibrating import MarkerUnseen, go_home, identify

    for line in _board(setup.camera):
        click.echo(line)
    model = ArmModel(arm, {"A": CameraPrior.of(setup.camera.camera)}, known)
    try:
        result = identify(setup.rig, model, setup.touches, click.echo, seconds)
    except MarkerUnseen:
        setup.check()  # why, the picture may tell
        raise
    setup.check()
    check_scale(result.fit, setup.camera.bar)
    go_home(setup.rig)
    rows = measured(result.fit)
    for line in _table(rows):
        click.echo(line)
    return result, rows


def _report_written(new: WrittenArm | None) -> None:
    """Report the arm's file that was written; None: none was to be written."""
    if new is None:
        click.echo("the arm's file was left as it is, as wished")
    else:
        old = f"; the old one is {new.before}" if new.before else ""
        click.echo(f"written: {new.file}{old}")


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
    from laptop.measure.arm.calibrating import check_unmoved, seen_board
    from laptop.see.table.camera_file import read_camera
    from laptop.see.table.camera_fit import calibrate as fit_camera

    view = seen_board(rig.image())
    if camera_file:
        found = read_camera(camera_file)
        if bar is not None and bar != found.bar:
            raise click.UsageError(f"--bar is that of {camera_file}: leave it out here")
    else:
        found = fit_camera([view], bar)

    def check() -> None:
        check_unmoved(found, rig.image())

    if camera_file:
        check()
    return found, check


def _touched(rig: LiveRig, crosses: list[tuple[float, float]]) -> list[TouchSight]:
    """Ask for the pen on each cross, and sample the marker."""
    from laptop.measure.arm.touching import touch_sight

    found = []
    if crosses and not sys.stdin.isatty():
        raise click.ClickException("--crosses asks somebody; there is no terminal to answer at")
    for x, y in crosses:
        click.pause(f"set the pen on the cross at {x:g}, {y:g} cm, hands off, and press a key")
        found.append(touch_sight((x, y), rig.watch(TOUCH_SAMPLE_S)["A"]))
    return found
