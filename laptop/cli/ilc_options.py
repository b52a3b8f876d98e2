"""The options of `draw --trials`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from laptop.cli.options import SYNTHETIC, FiniteRange, bar_option, listen_port_option, option_group
from shared.arm_description import Arm
from shared.config_files import InvalidFile, number


@dataclass(frozen=True)
class IlcOptions:
    """Options of drawing by sight.

    times        rehearsals; 0: what is kept is drawn, and nothing learned
    strokes      number of strokes in them, which teach all; None: all
    camera       source of the camera, as for `track`
    camera_file  of `measure camera --out`; None: the board is looked for in the picture
    arm_at       where the arm stands on the board, (x, y, degrees); None: as the drawing lies
    height_mm    of the marker over the table
    scene        of a synthetic camera
    forget       what was learned before is not used
    bar          length of the board's bar as measured, mm; None: as printed
    port         at which the brick is waited for; None: the usual one
    emulated     which emulated arm draws, of which no other one learns; "": a real one
    """

    times: int
    strokes: int | None
    camera: str | None
    camera_file: Path | None
    arm_at: tuple[float, float, float] | None
    height_mm: float
    scene: str
    forget: bool
    bar: float | None
    port: int | None
    emulated: str


@dataclass(frozen=True)
class TypedIlcOptions:
    """The same options as typed; None where nothing is typed."""

    trials: int | None
    of: int | None
    camera: str | None
    camera_file: Path | None
    arm_at: str | None
    marker_height: float
    scene: str
    forget: bool
    bar: float | None
    port: int | None


ILC_OPTIONS = option_group(
    click.option(
        "--trials",
        type=click.IntRange(0, 20),
        metavar="N",
        help="Teach the path by camera first, in N trials on scrap; 0: draw as taught before.",
    ),
    click.option(
        "--of",
        type=click.IntRange(3),
        metavar="M",
        help="With --trials: rehearse M strokes that stand for all, and foretell the others.",
    ),
    click.option("--camera", metavar="SOURCE", help="For --trials, as for track."),
    click.option(
        "--calibration",
        "camera_file",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        metavar="FILE.json",
        help="What `measure camera` wrote.  [default: the board is looked for in the picture]",
    ),
    click.option(
        "--arm-at",
        metavar="X,Y,DEG",
        help="Where on the board the arm's axis is, cm, and to where it points.",
    ),
    click.option(
        "--marker-height",
        type=FiniteRange(0, 500),
        default=25.0,
        show_default=True,
        metavar="MM",
        help="Of the arm's marker over the table.",
    ),
    click.option("--scene", default="", metavar="KEY=VALUE,...", help="Of a synthetic camera."),
    click.option("--built", metavar="FILE", help="For --simulate: the arm as it truly is."),
    bar_option,
    listen_port_option,
    click.option("--forget", is_flag=True, help="Learn anew, not from what was learned before."),
)


def read_ilc_options(typed: TypedIlcOptions, arm: Arm, emulated: str | None) -> IlcOptions | None:
    """Return the options of learning by camera; None if there are no trials.

    Args:
        typed: as typed.
        arm: that draws.
        emulated: which emulated brick draws, see SightOptions; None: none does.

    Raises:
        click.UsageError: what is typed does not go together, or is no place.
    """
    if typed.trials is None:
        return None
    if len(arm.joints) > 2:
        raise click.UsageError(
            f"--trials teaches an arm in the plane, and {arm.name} moves in space: leave it out."
        )
    at = None
    if typed.arm_at:
        try:
            x, y, degrees = (number(float(part)) for part in typed.arm_at.split(","))
        except (ValueError, InvalidFile):
            raise click.UsageError(
                f"--arm-at {typed.arm_at}: write it as -9,0,0: cm, cm and degrees."
            ) from None
        at = x, y, degrees
    if emulated is None:
        emulated = SYNTHETIC if typed.camera == SYNTHETIC else ""
    return IlcOptions(
        typed.trials,
        typed.of,
        typed.camera,
        typed.camera_file,
        at,
        typed.marker_height,
        typed.scene,
        typed.forget,
        typed.bar,
        typed.port,
        emulated,
    )
