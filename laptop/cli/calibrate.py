"""`calibrate`: an arm measures itself by a camera, and its file says what it found."""

from __future__ import annotations

import sys
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.options import FiniteRange, arm_option, examples, importing, in_one_line
from laptop.cli.rigs import live_rig

if TYPE_CHECKING:
    from laptop.calibration.camera_fit import Calibration
    from laptop.identification.arm_fit import TouchSight
    from laptop.identification.measured_numbers import Measured
    from laptop.measuring.live_rig import LiveRig
    from shared.arm_description import Arm

LOOK_S = 1.0
"""The marker is looked at so long while the pen stands on a cross, s."""


@click.command(
    epilog=examples(
        "calibrate 0 --bar 97 --height 25 --touch 1,3,4,6,7,9", "calibrate --simulate --seed 3"
    )
)
@click.argument("sources", metavar="[SOURCE]...", nargs=-1)
@arm_option("Calibrate this arm")
@click.option(
    "--bar",
    type=FiniteRange(50, 200),
    metavar="MM",
    help="Length of the board's printed bar as measured.  [default: 100, not measured]",
)
@click.option(
    "--camera",
    "camera_file",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.json",
    help="The camera as the command camera has it, of several views; it has not moved since.",
)
@click.option(
    "--height",
    type=FiniteRange(0, 200),
    metavar="MM",
    help="Of the marker over the table, by a ruler.",
)
@click.option(
    "--touch",
    default="",
    metavar="N,N,...",
    help="Set the pen by hand on these crosses of the board before the arm moves.",
)
@click.option(
    "--board-square",
    type=click.Choice(["0", "90", "180", "270"]),
    metavar="DEG",
    help="The board's edge lies along the arm's x: its own x is turned from that by 0, 90, ...",
)
@click.option("--seconds", type=FiniteRange(60, 900), default=180, show_default=True, metavar="S",
              help="The arm moves for so long at the most.")  # fmt: skip
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.ini",
    help="Write this arm file instead of the arm's own.",
)
@click.option("--dry-run", is_flag=True, help="Measure and tell, write nothing.")
@click.option("--call", is_flag=True, help="Start the brick's program over ssh.")
@click.option("--effector", metavar="SPEC", help="The marker on the arm, as for track.")
@click.option("--simulate", is_flag=True, help="An emulated arm before an emulated camera.")
@click.option("--plant", metavar="KEY=VALUE,...", help="Of the emulated arm, as for simulate.")
@click.option("--built", metavar="FILE", help="The emulated arm is built as this file says.")
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Of all that is emulated.")
def calibrate(
    sources: tuple[str, ...],
    arm_file: str,
    bar: float | None,
    camera_file: Path | None,
    height: float | None,
    touch: str,
    board_square: str | None,
    seconds: float,
    out: Path | None,
    dry_run: bool,
    call: bool,
    effector: str | None,
    simulate: bool,
    plant: str | None,
    built: str | None,
    seed: int | None,
) -> None:
    """Let an arm measure itself by a camera: links, zeros, backlash, and its marker's place.

    The printed board lies within the arm's reach, and the camera sees it and all of the arm.  The
    pen is up.  What comes out is written into the arm's file; the old one is kept beside it.
    """
    with importing():
        from laptop.calibration.arm_file import BACKUP
        from laptop.identification import measured_numbers as numbers
        from laptop.identification.arm_model import ArmModel, CameraPrior, MeasuredByHand
        from laptop.identification.calibrating import go_home, identify
        from shared.arm_description import find_arm, read_arm

    with in_one_line():
        _check_words(sources, simulate, plant, built, seed)
        arm = read_arm(find_arm(arm_file))
        square = None if board_square is None else int(board_square) // 90
        crosses = _crosses(touch, arm)
        known = MeasuredByHand(None if height is None else height / 10, square)

        def finish(rig, found: Calibration, touches: list[TouchSight], check) -> None:  # type: ignore[no-untyped-def]
            for line in _board(found):
                click.echo(line)
            model = ArmModel(arm, {"A": CameraPrior.of(found.camera)}, known)
            result = identify(rig, model, touches, click.echo, seconds)
            check()
            numbers.check_scale(result.fit, found.bar)
            go_home(rig)
            rows = numbers.measured(result.fit)
            for line in _table(rows):
                click.echo(line)
            if dry_run:
                click.echo("nothing was written, as wished")
                return
            file = numbers.write_measured(result.fit, rows, date.today(), out)
            old = Path(f"{file}{BACKUP}")
            click.echo(f"written: {file}" + (f"; the old one is {old}" if old.exists() else ""))
            if any(row.key == "home" and not row.why for row in rows):
                click.echo(
                    "the arm stands where its home pose was; so that the brick takes over its "
                    "zero, leave it there and type: driver.py home --here"
                )

        if simulate:
            _simulated(arm, built, plant or "cpu=1", seed or 0, bar, crosses, known, finish)
            return
        with live_rig(sources, arm_file, effector=effector, call=call and not crosses) as rig:
            found, check = _calibrated(rig, camera_file, bar)
            finish(rig, found, _touched(rig, crosses), check)


def _check_words(
    sources: tuple[str, ...],
    simulate: bool,
    plant: str | None,
    built: str | None,
    seed: int | None,
) -> None:
    emulated = [
        word
        for word, value in (("--plant", plant), ("--built", built), ("--seed", seed))
        if value is not None
    ]
    if simulate and sources:
        raise click.UsageError(f"--simulate has a camera of its own: leave {sources[0]} out")
    if not simulate and emulated:
        raise click.UsageError(f"{emulated[0]} is of what is emulated: give --simulate, too")
    if not simulate and not sources:
        raise click.UsageError("give a camera, such as 0, or --simulate")


def _crosses(text: str, arm: Arm) -> list[tuple[float, float]]:
    """Read the numbers of the board's crosses."""
    from laptop.vision.board import CROSSES

    numbers = [part.strip() for part in text.split(",") if part.strip()]
    if numbers and arm.chain != "planar":
        raise click.UsageError("--touch is for an arm in the plane, with a pen; leave it out")
    if not all(one.isdecimal() and 1 <= int(one) <= len(CROSSES) for one in numbers):
        raise click.UsageError(
            f"--touch {text}: the crosses have numbers from 1 to {len(CROSSES)}, like 1,3,7,9"
        )
    if numbers and len(set(numbers)) < 3:
        raise click.UsageError(f"--touch {text}: 3 different crosses are the least, 6 are better")
    return [(float(x), float(y)) for x, y in (CROSSES[int(one) - 1] for one in numbers)]


def _board(found: Calibration) -> list[str]:
    from laptop.calibration.camera_report import describe

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


def _simulated(arm, built, plant, seed, bar, crosses, known, finish) -> None:  # type: ignore[no-untyped-def]
    """Let an emulated arm do it."""
    import math

    from laptop.identification.emulated_table import EmulatedTable, camera_over, luck_of
    from laptop.measuring.emulated_rig import EmulatedRig
    from shared.arm_description import find_arm, read_arm

    truth = read_arm(find_arm(built)) if built else arm
    height = 2.5 if known.height is None else known.height
    camera = camera_over(560.0, (-8.0, 0.0), 44.0, math.radians(20), 1.0, 0.1)
    turn = 0.0 if known.square is None else -math.pi / 2 * known.square
    table = EmulatedTable(truth, camera, turn=turn, height=height)
    luck = luck_of(seed)
    found = table.calibrated(luck, bar)
    touches = table.touches(len(crosses), luck) if crosses else []
    text = plant if "seed=" in plant else f"{plant},seed={seed}"
    rig = EmulatedRig(arm, truth, text, {"A": table}, height, seed=seed)
    finish(rig, found, touches, lambda: None)


def _calibrated(rig: LiveRig, camera_file: Path | None, bar: float | None):  # type: ignore[no-untyped-def]
    """Return the camera, and what raises if it or the board has moved by the end."""
    from laptop.calibration.camera_file import read_camera
    from laptop.calibration.camera_fit import calibrate as fit_camera
    from laptop.calibration.camera_report import shift_since
    from laptop.identification.calibrating import check_board
    from laptop.vision.finders.board import find_board

    view = check_board(find_board(rig.image()))
    if camera_file:
        found = read_camera(camera_file)
        if bar is not None and bar != found.bar:
            raise click.UsageError(f"--bar is that of {camera_file}: leave it out here")
    else:
        found = fit_camera([view], bar)

    def check() -> None:
        now = find_board(rig.image())
        if now is None:
            return  # the arm may hide it
        shift = shift_since(found, now)
        if shift.moved:
            raise click.ClickException(f"{shift}; calibrate again; nothing was written")

    if camera_file:
        check()
    return found, check


def _touched(rig: LiveRig, crosses: list[tuple[float, float]]) -> list[TouchSight]:
    """Ask for the pen on each cross, and look."""
    from laptop.identification.touching import touch_sight

    found = []
    if crosses and not sys.stdin.isatty():
        raise click.ClickException("--touch asks somebody; there is no terminal to answer at")
    for x, y in crosses:
        click.pause(f"set the pen on the cross at {x:g}, {y:g} cm, hands off, and press a key")
        found.append(touch_sight((x, y), rig.look(LOOK_S)["A"]))
    return found
