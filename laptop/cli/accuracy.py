"""`measure accuracy`: how accurately the arm goes where it is sent, after ISO 9283, by camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.command import OwnCommand
from laptop.cli.groups import in_groups
from laptop.cli.options import (
    SYNTHETIC,
    FiniteRange,
    ParamType,
    arm_option,
    calibration_option,
    call_option,
    camera_option,
    cameras_of,
    examples,
    frame_size_option,
    importing,
    in_one_line,
    json_option,
    marker_height_option,
    noise_option,
    out_option,
    sources_argument,
    typed_args,
    write_run,
)
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.run_folder import run_folder
from shared.arm_description import find_arm, read_arm

if TYPE_CHECKING:
    from laptop.measure.accuracy.accuracy_test import AccuracyResult
    from laptop.measure.accuracy.plan import AccuracyPlan
    from laptop.measure.accuracy.sighting import BoardArmPose
    from laptop.measure.live_rig import LiveRig
    from laptop.record.run import Run
    from laptop.record.run_folder import RunFolder
    from laptop.see.table.camera_fit import Calibration
    from shared.arm_description import Arm
    from shared.job_messages import JobStatus

PICTURE, TABLE = "accuracy.png", "accuracy.csv"


class Numbers(ParamType):
    """Some numbers with commas between."""

    def __init__(self, name: str, counts: tuple[int, ...]) -> None:
        self.name, self._counts = name, counts

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        """Return the numbers; fail if they are none, or too few."""
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self._counts or not all(map(math.isfinite, numbers)):
            self.fail(f"'{value}' is not {self.name}: numbers with commas between")
        return numbers


@dataclass(frozen=True)
class AccuracyOptions:
    """Options of the test.

    arm_file  the arm's name or file
    cycles    of each pose
    side      of the test's square or cube, cm; None: the largest
    at        its centre, cm; None: where the arm has most room
    """

    arm_file: str
    cycles: int
    side: float | None
    at: tuple[float, ...] | None


@dataclass(frozen=True)
class AccuracyCameraOptions:
    """Cameras before a real arm, and its pose.

    sources      of the cameras, as they were typed before
    cameras      the same, as they are typed
    place        how the arm stands on the board, (x, y) cm and degrees; None: fitted
    bar          length of the board's bar as measured, mm; None: as printed
    height       of the arm's marker, mm; None: 0
    calibration  files of `measure camera`, one for each camera; (): what the board tells
    scene        of synthetic cameras
    effector     the marker's SPEC, as for `track`
    size         asked of webcams, as for `track`
    call         the real brick's name, see RigOptions
    """

    sources: tuple[str, ...]
    cameras: tuple[str, ...]
    place: tuple[float, float, float] | None
    bar: float | None
    height: float | None
    calibration: tuple[Path, ...]
    scene: str
    effector: str | None
    size: str | None
    call: str | None

    def stand(self) -> BoardArmPose | None:
        """Return how the arm stands on the board; None: that is fitted."""
        from laptop.measure.accuracy.sighting import BoardArmPose

        if self.place is None:
            return None
        x, y, degrees = self.place
        return BoardArmPose(math.radians(degrees), (x, y))


@dataclass(frozen=True)
class EmulatedTest:
    """An emulated arm, before emulated cameras.

    simulate  whether it is that which is tested
    plant     constants of its brick, as text
    built     file of the arm as it was built; None: as it is described
    noise     of the marker in a picture, px
    seed      of cameras and noise
    """

    simulate: bool
    plant: str
    built: str | None
    noise: float
    seed: int


@click.command(
    cls=OwnCommand,
    short_help="How accurately the arm goes where it is sent, after ISO 9283.",
    epilog=examples(
        "measure accuracy --simulate --cycles 5",
        "measure accuracy --camera 0 --bar 99.5 --marker-height 25 --arm mine.ini",
        "measure accuracy --camera 0 --camera 2 --arm spatial --calibration a.json --calibration "
        "b.json",
    ),
)
@sources_argument
@camera_option
@arm_option("The arm")
@click.option(
    "--cycles", type=click.IntRange(3, 100), default=30, show_default=True, help="Of each pose."
)
@click.option(
    "--size",
    "side",
    type=FiniteRange(0, 100),
    metavar="CM",
    help="Of the test's square or cube.  [default: the largest to which the arm comes easily]",
)
@click.option(
    "--at",
    type=Numbers("X,Y or X,Y,Z", (2, 3)),
    metavar="X,Y[,Z]",
    help="Its centre in the arm's frame, cm.  [default: where it has most room]",
)
@click.option(
    "--arm-at",
    "place",
    type=Numbers("X,Y,DEG", (3,)),
    metavar="X,Y,DEG",
    help="How the arm stands on the board: its origin there, cm, and how far its x is turned from "
    "the board's.  [default: fitted to the poses, which hides what they have in common]",
)
@click.option(
    "--bar",
    type=float,
    metavar="MM",
    help="Length of the board's bar as measured.  [default: 100, not measured]",
)
@marker_height_option("Of the arm's marker over the table; in space over the tip.  [default: 0]")
@calibration_option(
    "What `measure camera` wrote, one for each --camera.  [default: what the board tells now]",
    multiple=True,
)
@click.option("--scene", default="", metavar="KEY=VALUE,...", help="Of synthetic cameras.")
@click.option("--effector", metavar="SPEC", help="The arm's marker, as for `track`.")
@frame_size_option
@call_option
@click.option("--simulate", is_flag=True, help="On an emulated arm, before emulated cameras.")
@click.option(
    "--plant", default="", metavar="KEY=VALUE,...", help="Of the emulated brick, as for `simulate`."
)
@click.option(
    "--built",
    metavar="FILE",
    help="The emulated arm as it was built, where that is not what --arm says.",
)
@noise_option("Of the marker in an emulated camera's picture.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=1000,
    show_default=True,
    help="Of emulated cameras and their noise.",
)
@out_option
@json_option
@in_groups(test=AccuracyOptions, camera_options=AccuracyCameraOptions, emulation=EmulatedTest)
def accuracy(
    test: AccuracyOptions,
    camera_options: AccuracyCameraOptions,
    emulation: EmulatedTest,
    out: Path | None,
) -> None:
    """Measure accuracy and repeatability of poses and paths after ISO 9283, by camera, in mm.

    An arm in space needs two cameras.  The printed board lies on the table.  The arm goes to five
    poses, 30 times, then from several directions, then along a line and a circle at three speeds;
    the pen stays up.

    Leaves run.json, accuracy.png and accuracy.csv in a folder of its own.
    """
    with importing():
        from laptop.measure.accuracy import report
        from laptop.measure.accuracy.plan import plan_accuracy

    with in_one_line():
        sources = cameras_of(camera_options.cameras, camera_options.sources)
        _check_calibrations(sources, camera_options.calibration, camera_options.bar)
        arm = read_arm(find_arm(test.arm_file))
        plan = plan_accuracy(arm, test.cycles, test.side, test.at)
        with run_folder("measure-accuracy", out, PICTURE, TABLE) as folder:
            click.echo(report.describe_plan(plan))
            click.echo(f"that takes the brick some {plan.seconds() / 60:.0f} min")
            truth, built_arm = None, None
            if emulation.simulate:
                built_arm = read_arm(find_arm(emulation.built)) if emulation.built else None
                result, truth = _simulated(plan, built_arm, emulation)
            else:
                result = _live(plan, sources, test.arm_file, camera_options)
            reported = report.accuracy_run(result, truth)
            reported.typed, reported.arm = typed_args(), numbers_of(arm)
            reported.built = built_arm and numbers_of(built_arm)
            if emulation.simulate:
                reported.on_emulated_brick(emulation.plant, **{"noise px": emulation.noise})
                reported.seeds["cameras"] = emulation.seed
            elif SYNTHETIC in sources:
                reported.on_emulated_brick()
            _leave(folder, result, reported, truth)


def _check_calibrations(
    sources: Sequence[str], calibrated: Sequence[Path], bar: float | None
) -> None:
    """Refuse calibrations that do not match the cameras, and an impossible bar."""
    from laptop.see.table.camera_fit import check_bar

    if calibrated and len(calibrated) != len(sources):
        raise click.UsageError(
            f"{len(calibrated)} --calibration for {len(sources)} --camera: give one for each."
        )
    check_bar(bar)


def _report_part(part: str, number: int, count: int) -> None:
    click.echo(f"{number}/{count} {part}")


def _simulated(
    plan: AccuracyPlan, built: Arm | None, emulation: EmulatedTest
) -> tuple[AccuracyResult, dict[str, float]]:
    from laptop.emulator.device.plant_constants import read_plant
    from laptop.measure.accuracy.emulated import measure_emulated

    read_plant(emulation.plant)  # before minutes are spent
    return measure_emulated(
        plan, built, emulation.plant, emulation.noise, emulation.seed, False, _report_part
    )


def _live(
    plan: AccuracyPlan, sources: Sequence[str], arm_file: str, camera_options: AccuracyCameraOptions
) -> AccuracyResult:
    from laptop.cli.rigs import RigOptions, live_rig
    from laptop.measure.accuracy import accuracy_test
    from laptop.measure.accuracy.sighting import ArmSighting, check_cameras
    from laptop.see.table import camera_file
    from shared.job_messages import DRAWING

    check_cameras(plan.arm, len(sources))
    calibrations = [camera_file.read_camera(file) for file in camera_options.calibration]
    reported = -1

    def report(status: JobStatus) -> None:
        nonlocal reported
        if status.state != DRAWING:
            return  # fetching has another progress
        share = int(10 * status.cm / status.cm_all) if status.cm_all else reported
        if share != reported:
            reported = share
            click.echo(f"  {10 * share} %")

    asked = RigOptions(
        sources,
        arm_file,
        camera_options.scene,
        camera_options.effector,
        size=camera_options.size,
        call=camera_options.call,
    )
    with live_rig(asked, report) as rig:
        names = [chr(ord("A") + k) for k in range(len(sources))]
        found = (
            dict(zip(names, calibrations, strict=True))
            if calibrations
            else _calibrate_cameras(rig, names, camera_options.bar)
        )
        cameras = {name: calibration.camera for name, calibration in found.items()}
        sighting = ArmSighting(plan.arm, cameras, (camera_options.height or 0.0) / 10)
        _check_still(rig, found)
        return accuracy_test.measure(
            *(rig, plan, sighting, camera_options.stand(), _report_part),
            lambda paths, run: _check_still(rig, found),
        )


def _calibrate_cameras(
    rig: LiveRig, names: Sequence[str], bar: float | None
) -> dict[str, Calibration]:
    """Calibrate the cameras by the board in their present pictures."""
    from laptop.measure.accuracy.sighting import BadSighting
    from laptop.see.markers.finders.board import find_board
    from laptop.see.table.camera_fit import calibrate

    found = {}
    for name in names:
        view = find_board(rig.image(name))
        if view is None:
            raise BadSighting(
                f"camera {name} does not see the board: lay it flat where the arm works, or give "
                "--calibration"
            )
        found[name] = calibrate([view], bar)
    return found


def _check_still(rig: LiveRig, found: Mapping[str, Calibration]) -> None:
    """Raise BadSighting if a camera or its board is not where it was calibrated."""
    from laptop.measure.accuracy.sighting import BadSighting
    from laptop.see.markers.finders.board import find_board
    from laptop.see.table.camera_report import shift_since

    for name, calibration in found.items():
        view = find_board(rig.image(name))
        if view is None:
            click.echo(f"camera {name}: the board is covered; whether it has moved is not known")
        elif (shift := shift_since(calibration, view)).moved:
            raise BadSighting(
                f"camera {name} or its board has moved since it was calibrated, by {shift.px:.1f} "
                f"px, {shift.mm:.1f} mm on the table: fix both, and do the test again"
            )


def _leave(
    folder: RunFolder, result: AccuracyResult, reported: Run, truth: dict[str, float] | None
) -> None:
    """Print the table and write the files."""
    from laptop.measure.accuracy import plots, report

    headings, rows = report.table(result, truth)
    widths = [max(len(row[k]) for row in (headings, *rows)) for k in range(len(headings))]
    left = 2  # columns of words
    for row in (headings, *rows):
        cells = [
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        click.echo("  ".join(cells).rstrip())
    for note in report.notes(result):
        click.echo(note)
    title = f"Accuracy and repeatability after {report.STANDARD}: {result.plan.arm.name}"
    files: dict[str, tuple[Callable[[str], None], str]] = {
        TABLE: (
            lambda path: report.write_csv(path, result),
            "where the tip was in each cycle, with the camera's noise",
        ),
        PICTURE: (
            lambda path: plots.write_accuracy_plot(
                path, result, title, report.describe_plan(result.plan)
            ),
            "Accuracy and repeatability, measured by the camera.",
        ),
    }
    click.echo(write_run(folder, reported, files))
