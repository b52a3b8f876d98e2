"""`measure pen`: where the arm's marker sits beside the pen, by touching the board's crosses."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.brick import THE_BRICK, talk
from laptop.cli.command import OwnCommand
from laptop.cli.groups import in_groups
from laptop.cli.options import (
    ParamType,
    arm_option,
    bar_option,
    camera_option,
    cameras_of,
    examples,
    importing,
    in_one_line,
    json_option,
    marker_height_option,
    print_json,
    sources_argument,
    typed_args,
)
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.run import CALIBRATION, Ending, Run, RunFile, table
from laptop.record.run_folder import run_folder
from laptop.system.files import CannotWrite, check_shown
from shared import state
from shared.arm_description import Arm, find_arm, read_arm
from shared.message_fields import printable
from shared.messages import EFFECTOR

if TYPE_CHECKING:
    from laptop.cli.touch_simulated import SimulatedTouching
    from laptop.see.markers.markers import Marker
    from laptop.see.table.cross_sampling import CrossSampler
    from laptop.see.table.cross_touching import CrossTouching
    from laptop.see.table.marker_offset import MarkerFit

MAX_LINE = 4096
"""Longest line of a file of touches, characters."""
CROSS_COUNT = 9
"""Number of the board's crosses."""


class Crosses(ParamType):
    """Some of the board's crosses, by the numbers that are printed beside them."""

    name = "N,N,..."

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, ...]:
        """Return their places in the list of crosses; fail if they are none."""
        numbers = [int(one) if one.strip().isdecimal() else 0 for one in value.split(",")]
        if not all(1 <= one <= CROSS_COUNT for one in numbers) or len(set(numbers)) < len(numbers):
            self.fail(
                f"'{value}' is not a list of crosses from 1 to {CROSS_COUNT}, like 1,3,4,6,7,9"
            )
        return tuple(one - 1 for one in numbers)


@dataclass(frozen=True)
class PenCameraOptions:
    """Camera before the crosses and the arm's marker.

    sources   of the camera, as they were typed before
    cameras   the same, as they are typed
    bar       length of the board's bar as measured, mm; None: as printed
    height    of the marker over the paper, mm; None: it is found
    effector  the marker's SPEC, as for `track`; None: the one of the markers file
    """

    sources: tuple[str, ...]
    cameras: tuple[str, ...]
    bar: float | None
    height: float | None
    effector: str | None

    def source(self) -> str | None:
        """Return the camera's source; None: none is typed.

        Raises:
            click.UsageError: there are several.
        """
        source, *others = *cameras_of(self.cameras, self.sources), None
        if others[:-1]:
            raise click.UsageError("One camera sees all crosses: give --camera once.")
        return source


@dataclass(frozen=True)
class TouchOptions:
    """Options of touching the crosses.

    crosses  their places in the list of crosses, in this order
    name     of the brick whose arm touches; None: the last one
    pen      where it is put first, "up" or "down"; None: it stays
    file     of points that were touched, "-" for standard input; None: a brick is called
    """

    crosses: tuple[int, ...]
    name: str | None
    pen: str | None
    file: str | None

    @property
    def is_live(self) -> bool:
        """Whether the crosses are touched now, and again where something is wrong."""
        return self.file is None or self.file == "-" or Path(self.file).is_fifo()

    def args(self, arm: Arm) -> tuple[str, ...]:
        """Return the arguments for the program on the brick."""
        return ("--arm", arm.name, *(("--pen", self.pen) if self.pen else ()))


@dataclass(frozen=True)
class EmulatedHand:
    """A hand that touches with an emulated arm, before a synthetic camera.

    simulated  whether it is there
    scene      of the camera, as text; None: the usual one
    plant      constants of the arm, as text
    """

    simulated: bool
    scene: str | None
    plant: str

    def simulation(self, arm: Arm, report: Callable[[str], None]) -> SimulatedTouching:
        """Return the arm, the hand and the camera; `report` is called with a line for people."""
        from laptop.cli.touch_simulated import SimulatedTouching

        return SimulatedTouching(arm, self.scene, self.plant, report)


@click.command(
    cls=OwnCommand,
    short_help="Where the arm's marker sits beside the pen, by touching crosses.",
    epilog=examples(
        "measure pen --camera 0 --arm mine.ini --bar 97",
        "measure pen --camera pictures/ --arm mine.ini --touches points.jsonl",
        "measure pen --simulate",
    ),
)
@sources_argument
@camera_option
@arm_option("Arm that touches")
@THE_BRICK
@bar_option
@marker_height_option("Of the arm's marker over the paper, if measured.  [default: it is found]")
@click.option(
    "--effector",
    metavar="SPEC",
    help="The arm's marker, as for track.  [default: effector of ~/.brickservo/markers.ini]",
)
@click.option(
    "--crosses",
    type=Crosses(),
    default="1,2,3,4,5,6,7,8,9",
    metavar="N,N,...",
    help="The crosses to touch, in this order; six are the least.  [default: all nine]",
)
@click.option(
    "--pen",
    type=click.Choice(["up", "down"]),
    help="Put the pen there before the motors let go.  [default: where it is]",
)
@click.option(
    "--touches",
    "file",
    metavar="FILE",
    help="Points that driver.py touch --json has written, or - for those that it writes now; no "
    "brick is called.  Of a folder, the first picture shows the board, then there is one each.",
)
@click.option(
    "--simulate",
    "simulated",
    is_flag=True,
    help="On the emulated brick, with an emulated hand and the synthetic camera.",
)
@click.option(
    "--scene",
    metavar="KEY=VALUE,...",
    help="Of the synthetic camera.  [default: board=a4,board_x=12,marker_stray=0.4]",
)
@click.option("--plant", default="", metavar="KEY=VALUE,...", help="Of the emulated arm.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write arm file and fit there.  [default: the arm's own file, or a copy in "
    "~/.brickservo/arms of one that comes along, and ~/.brickservo/touched; with --simulate, "
    "runs/TIME-measure-pen]",
)
@json_option
@in_groups(camera_options=PenCameraOptions, asked=TouchOptions, hand=EmulatedHand)
def touch(
    arm_file: str,
    camera_options: PenCameraOptions,
    asked: TouchOptions,
    hand: EmulatedHand,
    out: Path | None,
) -> None:
    """Find where the arm's marker sits beside the pen: set the pen on the printed board's crosses.

    A camera sees the board: a webcam's number or a stream.  Lead the arm by hand;
    a touch sensor, the brick's centre button or Enter here takes each cross.
    """
    with importing():  # OpenCV
        from laptop.see.table.camera_fit import check_bar
        from laptop.see.table.camera_report import describe
        from laptop.see.table.cross_touching import CrossTouching, check_led
        from laptop.see.table.marker_offset import MIN_TOUCHES, BadTouches

    source = camera_options.source()
    report = partial(click.echo, file=sys.stdout)  # also while a program on the brick has that
    with in_one_line(), ExitStack() as stack:
        check_bar(camera_options.bar)
        arm = read_arm(find_arm(arm_file))
        check_led(arm)
        folder = stack.enter_context(run_folder("measure-pen", out)) if hand.simulated else None
        places = _places(arm, folder.path if folder else out)
        if len(asked.crosses) < MIN_TOUCHES:
            raise BadTouches(
                f"{len(asked.crosses)} crosses; {MIN_TOUCHES} are the least, 9 are better"
            )
        simulation = hand.simulation(arm, report) if hand.simulated else None
        sampler = (
            simulation.sampler(camera_options.effector)
            if simulation
            else _open(source, camera_options, stack)
        )
        calibration = sampler.board(camera_options.bar)
        for line in describe(calibration):
            report(line)
        again = asked.is_live
        touching = CrossTouching(arm, calibration, sampler.sample, report, again, asked.crosses)
        if simulation:
            simulation.run(touching)
        elif asked.file is not None:
            _from_file(touching, asked.file)
        else:
            _from_brick(touching, asked.name, asked.args(arm))
        if again:
            touching.check_camera(sampler.sample())
        fit = _conclude(touching, arm, camera_options.height, places)
        if folder:
            report(folder.write(_record(arm, fit, hand, [file.name for file in places if file])))


def _open(source: str | None, camera_options: PenCameraOptions, stack: ExitStack) -> CrossSampler:
    """Return a sampler of the real camera."""
    from laptop.see.camera.cameras import is_live, open_camera
    from laptop.see.table.cross_sampling import CrossSampler
    from laptop.system.decoders import quiet_decoders

    assert source is not None
    marker = _marker(camera_options.effector)
    stack.enter_context(quiet_decoders())
    camera = open_camera(source)
    stack.callback(camera.close)
    return CrossSampler(camera, marker, is_live(source))


def _marker(effector: str | None) -> Marker:
    """Return the arm's marker as given, or as the tracker has learned it."""
    from laptop.see.markers.markers import BadMarker, read_markers, read_spec
    from laptop.see.serve.setup import markers_file

    if effector is not None:
        return read_spec(EFFECTOR, effector)
    file = markers_file()
    known = read_markers(file) if file.exists() else {}
    if EFFECTOR not in known:
        raise BadMarker(
            f"{file} has no marker [{EFFECTOR}]: say what it is, --effector disc:red, or let "
            "track learn it"
        )
    return known[EFFECTOR]


def _lines(file: str) -> Iterator[str]:
    if file == "-":
        yield from iter(lambda: sys.stdin.readline(MAX_LINE), "")
        return
    try:
        with open(file, encoding="utf-8", errors="replace") as lines:
            yield from iter(lambda: lines.readline(MAX_LINE), "")
    except OSError as error:
        raise click.ClickException(f"{printable(file)}: {error.strerror}") from None


def _from_file(touching: CrossTouching, file: str) -> None:
    """Take the touches of a file, or of a program that writes them now."""
    from laptop.see.table.cross_touching import read_point

    click.echo(touching.request())
    for line in _lines(file):
        if not line.strip():
            continue
        touching.handle(read_point(line))
        if touching.cross is None:
            return
        click.echo(touching.request())


def _from_brick(touching: CrossTouching, name: str | None, args: tuple[str, ...]) -> None:
    """Let the user touch the crosses with the brick's arm."""
    from laptop.brick import touching as on_brick
    from laptop.see.table.cross_touching import read_point

    def went_on() -> bool:
        if touching.cross is None:
            return True
        _ask()
        return False

    def handle(line: str) -> bool:
        if touching.cross is not None:
            touching.handle(read_point(line))
        return went_on()

    def skip() -> bool:
        touching.skip()
        return went_on()

    def _ask() -> None:
        click.echo(touching.request())

    click.echo("Enter here takes a point, too; s leaves a cross out, q ends, Ctrl-C gives up")
    _ask()
    talk(name, on_brick.touch, args, handle, skip)


def _places(arm: Arm, out: Path | None) -> tuple[Path | None, Path]:
    """Return where the arm's file goes, None for its own, and the file of how it stands.

    Raises:
        CannotWrite: something is there that would be lost, or cannot be replaced.
    """
    from laptop.see.table.arm_file import check_writable, own_file
    from laptop.see.table.marker_offset import BadTouches
    from laptop.see.table.touch_file import read_touched, touched_file

    own = None if out is None else out / f"{arm.name}.ini"
    touch_path = touched_file(arm.name) if out is None else out / f"{arm.name}.touched.json"
    if out is not None:
        check_shown(out, "choose another folder with --out")
    check_writable(own or own_file(arm))
    check_writable(touch_path)
    if touch_path.exists():
        try:
            read_touched(touch_path)
        except BadTouches:
            raise CannotWrite(
                f"{touch_path} is no file of touched crosses, and would be lost; move it away, or "
                "choose another folder with --out"
            ) from None
    return own, touch_path


def _conclude(
    touching: CrossTouching, arm: Arm, height: float | None, places: tuple[Path | None, Path]
) -> MarkerFit:
    """Report the fit, write it, and return it."""
    from laptop.see.table.arm_file import write_values
    from laptop.see.table.touch_file import TouchedArm, write_touched

    fit = touching.fit(None if height is None else height / 10)
    for line in fit.notes():
        click.echo(line)
    x, y = (f"{value + 0.0:.3f}" for value in fit.offset)
    own, touch_path = places
    path = write_values(arm, {("arm", "marker_offset"): f"{x} {y}"}, own).file
    write_touched(touch_path, TouchedArm(arm.name, touching.paper, touching.bar, fit))
    print_json(json.loads(touch_path.read_text(encoding="utf-8")))
    click.echo(
        f"marker_offset = {x} {y} written to {path}; how the arm stands on the board: {touch_path}"
    )
    if own is None:
        click.echo(f"put it on the brick, too: {state.laptop_program()} brick arm {path}")
    return fit


def _record(arm: Arm, fit: MarkerFit, hand: EmulatedHand, files: list[str]) -> Run:
    """Return the record of an emulated hand's touching."""
    aside, above = fit.offset_sigma, fit.height_sigma
    rows = [
        (what, round(10 * float(cm), 2), round(10 * float(sigma), 2))
        for what, cm, sigma in (
            ("the marker from the tip, forward", fit.offset[0], aside),
            ("the marker from the tip, to the left", fit.offset[1], aside),
            ("the marker over the paper", fit.height, above),
        )
    ]
    headings = ["what", "it is mm", "standard uncertainty mm"]
    caption = "Where the marker sits, by the crosses that were touched"
    reported = Run(
        kind=CALIBRATION,
        what="the marker's place beside the pen",
        typed=typed_args(),
        ending=Ending(0, "found"),
        arm=numbers_of(arm),
        tables=[table("marker", caption, headings, rows)],
        files=[RunFile(name) for name in files],
    )
    reported.on_emulated_brick(hand.plant, hand.scene, scene=hand.scene, plant=hand.plant or None)
    return reported
